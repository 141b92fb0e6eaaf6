"""mkdocs hook: pages written from what the code declares, so that they cannot go stale.

Each plugin gets a page from its docstring, its `Options` and its `FORMAT`. `<!-- formats -->` in a
page becomes the format table, `<!-- front door -->` the public names. Each script or notebook of
examples/gallery becomes a page, and so do CHANGELOG.md and CONTRIBUTING.md.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

import hairkit
from hairkit.cli.format_table import format_table
from hairkit.io.file_format import Feature
from hairkit.manager import Manager, PluginInfo
from hairkit.options import OptionInfo

PROJECT = Path(__file__).parents[1]
GALLERY = PROJECT / "examples" / "gallery"
COPIED = ("CHANGELOG.md", "CONTRIBUTING.md")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Fill the empty sections of the navigation with the generated pages."""
    plugins = [{i.name: f"plugins/{i.name}.md"} for i in _plugins()]
    gallery = [{_gallery_title(path): _gallery_page(path)} for path in _gallery_files()]
    _fill(config.nav, {"Plugins": plugins, "Gallery": gallery})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the site's files."""
    pages = {f"plugins/{info.name}.md": plugin_page(info) for info in _plugins()}
    pages |= {_gallery_page(path): gallery_page(path) for path in _gallery_files()}
    pages |= {name.lower(): _copied(name) for name in COPIED}
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return the page with generated text in the place of its markers."""
    for marker, made in (("formats", format_table_text), ("front door", front_door)):
        if f"<!-- {marker} -->" in markdown:
            markdown = markdown.replace(f"<!-- {marker} -->", made())
    return markdown


def format_table_text() -> str:
    """Return the table of what each file format carries."""
    return format_table(_manager())


def front_door() -> str:
    """Return the public names of hairkit: links to types and decorators, then the functions."""
    homes = {name: f"{hairkit._HOME_OF[name]}.{name}" for name in hairkit.__all__}
    functions = [name for name in homes if inspect.isfunction(getattr(hairkit, name))]
    links = [name for name in homes if name not in functions or name == "option"]
    others = [f"[`{name}`][{homes[name]}]" for name in links]
    blocks = [f"::: {homes[name]}" for name in functions if name != "option"]
    return "\n\n".join(["Types and decorators: " + ", ".join(others) + ".", *blocks])


def plugin_page(info: PluginInfo) -> str:
    """Return the page of a plugin: docstring, hooks, file format, options."""
    lines = [f"# {info.name}", "", _docstring(info), "", f"Hooks: {_hooks(info)}."]
    if info.models:
        lines += ["", f"[Networks](../models.md): {', '.join(f'`{m}`' for m in info.models)}."]
    if info.format is not None:
        lines += ["", "## File format", "", *_format_rows(info)]
    lines += ["", "## Options", ""]
    if not info.options:
        return "\n".join([*lines, "This plugin has no options."])
    lines += ["| option | default | allowed | meaning |", "|---|---|---|---|"]
    lines += [_option_row(option) for option in info.options]
    name = info.options[0].name
    lines += ["", f"In a recipe or on the command line: `--set {info.name}.{name}=VALUE`."]
    return "\n".join(lines)


def gallery_page(path: Path) -> str:
    """Return the page of a gallery script or notebook: its text, then its code."""
    where = f"`{path.relative_to(PROJECT)}`"
    if path.suffix == ".ipynb":
        cells = json.loads(path.read_text())["cells"]
        first, *rest = (_cell(cell) for cell in cells)
        return "\n\n".join([first, f"This notebook is {where}.", *rest])
    source = path.read_text()
    tree = ast.parse(source)
    title, _, text = (ast.get_docstring(tree) or "").partition("\n")
    code = "".join(source.splitlines(keepends=True)[tree.body[0].end_lineno :]).strip()
    run = f"Run it with `python {path.relative_to(PROJECT)}`."
    return f"# {title.rstrip('.')}\n\n{text.strip()}\n\n{run}\n\n```python\n{code}\n```\n"


def _manager() -> Manager:
    """Return the plugins that ship with hairkit."""
    return Manager.loaded(autoload=False)


def _plugins() -> list[PluginInfo]:
    return sorted(_manager().plugins(), key=lambda info: info.name)


def _copied(name: str) -> str:
    """Return a file of the project's folder with its links as they are within docs."""
    return (PROJECT / name).read_text().replace("](docs/", "](")


def _fill(nav: Any, pages: dict[str, list[dict[str, str]]]) -> None:
    """Put lists of pages into the entries of the navigation that have their names and are empty."""
    for entry in nav:
        for name, value in entry.items():
            if value == [] and name in pages:
                entry[name] = pages[name]
            elif isinstance(value, list):
                _fill(value, pages)


def _docstring(info: PluginInfo) -> str:
    """Return the docstring of a plugin as Markdown, without the list of its modules."""
    module = sys.modules[f"hairkit_plugins.{info.name}"]
    text = re.sub(r"\n+(\* `\w+`: .*\n?)+$", "", inspect.getdoc(module) or info.summary)
    text = re.sub(r"(?<=[^\n])\n(?=\* |\d+\. )", "\n\n", text)
    return re.sub(r"\n {2,3}(?=\S)", "\n    ", text)  # continued list items, as Markdown wants them


def _hooks(info: PluginInfo) -> str:
    """Return a plugin's hooks, each linked to its description."""
    return ", ".join(
        f"[`{hook}`](../plugins.md#{hook})" for hook in (*info.stages, *info.notifications)
    )


def _format_rows(info: PluginInfo) -> list[str]:
    """Return what the plugin's format carries as a table; compare the page on formats."""
    assert info.format is not None
    endings = ", ".join(f"`{suffix}`" for suffix in info.suffixes)
    rows = [f"{info.format.title}, {endings}; [all formats](../formats.md) side by side.", ""]
    rows += ["| feature | in the file |", "|---|---|"]
    return rows + [f"| {f.value} | {info.format.state(f) or '-'} |" for f in Feature]


def _option_row(option: OptionInfo) -> str:
    cells = [f"`{option.name}`", f"`{option.default}`", option.wanted, option.doc]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _gallery_files() -> list[Path]:
    return sorted(path for path in GALLERY.iterdir() if path.suffix in (".py", ".ipynb"))


def _gallery_page(path: Path) -> str:
    return f"gallery/{path.stem}.md"


def _gallery_title(path: Path) -> str:
    return gallery_page(path).partition("\n")[0].removeprefix("# ")


def _cell(cell: dict[str, Any]) -> str:
    """Return a cell of a notebook as Markdown."""
    text = "".join(cell["source"])
    return text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"
