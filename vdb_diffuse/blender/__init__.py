"""Bakes the diffuse light of a Volume object with the vdb_diffuse program, and builds a material that shows it.

    operator.py   what the buttons do: export, run, load
      scene_export.py   scene -> dictionary and meshes, in the frame of the volume's file
        lights.py, world.py, surfaces.py, medium.py
      job.py            the program in the background, and its progress (no bpy)
      sequence.py       names of files (no bpy)
      material.py       the lit volume's shader nodes
    panel.py, settings.py, preferences.py   what the user sees
"""

bl_info = {  # Blender 4.2 and later read blender_manifest.toml instead
    "name": "vdb_diffuse",
    "description": "Bake multiple scattering into volumes",
    "author": "The vdb_diffuse authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Object Data, on a Volume object",
    "category": "Render",
}

from . import operator, panel, preferences, settings

MODULES = (preferences, settings, operator, panel)


def register():
    for module in MODULES:
        module.register()


def unregister():
    for module in reversed(MODULES):
        module.unregister()
