"""Laws of what is chosen by hand: it is kept in the project and reaches every reconstruction."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairkit.cameras.similarity import Similarity, move_head
from hairkit.errors import HairkitError
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture
from hairkit.io.capture_toml import HeadEntry, head_entry, head_pose
from hairkit.studio.feedback import EXAMPLES, Feedback, judge_photo
from hairkit.studio.framing import judge_view
from hairkit.studio.pose import Nudge, Placed
from hairkit.studio.project import Project
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.chosen import ChosenHair
from hairkit.types.edits import read_edits
from hairkit.types.groom import HairMaterial
from hairkit.types.scene import Scene
from hairkit.types.waves import Waves

WIDTH, HEIGHT = 600, 800


def placed(pose: np.ndarray[Any, Any] | None = None) -> Placed:
    """Return a head that two cameras see."""
    cameras = tuple(
        Camera.on_turn(azimuth, distance=0.7, focal=900.0, width=WIDTH, height=HEIGHT)
        for azimuth in (0.0, 90.0)
    )
    pose = np.eye(4) if pose is None else pose
    scene = move_head(Scene(("front", "left"), cameras, default_head()), pose)
    return Placed(scene, ("001.jpg", "002.jpg"), pose)


def middle(seen: Placed, pose: np.ndarray[Any, Any], view: int) -> np.ndarray[Any, Any]:
    """Return where a camera sees the head's middle after the head was moved to a pose."""
    scene = move_head(seen.scene, np.linalg.inv(seen.pose) @ pose)
    point = default_head().vertices.astype(np.float64).mean(axis=0)
    return np.asarray(scene.cameras[view].project(point[None])[0])


def test_a_dragged_head_follows_the_pointer() -> None:
    """The head's middle moves by what was dragged, in the photo in which it was dragged."""
    seen = placed()
    before = middle(seen, seen.pose, 1)
    nudged = seen.nudged(Nudge("002.jpg", (0.05, -0.03)))
    moved = middle(seen, nudged, 1) - before
    assert moved == pytest.approx([0.05 * WIDTH, -0.03 * HEIGHT], abs=0.5)


def test_turning_and_growing_keep_the_middle() -> None:
    """Turn and growth are about the head's middle; growth is that of the head's picture."""
    start = head_pose(HeadEntry(1.1, (3.0, -5.0, 8.0), (0.01, 0.0, -0.02)))
    seen = placed(start)
    nudged = seen.nudged(Nudge("001.jpg", turn_deg=(0.0, 0.0, 10.0), factor=1.05))
    for view in (0, 1):
        assert middle(seen, nudged, view) == pytest.approx(middle(seen, start, view), abs=0.5)
    assert Similarity.of(nudged).scale == pytest.approx(1.1 * 1.05)
    top = default_head().vertices[default_head().vertices[:, 1].argmax()][None].astype(float)
    scene = move_head(seen.scene, np.linalg.inv(start) @ nudged)
    at = scene.cameras[0].project(top)[0] - middle(seen, nudged, 0)
    was = seen.scene.cameras[0].project(top)[0] - middle(seen, start, 0)
    turned = np.degrees(np.arctan2(at[1], at[0]) - np.arctan2(was[1], was[0]))
    assert turned == pytest.approx(10, abs=1.5)  # clockwise, as the page draws it


def test_a_pose_is_written_and_read() -> None:
    """The table of a pose gives the pose."""
    pose = head_pose(HeadEntry(0.95, (10.0, 20.0, -30.0), (0.01, 0.02, 0.03)))
    assert head_pose(head_entry(pose)) == pytest.approx(pose, abs=1e-6)
    with pytest.raises(HairkitError, match="no camera"):
        placed().nudged(Nudge("elsewhere.jpg"))


