"""Laws of names: any characters in paths, whatever the locale, for every format and for photos."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from ball import write_capture

PROGRAM = """
import logging, os, shutil, sys
from pathlib import Path
from hairkit.errors import MissingExtraError
from hairkit.io.capture_reader import read_capture
from hairkit.io.head_reader import read_head, write_head_obj
from hairkit.manager import Manager
from hairkit.testing import bristle_groom

logging.disable()
folder, manager, groom = Path(sys.argv[1]), Manager.loaded(autoload=False), bristle_groom()
for info in manager.plugins():
    for suffix in info.suffixes:
        path = folder / (sys.argv[2] + suffix)
        try:
            if "export_groom" in info.stages:
                manager.call("export_groom", info.name, groom=groom, path=path)
                assert path.is_file(), ascii(path)
                if "import_groom" in info.stages:
                    found = manager.call("import_groom", info.name, path=path)
                    assert len(found.strands) == len(groom.strands), ascii(path)
        except MissingExtraError:
            pass
head = folder / (sys.argv[2] + "-head.obj")
write_head_obj(head, groom.head)
read_head(head)
shutil.copytree(sys.argv[3], folder / sys.argv[2])
assert len(read_capture(folder / sys.argv[2]).views) == 8
print(len(os.listdir(folder)))
"""
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
"""The C locale for libraries, and for Python, which would turn to UTF-8 of itself."""
NAME = "Grüße 日本  'or' \"more\";\n$HOME"


def test_every_format_takes_any_name(tmp_path: Path) -> None:
    """Grooms are written and read again, heads and photos read, in folders of any name."""
    folder = tmp_path / NAME
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder), NAME, str(write_capture(tmp_path / "photos"))],
        env={**os.environ, **C_LOCALE},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode("utf-8", "replace")
    assert int(done.stdout) == len(list(folder.iterdir())) > 10
    assert not [entry for entry in folder.iterdir() if entry.name.startswith(".")]
