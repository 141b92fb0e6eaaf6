"""What the user can do in the viewer, as one table of actions with names and values.

Keys, mouse, panel and scripts go through this table, so each of them can do the same.

* `actions`: the actions
* `pose`: the actions that place the head by hand
* `presets`: named settings beside the groom
* `registry`: the table: names, values and keys
* `script`: scripts of actions, without a window
"""
