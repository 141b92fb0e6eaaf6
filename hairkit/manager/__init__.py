"""Plugins: found, loaded, called one at a time, and what they return checked at once.

* `manager`: `Manager`, the plugins of this process, by name.
* `loading`: installed plugins and plugin files, and what they must look like.
* `results`: checks of what plugins return
* `command_plugin`: a plugin in an environment of its own
* `manifest`: plugins on shared drives, described by files that are read without running them
* `plugin_check`: a plugin tried on the made-up head
* `guard`: errors of plugins name the plugin; what plugins print does not reach stdout.
"""

from __future__ import annotations

from hairkit.manager.loading import DISABLE_AUTOLOAD, PluginInfo
from hairkit.manager.manager import Manager

__all__ = ["DISABLE_AUTOLOAD", "Manager", "PluginInfo"]
