"""A custom plugin.

Replace one stage, the 2D orientation of hair, by a method of your own, and compare the result with
that of the default method. In a program a plugin can be any object with hook methods; to use it
from the command line, save hook functions in a file and name it with `--plugin`.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

import hairkit

out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery-out") / "custom_plugin"


@dataclass(frozen=True)
class Options:
    """Settings of the method; recipes and `--set` check them against these bounds."""

    sigma: float = hairkit.option(4.0, low=0.5, high=50.0, doc="Width of the window.", unit="px")


class GradientOrienter:
    """Hair runs across the mean brightness gradient (a structure tensor of one scale)."""

    Options = Options

    @hairkit.hookimpl
    def orient(
        self, view: hairkit.View, mask: hairkit.Mask, options: Options
    ) -> hairkit.OrientationMap:
        """Return angles in [0, pi) from +x towards +y (down), and confidence in [0, 1]."""
        grey = cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY).astype(np.float32)
        gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
        xx, yy, xy = (
            cv2.GaussianBlur(product, (0, 0), options.sigma)
            for product in (gx * gx, gy * gy, gx * gy)
        )
        across = 0.5 * np.arctan2(2 * xy, xx - yy)
        angle = np.mod(across + np.pi / 2, np.pi).astype(np.float32)
        angle[angle >= np.float32(np.pi)] = 0.0
        coherence = np.hypot(xx - yy, 2 * xy) / np.maximum(xx + yy, 1e-6)
        return hairkit.OrientationMap(angle, np.where(mask.hair, coherence, 0).astype(np.float32))


manager = hairkit.Manager.loaded()
manager.register(GradientOrienter(), "gradient")

# --set on the command line takes the same texts.
recipe = hairkit.load_recipe("default").with_set(["orient=gradient", "gradient.sigma=6"])

capture = hairkit.sample_capture()
ours = hairkit.reconstruct(capture, out / "gradient", recipe, manager, guides=100, sheet=False)
theirs = hairkit.reconstruct(capture, out / "default", guides=100, sheet=False)
for name, groom in (("gradient", ours), ("default", theirs)):
    print(f"{name}: mean length {groom.strands.lengths().mean():.3f} m")
