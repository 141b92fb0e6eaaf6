"""The live preview: a groom that moves, in a window or headless, with one set of actions for both.

`Session` is what the user sees and changes, `Stage` draws it offscreen, `actions.ACTIONS` is the
one table that keys, mouse, panel and scripts go through; `window` only passes events on.
"""

from __future__ import annotations
