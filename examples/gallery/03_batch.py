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
        photograph(grow(style, default_head(), strands=1000, seed=1), folder, size=(300, 400))

# The manager loads the plugins once for all runs. Coarse cells keep this example quick.
manager = hairkit.Manager.loaded()
recipe = hairkit.load_recipe("default").with_set(["visual_hull.voxel_size=0.006"])

print("| capture | strands | F 4 mm/40 deg | mean length / true |")
print("|---|---|---|---|")
for photos in sorted((out / "captures").iterdir()):
    result = out / photos.name
    try:
        hairkit.reconstruct(photos, result, recipe, manager, guides=300, sheet=False)
    except hairkit.HairkitError as error:  # one line; go on with the next capture
        print(f"| {photos.name} | {error} | | |")
        continue
    scores = hairkit.evaluate(result, photos / "truth")
    f, length = 100 * scores.scores.all[-1].f, scores.lengths.mean_ratio
    print(f"| {photos.name} | {scores.strands} | {f:.1f} | {length:.2f} |")
