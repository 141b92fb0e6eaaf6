"""The Python API.

Reconstruct the capture that ships with hairkit, look at the arrays of the result, draw it, and
write it in three formats. All arrays are in metres in the head frame: +X the subject's left, +Y up,
+Z out of the face.
"""

import sys
from pathlib import Path

import hairkit

out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery-out") / "python_api"

capture = hairkit.sample_capture()  # or hairkit.read_capture("photos/")
print([view.name for view in capture.views])  # front, front-left, left, ...
print(capture.views[0].image.shape)  # (H, W, 3) uint8 RGB

# All stages of the default recipe. Run it again, and only what has changed is computed.
groom = hairkit.reconstruct(capture, out, guides=200)

strands = groom.strands
print(strands.points.shape)  # (P, 3) float32, packed, root first
print(strands.offsets.shape)  # (S + 1,) int64: strand s is points[offsets[s]:offsets[s + 1]]
print(f"{len(strands)} guides, mean length {strands.lengths().mean():.3f} m")
print(groom.head.vertices.shape, groom.head.faces.shape)  # the head fitted to the photos

# A picture with hair interpolated between the guides; a view's name or (azimuth, elevation).
picture = hairkit.render(groom, out / "three_quarter.png", (40, 10), size=(360, 480), hairs=5000)
print(picture.shape)  # (480, 360, 3) uint8 RGB

# The ending names the format; keywords are options of its plugin (`hairkit plugins alembic`).
hairkit.export(groom, out / "hair.abc", hairs=2000)
hairkit.export(groom, out / "hair.glb", strips=500)
hairkit.write_groom(groom, out / "copy.npz")  # lossless
assert len(hairkit.read_groom(out / "hair.abc").strands) == 2000
