"""The actions of the viewer: what a user or a script can do.

Each action is a function of a session and of named values; keys, mouse, panel and scripts use it.

* `actions`: the actions
* `brush`: the brushes over the hair
* `presets`: simulator options saved under a name
* `registry`: the table: names, values and keys
* `scene`: light, backdrop, lens, the photo beside the hair
* `script`: TOML scripts of actions, run without a window
"""
