"""How the network of `hairkit.field.hair_depth` was trained: from grooms alone, on a graphics card.

    python -m training.hair_depth.train -o hair_depth.npz

* `grooms`: random procedural grooms on random heads
* `views`: what a photo of a groom shows, and the depths behind it, drawn in PyTorch
* `train`: data, training, and the errors on grooms that were left out
"""
