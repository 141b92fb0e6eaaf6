"""Laws of runs without a window, and of `hairkit simulate`."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hairkit import cli
from hairkit.errors import HairkitError, InputError
from hairkit.manager import Manager
from hairkit.simulation import Measures, Weather, add_shakes, run, static_motion
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache, read_cache


@pytest.fixture(scope="module")
def groom() -> Groom:
    """Return a few bristles."""
    ball = bristle_groom()
    pick = np.arange(0, len(ball.strands), 12)

    keep = np.zeros(len(ball.strands), bool)
    keep[pick] = True
    return ball.select(keep)


def made(manager: Manager, groom: Groom, **options: object) -> object:
    """Return the simulator in float64."""
    return manager.call("make_simulator", "rods", {"backend": "reference", **options}, groom=groom)


def test_the_first_frame_is_the_rest(manager: Manager, groom: Groom) -> None:
    """Frame 0 is the captured hair on the head's first key; times and heads are the motion's."""
    motion = add_shakes(["yaw:20:2"], groom.head)
    cache = run(made(manager, groom), motion, 5, 50.0)
    np.testing.assert_array_equal(cache.points[0], groom.strands.points)
    np.testing.assert_allclose(cache.times, np.arange(5) / 50)
    np.testing.assert_allclose(cache.head_from_rest[3], motion(3 / 50))


def test_warm_up_is_the_end_of_a_longer_run(manager: Manager, groom: Groom) -> None:
    """Frames after a warm-up are the frames of the same run without it."""
    weather = Weather(np.array([3.0, 0.0, 0.0]), 0.3)
    simulator = made(manager, groom)
    long = run(simulator, static_motion(), 8, weather=weather)
    short = run(simulator, static_motion(), 3, weather=weather, warm_up=5 / 60)
    np.testing.assert_array_equal(short.points, long.points[5:])


def test_what_is_not_finite_is_an_error(manager: Manager, groom: Groom) -> None:
    """A simulator that blows up is named, not written."""
    simulator = made(manager, groom)

    class Exploding:
        strands, points = simulator.strands, np.full_like(simulator.points, np.nan)

        def reset(self, head: object) -> None: ...
        def advance(self, seconds: float, around: object) -> None: ...

    with pytest.raises(HairkitError, match="diverged") as caught:
        run(Exploding(), static_motion(), 2)
    assert cli.explain(caught.value)[1] == 3
    with pytest.raises(InputError, match="frames"):
        run(simulator, static_motion(), 0)


@pytest.mark.parametrize(("stretch", "frames"), [(0.02, 60), (0.5, 200), (0.009, 200)])
def test_hair_that_stays_stretched_is_an_error(
    manager: Manager, groom: Groom, stretch: float, frames: int
) -> None:
    """More than 1 % for more than a second on end ends a run; a jerk or less does not."""
    simulator = made(manager, groom)

    class Torn:
        strands, points = simulator.strands, simulator.points

        def reset(self, head: object) -> None: ...
        def advance(self, seconds: float, around: object) -> None: ...
        def measure(self) -> Measures:
            return Measures(stretch, 0.0, 0.0)

    if stretch > 0.01 and frames > 60:
        with pytest.raises(HairkitError, match="stretched"):
            run(Torn(), static_motion(), frames)
    else:
        assert len(run(Torn(), static_motion(), frames)) == frames


def simulate(groom: Groom, folder: Path, *more: str) -> int:
    """Run the verb on a groom's file."""
    groom.save(folder / "groom.npz")
    words = ["simulate", str(folder / "groom.npz"), "--frames", "4", "--quiet"]
    return cli.main([*words, "--set", "rods.backend=reference", *more])


