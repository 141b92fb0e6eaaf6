"""Print the speed of super-helices, and how the cost of a step grows with elements.

python benchmarks/super_helix.py --pictures pictures/

600 guides of a procedural groom, frames of 1/60 s with default options: a still head, a head
shaken by 25 degrees 1.5 times a second (long straight hair), and wind of 5 m/s with gusts (long
wavy hair). `cpu ms` is the time of all threads together. The second table is one step
without contact and neighbours.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from pathlib import Path

import cv2
import numpy as np
from hairkit_plugins.super_helix import Options
from hairkit_plugins.super_helix.simulator import SuperHelices

from hairkit.head_model.template import default_head
from hairkit.parallel import thread_count
from hairkit.rendering import draw
from hairkit.simulation import Surroundings
from hairkit.simulation.motion import HeadMotion, add_shakes, static_motion
from hairkit.synth import grow
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

GUIDES, ELEMENTS, FRAMES = 600, 10, 90
STEPS = 20
"""That are timed for each number of elements."""


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", type=Path, help="folder for frames of the two scenes")
    folder = parser.parse_args().pictures
    straight, wavy = (grow(style, default_head(), GUIDES) for style in ("straight", "wavy"))
    print(f"{GUIDES} guides, {thread_count()} threads")
    print("| scene | elements | ms a frame | cpu ms | frames a second | worst ms | max stretch % |")
    print("|---|---|---|---|---|---|---|")
    shake = add_shakes(["yaw:25:1.5"], straight.head)
    for elements in (ELEMENTS, 0):
        scene("still head", straight, static_motion(), np.zeros(3), folder, elements)
        scene("shaken head", straight, shake, np.zeros(3), folder, elements)
        scene("wind", wavy, static_motion(), np.array([4.0, 0.0, -3.0]), folder, elements)
    print("\n| elements | ms a step |")
    print("|---|---|")
    for elements in (5, 10, 20, 40):
        print(f"| {elements} | {step_ms(straight, elements):.1f} |")


def scene(
    name: str,
    groom: Groom,
    motion: HeadMotion,
    wind: np.ndarray,
    folder: Path | None,
    elements: int,
) -> None:
    """Run one scene, print its row, and draw four frames."""
    simulator = SuperHelices(groom, Options(elements=elements))
    simulator.advance(1 / 60, Surroundings())
    simulator.reset(motion(0.0))
    times, stretch, cpu = [], 0.0, time.process_time()
    for frame in range(1, FRAMES + 1):
        head = motion(frame / 60)
        start = time.perf_counter()
        simulator.advance(1 / 60, Surroundings(head, wind, 0.4))
        times.append(1e3 * (time.perf_counter() - start))
        if folder and frame % 30 == 0:
            picture(groom, simulator, head, folder / f"{name.replace(' ', '_')}_{frame:03d}.png")
        if frame % 10 == 0:
            stretch = max(stretch, simulator.measure().stretch)
    spent = 1e3 * (time.process_time() - cpu) / FRAMES
    mean, count = np.mean(times), elements or "adaptive"
    print(
        f"| {name} | {count} | {mean:.1f} | {spent:.1f} | {1e3 / mean:.0f} | {max(times):.0f} "
        f"| {100 * stretch:.2f} |"
    )


def picture(groom: Groom, simulator: SuperHelices, head: np.ndarray, path: Path) -> None:
    """Write the guides as they are, in front of the head."""
    path.parent.mkdir(parents=True, exist_ok=True)
    own = (simulator.points - head[:3, 3]) @ head[:3, :3]
    hair = Strands(own.astype(np.float32), groom.strands.offsets)
    camera = Camera.on_turn(30.0, distance=1.1, focal=900.0, width=600, height=800)
    image = draw(dataclasses.replace(groom, strands=hair), None, camera)
    cv2.imwrite(str(path), image[..., ::-1])


def step_ms(groom: Groom, elements: int) -> float:
    """Return milliseconds of a step of all strands."""
    options = Options(
        elements=elements, contact=False, hair_friction=0.0, hair_push=0.0, substeps=1
    )
    simulator, around = SuperHelices(groom, options), Surroundings()
    simulator.advance(1 / 60, around)
    start = time.perf_counter()
    for _ in range(STEPS):
        simulator.advance(1 / 60, around)
    return 1e3 * (time.perf_counter() - start) / STEPS


if __name__ == "__main__":
    main()
