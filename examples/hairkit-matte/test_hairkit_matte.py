"""Laws of the plugin `matte`."""

import sys
from pathlib import Path

from hairkit.manager import Manager
from hairkit.manager.command_plugin import PluginCommand
from hairkit.testing import striped_view

FOLDER = str(Path(__file__).parent)


def test_more_is_hair_at_a_higher_level():
    """Through the process and back, hair is where the photo is darker than the level."""
    manager = Manager()
    command = (sys.executable, "hairkit_matte.py")
    manager.add_command(PluginCommand("matte", command, FOLDER))
    view = striped_view(30.0)
    for level in (90.0, 110.0, 130.0):
        mask = manager.call("segment", "matte", {"level": level}, view=view)
        assert (mask.hair == (view.image.mean(axis=-1) < level)).all()