@pytest.mark.parametrize("simulator", ["rods", "super_helix"])
def test_full_hair_moves_with_guides_chosen_from_it(
    groom: Groom, tmp_path: Path, simulator: str
) -> None:
    """From full hair to its motion in one command: few strands are simulated, all are written."""
    words = ["simulate", str(tmp_path / "full.npz"), "--guides", "5", "--using", simulator]
    words += ["--frames", "6", "--wind", "9,0,0", "--quiet", "-o"]
    groom.save(tmp_path / "full.npz")
    assert cli.main([*words, str(tmp_path / "guides.npz")]) == 0
    cache = PointCache.load(tmp_path / "guides.npz")
    assert cache.points.shape[1] == 5 * groom.strands.counts[0] < len(groom.strands.points)
    assert cli.main([*words, str(tmp_path / "moving.glb")]) == 0
    assert cli.main(["info", str(tmp_path / "moving.glb")]) == 0
    assert cli.main([*words, str(tmp_path / "x.npz"), "--guides", "0"]) == 2


def test_the_verb_writes_a_cache_of_the_groom(groom: Groom, tmp_path: Path) -> None:
    """The cache belongs to the groom and equal commands write equal bytes."""
    files = []
    for name in ("a.npz", "b.npz"):
        path = tmp_path / name
        words = ["--shake", "yaw:20:3", "--wind", "3,0,1", "--turbulence", "0.3"]
        assert simulate(groom, tmp_path, "-o", str(path), *words) == 0
        files.append(path.read_bytes())
    assert len(read_cache(tmp_path / "a.npz", groom)) == 4
    assert files[0] == files[1]


@pytest.mark.parametrize("name", ["head.glb", "head.json"])
def test_the_verb_follows_a_motion_file(groom: Groom, tmp_path: Path, name: str) -> None:
    """A yaw of 30 degrees a tenth of a second turns the head of every frame by its share."""
    path, half = tmp_path / name, np.radians(15.0)
    if name == "head.glb":
        path.write_bytes(
            turning_head([0.0, 0.1], [[0, 0, 0, 1], [0, np.sin(half), 0, np.cos(half)]])
        )
    else:
        keys = [{"time": 0.1 * k, "turn_deg": [0, 30 * k, 0]} for k in range(2)]
        path.write_text(json.dumps({"frames": keys}))
    cache = tmp_path / "c.npz"
    assert simulate(groom, tmp_path, "-o", str(cache), "--motion", str(path), "--frames", "7") == 0
    heads = read_cache(cache, groom).head_from_rest
    turned = np.degrees(np.arctan2(heads[:, 0, 2], heads[:, 0, 0]))
    np.testing.assert_allclose(turned[[0, 3, 6]], [0.0, 15.0, 30.0], atol=0.05)
    roots = read_cache(cache, groom).points[6][groom.strands.offsets[:-1]]
    wanted = groom.strands.roots @ heads[6, :3, :3].T + heads[6, :3, 3]
    np.testing.assert_allclose(roots, wanted, atol=1e-6)


def turning_head(times: list[float], rotations: list[list[float]]) -> bytes:
    """Return a .glb with one node, `head`, whose rotation (x, y, z, w) is animated."""
    data = np.array(times, "<f4").tobytes() + np.array(rotations, "<f4").tobytes()
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": 4 * len(times)},
        {"buffer": 0, "byteOffset": 4 * len(times), "byteLength": 16 * len(times)},
    ]
    kinds: list[dict[str, object]] = [
        {"type": "SCALAR", "min": [min(times)], "max": [max(times)]},
        {"type": "VEC4"},
    ]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "head"}], "buffers": [{"byteLength": len(data)}], "bufferViews": views,
        "accessors": [
            {"bufferView": k, "componentType": 5126, "count": len(times)} | kind
            for k, kind in enumerate(kinds)
        ],
        "animations": [{
            "samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
        }],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_other_endings_go_through_their_exporter(groom: Groom, tmp_path: Path) -> None:
    """`-o hair.abc` writes an animated file; formats without animation are refused by name."""
    assert simulate(groom, tmp_path, "-o", str(tmp_path / "hair.abc")) == 0
    assert (tmp_path / "hair.abc").stat().st_size > 1000
    assert simulate(groom, tmp_path, "-o", str(tmp_path / "hair.apx")) == 2
    assert not (tmp_path / "hair.apx").exists()


