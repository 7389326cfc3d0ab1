"""Lights, as vdb_diffuse has them: in the frame of the volume's file, radiance in W/m2/sr.

A lamp of power P in Blender sends out, as measured in Cycles by tests/blender/lamps.py:

    point, spot   intensity P / (4 pi), on a spot's axis           a point's total is P
    area          radiance P / (4 A), A the lamp's area            so P pi / 4 in all
    sun           strength S: int L dw = S, L falling so that a plane facing it gets S 2 cos a / (1 + cos a),
                  with a half the sun's angle

The file's frame is the world's, turned and shrunk by s (the volume's scale). Radiance stays, and so does
irradiance; an intensity becomes I / s^2.
"""

import math

from mathutils import Vector

from .surfaces import Mesh

DISK_CORNERS = 32


def _tint(light, warn):
    """Colour times what the lamp's nodes say."""
    color = Vector(light.color)
    if not light.use_nodes or not light.node_tree:
        return color
    emission = [node for node in light.node_tree.nodes if node.type == "EMISSION"]
    if len(emission) != 1 or any(socket.is_linked for socket in emission[0].inputs):
        warn(f"lamp '{light.name}': its nodes are not understood, its colour and power are taken")
        return color
    inputs = emission[0].inputs
    return color * Vector(inputs["Color"].default_value[:3]) * inputs["Strength"].default_value


def _areaMesh(light):
    """Corners around the lamp's edge, seen counter-clockwise from where it shines, which is its -z."""
    width = light.size
    height = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    if light.shape in ("SQUARE", "RECTANGLE"):
        edge = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    else:
        turns = [-2 * math.pi * i / DISK_CORNERS for i in range(DISK_CORNERS)]
        edge = [(math.cos(t), math.sin(t)) for t in turns]
    corners = [Vector((0.5 * width * x, 0.5 * height * y, 0)) for x, y in edge]
    return Mesh(corners, [(0, i, i + 1) for i in range(1, len(corners) - 1)])


def lightOf(lamp, to_file, scale, meshes, warn):
    """The dictionary of one lamp; None where it gives no light. `meshes.add(name, mesh)` stores an area lamp's."""
    light = lamp.data
    power = _tint(light, warn) * light.energy
    if min(power) < 0:
        warn(f"lamp '{lamp.name}': negative light is left out")
        return None
    if max(power) == 0:
        return None
    frame = to_file @ lamp.matrix_world
    axis = list((frame.to_3x3() @ Vector((0, 0, -1))).normalized())
    position = list(frame.translation)
    intensity = list(power / (4 * math.pi * scale**2))
    if light.type == "SUN":
        # A disc of even radiance whose int L dw is the strength; vdb_diffuse counts on a plane that faces it.
        irradiance = power * (1 + math.cos(0.5 * light.angle)) / 2
        return {"type": "sun", "name": lamp.name, "direction": axis, "irradiance": list(irradiance),
                "angle": math.degrees(light.angle)}
    if light.type == "POINT":
        return {"type": "point", "name": lamp.name, "position": position, "intensity": intensity,
                "radius": light.shadow_soft_size / scale}
    if light.type == "SPOT":
        return {"type": "spot", "name": lamp.name, "position": position, "direction": axis, "intensity": intensity,
                "angle": math.degrees(light.spot_size), "blend": light.spot_blend}
    if getattr(light.cycles, "is_portal", False):
        return None
    if light.spread < math.pi:
        warn(f"lamp '{lamp.name}': its spread is ignored, it shines to all sides of its front")
    mesh = _areaMesh(light).transformed(lamp.matrix_world)
    radiance = power / (4 * mesh.area())
    return {"type": "area", "name": lamp.name, "mesh": meshes.add(lamp.name, mesh.transformed(to_file)),
            "radiance": list(radiance)}
