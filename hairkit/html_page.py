"""Pages of HTML that need no server: reports, questionnaires, a result."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def page(title: str, style: str, *parts: str) -> str:
    """Return a page in English of parts, which are HTML; the title is text."""
    return "\n".join(
        [
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(title)}</title><style>{style}</style></head>",
            *parts,
            "</html>\n",
        ]
    )


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; heads and cells are HTML."""
    lines = [f"<tr><td>{'<td>'.join(cells)}" for cells in rows]
    return "\n".join([f"<table><tr><th>{'<th>'.join(heads)}", *lines, "</table>"])
