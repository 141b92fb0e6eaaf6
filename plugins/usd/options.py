"""Settings of USD files."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.grooming.adopt_strands import ImportOptions
from hairkit.grooming.prepare_export import AnimationOptions, ExportOptions
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.options import option


@dataclass(frozen=True)
class Options(SpaceOptions, ImportOptions, AnimationOptions, ExportOptions):
    """Settings of the USD exporter and importer.

    USD files say their axes and unit themselves: `axis` is for writing, and reading takes `scale`
    only to overrule the file.
    """

    head_mesh: bool = option(True, doc="Write the head's mesh.")
    bust: bool = option(True, doc="Write a clothed bust under a head that ends at the neck.")
    mark_guides: bool = option(
        False, doc="Mark guides in a file of guides alone, which Unreal then does not draw."
    )
    attributes: bool = option(
        True,
        doc="Write ids, groups, guides and their weights, uv and colours of the strands; false"
        " leaves points and widths.",
    )