def test_chosen_hair_replaces_what_was_measured() -> None:
    """Each choice replaces its own figure; what a material gives as choices gives it again."""
    measured = HairMaterial(np.array([0.1, 0.2, 0.3], np.float32))
    assert ChosenHair().material(measured) is not None
    assert ChosenHair().waves(Waves(0.01, 0.03)) == Waves(0.01, 0.03)
    assert ChosenHair(curl_radius_mm=0).waves(Waves(0.01, 0.03)) == Waves()
    look = ChosenHair("#ff8000", width_mm=0.1).material(measured)
    assert look.root_colour == pytest.approx([1, 0.2159, 0], abs=1e-3)
    assert look.width == pytest.approx(1e-4)
    again = dataclasses.replace(ChosenHair.of(look), curl_radius_mm=None).material(HairMaterial())
    assert again.root_colour == pytest.approx(look.root_colour, abs=5e-3)
    for wrong in ({"root_colour": "red"}, {"curl_radius_mm": 3.0}):
        with pytest.raises(HairkitError):
            ChosenHair(**wrong)


def test_choices_reach_a_capture(tmp_path: Path, photos: list[Path]) -> None:
    """Tones, options, hair and head are read from the project; taking them back leaves nothing."""
    folder = tmp_path / "head"
    (folder / "photos").mkdir(parents=True)
    for photo in photos[:3]:
        (folder / "photos" / photo.name).write_bytes(photo.read_bytes())
    project = Project(folder)
    before = read_capture(folder)
    project.tone(project.shots[1].id, 1.5, 0.8)
    project.choose("structure_tensor", {"window_sigma": 16.0}, ChosenHair(width_mm=0.05))
    project.place_head(HeadEntry(1.02))
    capture = read_capture(folder)
    assert capture.chosen.settings == ("structure_tensor.window_sigma=16.0",)
    assert capture.chosen.hair.width_mm == 0.05
    assert capture.chosen.head is not None
    assert [(v.brightness, v.contrast) for v in capture.views] == [(1, 1), (1.5, 0.8), (1, 1)]
    assert (capture.views[1].toned().image != before.views[1].image).any()
    assert [shot.brightness for shot in Project(folder).shots] == [1, 1.5, 1]
    (folder / "studio.json").unlink()  # the capture alone tells it, too
    project = Project(folder)
    assert [shot.contrast for shot in project.shots] == [1, 0.8, 1]
    project.tone(project.shots[1].id, 1.0, 1.0)
    project.choose("structure_tensor", {}, ChosenHair())
    project.place_head(HeadEntry())
    again = read_capture(folder)
    assert again.chosen.head is None
    assert (again.chosen.settings, again.chosen.hair) == ((), ChosenHair())
    assert "[" not in (folder / "capture.toml").read_text().replace("[[views]]", "")


def test_wrong_choices_are_refused(server: Any, photos: list[Path]) -> None:
    """Options out of bounds, unknown ones and wrong kinds change nothing; one line says why."""
    number = server.ask("POST", "/api/photos", photos[0].read_bytes()).json["id"]
    wrong = [
        ("PUT", "/api/choices", {"options": {"window_sigma": 1e9}}),
        ("PUT", "/api/choices", {"options": {"nothing": 1}}),
        ("PUT", "/api/choices", {"hair": {"root_colour": "<b>"}}),
        ("PUT", "/api/choices", {"hair": []}),
        ("PUT", f"/api/photos/{number}/tone", {"brightness": "bright"}),
        ("PUT", f"/api/photos/{number}/tone", {"contrast": -1}),
        ("POST", f"/api/photos/{number}/strands", {"tone": 3}),
        ("POST", f"/api/photos/{number}/strands", {"options": {"window_sigma": []}}),
        ("POST", "/api/head", {"photo": "001.jpg"}),
        ("PUT", "/api/head", {"scale": 0}),
    ]
    for method, path, body in wrong:
        answer = server.ask(method, path, body)
        assert answer.status in (400, 422), (path, body, answer.body)
        assert "\n" not in answer.json["error"]
    assert not (server.folder / "capture.toml").exists()
    found = server.ask("GET", "/api/choices").json
    assert found["plugin"] == "structure_tensor"
    lines = server.ask("POST", f"/api/photos/{number}/strands", {"options": {"window_sigma": 8}})
    assert lines.body.startswith(b"\x89PNG")


