"""The one setting: where hairkit is installed."""

import bpy


class Preferences(bpy.types.AddonPreferences):
    """Shown in Edit > Preferences > Add-ons > hairkit."""

    bl_idname = __package__

    python: bpy.props.StringProperty(
        name="hairkit's Python",
        description="Python that has hairkit (python, or the folder of its virtual environment);"
        " empty: the command `hairkit` on the PATH",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        """Show the setting."""
        self.layout.prop(self, "python")


def chosen_python() -> str:
    """Return what the user set, or an empty text."""
    addon = bpy.context.preferences.addons.get(__package__)
    return bpy.path.abspath(addon.preferences.python) if addon else ""
