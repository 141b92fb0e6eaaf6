"""Hair by a network of PyTorch, exported with `torch.jit.save`: a map of hair for a photo."""

import functools
import os

from hairkit.worker import option, serve

WEIGHTS = os.environ["MATTE_WEIGHTS"]


@functools.cache
def load(device):
    """Return the network: once, at the first call, so that a recipe is checked without it."""
    import torch

    return torch.jit.load(WEIGHTS, map_location=device).eval()


def segment(view, options):
    """Return the network's map as opacity, and as labels above the threshold."""
    import numpy as np
    import torch

    photo = torch.from_numpy(view.image.copy()).permute(2, 0, 1)[None].float() / 255
    with torch.inference_mode():
        hair = load(options.device)(photo.to(options.device))[0, 0].clamp(0, 1).cpu().numpy()
    labels = np.where(hair >= options.threshold, np.uint8(255), np.uint8(0))
    return {"labels": labels, "person_known": False, "alpha": (255 * hair).round().astype("u1")}


if __name__ == "__main__":
    serve(
        segment,
        options={
            "device": option("cuda", choices=("cuda", "cpu"), doc="Where the network runs."),
            "threshold": option(0.5, low=0.0, high=1.0, doc="Opacity from which is hair."),
        },
        version="0.1.0",
        files=[WEIGHTS],  # other weights, other results: those kept by hairkit then count as old
    )
