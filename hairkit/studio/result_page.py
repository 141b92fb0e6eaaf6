"""`result.html`: the hair that turns and moves in any browser, in one file that needs no server."""

from __future__ import annotations

import base64
import re
from pathlib import Path

from hairkit.html_page import page
from hairkit.storage import read_bytes, read_text

SCRIPTS = ("hair_motion.js", "hair_shaders.js", "hair_view.js", "hair_controls.js")
"""Modules of the page in the order in which they use one another."""


def result_page(packet: Path) -> bytes:
    """Return the page of a file that `write_packet` wrote."""
    pages = Path(__file__).parent / "pages"
    style = read_text(pages / "style.css")
    scripts = [read_text(pages / name) for name in SCRIPTS]
    code = "\n".join(_without_modules(script) for script in scripts)
    data = base64.b64encode(read_bytes(packet)).decode()
    return page("Hair", style, _BODY.format(code=code, data=data)).encode()


def _without_modules(script: str) -> str:
    """Return a module's text as part of one script: browsers load no modules from files."""
    script = re.sub(r"^import .*?;\n", "", script, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^export ", "", script, flags=re.MULTILINE)


_BODY = """<body class="alone"><main id="hair" class="stage"></main>
<script type="module">
{code}
const text = atob("{data}");
const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
showHair(document.getElementById("hair"), bytes.buffer);
</script></body>"""
