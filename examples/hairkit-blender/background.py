"""Commands that run hairkit beside Blender, which stays usable meanwhile."""

import re

import bpy

from . import child
from .groom_file import GroomError

ERRORS = (child.ChildError, GroomError, ValueError, KeyError, OSError)
"""What is the user's to know, in one line."""
_STEP = re.compile(r"(\w+) +(\d+)/(\d+)")


class Background:
    """An operator whose `work` yields commands, one after the other, and gets their answers.

    With a window Blender goes on meanwhile and shows how far hairkit is; without one it waits.
    """

    _run = None
    _steps = None
    _timer = None

    def execute(self, context):
        """Start the first command."""
        self._steps = self.work(context)
        state = self._go_on(None)
        alone = bpy.app.background or context.window is None
        if alone or state != {"RUNNING_MODAL"}:
            while state == {"RUNNING_MODAL"}:
                state = self._ended()
            return state
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.2, window=context.window)
        manager.progress_begin(0, 1)
        manager.modal_handler_add(self)
        return state

    def modal(self, context, event):
        """Show how far it is, stop it at Escape, go on with its answer at the end."""
        if event.type == "ESC":
            self._run.stop()
            self._steps.close()
            self._leave(context)
            self.report({"WARNING"}, "hairkit was stopped; run it again to go on from there")
            return {"CANCELLED"}
        if event.type != "TIMER" or not self._run.over():
            self._show(context)
            return {"PASS_THROUGH"}
        state = self._ended()
        if state == {"RUNNING_MODAL"}:
            return state
        self._leave(context)
        return state

    def _go_on(self, answer):
        """Start the next command with the answer of the last one."""
        try:
            self._run = child.Child(self._steps.send(answer))
        except StopIteration:
            return {"FINISHED"}
        except ERRORS as error:
            return self._failed(error)
        return {"RUNNING_MODAL"}

    def _ended(self):
        try:
            answer = self._run.result()
        except child.ChildError as error:
            self._steps.close()
            return self._failed(error)
        return self._go_on(answer)

    def _failed(self, error):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def _show(self, context):
        line = self._run.last_line()
        context.workspace.status_text_set(f"hairkit: {line}   [Esc] stops")
        context.window_manager.progress_update(share(line) or 0.0)

    def _leave(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


def share(line):
    """Return the share of a stage that a line of progress tells, None where it tells none."""
    found = _STEP.fullmatch(line)
    return int(found[2]) / max(int(found[3]), 1) if found else None