def test_outlines_survive_a_restart(tmp_path: Path, start_studio: Any, photos: list[Path]) -> None:
    """An outline that was found is read from the project by the next studio, not found again."""
    folder = tmp_path / "head"
    first = start_studio(folder).enter()
    number = first.ask("POST", "/api/photos", photos[0].read_bytes()).json["id"]
    found = first.ask("GET", f"/api/photos/{number}/outline").json
    first.kill()
    kept = folder / ".studio" / "pictures" / "001-outline.json"
    document = json.loads(kept.read_text())
    assert document["found"]["outline"] == found["outline"]
    document["found"]["share"] = 0.25
    kept.write_text(json.dumps(document))
    second = start_studio(folder).enter()
    try:
        assert second.ask("GET", f"/api/photos/{number}/outline").json["share"] == 0.25
    finally:
        second.kill()


def test_examples_show_what_they_are_named_after(monkeypatch: pytest.MonkeyPatch) -> None:
    """The right picture has no fault; each wrong one has its own."""
    from docs.images import camera_examples as drawing
    from docs.images.camera_examples import GOOD, draw_examples
    from hairkit.studio.capture_guides import guide_at
    from hairkit.types.face import Face

    monkeypatch.setattr(drawing, "STRANDS", 400)
    drawn = {example.name: example for example in draw_examples()}
    assert set(drawn) == set(EXAMPLES)
    for name, example in drawn.items():
        yaw = -38.0 if name == Feedback.WRONG_ANGLE else 0.0
        face = Face(0.99, example.landmarks, np.zeros(68), yaw, 0.0, 0.0)
        view = View("front", 0.0, example.image, person=example.person, face=face)
        codes = judge_photo(example.image) + judge_view(view, guide_at(0.0, 0.0))
        assert (codes == []) if name == GOOD else (Feedback(name) in codes), (name, codes)


def test_every_example_lies_beside_the_pages(project: Path) -> None:
    """The page finds a picture for each name."""
    for name in EXAMPLES:
        data = (project / "hairkit" / "studio" / "pages" / f"example-{name}.jpg").read_bytes()
        assert data.startswith(b"\xff\xd8\xff")
        assert len(data) < 10_000


def test_turns_are_those_that_the_page_names() -> None:
    """About the axis to the right a face nods down, about the one downwards it turns left."""
    seen = placed()
    vertices = default_head().vertices.astype(np.float64)
    nose = vertices[vertices[:, 2].argmax()][None]
    before = seen.scene.cameras[0].project(nose)[0]
    for axis, along in (((10.0, 0.0, 0.0), (0, 1)), ((0.0, 10.0, 0.0), (-1, 0))):
        scene = move_head(seen.scene, seen.nudged(Nudge("001.jpg", turn_deg=axis)))
        moved = scene.cameras[0].project(nose)[0] - before
        assert moved @ along > 10
        assert abs(np.cross([*moved, 0], [*along, 0])[2]) < 2


def test_strokes_over_the_hair_are_kept(server: Any) -> None:
    """Strokes come back as they were sent; what is no stroke is refused, and nothing is written."""
    given = server.ask("GET", "/api/edits").json
    assert given["strokes"] == []
    assert {"comb", "add", "thin"} <= {*given["brushes"]}
    assert given["groups"] == ["hair", "brows", "lashes", "beard"]
    stroke = {"brush": "cut", "radius": 0.02, "mirror": True, "path": [[0.1, 0, 0]]}
    assert server.ask("PUT", "/api/edits", {"strokes": [stroke]}).status == 200
    [kept] = server.ask("GET", "/api/edits").json["strokes"]
    assert stroke.items() <= kept.items()
    for wrong in ({"strokes": 7}, {"strokes": [{"radius": -1}]}, {"strokes": [{"path": [1]}]}, {}):
        answer = server.ask("PUT", "/api/edits", wrong)
        assert answer.status == 422
        assert "edits" in answer.json["error"]
    assert server.ask("GET", "/api/edits").json["strokes"] == [kept]
    early = server.ask("POST", "/api/edits/stroke", {"stroke": stroke})
    assert early.status == 422
    assert early.json["error"] == "strokes are kept, and show once the hair is made again"
    assert read_capture_edits(server.folder) == [kept]


def read_capture_edits(folder: Path) -> Any:
    """Return the strokes of a project as a run reads them."""
    return read_edits(folder / "edits.json").values()
