"""An evaluation as files: `evaluation.json`, and `report.html` that holds its pictures itself."""

from __future__ import annotations

import base64
import html
import json
import os
from pathlib import Path

from hairkit.evaluation.error_maps import LEVEL_COLOURS, view_pictures
from hairkit.evaluation.evaluation import Evaluation
from hairkit.evaluation.prediction import Prediction
from hairkit.evaluation.scorecard import Figure, figures
from hairkit.evaluation.scores import Score
from hairkit.evaluation.truth import Truth
from hairkit.html_page import page, table
from hairkit.imaging.picture_file import encode_picture
from hairkit.storage import write_text

_JPEG_QUALITY = 82
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1800px; color: #222 }
table { border-collapse: collapse; margin: 1em 0 }
td, th { padding: .2em .8em; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child, .words td:last-child { text-align: left }
.words td:last-child { color: #555 }
.view { display: flex; gap: 6px; flex-wrap: wrap }
figure { margin: 0 } figcaption { font-size: 12px; color: #555 }
.key { display: inline-block; width: 1em; height: 1em; vertical-align: -2px }
"""


def write_report(
    folder: str | os.PathLike[str], evaluation: Evaluation, prediction: Prediction, truth: Truth
) -> tuple[Path, Path]:
    """Write `evaluation.json` and `report.html` into `folder`, made if need be; return both."""
    base = Path(folder)
    base.mkdir(parents=True, exist_ok=True)
    figures_path, report_path = base / "evaluation.json", base / "report.html"
    write_text(figures_path, to_text(evaluation))
    write_text(report_path, _page(evaluation, prediction.in_order_of(truth), truth))
    return figures_path, report_path


def to_text(evaluation: Evaluation) -> str:
    """Return the figures as JSON, in the order they are declared."""
    return json.dumps(evaluation.to_json(), indent=1) + "\n"


def score_rows(evaluation: Evaluation) -> list[tuple[str, tuple[Score, ...]]]:
    """Return name and scores of each kind of comparison that was made."""
    scores = evaluation.scores
    rows = [("all", scores.all), ("all, signed", scores.all_signed)]
    if scores.outer is not None and scores.outer_signed is not None:
        rows += [("outer", scores.outer), ("outer, signed", scores.outer_signed)]
    return rows


def _page(evaluation: Evaluation, prediction: Prediction, truth: Truth) -> str:
    title = f"{evaluation.strands} strands against {len(truth.strands)} true ones"
    views = [
        _view(evaluation, prediction, truth, view, name) for view, name in enumerate(truth.names)
    ]
    return page(
        title,
        _STYLE,
        f"<h1>{html.escape(title)}</h1>",
        _figure_table(figures(evaluation)),
        _score_table(evaluation),
        _view_table(evaluation, truth),
        _key(),
        *views,
    )


def _figure_table(rows: tuple[Figure, ...]) -> str:
    cells = ([html.escape(x) for x in (row.name, row.text(), row.meaning)] for row in rows)
    return f"<div class=words>{table(['figure', 'value', 'what is good'], cells)}</div>"


def _score_table(evaluation: Evaluation) -> str:
    rows = score_rows(evaluation)
    heads = [f"{s.distance_mm:g} mm / {s.angle_deg:g}&deg; P, R, F" for s in rows[0][1]]
    cells = [
        [name]
        + [f"{100 * s.precision:.1f}, {100 * s.recall:.1f}, <b>{100 * s.f:.1f}</b>" for s in scores]
        for name, scores in rows
    ]
    return table(["per cent", *heads], cells)


def _view_table(evaluation: Evaluation, truth: Truth) -> str:
    heads = (
        *("view", "azimuth error", "rotation error", "position error", "reprojection"),
        *("drawn direction", "silhouette IoU", "2D orientation error", "hair mask IoU"),
    )
    bends, masks = evaluation.orientation_views, evaluation.mask_views
    cells = [
        (
            html.escape(name),
            f"{camera.azimuth_deg:+.2f}&deg;",
            f"{camera.rotation_deg:.2f}&deg;",
            f"{1000 * camera.position_m:.1f} mm",
            f"{camera.reprojection_px:.1f} px",
            f"{100 * evaluation.direction_views[view]:.1f} %",
            f"{evaluation.silhouette_views[view]:.3f}",
            "-" if bends is None else f"{bends[view].mean_deg:.1f}&deg;",
            "-" if masks is None else f"{masks[view]:.3f}",
        )
        for view, (name, camera) in enumerate(zip(truth.names, evaluation.cameras, strict=True))
    ]
    return table(heads, cells)


def _key() -> str:
    names = ("within 2 mm, 20&deg;", "within 3 mm, 30&deg;", "within 4 mm, 40&deg;", "farther off")
    return "<p>" + " ".join(
        f"<span class=key style='background:rgb{colour}'></span> {name}"
        for colour, name in zip(LEVEL_COLOURS, names, strict=True)
    )


def _view(
    evaluation: Evaluation, prediction: Prediction, truth: Truth, view: int, name: str
) -> str:
    maps = prediction.orientations
    pictures = view_pictures(evaluation, truth, view, None if maps is None else maps[view])
    parts = [f"<h2>{html.escape(name)}</h2><div class=view>"]
    for caption, picture in pictures.items():
        jpeg = base64.b64encode(encode_picture(picture, ".jpg", _JPEG_QUALITY)).decode()
        parts.append(
            f"<figure><img alt='{html.escape(caption)}' src='data:image/jpeg;base64,{jpeg}'>"
            f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        )
    return "\n".join([*parts, "</div>"])
