"""The command that lets hair move: a simulation by hairkit, played in the scene."""

import json
from pathlib import Path

import bpy
import numpy as np

from . import child, playback
from .background import Background
from .groom_file import GroomError, y_up, z_up
from .objects import SCALP
from .preferences import chosen_python

EDITED = 1e-6
"""Metres by which points are moved in Blender to count as edited."""


class Simulate(bpy.types.Operator, Background):
    """Simulate the hair over the scene's frames; it follows the motion that its head has there."""

    bl_idname = "hairkit.simulate"
    bl_label = "Simulate hair"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 (Blender wants a set)

    shake: bpy.props.StringProperty(
        name="Shake",
        description="Shakes of a head that stands still, as yaw:20:1.5 (axis, degrees, hertz)",
    )
    wind: bpy.props.FloatVectorProperty(name="Wind", subtype="VELOCITY", size=3)
    turbulence: bpy.props.FloatProperty(name="Turbulence", default=0.0, min=0.0, max=10.0)
    warm_up: bpy.props.FloatProperty(
        name="Warm-up", description="Seconds before the first frame", default=0.0, min=0.0
    )
    settings: bpy.props.StringProperty(
        name="Settings", description="As of the command line: rods.stiffness=2"
    )

    def invoke(self, context, event):
        """Ask for wind and shakes."""
        return context.window_manager.invoke_props_dialog(self)

    def work(self, context):
        """Yield the simulation's command; then let the hair play what it made."""
        hair, words = hair_of(context), child.hairkit(chosen_python())
        place, scene = playback.folder(hair.name), context.scene
        groom, out = place / "groom.npz", place / "simulation.npz"
        write_current(hair, groom)
        carried, motion = playback.head_motion(context, hair.parent, SCALP)
        yield [*words, *self._command(scene, motion, groom, out)]
        frames = playback.read_frames(out)
        if self.shake and not playback.moves(motion):
            carried = frames.head_from_rest
            playback.set_keys(hair.parent, carried, scene.frame_start)
        playable = playback.write_playable(words, groom, frames, carried, place)
        playback.play(hair, playable, scene.frame_start)
        scene.frame_set(scene.frame_start)
        if not bpy.data.filepath:
            self.report({"WARNING"}, "save the file and simulate again to keep the simulation")
        self.report({"INFO"}, f"{len(frames.times)} frames")

    def _command(self, scene, motion, groom, out):
        rate = scene.render.fps / scene.render.fps_base
        words = ["simulate", str(groom), "-o", str(out), "--steps", "--fps", f"{rate:.9g}"]
        words += ["--frames", str(len(motion)), "--warm-up", f"{self.warm_up:.9g}"]
        words += ["--wind=" + ",".join(f"{part:.9g}" for part in y_up(np.array([self.wind]))[0])]
        words += ["--turbulence", f"{self.turbulence:.9g}"]
        if playback.moves(motion):
            path = out.with_name("motion.json")
            keys = {"times": (np.arange(len(motion)) / rate).tolist()}
            path.write_text(json.dumps(keys | {"head_from_rest": motion.tolist()}))
            words += ["--motion", str(path)]
        elif self.shake:
            words += ["--shake", self.shake]
        return words + [word for text in self.settings.split() for word in ("--set", text)]


def hair_of(context):
    """Return the active hair that the add-on has added, or that of the active head."""
    active = context.view_layer.objects.active
    near = [active, *active.children] if active is not None else []
    found = [thing for thing in near if thing.get(playback.GROOM) and thing.parent]
    if not found:
        raise GroomError("select hair that the menu hairkit has added, on its head")
    return found[0]


def write_current(hair, path):
    """Write the groom of a hair object as it is now: combed in Blender, with hairkit's physics."""
    source = Path(bpy.path.abspath(hair[playback.GROOM]))
    try:
        with np.load(source, allow_pickle=False) as stored:
            arrays = dict(stored)
    except (OSError, ValueError) as error:
        raise GroomError(f"{source}: {hair.name} came from it; import it again") from error
    offsets = np.empty(len(hair.data.curves) + 1, np.int32)
    hair.data.curve_offset_data.foreach_get("value", offsets)
    if not np.array_equal(offsets, arrays["offsets"]):
        raise GroomError(
            f"{hair.name}: strands or points were added or removed in Blender; export it as .abc"
            " and import that"
        )
    points = np.empty(3 * len(hair.data.points), np.float32)
    hair.data.position_data.foreach_get("vector", points)
    if np.abs(points.reshape(-1, 3) - z_up(arrays["points"])).max() > EDITED:
        arrays["points"] = y_up(points.reshape(-1, 3))
    np.savez(path, **arrays)
