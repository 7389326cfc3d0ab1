"""A Blender scene as vdb_diffuse reads it, in the frame of the volume's file."""

import json
import os

from .errors import BakeError
from .lights import lightOf
from .medium import mediumOf, panelMedium
from .surfaces import MeshFolder, surfacesOf
from .world import domeOf

EVEN = 1e-3  # by how much the three scales of a volume may differ


def scaleOf(matrix, name):
    """The scale of a volume's object. Raises BakeError where it is uneven, mirrored or sheared."""
    columns = [matrix.col[i].to_3d() for i in range(3)]
    lengths = [column.length for column in columns]
    scale = sum(lengths) / 3
    skew = max(abs(columns[i].dot(columns[(i + 1) % 3])) for i in range(3))
    if scale == 0 or max(lengths) - min(lengths) > EVEN * scale or skew > EVEN * scale**2 or matrix.determinant() < 0:
        raise BakeError(f"'{name}' is stretched or mirrored: give it the same positive scale on all three axes")
    return scale


def mediumInFile(volume, material, scale, warn):
    """The medium per length of the file."""
    settings = volume.vdb_diffuse
    medium = panelMedium(settings) if settings.medium_from == "PANEL" else mediumOf(material, warn)
    # Cycles takes densities per unit length of the object, or of the world where the volume is set to.
    per_world = scale if volume.render.space == "WORLD" else 1.0
    return {**medium, **{key: [per_world * s for s in medium[key]] for key in ("sigma_s", "sigma_a")}}


def _rendered(objects):
    for item in objects:
        if not item.hide_render and not all(c.hide_render for c in item.users_collection):
            yield item


def sceneOf(context, volume_object, medium, folder, warn, prefix=""):
    """Dictionary of medium, lights and surfaces; meshes and images go to the folder."""
    matrix = volume_object.matrix_world
    scale = scaleOf(matrix, volume_object.name)
    to_file = matrix.inverted()
    depsgraph = context.evaluated_depsgraph_get()
    meshes = MeshFolder(folder, prefix)
    lights = [lightOf(lamp, to_file, scale, meshes, warn) for lamp in _rendered(context.view_layer.objects)
              if lamp.type == "LIGHT" and getattr(lamp, "visible_volume_scatter", True)]
    rotation = matrix.to_quaternion().to_matrix().to_4x4()
    lights.append(domeOf(context.scene, rotation, folder, prefix))
    surfaces = []
    occluders = volume_object.data.vdb_diffuse.occluders
    for item in _rendered(occluders.all_objects if occluders else []):
        if item.type in ("MESH", "CURVE", "SURFACE", "META", "FONT"):
            surfaces += surfacesOf(item, depsgraph, to_file, meshes, warn)
    return {"medium": medium, "lights": [light for light in lights if light], "surfaces": surfaces}


def writeScene(path, scene):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(scene, file, indent=1)


def exportScene(context, volume_object, medium, folder, warn, frames=None):
    """Writes scene.json, or with `frames`, pairs of scene frame and number, one scene for each. Returns its path,
    with #### for the number."""
    if not frames:
        path = os.path.join(folder, "scene.json")
        writeScene(path, sceneOf(context, volume_object, medium, folder, warn))
        return path
    current = context.scene.frame_current
    try:
        for frame, number in frames:
            context.scene.frame_set(frame)
            scene = sceneOf(context, volume_object, medium, folder, warn, f"{number:04d}_")
            writeScene(os.path.join(folder, f"scene.{number:04d}.json"), scene)
    finally:
        context.scene.frame_set(current)
    return os.path.join(folder, "scene.####.json")
