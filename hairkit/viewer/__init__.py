"""The live preview: a groom in motion, in a window or by a script, with one table of actions.

`Session` holds what the user sees and changes, `Preview` draws it, and keys, mouse, panel and
scripts all go through `actions`.

* `actions`: what the user can do
* `draw`: drawing on the GPU or the processor
* `head_adjustment`: the head placed by hand against the photos
* `head_motion`: shakes and turns of the head
* `layers`: photos, masks, orientation, hull and field lines to show
* `opening`: files that the user opens
* `orbit_camera`: the camera that the mouse moves
* `picking`: what is under the mouse
* `preview`: a session and what draws it
* `recording`: screenshots and films
* `session`: the state: groom, simulation, view
* `simulation`: the simulator behind the preview
* `window`: window, input, panel and texts
"""

from __future__ import annotations
