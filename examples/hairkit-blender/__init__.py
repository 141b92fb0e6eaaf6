"""hairkit in Blender: hair from photos and files, on its head, simulated and filled in.

hairkit itself runs in a Python of its own, as a child process, so that no package of hairkit meets
Blender's NumPy; what crosses over is a groom file (.npz).
"""

import bpy

from .operators import ImportGroom, Reconstruct
from .preferences import Preferences
from .simulate import Simulate


class HairkitMenu(bpy.types.Menu):
    """The menu `hairkit` in the bar of the 3D view."""

    bl_idname = "VIEW3D_MT_hairkit"
    bl_label = "hairkit"

    def draw(self, context):
        """Show the commands."""
        self.layout.operator(Reconstruct.bl_idname)
        self.layout.operator(ImportGroom.bl_idname)
        self.layout.operator(Simulate.bl_idname)


_CLASSES = (Preferences, Reconstruct, ImportGroom, Simulate, HairkitMenu)


def register():
    """Add commands, menu and preferences to Blender."""
    for kind in _CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.VIEW3D_MT_editor_menus.append(_in_menu_bar)
    bpy.types.TOPBAR_MT_file_import.append(_in_file_menu)


def unregister():
    """Take away what `register` added."""
    bpy.types.TOPBAR_MT_file_import.remove(_in_file_menu)
    bpy.types.VIEW3D_MT_editor_menus.remove(_in_menu_bar)
    for kind in reversed(_CLASSES):
        bpy.utils.unregister_class(kind)


def _in_menu_bar(menu, context):
    if context.mode == "OBJECT":
        menu.layout.menu(HairkitMenu.bl_idname)


def _in_file_menu(menu, context):
    menu.layout.operator(ImportGroom.bl_idname, text="hairkit groom (.npz, .apx, .abc, ...)")
