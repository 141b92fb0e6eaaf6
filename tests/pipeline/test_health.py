"""Health: a good capture is green, and each fault turns the figure red that names it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from ball import ball_evidence

from hairkit.cameras.depth_raster import mesh_depth
from hairkit.grooming.densify import densify
from hairkit.grooming.wind_waves import add_waves
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.pipeline.figure import AMBER, GREEN, RED, Figure, Limits
from hairkit.pipeline.health import assess, assess_seen, summarise
from hairkit.rendering.picture import draw_views
from hairkit.synth import grow
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.face import Face
from hairkit.types.groom import Groom
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.tie import Tail, Tie, TiedHair
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull
from hairkit.types.waves import Waves

WIDTH, HEIGHT = 360, 480
HAIR_SIZE = 1.25
"""Size of the surface of the hair over that of the scalp."""
ROOTS = 240
HAIRS = 6000
"""In the photos, which are drawings."""
HAIR_LENGTH = 0.095
DISTANCE = ball_evidence().scalp_distance
SHUFFLED = [3, 6, 0, 5, 1, 7, 2, 4]


class Run:
    """The results of a run on the default head, and what to spoil in them."""

    def __init__(self) -> None:
        head = default_head()
        cameras = tuple(
            Camera.on_turn(45.0 * k, distance=0.8, focal=1000.0, width=WIDTH, height=HEIGHT)
            for k in range(8)
        )
        self.scene = Scene(tuple(str(k) for k in range(8)), cameras, head, residual_px=0.3)
        self.masks = tuple(self._mask(camera) for camera in cameras)
        assert head.landmark_vertices is not None
        points = head.vertices[head.landmark_vertices].astype(np.float64)
        plugins = Manager.loaded(autoload=False)
        self.hull: Hull = plugins.call(
            "build_hull", "visual_hull", scene=self.scene, masks=self.masks, orientations=()
        )
        self.groom: Groom = grow("short", head, ROOTS, seed=1)
        photos = draw_views(densify(self.groom, HAIRS), head, cameras)
        self.capture = Capture(
            tuple(
                View(str(k), 45.0 * k, photo, landmarks=seen if k in (0, 1, 7) else None)
                for k, photo in enumerate(photos)
                for seen in [cameras[k].project(points)]
            )
        )
        self.orientations = tuple(
            plugins.call("orient", "structure_tensor", view=view, mask=mask)
            for view, mask in zip(self.capture.views, self.masks, strict=True)
        )
        self.turn: Turnaround | None = self._turn(1.5)
        self.roots = len(self.groom.strands)
        self.hair_length = HAIR_LENGTH
        self.parting = Parting.at(0.0, skin_share=0.02, spread=0.012)
        self.tied = TiedHair()
        self.waves = Waves()

    def _mask(self, camera: Camera) -> Mask:
        head = self.scene.head
        faces = head.faces[(head.scalp[head.faces] > 0.5).all(axis=1)]
        skin = mesh_depth(head.vertices, head.faces, camera)
        hair = mesh_depth((HAIR_SIZE * head.vertices).astype(np.float32), faces, camera)
        labels = np.where(np.isfinite(skin), PERSON, BACKGROUND)
        labels[np.isfinite(hair) & (hair < skin)] = HAIR
        return Mask(labels, True)

    def _turn(self, margin: float) -> Turnaround:
        k, zero = np.arange(8), np.zeros(8)
        return Turnaround(k, 45.0 * k, zero, self.scene.names, margin, "a turn")

    def figures(self) -> dict[str, Figure]:
        """Return the figures by stage and name."""
        evidence = ball_evidence(
            masks=self.masks,
            scene=self.scene,
            orientations=self.orientations,
            hull=self.hull,
            scalp_distance=replace(DISTANCE, hair_length=self.hair_length),
            parting=self.parting,
            tied=self.tied,
            waves=self.waves,
        )
        every = assess(self.capture, evidence, self.groom, self.roots, self.turn)
        return {f"{figure.stage}: {figure.name}": figure for figure in every}


@pytest.fixture(scope="module")
def good_run() -> Run:
    """A run without faults, not to be changed."""
    return Run()


@pytest.fixture
def run(good_run: Run) -> Run:
    """The results of the run, to be replaced by others."""
    return copy(good_run)


@pytest.fixture(scope="module")
def good(good_run: Run) -> Mapping[str, Figure]:
    """The figures of the run as it is."""
    return good_run.figures()


def test_a_good_run_is_green(good: Mapping[str, Figure]) -> None:
    """Nothing is doubtful where masks, cameras, head and strands fit together."""
    assert {name for name, figure in good.items() if figure.light != GREEN} == set()
    assert summarise(list(good.values())) == [f"health: {len(good)} green, 0 amber, 0 red"]


def shuffle(run: Run) -> None:
    """The photos are in another order than the cameras."""
    views = tuple(run.capture.views[k] for k in SHUFFLED)
    run.capture, run.masks = Capture(views), tuple(run.masks[k] for k in SHUFFLED)


def bare_hairline(run: Run) -> None:
    """Skin shows over the whole breadth of the crown."""
    run.parting = Parting(skin_share=0.1, spread=0.09)


def unsure_crown(run: Run) -> None:
    """The views' directions just agree with a parting."""
    run.parting = Parting(Parting.at(0.0).line, sureness=0.0)


