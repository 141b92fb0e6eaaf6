"""Laws of the walk through the stages: results depend on photos and recipe alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import ball_plugin
import numpy as np
import pytest
from ball import RECIPE
from example_textures import draw_skin

from hairkit.errors import HairkitError, InputError
from hairkit.head_model import photo_skin
from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread, thread_count
from hairkit.pipeline import findings as module
from hairkit.pipeline.findings import Findings
from hairkit.pipeline.found import found
from hairkit.pipeline.recipe import Recipe, load_recipe, parse_recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import StageRunner
from hairkit.pipeline.work_folder import WorkFolder, digest_of
from hairkit.progress import Silent
from hairkit.stages import ROWS
from hairkit.storage import to_arrays
from hairkit.testing import ball_head, turn_capture
from hairkit.types.capture import Capture
from hairkit.types.chosen import Chosen, ChosenHair
from hairkit.types.groom import Groom
from hairkit.types.skin import SkinMaps, Texture

PHOTOGRAPHED = Texture.encode(draw_skin(40, 1))
EDGE, GUIDES = 360, 60
"""Pixels of the sample's photos here, and roots: a run takes two seconds."""
TURNED = np.array([[1.02, 0, 0, 0], [0, 1.02, 0, 0.003], [0, 0, 1.02, 0], [0, 0, 0, 1.0]])


def sample() -> Capture:
    """The sample with masks, as it ships."""
    return read_capture(sample_folder(), EDGE)


def photos_alone() -> Capture:
    """The sample's photos without masks and landmarks, with a moved head and chosen curls."""
    photos = read_capture(sample_folder() / "photos", EDGE)
    hair = ChosenHair(curl_radius_mm=4.0, curl_pitch_mm=20.0)
    return replace(photos, chosen=Chosen(hair, TURNED))


CASES: dict[str, tuple[Callable[[], Capture], str]] = {
    "sample": (sample, "default"),
    "photos alone": (photos_alone, "default"),
    "thesis": (sample, "thesis"),
}
SKIN_FIRST = {"photos alone"}
"""Cases whose skin is asked for first by the process of one thread, the others by one of more."""


@contextmanager
def findings_of(
    capture: Capture, recipe: Recipe, manager: Manager, folder: Path, threads: int = 2
) -> Iterator[Findings]:
    """Give what a recipe finds in photos, with a work folder."""
    with one_blas_thread(), WorkFolder(folder) as work, ThreadPoolExecutor(threads) as pool:
        run = StageRunner(recipe, manager, work, RunLog(Silent()), pool)
        yield Findings(run, capture, guides=GUIDES)


def digest(groom: Groom) -> str:
    """Return a digest of all that a groom holds."""
    return digest_of(*to_arrays(groom).values())


def grooms(folder: Path, threads: int, skin_first: Collection[str] = ()) -> dict[str, str]:
    """Return digests of the grooms of all cases, of some after the skin and what is on it."""
    made = {}
    for name, (read, recipe) in CASES.items():
        manager = Manager.loaded(autoload=False)
        with findings_of(read(), load_recipe(recipe), manager, folder / name, threads) as findings:
            if name in skin_first:
                _ = findings.skin, findings.hairline, findings.parting, findings.view_orientations
            made[name] = digest(findings.groom)
    return made


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """The work folders and the grooms of all cases."""
    folder = tmp_path_factory.mktemp("first")
    return folder, grooms(folder, thread_count())


@pytest.mark.parametrize("name", sorted(set(CASES) - SKIN_FIRST))
def test_the_order_of_questions_changes_no_byte(
    name: str, first: tuple[Path, dict[str, str]], manager: Manager, tmp_path: Path
) -> None:
    """Whether skin or strands are asked for first, the groom is the same in every bit."""
    read, recipe = CASES[name]
    with findings_of(read(), load_recipe(recipe), manager, tmp_path) as findings:
        _ = findings.skin, findings.hairline, findings.parting, findings.view_orientations
        assert digest(findings.groom) == first[1][name]


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_made_twice(
    name: str, first: tuple[Path, dict[str, str]], manager: Manager
) -> None:
    """In the work folder of a run that has ended every result is read, and the groom is that of the
    run."""
    read, recipe = CASES[name]
    with findings_of(read(), load_recipe(recipe), manager, first[0] / name) as findings:
        assert digest(findings.groom) == first[1][name]
        assert [time.stage for time in findings.run.log.stages if not time.reused] == []
        names = {time.stage for time in findings.run.log.stages}
        assert {"scene", "hull", "field", "track", "skin"} <= names <= {row.name for row in ROWS}


