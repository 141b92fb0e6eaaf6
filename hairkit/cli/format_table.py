"""The format matrix: what each file format carries, as its plugin declares it."""

from __future__ import annotations

from hairkit.io.file_format import Feature
from hairkit.manager import Manager, PluginInfo

_COPIED = {"yes": "yes", "written": "written", "": "-"}


def format_table(manager: Manager) -> str:
    """Return the matrix of all working plugins with a `FORMAT` as Markdown, features down.

    `yes`: comes back the same within float32; `written`: for other programs, not read back; a
    number: a note below the table says how it comes back; `-`: lost.
    """
    infos = [info for info in manager.plugins() if info.format is not None and not info.broken]
    notes: list[str] = []
    rows = [_row("", [info.format.title for info in infos if info.format is not None])]
    rows.append("|" + " --- |" * (len(infos) + 1))
    rows.append(_row("plugin", [f"`{info.name}`" for info in infos]))
    rows.append(_row("endings", [" ".join(f"`{suffix}`" for suffix in i.suffixes) for i in infos]))
    rows.append(_row("written", [_stage(info, "export_groom") for info in infos]))
    rows.append(_row("read", [_stage(info, "import_groom") for info in infos]))
    for feature in Feature:
        rows.append(_row(feature.value, [_cell(info, feature, notes) for info in infos]))
    footnotes = [f"{number}. {note}" for number, note in enumerate(notes, 1)]
    return "\n".join([*rows, "", *footnotes] if footnotes else rows)


def _row(heading: str, cells: list[str]) -> str:
    return "| " + " | ".join([heading, *cells]) + " |"


def _stage(info: PluginInfo, stage: str) -> str:
    return "yes" if stage in info.stages else "-"


def _cell(info: PluginInfo, feature: Feature, notes: list[str]) -> str:
    """Return one cell; texts of changed features become notes, each once."""
    state = info.format.state(feature) if info.format is not None else ""
    if state in _COPIED:
        return _COPIED[state]
    if state not in notes:
        notes.append(state)
    return f"({notes.index(state) + 1})"