def two_heads(run: Run) -> None:
    """Every other mask is that of another, taller head of hair."""
    lifted = [Mask(np.roll(mask.labels, -75, axis=0), True) for mask in run.masks]
    run.masks = tuple(lifted[k] if k % 2 else run.masks[k] for k in range(8))


def hairy_face(run: Run) -> None:
    """The whole head is called hair."""
    run.masks = tuple(
        Mask(np.where(mask.labels == PERSON, HAIR, mask.labels), True) for mask in run.masks
    )


def beard(run: Run) -> None:
    """The jaw below the mouth is called hair."""
    corners = run.scene.head.landmark_vertices
    assert corners is not None
    jaw = run.scene.head.vertices[corners[[*range(3, 14), 31, 35]]]
    masks = []
    for camera, mask in zip(run.scene.cameras, run.masks, strict=True):
        labels = mask.labels.copy()
        outline = cv2.convexHull(np.rint(camera.project(jaw)).astype(np.int32))
        cv2.fillConvexPoly(labels, outline, HAIR)
        masks.append(Mask(labels, True))
    run.masks = tuple(masks)


def large_head(run: Run) -> None:
    """The head and all around it came out 1.3 times too large."""
    head = replace(run.scene.head, vertices=1.3 * run.scene.head.vertices)
    run.scene = replace(run.scene, head=head)


def no_landmarks(run: Run) -> None:
    """No landmarks are known."""
    run.capture = Capture(tuple(replace(view, landmarks=None) for view in run.capture.views))


def wrong_outlines(run: Run) -> None:
    """The outlines of the views contradict each other."""
    run.scene = replace(run.scene, residual_px=6.0)


def few_strands(run: Run) -> None:
    """A fifth of the roots gave no strand."""
    run.roots = round(1.25 * run.roots)


def any_turn(run: Run) -> None:
    """Another arrangement of the photos fits as well."""
    run.turn = run._turn(1.0)


def no_back(run: Run) -> None:
    """The photos leave out the back."""
    turn = run._turn(1.5)
    run.turn = replace(turn, azimuth_deg=np.linspace(-90.0, 90.0, 8))


def combed_otherwise(run: Run) -> None:
    """The guides run across the directions that the photos show."""
    level = np.broadcast_to(120 + 60 * np.sin(np.arange(HEIGHT))[:, None, None], (HEIGHT, WIDTH, 3))
    striped = tuple(replace(v, image=level.astype(np.uint8)) for v in run.capture.views)
    run.capture = replace(run.capture, views=striped)


def blind(run: Run) -> None:
    """The orienter is sure of nothing, and its angles are wrong."""
    none = np.zeros((HEIGHT, WIDTH), np.float32)
    run.orientations = (OrientationMap(none, none),) * 8