def test_formats_without_animation_are_refused_before_anything_is_simulated(
    groom: Groom,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The line names what does carry animation."""
    monkeypatch.setattr("hairkit.simulation.run", lambda *_, **__: pytest.fail("simulated"))
    assert simulate(groom, tmp_path, "-o", str(tmp_path / "hair.obj")) == 2
    said = capsys.readouterr().err
    assert "obj writes no animation" in said
    assert all(ending in said for ending in (".npz", ".abc", ".glb", ".usdc"))


def test_wind_may_begin_with_a_minus(groom: Groom, tmp_path: Path) -> None:
    """Wind along -X is said as it is along +X, and blows the other way."""
    moved = []
    for wind in ("-8,0,0", "8,0,0"):
        cache = tmp_path / "c.npz"
        assert simulate(groom, tmp_path, "-o", str(cache), "--wind", wind, "--frames", "9") == 0
        points = read_cache(cache, groom).points
        moved.append(float((points[8] - points[0])[:, 0].mean()))
    assert moved[0] < 0 < moved[1]


def test_options_found_in_the_window_are_taken_by_name(groom: Groom, tmp_path: Path) -> None:
    """A preset beside the groom is as good as its options; `--set` goes before it."""
    (tmp_path / "groom.presets.toml").write_text(
        "[heavy]\nsimulator = 'rods'\noptions = {drag = 30.0, backend = 'reference'}\n"
    )
    words = ("--wind", "3,0,0", "--frames", "5", "-o", str(tmp_path / "c.npz"))
    found = []
    for more in (
        ("--preset", "heavy"),
        ("--set", "drag=30", "--set", "backend=reference"),
        ("--preset", "heavy", "--set", "drag=1"),
    ):
        assert simulate(groom, tmp_path, *words, *more) == 0
        found.append(read_cache(tmp_path / "c.npz", groom).points)
    assert (found[0] == found[1]).all()
    assert not (found[0] == found[2]).all()
    assert simulate(groom, tmp_path, *words, "--preset", "light") == 2


def test_a_groom_without_strands_is_refused(
    groom: Groom, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line says so, from simulate and from view."""

    bald = groom.select(np.zeros(len(groom.strands), bool))
    assert simulate(bald, tmp_path, "-o", str(tmp_path / "c.npz")) == 2
    assert "holds no strands" in capsys.readouterr().err
    (tmp_path / "s.toml").write_text("")
    words = [
        "view",
        str(tmp_path / "groom.npz"),
        "--headless",
        "--script",
        str(tmp_path / "s.toml"),
    ]
    assert cli.main(words) == 2
    assert "holds no strands" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["rods", "pbd", "super_helix"])
def test_no_simulator_takes_a_groom_without_strands(
    name: str, groom: Groom, manager: Manager
) -> None:
    """In the words of `hairkit simulate`, not by an error of an array without values."""
    bald = groom.select(np.zeros(len(groom.strands), bool))
    with pytest.raises(InputError, match="holds no strands, so there is nothing to simulate"):
        manager.call("make_simulator", name, groom=bald)


def test_frames_that_no_memory_holds_are_refused_at_once(groom: Groom, tmp_path: Path) -> None:
    """Before the first frame, with the size."""
    many = SimpleNamespace(strands=SimpleNamespace(points=np.zeros((10**7, 3))))
    with pytest.raises(InputError, match=r"GiB of memory.*record fewer frames"):
        run(many, static_motion(), 10**6)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "words",
    [["--wind", "3,0"], ["--shake", "yaw:x:1"], ["--fps", "0"], ["--set", "rods.dampin=1"],
     ["--set", "gabor.angles=3"], ["--using", "gabor"], ["--motion", "nowhere.json"]],
)  # fmt: skip
def test_bad_words_are_one_line(
    groom: Groom, tmp_path: Path, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, one line, nothing written."""
    assert simulate(groom, tmp_path, "-o", str(tmp_path / "c.npz"), *words) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not (tmp_path / "c.npz").exists()


def test_interrupted_runs_leave_nothing(
    groom: Groom, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while frames are made or written leaves neither file nor part."""

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    for owner, name in ((PointCache, "save"), (np, "isfinite")):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, interrupted)
            assert simulate(groom, tmp_path, "-o", str(tmp_path / "c.npz")) == 2
        assert [p.name for p in tmp_path.iterdir()] in (["groom.npz"], [])
