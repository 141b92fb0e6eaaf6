"""An evaluation as files: `evaluation.json`, and `report.html` that holds its pictures itself."""

from __future__ import annotations

import base64
import html
import json
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hairkit.evaluation.error_maps import LEVEL_COLOURS, view_pictures
from hairkit.evaluation.evaluation import Evaluation
from hairkit.evaluation.prediction import Prediction
from hairkit.evaluation.scorecard import Figure, figures
from hairkit.evaluation.scores import Score
from hairkit.evaluation.truth import Truth
from hairkit.imaging.picture_file import encode_picture
from hairkit.storage import write_text

_JPEG_QUALITY = 82
_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1800px; color: #222 }
table { border-collapse: collapse; margin: 1em 0 }
td, th { padding: .2em .8em; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child, td.text { text-align: left }
td.text { color: #555 }
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
    title = html.escape(f"{evaluation.strands} strands against {len(truth.strands)} true ones")
    views = [
        _view(evaluation, prediction, truth, view, name) for view, name in enumerate(truth.names)
    ]
    return "\n".join(
        [
            "<!doctype html><html lang=en><meta charset=utf-8>",
            f"<title>{title}</title><style>{_STYLE}</style><h1>{title}</h1>",
            _figure_table(figures(evaluation)),
            _score_table(evaluation),
            _view_table(evaluation, truth),
            _key(),
            *views,
            "</html>\n",
        ]
    )


def _figure_table(rows: tuple[Figure, ...]) -> str:
    lines = ["<table><tr><th>figure<th>value<th>what is good"]
    lines += [
        f"<tr><td>{html.escape(row.name)}<td>{html.escape(row.text())}"
        f"<td class=text>{html.escape(row.meaning)}"
        for row in rows
    ]
    return "\n".join([*lines, "</table>"])


def _score_table(evaluation: Evaluation) -> str:
    first = score_rows(evaluation)[0][1]
    head = "".join(f"<th>{s.distance_mm:g} mm / {s.angle_deg:g}&deg; P, R, F" for s in first)
    lines = [f"<table><tr><th>per cent{head}"]
    for name, scores in score_rows(evaluation):
        cells = "".join(
            f"<td>{100 * s.precision:.1f}, {100 * s.recall:.1f}, <b>{100 * s.f:.1f}</b>"
            for s in scores
        )
        lines.append(f"<tr><td>{name}{cells}")
    return "\n".join([*lines, "</table>"])


def _view_table(evaluation: Evaluation, truth: Truth) -> str:
    lines = [
        "<table><tr><th>view<th>azimuth error<th>rotation error<th>position error<th>reprojection"
        "<th>drawn direction<th>silhouette IoU<th>2D orientation error<th>hair mask IoU"
    ]
    for view, (name, camera) in enumerate(zip(truth.names, evaluation.cameras, strict=True)):
        bends, masks = evaluation.orientation_views, evaluation.mask_views
        cells = (
            f"{camera.azimuth_deg:+.2f}&deg;",
            f"{camera.rotation_deg:.2f}&deg;",
            f"{1000 * camera.position_m:.1f} mm",
            f"{camera.reprojection_px:.1f} px",
            f"{100 * evaluation.direction_views[view]:.1f} %",
            f"{evaluation.silhouette_views[view]:.3f}",
            "-" if bends is None else f"{bends[view].mean_deg:.1f}&deg;",
            "-" if masks is None else f"{masks[view]:.3f}",
        )
        lines.append(f"<tr><td>{html.escape(name)}" + "".join(f"<td>{cell}" for cell in cells))
    return "\n".join([*lines, "</table>"])


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
        parts.append(
            f"<figure><img alt='{html.escape(caption)}' src='{_data_url(picture)}'>"
            f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        )
    return "\n".join([*parts, "</div>"])


def _data_url(picture: npt.NDArray[np.uint8]) -> str:
    data = encode_picture(picture, ".jpg", _JPEG_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(data).decode()
