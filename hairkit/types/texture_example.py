"""What a texture is to become: a picture, or a picture and what a filter made of it."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.skin import Texture


@dataclass(frozen=True, eq=False)
class TextureExample(Stored):
    """The example that a texture follows: `source` is to `filtered` as the texture to the result.

    Raises `DataError` where the two are of different sizes.
    """

    filtered: Texture
    """The filtered picture (A'), such as a close-up photo of skin."""
    source: Texture | None = None
    """The same picture unfiltered (A); None where the plugin is to make it, as by a blur."""

    def __post_init__(self) -> None:
        if self.source is None:
            return
        wanted, found = self.filtered.pixels.shape, self.source.pixels.shape
        if found != wanted:
            raise DataError(
                f"the example's source has {found[1]} x {found[0]} pixels,"
                f" expected {wanted[1]} x {wanted[0]}, as the filtered picture has"
            )