def half_bald(run: Run) -> None:
    """No strand grows on the left half of the head."""
    points = run.groom.strands.resampled(21).points.reshape(-1, 21, 3)
    kept = points[points[:, 0, 0] < 0]
    offsets = np.arange(len(kept) + 1) * 21
    run.groom = replace(
        run.groom,
        strands=Strands(kept.reshape(-1, 3), offsets),
        root_triangle=run.groom.root_triangle[points[:, 0, 0] < 0],
        root_barycentric=run.groom.root_barycentric[points[:, 0, 0] < 0],
    )


def combed_up(run: Run) -> None:
    """The strands stand on end."""
    points = run.groom.strands.points.copy()
    points[:, 1] += 4 * np.maximum(points[:, 1].max() - points[:, 1], 0)
    run.groom = replace(run.groom, strands=Strands(points, run.groom.strands.offsets))


def curled(run: Run) -> None:
    """Straight hair came out in curls."""
    material = replace(run.groom.material, curl_radius=0.005, curl_pitch=0.02)
    run.groom = replace(run.groom, material=material)


FAULTS = {
    "cameras: landmarks off by": shuffle,
    "masks: hair that all views agree on, worst view": two_heads,
    "hull: overlap with the masks": two_heads,
    "masks: face called hair": hairy_face,
    "head: distance of the pupils": large_head,
    "landmarks: views used": no_landmarks,
    "cameras: outlines off by": wrong_outlines,
    "strands: roots grown": few_strands,
    "turn: margin over the next best": any_turn,
    "turn: largest step": no_back,
    "parting: width of the skin": bare_hairline,
    "parting: sureness": unsure_crown,
    "orient: angles as photographed": blind,
    "strands: directions as photographed": combed_otherwise,
    "strands: drawn where no photo has hair": combed_up,
    "strands: hair left bare": half_bald,
    "strands: direction of curly hair": curled,
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_turns_its_figure_red(name: str, run: Run) -> None:
    """The figure that names a fault is red, and its line is among the last ones of the run."""
    FAULTS[name](run)
    figures = run.figures()
    assert figures[name].light == RED
    assert figures[name].line() in summarise(list(figures.values()))


def test_curls_that_turn_one_way_are_judged_by_their_directions(run: Run) -> None:
    """Their locks run one way in the photos, as straight hair does: that is no fault."""
    curled(run)
    run.waves = Waves(0.005, 0.02, 0.3)
    names = run.figures()
    assert "strands: direction of curly hair" not in names
    assert "strands: directions as photographed" in names


def test_landmarks_of_one_view_are_not_judged(run: Run) -> None:
    """The head is bent to them, wherever they are."""
    first, *others = run.capture.views
    apart = replace(first, landmarks=np.full((68, 2), 5.0))
    alone = (replace(view, landmarks=None) for view in others)
    run.capture = Capture((apart, *alone))
    assert "cameras: landmarks off by" not in run.figures()


def test_landmarks_of_a_steep_face_are_not_judged(run: Run) -> None:
    """They are off where the cameras are right."""
    steep = Face(1.0, np.full((68, 2), 5.0), np.ones(68), 52.0, 0.0, 0.0)
    first, *others = run.capture.views
    run.capture = Capture((replace(first, landmarks=steep.landmarks, face=steep), *others))
    assert run.figures()["cameras: landmarks off by"].light == GREEN
    front = replace(steep, yaw_deg=10.0)
    run.capture = Capture((replace(first, landmarks=front.landmarks, face=front), *others))
    assert run.figures()["cameras: landmarks off by"].light == RED


def test_notes_name_the_photos(run: Run) -> None:
    """What to look at is named by the user's file, not by a view alone."""
    views = run.capture.views
    run.capture = Capture(
        tuple(replace(v, photo_path=Path(f"IMG_{k}.jpg")) for k, v in enumerate(views))
    )
    hairy_face(run)
    assert re.search(r"mask of \d \(IMG_\d\.jpg\)", run.figures()["masks: face called hair"].note)


def test_short_hair_is_not_blamed_for_its_parting(run: Run) -> None:
    """It is combed from none: skin all over its crown is what short hair looks like."""
    bare_hairline(run)
    run.hair_length = 0.02
    assert not [name for name in run.figures() if name.startswith("parting")]


@pytest.mark.parametrize("confidence", [0.0, 1.0])
def test_maps_that_are_wrong_everywhere_are_red(confidence: float, run: Run) -> None:
    """They need not be empty: the field may be made without them, and all else be green."""
    turned = tuple(
        OrientationMap(wrap_angle(o.angle + np.pi / 2), np.full_like(o.angle, confidence))
        for o in run.orientations
    )
    run.orientations = turned
    lights = {name: figure.light for name, figure in run.figures().items()}
    assert lights.pop("orient: angles as photographed") == RED
    assert set(lights.values()) == {GREEN}


def test_curls_are_not_blamed_for_their_coils(run: Run) -> None:
    """Coils of the right radius and pitch are not where those of the photos are."""
    combed_otherwise(run)
    curled(run)
    assert "strands: directions as photographed" not in run.figures()


def test_waves_are_judged_along_their_axes(run: Run, good: Mapping[str, Figure]) -> None:
    """Their windings count for nothing; axes across the directions in the photos are red."""
    name, waves = "strands: directions as photographed", Waves(0.002, 0.03)
    material = replace(run.groom.material, curl_radius=waves.radius, curl_pitch=waves.pitch)
    run.groom = replace(run.groom, strands=add_waves(run.groom.strands, waves), material=material)
    assert run.figures()[name].value == pytest.approx(good[name].value, abs=0.05)
    combed_otherwise(run)
    assert run.figures()[name].light == RED


def test_a_beard_in_the_masks_is_red(run: Run) -> None:
    """The face includes cheeks and jaw."""
    beard(run)
    assert run.figures()["masks: face called hair"].light == RED


def test_hair_before_the_face_of_one_view_is_no_fault(run: Run) -> None:
    """A lock that hides the face in one of three frontal views says nothing; in two it does."""
    whole, name = run.masks, "masks: face called hair"
    hairy_face(run)
    hidden = run.masks
    run.masks = (whole[0], hidden[1], *whole[2:])
    assert run.figures()[name].light == GREEN
    run.masks = (whole[0], hidden[1], *whole[2:7], hidden[7])
    assert run.figures()[name].light == RED


def test_short_hair_of_half_its_length_is_not_green(run: Run) -> None:
    """Hair that covers the head all the same is missed where it stands out over the outline."""
    points = run.groom.strands.resampled(21).points.reshape(-1, 21, 3)[:, :11]
    offsets = np.arange(len(points) + 1) * 11
    run.groom = replace(run.groom, strands=Strands(points.reshape(-1, 3), offsets))
    assert run.figures()["strands: hair left bare"].light != GREEN


def test_limits_may_rise_or_fall() -> None:
    """Green and red lie beyond their limits, amber between, whichever way is better."""
    lights = [Limits(0.9, 0.8).light(value) for value in (1.0, 0.9, 0.85, 0.8, 0.1)]
    assert lights == ["green", "green", "amber", "red", "red"]
    assert [Limits(1, 3).light(value) for value in (0, 2, 3)] == ["green", "amber", "red"]


def test_the_crown_of_tied_hair_is_no_parting(run: Run) -> None:
    """Its skin shows along the hairline, and the hair is combed to the tie whatever that says."""
    bare_hairline(run)
    tie = Tie(np.array([0.0, 0.05, -0.1]), np.array([0.0, 0.0, -1.0]), 0.015, "tail")
    spine = np.array([[0.0, 0.05, -0.1], [0.0, 0.0, -0.12]])
    spokes = 0.01 * np.broadcast_to(np.eye(3)[:2], (2, 2, 3))
    run.tied = TiedHair((Tail(tie, 0.9, spine, spokes, np.ones(2)),))
    assert not [name for name in run.figures() if name.startswith("parting")]


def test_what_is_made_up_is_told() -> None:
    """The share of strands that a photo shows is amber, with a line that says what the rest is."""
    line = np.array([[0, 0.1, 0], [0, 0.05, 0]], np.float32)
    strands = Strands(np.tile(line, (4, 1)), np.arange(5) * 2, group=np.array([0, 1, 1, 1]))
    (figure,) = assess_seen(strands)
    assert (figure.value, figure.light) == (0.25, AMBER)
    assert "made up" in figure.line()
