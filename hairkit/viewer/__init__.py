"""The interactive preview of a groom: simulation, drawing and user actions.

It runs in a window or headless. Every user input is an action of one table, so that keys, mouse,
panel and scripts do the same things. A `Session` holds the state, a `Preview` draws it offscreen,
and the window only passes events on and shows the result.

* `actions`: the table of actions, presets and scripts
* `brushing`: a brush over a groom, and its strokes
* `draw`: drawing on the GPU or the CPU
* `head_motion`: shakes and turns of the head
* `layers`: photos, masks, orientation, hull and field lines as drawable layers
* `orbit_camera`: the camera that orbits a target
* `picking`: the guide under the mouse and the lock grabbed with it
* `preview`: draws a session frame by frame
* `recording`: PNG files and MP4 videos
* `session`: the state: groom, simulation, view
* `simulation`: the simulator of a session and its option values
* `window`: window, input, option panel and text overlay
"""

from __future__ import annotations
