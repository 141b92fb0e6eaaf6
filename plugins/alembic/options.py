"""Settings of the Alembic plugin."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.grooming.adopt_strands import ImportOptions
from hairkit.grooming.prepare_export import AnimationOptions, ExportOptions
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.options import option

UNREAL_POINTS = 255
"""Unreal drops the points of a curve beyond these."""


@dataclass(frozen=True)
class Options(SpaceOptions, ImportOptions, AnimationOptions, ExportOptions):
    """Settings of the Alembic exporter and importer."""

    max_points: int = option(
        UNREAL_POINTS,
        low=2,
        high=65_535,
        doc="Strands of more points are resampled to so many; Unreal reads up to 255.",
    )
    mark_guides: bool = option(
        False, doc="Mark guides in a file of guides alone, which Unreal then does not draw."
    )
    attributes: bool = option(
        True,
        doc="Write the groom_* attributes (ids, groups, guides and their weights, colours); false"
        " leaves curves, widths and uv, which is all that Blender and Unity read.",
    )
    split: bool = option(
        False, doc="Write each group as an object of its name: Blender reads no groom_group_id."
    )
