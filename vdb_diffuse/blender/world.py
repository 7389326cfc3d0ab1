"""The world's light: a colour as it is, anything else rendered to an equirectangular image."""

import math
import os

import bpy
from mathutils import Matrix

SIZE = (512, 256)
SAMPLES = 64  # a sun in the image is about as wide as a pixel: many rays have to look for it

# Turns Cycles' panoramic camera so that the image's middle looks along +x with +z up, as vdb_diffuse has it.
PANORAMA = Matrix.Rotation(math.radians(-90), 4, "Z") @ Matrix.Rotation(math.radians(90), 4, "X")


def _background(world):
    """The Background node that is the world's surface; None where there is something else."""
    output = next((n for n in world.node_tree.nodes if n.type == "OUTPUT_WORLD" and n.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return None
    node = output.inputs["Surface"].links[0].from_node
    return node if node.type == "BACKGROUND" else None


def domeOf(scene, rotation, folder, prefix=""):
    """The dictionary of the world's light, None where it is black. `rotation`: 4x4, the volume's in the world."""
    world = scene.world
    if world is None:
        return None
    if not world.use_nodes:
        radiance = list(world.color)
    else:
        background = _background(world)
        if background is None or any(socket.is_linked for socket in background.inputs):
            file = prefix + "world.exr"
            renderWorld(world, rotation, os.path.join(folder, file))
            return {"type": "dome", "name": world.name, "image": file, "radiance": 1.0}
        strength = background.inputs["Strength"].default_value
        radiance = [strength * c for c in background.inputs["Color"].default_value[:3]]
    return {"type": "dome", "name": world.name, "radiance": radiance} if max(radiance) > 0 else None


def renderWorld(world, rotation, path):
    """What a camera sees of the world all around, by Cycles, in a scene of its own."""
    scene = bpy.data.scenes.new("vdb_diffuse world")
    camera_data = bpy.data.cameras.new("vdb_diffuse world")
    camera = bpy.data.objects.new("vdb_diffuse world", camera_data)
    try:
        camera_data.type = "PANO"
        owner = camera_data.cycles if hasattr(camera_data.cycles, "panorama_type") else camera_data
        owner.panorama_type = "EQUIRECTANGULAR"
        camera.matrix_world = rotation @ PANORAMA
        scene.collection.objects.link(camera)
        scene.camera, scene.world = camera, world
        render = scene.render
        render.engine, render.filepath = "CYCLES", path
        render.resolution_x, render.resolution_y = SIZE
        render.resolution_percentage = 100
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
        scene.cycles.use_adaptive_sampling = False
        scene.cycles.pixel_filter_type = "BOX"
        bpy.ops.render.render(scene=scene.name, write_still=True)
    finally:
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(camera_data)
        bpy.data.scenes.remove(scene)
