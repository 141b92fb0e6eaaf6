"""The walk through the stages: every result of a capture, made when it is first asked for.

A whole run asks for the groom, `hairkit head` for the skin, one photo alone for its masks and
orientations. Each property names what it is made from; `hairkit.stages` has the rest.
"""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import fields, replace
from typing import Any

from hairkit.cameras.similarity import move_head
from hairkit.field.find_parting import measure_parting
from hairkit.field.find_ties import measure_ties
from hairkit.field.unseen import group_seen, measure_ways
from hairkit.grooming.assemble import assemble_groom
from hairkit.head_model.hairline import measure_hairline
from hairkit.head_model.photo_skin import photograph_skin
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.imaging.waves import measure_waves
from hairkit.io.head_reader import HeadFile
from hairkit.pipeline.find_views import find_views
from hairkit.pipeline.found import Found, found, result_of
from hairkit.pipeline.judge_turn import judge_turn
from hairkit.pipeline.own_head import mark_head
from hairkit.pipeline.stage_runner import Given, StageRunner, Views, completed, gather, given_photo
from hairkit.pipeline.work_folder import digest_of
from hairkit.stages import (
    DISTANCE,
    EDITED,
    FIELD,
    FIRST_SCENE,
    FITTED,
    HAIRLINE,
    HULL,
    LABELS,
    ORIENTED,
    PARTING,
    REFINED,
    SCENE,
    SKIN,
    TEXTURE,
    TIES,
    TRACK,
    TURN,
    UNEDITED,
    WAVES,
    Stage,
)
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.chosen import ChosenHair
from hairkit.types.evidence import Evidence
from hairkit.types.groom import Groom
from hairkit.types.hairline import Hairline
from hairkit.types.head import Head, Roots
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull, OrientationField, ScalpDistance
from hairkit.types.waves import Waves


