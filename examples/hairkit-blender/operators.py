"""The commands of the menu that add hair: from files, and from photos."""

import json
import os
import shutil
from pathlib import Path
from typing import ClassVar

import bpy
import numpy as np
from bpy_extras.io_utils import ImportHelper

from . import child, playback
from .animated_file import PlaybackError, frames_of
from .background import ERRORS, Background
from .groom_file import read_groom
from .objects import add_groom
from .preferences import chosen_python

FILL = 20_000
"""Hairs that are drawn between guides: a full head at a distance of a metre."""
_FILL = bpy.props.IntProperty(
    name="Fill",
    description="Hairs that Blender's nodes draw between guides; 0: the guides alone",
    default=FILL,
    min=0,
    max=500_000,
)


class ImportGroom(bpy.types.Operator, ImportHelper):
    """Import a groom with its head and its animation; what is no .npz is read by hairkit."""

    bl_idname = "hairkit.import_groom"
    bl_label = "Import groom"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    fill: _FILL
    hairs: bpy.props.IntProperty(
        name="Hairs",
        description="Strands in all, made by hairkit between the guides; 0: those of the file",
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
    animation: bpy.props.BoolProperty(
        name="Animation", description="Play the animation of the file", default=True
    )
    simulation: bpy.props.StringProperty(
        name="Simulation",
        description="A cache that hairkit simulate wrote for this groom",
        subtype="FILE_PATH",
    )
    filter_glob: bpy.props.StringProperty(
        default="*.npz;*.apx;*.abc;*.usd;*.usda;*.usdc;*.glb;*.hair;*.tfx;*.data;*.ply;*.obj;*.ma"
        ";*.npy",
        options={"HIDDEN"},
    )

    def execute(self, context):
        """Add head and hair to the scene, and let them move as the file says."""
        source = Path(bpy.path.abspath(self.filepath))
        try:
            stored = self._stored(source)
            groom = read_groom(stored)
            frames = self._frames(context, source, groom)
            head, hair = add_groom(context, groom, source.stem, self.fill)
            hair[playback.GROOM] = str(stored)
            if frames is not None:
                self._play(context, head, hair, frames)
        except ERRORS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        moving = "" if frames is None else f", {len(frames.times)} frames"
        self.report({"INFO"}, f"{len(groom.offsets) - 1} strands{moving}")
        return {"FINISHED"}

    def _stored(self, source):
        """Return the groom of a file as hairkit's own file; that one needs no hairkit."""
        words = self._words()
        if source.suffix.lower() == ".npz" and not words:
            return source
        words = [*child.hairkit(chosen_python()), "convert", str(source)], words
        target = playback.free_name(playback.folder(source.stem), "groom", ".npz")
        try:
            answer = child.run([*words[0], str(target), *words[1]])
        except child.ChildError:
            if not any(target.parent.iterdir()):
                shutil.rmtree(target.parent)
            raise
        for warning in answer.warnings:
            self.report({"WARNING"}, warning)
        return target

    def _frames(self, context, source, groom):
        if self.simulation:
            return playback.read_frames(bpy.path.abspath(self.simulation))
        if not self.animation or self.hairs:
            return None
        try:
            return frames_of(context, source, groom.points, np.diff(groom.offsets))
        except PlaybackError as reason:
            self.report({"WARNING"}, str(reason))
            return None

    def _play(self, context, head, hair, frames):
        words, scene = child.hairkit(chosen_python()), context.scene
        place = playback.folder(hair.name)
        stored = bpy.path.abspath(hair[playback.GROOM])
        carried = frames.head_from_rest
        playback.play(hair, playback.write_playable(words, stored, frames, carried, place), 0)
        if playback.moves(carried):
            playback.set_keys(head, carried, 0)
        scene.frame_start, scene.frame_end = 0, len(frames.times) - 1
        scene.frame_set(0)

    def _words(self):
        words = ["--up", self.up] if self.up != "FILE" else []
        words += ["--scale", f"{self.scale:.9g}"] if self.scale > 0 else []
        return words + (["--set", f"writer.hairs={self.hairs}"] if self.hairs else [])


class Reconstruct(bpy.types.Operator, Background):
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
    fill: _FILL
    settings: bpy.props.StringProperty(
        name="Settings", description="As of the command line: gabor.angles=64"
    )

    def invoke(self, context, event):
        """Ask for the folder."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        """Yield the command that reconstructs; then add its groom."""
        photos = Path(bpy.path.abspath(self.directory))
        out = Path(bpy.path.abspath(self.out)) if self.out else _beside(photos)
        words = ["reconstruct", str(photos), "-o", str(out), "--guides", str(self.guides)]
        words += [word for text in self.settings.split() for word in ("--set", text)]
        answer = yield [*child.hairkit(chosen_python()), *words, "--json", "--steps"]
        made = json.loads(answer.output)
        _, hair = add_groom(context, read_groom(made["groom"]), out.name, self.fill)
        hair[playback.GROOM] = str(Path(made["groom"]).resolve())
        self.report({"INFO"}, f"{made['strands']} guides in {made['seconds']:.0f} s")


def _beside(photos):
    """Return the work folder of a folder of photos: `anna` gets `anna-hairkit`."""
    photos = Path(os.path.normpath(photos))
    return photos.parent / f"{photos.name}-hairkit"
