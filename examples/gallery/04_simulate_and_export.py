"""Simulate and export.

Grow a procedural groom, shake its head in wind, draw a frame, and write the motion as an animated
Alembic file and as a glTF file with morph targets.
"""

import sys
from pathlib import Path

import hairkit
from hairkit.head_model.template import default_head
from hairkit.synth import grow

out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery-out") / "simulate_and_export"
out.mkdir(parents=True, exist_ok=True)

groom = grow("wavy", default_head(), strands=100, seed=2)  # every strand is a guide

# Yaw by 20 degrees to each side, 1.5 times a second; wind in metres per second, with gusts.
cache = hairkit.simulate(
    groom, 24, fps=24, shake=["yaw:20:1.5"], wind=(3, 0, 1), turbulence=0.3, substeps=4
)
print(cache.points.shape)  # (frames, points, 3) metres, world

hairkit.render(
    groom, out / "frame_20.png", "front-left", size=(360, 480), hairs=2000, cache=cache, frame=20
)

hairkit.export(groom, out / "sway.abc", cache=cache)
hairkit.export(groom, out / "sway.glb", cache=cache, morphs=8, strips=200)
cache.save(out / "sway.npz")  # `hairkit export groom.npz -o hair.abc --set cache=sway.npz`
