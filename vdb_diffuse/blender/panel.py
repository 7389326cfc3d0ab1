"""The panel among a Volume's object data properties."""

import bpy

from .errors import BakeError
from .preferences import findProgram


class VDB_DIFFUSE_PT_volume(bpy.types.Panel):
    bl_label = "Diffuse Lighting"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "VOLUME"

    def draw(self, context):
        layout, volume = self.layout, context.object.data
        settings = volume.vdb_diffuse
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(settings, "occluders")
        layout.prop(settings, "medium_from")
        if settings.medium_from == "PANEL":
            for name in ("density", "albedo", "albedo_grid", "anisotropy"):
                layout.prop(settings, name)
        layout.prop(settings, "sweeps")
        layout.prop(settings, "material_kind")
        if volume.is_sequence:
            layout.prop(settings, "animated_lights")
        layout.prop(settings, "output_folder")
        self._drawButtons(context, layout, settings)

    def _drawButtons(self, context, layout, settings):
        progress = context.window_manager.vdb_diffuse_progress
        if progress >= 0:
            text = f"Baking: {progress:.0f} %   (Esc cancels)"
            if hasattr(layout, "progress"):  # from Blender 4.0
                layout.progress(factor=progress / 100, text=text)
            else:
                layout.prop(context.window_manager, "vdb_diffuse_progress", text="Baking (Esc cancels)", slider=True)
            return
        try:
            findProgram(context)
        except BakeError as error:
            layout.label(text=str(error), icon="ERROR")
        row = layout.row(align=True)
        row.operator("vdb_diffuse.bake", icon="OUTLINER_OB_LIGHT")
        if settings.source:
            row.operator("vdb_diffuse.restore", text="", icon="X")
            layout.label(text=f"Lit from {bpy.path.basename(settings.source)}", icon="CHECKMARK")


def register():
    bpy.utils.register_class(VDB_DIFFUSE_PT_volume)


def unregister():
    bpy.utils.unregister_class(VDB_DIFFUSE_PT_volume)
