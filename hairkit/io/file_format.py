"""Declarations of what file formats support; the format matrix is generated from them."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from enum import StrEnum


class Feature(StrEnum):
    """A part of a groom that a format may support; the value is its heading in the matrix."""

    POINTS = "points"
    COUNTS = "points differ per strand"
    WIDTHS = "width per point"
    ROOT_UV = "root uv"
    GROUP = "groups"
    TIES = "ties"
    GUIDE = "guide flag"
    GUIDE_WEIGHTS = "guide weights"
    DENSITY = "density at the roots"
    HEAD = "head mesh"
    MAPS = "texture maps of the head"
    SHAPES = "blendshapes of the head"
    SKIN = "skeleton and skin"
    CAPSULES = "capsules"
    COLOUR = "colour"
    COLOURS = "colour per point"
    CURL = "curl"
    PHYSICS = "physics"
    ANIMATION = "animation"


@dataclass(frozen=True)
class FileFormat:
    """One format: the plugin module's `FORMAT`.

    Every feature is in at most one of `exact`, `partial` and `written`, or it is lost.
    Tests export a groom with all features and compare the result with the declaration.
    """

    title: str
    """Name in the matrix: `Alembic`."""
    suffixes: tuple[str, ...]
    """Endings in lower case, dot first: `(".abc",)`."""
    exact: Set[Feature] = frozenset()
    """Export then import gives this back within float32."""
    partial: Mapping[Feature, str] = field(default_factory=dict)
    """Comes back changed; the text says how: `mean of each strand`."""
    written: Set[Feature] = frozenset()
    """Written for other programs, not read back here (formats without importer: everything)."""
    needs: str = ""
    """Module without which the format is not there, of an extra that may not be installed."""

    @property
    def there(self) -> bool:
        """Whether this installation reads or writes the format."""
        return not self.needs or importlib.util.find_spec(self.needs) is not None

    def state(self, feature: Feature) -> str:
        """Return the matrix's cell: `yes`, `written`, the text of `partial`, or empty for lost."""
        if feature in self.exact:
            return "yes"
        return "written" if feature in self.written else self.partial.get(feature, "")
