"""The report of a batch: `report.json` for programs, `report.html` for people."""

from __future__ import annotations

import dataclasses
import html
import json
import os
from collections.abc import Sequence
from urllib.parse import quote

from hairkit.batches.jobs import FAILED, Result
from hairkit.html_page import page
from hairkit.pipeline.figure import GREEN, Figure
from hairkit.remote import join, write_text

PAGE, DATA = "report.html", "report.json"
"""Names of the two files."""
_STYLE = """
:root { color-scheme: light dark; font: 15px/1.5 system-ui, sans-serif; }
body { margin: 2rem auto; max-width: 70rem; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; }
th, td { border-bottom: 1px solid #8884; padding: .4rem .6rem; }
th, td { text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
img { display: block; width: 10rem; height: auto; border-radius: 4px; }
.red, .failed { color: light-dark(#a11, #f88); } .amber { color: light-dark(#850, #fc6); }
.green { color: light-dark(#161, #8d8); } small { display: block; }
@media (max-width: 50rem) { .wide { display: none; } }
"""


def write_report(out: str | os.PathLike[str], results: Sequence[Result], seconds: float) -> None:
    """Write both files into the folder of the results; `seconds` is what the batch took."""
    ordered = sorted(results, key=lambda result: (result.state != FAILED, result.name))
    document = {
        "seconds": round(seconds, 3),
        "counts": count_states(results),
        "captures": [dataclasses.asdict(result) for result in ordered],
    }
    write_text(join(out, DATA), json.dumps(document, indent=1) + "\n")
    write_text(join(out, PAGE), _page(ordered, seconds))


def count_states(results: Sequence[Result]) -> dict[str, int]:
    """Return how many captures were done, kept and failed."""
    states = [result.state for result in results]
    return {state: states.count(state) for state in ("done", "kept", "failed")}


def summary(results: Sequence[Result], seconds: float) -> str:
    """Return one line about a batch."""
    counts = ", ".join(f"{count} {state}" for state, count in count_states(results).items())
    return f"{len(results)} captures in {seconds:.0f} s: {counts}"


def _page(results: Sequence[Result], seconds: float) -> str:
    rows = "\n".join(_row(result) for result in results)
    made = [result.seconds for result in results if result.state != FAILED]
    mean = f", {sum(made) / len(made):.1f} s each" if made else ""
    heads = """<tr><th>Capture</th><th>Result</th><th>Health</th><th class="wide">Scores</th>
<th>Seconds</th><th class="wide">Memory</th></tr>"""
    return page(
        "hairkit batch",
        _STYLE,
        f"<body><h1>Batch</h1>\n<p>{html.escape(summary(results, seconds))}{mean}.</p>",
        f"<table><thead>{heads}</thead>\n<tbody>\n{rows}\n</tbody></table></body>",
    )


def _row(result: Result) -> str:
    name = html.escape(result.name)
    folder = quote(result.name)
    picture = (
        f'<a href="{folder}/"><img src="{folder}/{quote(result.thumbnail)}" loading="lazy"'
        f' alt="Result of {name}"></a>'
        if result.thumbnail
        else ""
    )
    if result.state == FAILED:
        found = f'<span class="failed">failed</span><small>{html.escape(result.error)}</small>'
    else:
        found = f"{result.state}<small>{result.strands} guides</small>"
    found += f"<small>{result.tries} tries</small>" if result.tries > 1 else ""
    memory = f"{result.peak_bytes / 2**30:.2f} GiB" if result.peak_bytes else ""
    scores = "".join(f"<small>{html.escape(k)}: {v:.2f}</small>" for k, v in result.scores.items())
    return (
        f"<tr><td>{name}{picture}</td><td>{found}</td><td>{_health(result)}</td>"
        f'<td class="wide">{scores}</td><td class="number">{result.seconds:.1f}</td>'
        f'<td class="number wide">{memory}</td></tr>'
    )


def _health(result: Result) -> str:
    """Return the counts of lights, and the figures that are not green."""
    if not result.health:
        return ""
    lights = ", ".join(f'<span class="{k}">{v} {k}</span>' for k, v in result.lights.items() if v)
    figures = [Figure(**figure) for figure in result.health]
    lines = (
        f'<small class="{figure.light}">{html.escape(figure.line())}</small>'
        for figure in figures
        if figure.light != GREEN
    )
    return lights + "".join(lines)
