"""Training of the hair network that ships with hairkit (docs/segmentation.md).

* `heads`: program that photographs random heads, with hair on the shoulders too
* `renders`: rendered photos with their labels, heads and landmarks
* `colours`: random colours, noise and textures
* `bodies`: hair of other lengths over bodies with arms and clothes, hats, hoods, scarves, hands
* `looks`: other hair, skin, clothes, beards, glasses, bald crowns and fading cuts
* `composer`: one training picture: another look, backdrop, light, shape, crop and camera
* `compose`: program that makes a set of pictures as the network sees them
* `train`: program that trains in PyTorch, writes the weights, and compares with NumPy
"""
