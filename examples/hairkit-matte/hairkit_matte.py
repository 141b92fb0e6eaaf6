"""Hair where the photo is dark: a stand-in for a network."""

import numpy as np

from hairkit.worker import option, serve


def segment(view, options):
    """Return hair below a grey level; the person is not looked for."""
    dark = view.image.mean(axis=-1) < options.level
    return {"labels": np.where(dark, np.uint8(255), np.uint8(0)), "person_known": False}


if __name__ == "__main__":
    level = option(60.0, low=0.0, high=255.0, doc="Grey level below which is hair.")
    serve(segment, options={"level": level}, version="0.1.0")
