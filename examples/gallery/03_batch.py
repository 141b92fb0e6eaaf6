"""Many captures with scores.

Reconstruct a folder of captures and print one table. The captures here are made by
`hairkit.synth`, so their true strands are known; for real photos leave out the scores.
"""

import sys
from pathlib import Path

import hairkit
from hairkit.head_model.template import default_head
from hairkit.synth import grow, photograph

out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery-out") / "batch"

for style in ("short", "straight"):
    folder = out / "captures" / style
    if not folder.exists():
        hair = grow(style, default_head(), strands=1000, seed=1)
        photograph(hair, folder, views=4, size=(300, 400))

# Every capture has a process of its own, and one that fails does so alone. A second run keeps what
# the first has done. Coarse cells and four small photos a capture keep this example quick.
settings = {"guides": 300, "settings": ["visual_hull.voxel_size=0.006"]}

print("| capture | strands | F 4 mm/40 deg | mean length / true |")
print("|---|---|---|---|")
for result in hairkit.batch(out / "captures", out / "results", settings=settings):
    if result.error:
        print(f"| {result.name} | {result.error} | | |")
        continue
    scores = hairkit.evaluate(result.out, out / "captures" / result.name / "truth")
    f, length = 100 * scores.scores.all[-1].f, scores.lengths.mean_ratio
    print(f"| {result.name} | {scores.strands} | {f:.1f} | {length:.2f} |")
