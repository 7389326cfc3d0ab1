"""Meshes that hide and reflect light, and OBJ files of them."""

import os
from dataclasses import dataclass

from mathutils import Vector

GREY = 0.8  # what Blender gives a mesh without a material


@dataclass
class Mesh:
    positions: list  # of Vector
    triangles: list  # of three indices; counter-clockwise is the front

    def transformed(self, matrix):
        return Mesh([matrix @ p for p in self.positions], self.triangles)

    def area(self):
        corners = ([self.positions[i] for i in t] for t in self.triangles)
        return sum(0.5 * (b - a).cross(c - a).length for a, b, c in corners)


def writeObj(path, mesh):
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(f"v {p[0]:.9g} {p[1]:.9g} {p[2]:.9g}\n" for p in mesh.positions)
        file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in mesh.triangles)


class MeshFolder:
    """OBJ files beside a scene file, which names them without their folder."""

    def __init__(self, folder, prefix=""):
        self.folder, self.prefix, self.count = folder, prefix, 0

    def add(self, name, mesh):
        safe = "".join(c if c.isalnum() and c.isascii() else "_" for c in name)
        file = f"{self.prefix}{self.count:03d}_{safe}.obj"
        self.count += 1
        writeObj(os.path.join(self.folder, file), mesh)
        return file


def _albedo(material, warn):
    """Base colour of a Principled or Diffuse BSDF, 0 to 1; the viewport's colour where nodes feed it."""
    if material is None:
        return [GREY] * 3
    if not material.use_nodes:
        return [min(max(c, 0), 1) for c in material.diffuse_color[:3]]
    for node in material.node_tree.nodes:
        color = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color"}.get(node.type)
        if color and not node.inputs[color].is_linked:
            return [min(max(c, 0), 1) for c in node.inputs[color].default_value[:3]]
    warn(f"material '{material.name}': no plain base colour, its viewport colour is taken as albedo")
    return [min(max(c, 0), 1) for c in material.diffuse_color[:3]]


def surfacesOf(mesh_object, depsgraph, to_file, meshes, warn):
    """Dictionaries of one object's surfaces, one for each of its materials."""
    evaluated = mesh_object.evaluated_get(depsgraph)
    data = evaluated.to_mesh()
    try:
        data.calc_loop_triangles()
        frame = to_file @ evaluated.matrix_world
        positions = [frame @ Vector(vertex.co) for vertex in data.vertices]
        by_slot = {}
        for triangle in data.loop_triangles:
            by_slot.setdefault(triangle.material_index, []).append(tuple(triangle.vertices))
        slots = [slot.material for slot in evaluated.material_slots]
    finally:
        evaluated.to_mesh_clear()
    surfaces = []
    for slot, triangles in sorted(by_slot.items()):
        material = slots[slot] if slot < len(slots) else None
        surfaces.append({"name": mesh_object.name, "albedo": _albedo(material, warn),
                         "mesh": meshes.add(mesh_object.name, Mesh(positions, triangles))})
    return surfaces
