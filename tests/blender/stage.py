"""Scenes for the tests: an empty Blender with the add-on from its zip, a volume, lamps, a camera, a small picture."""

import math
import os
import subprocess
import sys
import tempfile

import bpy
import numpy as np
from mathutils import Matrix, Vector

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PROGRAM = os.environ.get("VDB_DIFFUSE_PROGRAM", os.path.join(ROOT, "build", "vdb_diffuse"))
FOLDER = tempfile.mkdtemp(prefix="vdb_diffuse_test_")
MIDDLE, WIDTH, SIZE = Vector((0.45, 0.45, 1.7)), 14.0, 48  # a view of data/cumulus.vdb


def data(name):
    return os.path.join(ROOT, "data", name)


def installAddon():
    """Installs the add-on from a fresh zip, into a folder of its own: run Blender with BLENDER_USER_SCRIPTS set."""
    archive = os.path.join(FOLDER, "addon.zip")
    make_zip = os.path.join(ROOT, "vdb_diffuse", "blender", "make_zip.py")
    subprocess.run([sys.executable, make_zip, archive], check=True, stdout=subprocess.DEVNULL)
    bpy.ops.preferences.addon_install(filepath=archive, overwrite=True)
    bpy.ops.preferences.addon_enable(module="vdb_diffuse")
    bpy.context.preferences.addons["vdb_diffuse"].preferences.program = PROGRAM


def emptyScene(samples):
    for group in (bpy.data.objects, bpy.data.volumes, bpy.data.materials, bpy.data.lights, bpy.data.cameras,
                  bpy.data.meshes, bpy.data.worlds, bpy.data.collections, bpy.data.images):
        for item in list(group):
            group.remove(item)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0  # as vdb_diffuse render has it
    cycles.volume_bounces = 0
    return scene


def addObject(name, content, matrix=None):
    item = bpy.data.objects.new(name, content)
    bpy.context.scene.collection.objects.link(item)
    if matrix is not None:
        item.matrix_world = matrix
    bpy.context.view_layer.update()
    return item


def addVolume(path, color=(1, 1, 1), density=1.0, g=0.0, matrix=None):
    """A Volume object with a Principled Volume, selected."""
    volume = bpy.data.volumes.new("cloud")
    volume.filepath = path
    item = addObject("cloud", volume, matrix)
    material = bpy.data.materials.new("cloud")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    principled = nodes.new("ShaderNodeVolumePrincipled")
    principled.inputs["Color"].default_value = (*color, 1)
    principled.inputs["Density"].default_value = density
    principled.inputs["Anisotropy"].default_value = g
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(principled.outputs[0], output.inputs["Volume"])
    volume.materials.append(material)
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    return item


def addLamp(kind, energy, position=(0, 0, 0), direction=(0, 0, -1), color=(1, 1, 1), **settings):
    light = bpy.data.lights.new(kind.lower(), kind)
    light.energy, light.color = energy, color
    for name, value in settings.items():
        setattr(light, name, value)
    turn = Vector(direction).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    return addObject(kind.lower(), light, Matrix.Translation(position) @ turn)


def addWorld(color):
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1)
    bpy.context.scene.world = world
    return world


def addCamera(matrix=Matrix()):
    """Orthographic, on MIDDLE from the front left; `matrix` moves it with a volume."""
    offset = Vector((math.sin(math.radians(-30)), -math.cos(math.radians(-30)), 0.36)).normalized()
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", WIDTH * matrix.median_scale
    camera.clip_end = 1000
    turn = (-offset).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    place = matrix @ Matrix.Translation(MIDDLE + 20 * offset) @ turn
    bpy.context.scene.camera = addObject("camera", camera, place.normalized())
    return MIDDLE + 20 * offset


def readPicture(path):
    image = bpy.data.images.load(path, check_existing=False)
    picture = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], 4)[:, :, :3]
    bpy.data.images.remove(image)
    return picture


def cyclesPicture(name="cycles"):
    path = os.path.join(FOLDER, name + ".exr")
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    return readPicture(path)


def ownPicture(lit, start, *flags, shift=Vector()):
    """The same view by vdb_diffuse render; `shift` moves the camera."""
    def word(point):
        return ",".join(map(str, point + shift))

    path = os.path.join(FOLDER, "own.exr")
    words = [PROGRAM, "render", lit, "-o", path, "--size", f"{SIZE}x{SIZE}", "--quiet", "--background", "0",
             "--ortho", str(WIDTH), "--from", word(start), "--look-at", word(MIDDLE)]
    subprocess.run(words + list(flags), check=True)
    return readPicture(path)


def bake(item, **settings):
    """Bakes, waits, and gives the lit file's path."""
    for name, value in settings.items():
        setattr(item.data.vdb_diffuse, name, value)
    item.data.vdb_diffuse.output_folder = FOLDER
    assert bpy.ops.vdb_diffuse.bake() == {"FINISHED"}
    return item.data.filepath


def difference(a, b):
    """Of the means, and RMS over the pixels, relative to b's mean."""
    mean = b.mean()
    return a.mean() / mean - 1, float(np.sqrt(((a - b) ** 2).mean())) / mean