def test_one_thread_waits_for_nothing_behind_it(
    first: tuple[Path, dict[str, str]], tmp_path: Path
) -> None:
    """With one thread for all stages every run ends, with the grooms of several threads, those of
    `SKIN_FIRST` in the other order too."""
    done = subprocess.run(
        [sys.executable, __file__, str(tmp_path), str(photo_skin.SIZE), str(photo_skin.COARSE)],
        env=os.environ | {"NUMBA_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == first[1]


def test_the_skin_asks_for_nothing_of_the_hair(tmp_path: Path) -> None:
    """What `hairkit head` asks for runs no stage of directions, volume and strands."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    recipe = parse_recipe(RECIPE.encode(), "ball", "test")
    ball_plugin.CALLS.clear()
    with findings_of(turn_capture(), recipe, manager, tmp_path) as findings:
        findings.given_head = ball_head()
        _ = findings.skin
    assert {call.partition(" ")[0] for call in ball_plugin.CALLS} == {"segment", "scene", "fit"}


class Counted(Findings):
    """Findings with a property that counts how often it is made, and one that fails."""

    count = 0

    @found
    def answer(self) -> int:
        """One more each time."""
        self.count += 1
        return self.count

    @found
    def fault(self) -> int:
        """An error, counted."""
        self.count += 1
        raise InputError(f"fault {self.count}")


def test_a_result_is_made_once_for_all_threads() -> None:
    """Threads that ask at the same time get the same result, or the same error."""
    findings = Counted.__new__(Counted)
    findings.guard, findings.made = threading.Lock(), {}
    with ThreadPoolExecutor(8) as pool:
        assert {*pool.map(lambda _: findings.answer, range(50))} == {1}
        errors = [pool.submit(lambda: findings.fault).exception() for _ in range(20)]
    assert {str(error) for error in errors} == {"fault 2"}


def photographed(capture: object, scene: object, masks: object) -> SkinMaps:
    """Stands for the projection of photos."""
    return SkinMaps(albedo=PHOTOGRAPHED)


def skin_of(recipe: str, folder: Path, manager: Manager) -> SkinMaps:
    """Return the skin that a recipe makes of the made-up head."""
    manager.register(ball_plugin, "ball_plugin")
    parsed = parse_recipe((RECIPE + recipe).encode(), "mine", "mine")
    parsed.check(manager)
    with findings_of(turn_capture(), parsed, manager, folder / "work") as findings:
        findings.given_head = ball_head()
        return findings.skin


def test_the_table_texture_enhances_the_albedo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the table the albedo is the photographed one, with it the plugin's, of its size."""
    monkeypatch.setattr(module, "photograph_skin", photographed)
    photographed.__module__ = module.__name__  # whose sources make its digest
    assert load_recipe("default").stage("texture") is None
    plain = skin_of("", tmp_path, Manager.loaded()).albedo
    assert plain is not None
    np.testing.assert_array_equal(plain.pixels, PHOTOGRAPHED.pixels)
    close_up = tmp_path / "close_up.png"
    close_up.write_bytes(Texture.encode(draw_skin(48, 2)).data.tobytes())
    table = f'[texture]\nplugin = "image_analogies"\nclose_up = "{close_up}"\n'
    finer = skin_of(table, tmp_path, Manager.loaded()).albedo
    assert finer is not None
    assert finer.pixels.shape == plain.pixels.shape
    assert (finer.pixels != plain.pixels).any()
    with pytest.raises(HairkitError, match="close_up=FILE"):
        skin_of('[texture]\nplugin = "image_analogies"\n', tmp_path, Manager.loaded())


def test_a_table_without_a_plugin_is_refused() -> None:
    """The default recipe names none that its options could be for."""
    with pytest.raises(HairkitError, match=r"texture\.plugin is None"):
        parse_recipe(b"[texture]\nalpha = 0.1\n", "mine", "mine")


if __name__ == "__main__":
    photo_skin.SIZE, photo_skin.COARSE = map(int, sys.argv[2:])  # as in the process that compares
    print(json.dumps(grooms(Path(sys.argv[1]), 1, SKIN_FIRST)))
