"""A part of a picture that has changed."""

from __future__ import annotations

from typing import NamedTuple


class Region(NamedTuple):
    """Columns from `left` to before `right`, rows from `top` to before `bottom`."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Whether it holds no pixel."""
        return self.left >= self.right or self.top >= self.bottom

    def union(self, other: Region) -> Region:
        """Return the least region that holds both.

        >>> Region(0, 0, 2, 1).union(Region(5, 3, 6, 4))
        Region(left=0, top=0, right=6, bottom=4)
        """
        if self.empty or other.empty:
            return other if self.empty else self
        low = min(self.left, other.left), min(self.top, other.top)
        return Region(*low, max(self.right, other.right), max(self.bottom, other.bottom))


NOWHERE = Region(0, 0, 0, 0)