class Findings:
    """What is found in photos by the stages of a recipe."""

    def __init__(
        self,
        run: StageRunner,
        photos: Capture,
        head: Head | HeadFile | None = None,
        guides: int = 1,
        seed: int = 0,
    ) -> None:
        """Find nothing yet in `photos` as they were read, in any order.

        `run` runs the stages, `head` is the one to fit (None: the default head), `guides` and
        `seed` give the number of roots and their positions.
        """
        self.run, self.photos, self.given_head = run, photos, head
        self.guides, self.seed = guides, seed
        self.guard, self.made = threading.Lock(), dict[Found[Any], Future[Any]]()

    def kept(self, stage: Stage[Any]) -> Any:
        """Return a result that is not made anew: none here, some in a draft."""
        return None

    @found
    def own_head(self) -> Head:
        """The head to fit, as it was given."""
        given = self.given_head
        if given is None:
            return default_head()
        return given if isinstance(given, Head) else given.read()

    @found
    def rest(self) -> Given[Head]:
        """The head to fit, with landmarks where they can be found."""
        run = self.run
        return Given.of(mark_head(self.own_head, run.recipe, run.manager, run.log.message))

    @found
    def seen(self) -> tuple[Capture, Given[Turnaround] | None]:
        """The photos upright, as they came, with faces and persons; and the likeliest turns."""
        return find_views(self.run, self.photos)

    @found
    def photo_labels(self) -> Views[Mask]:
        """Masks of single photos, as they came: those by which the turn is judged."""
        plain = self.seen[0].plain()
        photos = [given_photo(replace(v, name=f"photo-{k}")) for k, v in enumerate(plain.views)]
        return self.run.every_view(LABELS, photos)

    @found
    def views(self) -> tuple[Capture, Turnaround | None]:
        """The photos upright, in the order of the turn, with faces and persons; and the turn."""
        seen, likeliest = self.seen
        if likeliest is None:
            return seen, None
        masks = gather(self.photo_labels) if likeliest.value.others else Given.of(())
        turn = self.run.derive(
            TURN, judge_turn, capture=Given.of(seen.plain()), masks=masks, head=self.rest,
            turn=likeliest,
        ).value  # fmt: skip
        self.run.log.message(turn.line())
        return seen.arranged(turn), turn

    @property
    def capture(self) -> Capture:
        """The photos upright, in the order of the turn, with what the user chooses."""
        return self.views[0]

    @property
    def turn(self) -> Turnaround | None:
        """From where each photo was taken; None where the recipe looks for no turn."""
        return self.views[1]

    @found
    def plain(self) -> Given[Capture]:
        """The capture as stages see it."""
        return Given.of(self.capture.plain())

    @found
    def view_labels(self) -> Views[Mask]:
        """Masks of single photos."""
        views, likeliest = self.plain.value.views, self.seen[1]
        if self.turn is None or likeliest is None or not likeliest.value.others:
            return self.run.every_view(LABELS, [given_photo(view) for view in views])
        labels = [self.photo_labels[i] for i in self.turn.order]
        for view, label in zip(views, labels, strict=True):
            self.run.keep(LABELS, label.result(), view.name)
        return labels

    @found
    def first_scene(self) -> Given[Scene] | None:
        """Cameras by the masks of single photos; None where nothing mends masks."""
        given = all(view.mask_path for view in self.plain.value.views)
        if given or not self.run.recipe.has(REFINED):
            return None
        return self._solve(FIRST_SCENE, gather(self.view_labels))

    @result_of(REFINED)
    def refined(self) -> Given[Masks]:
        """Masks that all views mended together, those that were given, too."""
        assert self.first_scene is not None  # else nobody asks
        masks = gather(self.view_labels)
        return self.run.once(REFINED, capture=self.plain, masks=masks, scene=self.first_scene)

    @found
    def view_masks(self) -> Views[Mask]:
        """Masks that hold: those given, and the others mended by where the head is."""
        if self.first_scene is None:
            return self.view_labels
        triples = zip(
            self.plain.value.views, self.view_labels, self.refined.value.views, strict=True
        )
        return [old if view.mask_path else _changed(old, new) for view, old, new in triples]

    @found
    def masks(self) -> Given[tuple[Mask, ...]]:
        """Masks that hold, of all views."""
        return gather(self.view_masks)

    @found
    def view_orientations(self) -> Views[OrientationMap]:
        """Directions of the strands in each photo, as the user toned it."""
        toned = [given_photo(view.toned()) for view in self.capture.views]
        return self.run.every_view(ORIENTED, toned, mask=self.view_masks)

    @found
    def orientations(self) -> Given[tuple[OrientationMap, ...]]:
        """Directions of the strands in all photos."""
        return gather(self.view_orientations)

    @result_of(SCENE)
    def solved(self) -> Given[Scene]:
        """The cameras, and the head's size and pose."""
        return self._solve(SCENE, self.masks, self.first_scene)

    @result_of(FITTED)
    def fitted(self) -> Given[Scene]:
        """The cameras and the head with the person's shape."""
        if not self.run.recipe.has(FITTED):
            return self.solved
        return self.run.once(FITTED, capture=self.plain, masks=self.masks, scene=self.solved)

    @found
    def scene(self) -> Given[Scene]:
        """The cameras and the fitted head, where the user put it."""
        pose = self.capture.chosen.head
        return self.fitted if pose is None else Given.of(move_head(self.fitted.value, pose))

    @found
    def head(self) -> Given[Head]:
        """The head of the scene."""
        return Given.of(self.scene.value.head)

    @found
    def cameras(self) -> Given[tuple[Camera, ...]]:
        """The cameras of the scene."""
        return Given.of(self.scene.value.cameras)

    @result_of(SKIN)
    def photographed(self) -> Given[SkinMaps]:
        """The skin that the photos show."""
        return self.run.derive(
            SKIN, photograph_skin, capture=self.plain, scene=self.scene, masks=self.masks
        )

    @result_of(TEXTURE)
    def texture(self) -> Given[Texture]:
        """The albedo of the skin, enhanced."""
        albedo = Given(self.photographed.value.albedo, self.photographed.digest)
        return self.run.once(TEXTURE, texture=albedo, example=Given.of(None))

    @found
    def skin(self) -> SkinMaps:
        """The skin, enhanced where the recipe says so."""
        skin = self.photographed.value
        bare = skin.albedo is None or not self.run.recipe.has(TEXTURE)
        return skin if bare else replace(skin, albedo=self.texture.value)

    @result_of(HULL)
    def hull(self) -> Given[Hull]:
        """The volume that hair fills. A turn bounds it by its outlines, without directions."""
        known = self.orientations if self.scene.value.one_sided else Given.of(())
        return self.run.once(HULL, scene=self.scene, masks=self.masks, orientations=known)

    @result_of(DISTANCE)
    def scalp_distance(self) -> Given[ScalpDistance]:
        """Ways through the hull to the scalp."""
        return self.run.derive(
            DISTANCE, measure_ways, scene=self.scene, hull=self.hull, masks=self.masks,
            orientations=self.orientations,
        )  # fmt: skip

    @result_of(WAVES)
    def measured_waves(self) -> Given[Waves]:
        """The waves that the photos show."""
        return self.run.derive(
            WAVES, measure_waves, capture=self.plain, orientations=self.orientations,
            scalp_distance=self.scalp_distance, masks=self.masks, cameras=self.cameras,
        )  # fmt: skip

    @found
    def waves(self) -> Given[Waves]:
        """The waves of the hair: those that the user chooses, else those of the photos."""
        hair, measured = self.capture.chosen.hair, self.measured_waves
        return measured if hair == ChosenHair() else Given.of(hair.waves(measured.value))

    @result_of(TIES)
    def tied(self) -> Given[TiedHair]:
        """The ties, and the tails that hang from them."""
        return self.run.derive(
            TIES, measure_ties, orientations=self.orientations, head=self.head,
            hull=self.hull, scalp_distance=self.scalp_distance, masks=self.masks,
            cameras=self.cameras,
        )  # fmt: skip

    @result_of(PARTING)
    def parting(self) -> Given[Parting]:
        """How the crown is combed."""
        return self.run.derive(
            PARTING, measure_parting, capture=self.plain, orientations=self.orientations,
            head=self.head, tied=self.tied, hull=self.hull, scalp_distance=self.scalp_distance,
            masks=self.masks, cameras=self.cameras,
        )  # fmt: skip

    @found
    def evidence(self) -> Given[Evidence]:
        """All that field and strands are made from: the results by these names."""
        parts: dict[str, Given[Any]] = {
            each.name: getattr(self, each.name) for each in fields(Evidence)
        }
        digest = digest_of([part.digest for part in parts.values()])
        return Given(Evidence(**{name: part.value for name, part in parts.items()}), digest)

    @result_of(FIELD)
    def field(self) -> Given[OrientationField]:
        """Directions in every cell of the hull."""
        return self.run.once(FIELD, self.evidence)

    @result_of(HAIRLINE)
    def hairline(self) -> Given[Hairline]:
        """Where on the head hair grows."""
        return self.run.derive(HAIRLINE, measure_hairline, scene=self.scene, masks=self.masks)

    @found
    def grown_head(self) -> Head:
        """The fitted head with its hairline and torso, without skin."""
        density, torso = self.hairline.value.density, self.hull.value.torso
        return replace(self.scene.value.head, density=density, torso=torso)

    @found
    def roots(self) -> Given[Roots]:
        """Where on the scalp the guides grow."""
        head, rest = self.grown_head, self.rest.value
        return Given.of(sample_roots(head, self.guides, self.seed, rest=rest))

    @result_of(TRACK)
    def strands(self) -> Given[Strands]:
        """A strand from each root."""
        return self.run.once(TRACK, self.evidence, field=self.field, roots=self.roots)

    @found
    def groom(self) -> Groom:
        """The groom with what was drawn on it by hand."""
        before, edits = Given.of(self.tracked), self.capture.chosen.edits
        self.run.keep(UNEDITED, before, "")
        if not edits or not self.run.recipe.has(EDITED):
            return self.tracked
        return self.run.once(EDITED, groom=before, edits=Given.of(edits)).value

    @found
    def tracked(self) -> Groom:
        """The strands on the head with its skin, their colours from the photos."""
        _ = self.view_orientations, self.scene  # what runs beside waits for no task behind it
        skin = self.run.beside(lambda: self.skin)  # strands need none of it
        evidence, strands = self.evidence.value, self.strands.value
        return assemble_groom(
            self.capture.views, evidence.masks, replace(self.grown_head, maps=skin.result()),
            self.roots.value, group_seen(strands, evidence), evidence.waves, evidence.tied,
            self.capture.chosen.hair, evidence.scene.cameras,
        )  # fmt: skip

    def _solve(
        self, stage: Stage[Scene], masks: Given[tuple[Mask, ...]], start: Given[Scene] | None = None
    ) -> Given[Scene]:
        begin: Any = Given.of(None) if start is None else start
        return self.run.once(stage, capture=self.plain, masks=masks, head=self.rest, start=begin)


def _changed(old: Future[Given[Mask]], new: Mask) -> Future[Given[Mask]]:
    """Return a view's mask as it came where mending left it alone: what was made of it holds."""
    same = digest_of(old.result().value) == digest_of(new)
    return old if same else completed(Given.of(new))
