"""The commands of the menu."""

import json
import os
import tempfile
from pathlib import Path
from typing import ClassVar

import bpy
from bpy_extras.io_utils import ImportHelper

from . import child
from .groom_file import GroomError, read_groom
from .objects import add_groom
from .preferences import chosen_python


class ImportGroom(bpy.types.Operator, ImportHelper):
    """Import a groom with its head; what is no .npz is read by hairkit."""

    bl_idname = "hairkit.import_groom"
    bl_label = "Import groom"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    hairs: bpy.props.IntProperty(
        name="Hairs",
        description="Strands in all, interpolated between the guides; 0: those of the file",
        default=0,
        min=0,
        max=2_000_000,
    )
    up: bpy.props.EnumProperty(
        name="Up",
        description="Axis that points up in a file that does not say so",
        items=[("FILE", "As the format has it", ""), ("y", "Y", ""), ("z", "Z", "")],
    )
    scale: bpy.props.FloatProperty(
        name="Metres per unit",
        description="Of a file that does not say so; 0: as the format has it",
        default=0.0,
        min=0.0,
        precision=5,
    )
    filter_glob: bpy.props.StringProperty(
        default="*.npz;*.apx;*.abc;*.usd;*.usda;*.usdc;*.glb;*.hair;*.tfx;*.data;*.ply;*.obj",
        options={"HIDDEN"},
    )

    def execute(self, context):
        """Add head and hair to the scene."""
        source = Path(bpy.path.abspath(self.filepath))
        try:
            groom = self._read(source)
        except (child.ChildError, GroomError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        add_groom(context, groom, source.stem)
        self.report({"INFO"}, f"{len(groom.offsets) - 1} strands")
        return {"FINISHED"}

    def _read(self, source):
        """Return the groom in a file; hairkit's own file needs no hairkit."""
        words = self._words()
        if source.suffix.lower() == ".npz" and not words:
            return read_groom(source)
        with tempfile.TemporaryDirectory() as folder:
            target = str(Path(folder) / "groom.npz")
            command = [*child.hairkit(chosen_python()), "convert", str(source), target, *words]
            for warning in child.run(command).warnings:
                self.report({"WARNING"}, warning)
            return read_groom(target)

    def _words(self):
        words = ["--up", self.up] if self.up != "FILE" else []
        words += ["--scale", f"{self.scale:.9g}"] if self.scale > 0 else []
        return words + (["--set", f"writer.hairs={self.hairs}"] if self.hairs else [])


class Reconstruct(bpy.types.Operator):
    """Make hair from a folder with eight photos around a head."""

    bl_idname = "hairkit.reconstruct"
    bl_label = "Reconstruct folder of photos"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(name="Photos", subtype="DIR_PATH")
    out: bpy.props.StringProperty(
        name="Work folder",
        description="Where results go; empty: beside the photos",
        subtype="DIR_PATH",
    )
    guides: bpy.props.IntProperty(name="Guides", default=600, min=10, max=20_000)
    settings: bpy.props.StringProperty(
        name="Settings", description="As of the command line: gabor.angles=64"
    )

    _run = None
    _timer = None
    _area = None

    def invoke(self, context, event):
        """Ask for the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """Start hairkit; with a window Blender goes on meanwhile, without one it waits."""
        try:
            self._run = child.Child(self._command())
        except child.ChildError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if bpy.app.background or context.window is None:
            return self._finish(context)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.2, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show how far it is, stop it at Escape, take its groom at the end."""
        if event.type == "ESC":
            self._run.stop()
            self._leave(context)
            self.report({"WARNING"}, "hairkit was stopped; run it again to go on from there")
            return {"CANCELLED"}
        if event.type != "TIMER" or not self._run.over():
            context.workspace.status_text_set(f"hairkit: {self._run.last_line()}   [Esc] stops")
            return {"PASS_THROUGH"}
        self._leave(context)
        return self._finish(context)

    def _command(self):
        photos = Path(bpy.path.abspath(self.directory))
        out = Path(bpy.path.abspath(self.out)) if self.out else _beside(photos)
        words = ["reconstruct", str(photos), "-o", str(out), "--guides", str(self.guides)]
        words += [word for text in self.settings.split() for word in ("--set", text)]
        return [*child.hairkit(chosen_python()), *words, "--json"]

    def _finish(self, context):
        try:
            made = json.loads(self._run.result().output)
            groom = read_groom(made["groom"])
        except (child.ChildError, GroomError, ValueError, KeyError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        add_groom(context, groom, Path(made["groom"]).parent.name)
        self.report({"INFO"}, f"{made['strands']} guides in {made['seconds']:.0f} s")
        return {"FINISHED"}

    def _leave(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)


def _beside(photos):
    """Return the work folder of a folder of photos: `anna` gets `anna-hairkit`."""
    photos = Path(os.path.normpath(photos))
    return photos.parent / f"{photos.name}-hairkit"
