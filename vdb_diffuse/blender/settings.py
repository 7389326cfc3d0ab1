"""What is stored with a Volume: how to bake it, and what it was before."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty
from bpy.props import PointerProperty, StringProperty


class VdbDiffuseSettings(bpy.types.PropertyGroup):
    material_kind: EnumProperty(
        name="Material",
        items=[
            ("BAKED", "All Baked", "Absorption and emission: no noise, and no paths to trace. With anisotropy, "
             "light that scatters once counts as isotropic"),
            ("HYBRID", "Single Scattering Traced", "Cycles traces the light that scatters once, with sharp shadows "
             "and the true phase function; the rest is baked. Seen by the camera only: not in mirrors"),
        ],
    )
    occluders: PointerProperty(
        name="Occluders", type=bpy.types.Collection,
        description="Meshes that hide light from the volume, and reflect it by their base colour",
    )
    sweeps: IntProperty(
        name="Sweeps", default=2, min=0, max=100, soft_max=8,
        description="Transport sweeps after the diffusion solve: each buys a smaller error for more time",
    )
    animated_lights: BoolProperty(
        name="Animated Lights",
        description="For a sequence: take lights and occluders as they are at each frame, not at the current one",
    )
    output_folder: StringProperty(
        name="Output", subtype="DIR_PATH",
        description="Folder of the lit files; empty: beside the volume's own",
    )
    medium_from: EnumProperty(
        name="Medium",
        items=[
            ("MATERIAL", "From Material", "Principled Volume, Volume Scatter and Volume Absorption"),
            ("PANEL", "Set Here", "Values below"),
        ],
    )
    density: FloatProperty(name="Density", default=1, min=0, description="Extinction per unit of the density grid")
    albedo: FloatVectorProperty(
        name="Albedo", subtype="COLOR", size=3, default=(1, 1, 1), min=0, max=1,
        description="Share of the light that scatters where light meets the medium; the rest is absorbed",
    )
    albedo_grid: StringProperty(
        name="Albedo Grid",
        description="Grid of the file, such as Cd, that multiplies the albedo; empty: none",
    )
    anisotropy: FloatProperty(name="Anisotropy", min=-0.99, max=0.99, description="Mean cosine of scattering")

    # What the volume was before the first bake, so that a second one does not build on the first.
    source: StringProperty(options={"HIDDEN"})
    source_clipping: FloatProperty(options={"HIDDEN"})
    baked_file: StringProperty(options={"HIDDEN"})
    source_material: PointerProperty(type=bpy.types.Material, options={"HIDDEN"})
    baked_material: PointerProperty(type=bpy.types.Material, options={"HIDDEN"})


def register():
    bpy.utils.register_class(VdbDiffuseSettings)
    bpy.types.Volume.vdb_diffuse = PointerProperty(type=VdbDiffuseSettings)
    bpy.types.WindowManager.vdb_diffuse_progress = FloatProperty(
        name="Progress", subtype="PERCENTAGE", min=-1, max=100, default=-1, options={"SKIP_SAVE"})


def unregister():
    del bpy.types.WindowManager.vdb_diffuse_progress
    del bpy.types.Volume.vdb_diffuse
    bpy.utils.unregister_class(VdbDiffuseSettings)
