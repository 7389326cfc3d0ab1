"""Where the vdb_diffuse program is."""

import os
import shutil

import bpy

from .errors import BakeError


class VdbDiffusePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: bpy.props.StringProperty(
        name="Program",
        description="The vdb_diffuse program; empty: the one on the PATH",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "program")


def findProgram(context):
    """Path of the program. Raises BakeError where there is none."""
    addon = context.preferences.addons.get(__package__)
    chosen = bpy.path.abspath(addon.preferences.program) if addon else ""
    if chosen:
        if not os.access(chosen, os.X_OK) or os.path.isdir(chosen):
            raise BakeError(f"{chosen} is not a program: correct the path in the add-on's preferences")
        return chosen
    found = shutil.which("vdb_diffuse")
    if not found:
        raise BakeError("vdb_diffuse is not on the PATH: give its path in the add-on's preferences")
    return found


def register():
    bpy.utils.register_class(VdbDiffusePreferences)


def unregister():
    bpy.utils.unregister_class(VdbDiffusePreferences)
