"""Shader nodes that show a lit volume in Cycles.

Baked:   extinction sigma_t rho, and what a unit of length sends to the camera as emission,

             sigma_s rho max(0, direct + diffuse (1 + g I1.s / lum(diffuse))),   I1 = 3 flux / (4 pi),

         with s toward the camera; without a flux grid, and for g = 0, the bracket is 1.
Hybrid:  to rays from the camera the medium scatters, so that Cycles finds the light that scatters once, and
         emits the same without `direct`. To all other rays it only absorbs, with sigma_t: emission met after a
         scattering, and a second scattering, are in `diffuse` already.

An albedo grid multiplies sigma_s and leaves sigma_t as it is.

Grids are read by Attribute nodes, since Volume Info knows only a few names.
"""

import math

import bpy

X_STEP, Y_STEP = 200, 180


class _Tree:
    """Adds nodes and links them: an input that is a socket is linked, anything else is its value."""

    def __init__(self, material):
        material.use_nodes = True
        self.tree = material.node_tree
        self.tree.nodes.clear()
        self.rows = {}

    def add(self, kind, column, inputs=None, **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        row = self.rows[column] = self.rows.get(column, -1) + 1
        node.location = (column * X_STEP, -row * Y_STEP)
        return node

    def grid(self, name):
        return self.add("ShaderNodeAttribute", 0, attribute_name=name, label=name)

    def math(self, operation, column, a, b):
        return self.add("ShaderNodeMath", column, {0: a, 1: b}, operation=operation).outputs[0]

    def vector(self, operation, column, *operands):
        node = self.add("ShaderNodeVectorMath", column, dict(enumerate(operands)), operation=operation)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else 0]

    def scaled(self, column, vector, factor):
        return self.add("ShaderNodeVectorMath", column, {0: vector, "Scale": factor}, operation="SCALE").outputs[0]


def _towardCamera(tree, diffuse, g):
    """diffuse (1 + g I1.s / lum(diffuse)); the light that has scattered more than once, seen by the camera."""
    incoming = tree.add("ShaderNodeNewGeometry", 0).outputs["Incoming"]
    turned = tree.add("ShaderNodeVectorTransform", 1, {0: incoming}, vector_type="VECTOR", convert_from="WORLD",
                      convert_to="OBJECT").outputs[0]
    s = tree.vector("NORMALIZE", 2, turned)
    along = tree.vector("DOT_PRODUCT", 3, tree.grid("flux").outputs["Color"], s)
    luminance = tree.add("ShaderNodeRGBToBW", 1, {0: diffuse}).outputs[0]
    share = tree.math("DIVIDE", 4, along, luminance)  # Cycles divides by zero to zero
    factor = tree.add("ShaderNodeMath", 5, {0: share, 1: 3 * g / (4 * math.pi), 2: 1.0},
                      operation="MULTIPLY_ADD").outputs[0]
    return tree.scaled(6, diffuse, factor)


def _color(value):
    """Colours of nodes have four components."""
    return value if isinstance(value, bpy.types.NodeSocket) else [*value, 1]


def build(material, medium, kind, has_flux):
    """Makes the material's nodes anew. `kind` is BAKED or HYBRID."""
    tree = _Tree(material)
    sigma_s, sigma_a, g = medium["sigma_s"], medium["sigma_a"], medium["g"]
    sigma_t = [s + a for s, a in zip(sigma_s, sigma_a)]
    largest = max(max(sigma_t), 1e-30)  # nodes want a density and a colour of at most 1
    rho = tree.grid(medium["density"]).outputs["Fac"]
    light = tree.grid("diffuse").outputs["Color"]
    if has_flux:
        light = _towardCamera(tree, light, g)
    thick = tree.math("MULTIPLY", 7, rho, largest)
    passes = [1 - t / largest for t in sigma_t]
    scatters = [s / largest for s in sigma_s]
    if "albedo_grid" in medium:
        scatters = tree.vector("MULTIPLY", 6, tree.grid(medium["albedo_grid"]).outputs["Color"], scatters)
    if kind == "BAKED":
        light = tree.vector("ADD", 7, light, tree.grid("direct").outputs["Color"])
        seen = rho
    else:
        camera = tree.add("ShaderNodeLightPath", 6).outputs["Is Camera Ray"]
        passes = tree.vector("MULTIPLY_ADD", 7, camera, scatters, passes)
        seen = tree.math("MULTIPLY", 7, rho, camera)
    light = tree.vector("MULTIPLY", 8, tree.vector("MAXIMUM", 8, light, (0, 0, 0)), scatters)
    seen = tree.math("MULTIPLY", 8, seen, largest)
    emission = tree.add("ShaderNodeEmission", 9, {"Color": light, "Strength": seen})
    absorption = tree.add("ShaderNodeVolumeAbsorption", 9, {"Color": _color(passes), "Density": thick})
    shader = tree.add("ShaderNodeAddShader", 10, {0: emission.outputs[0], 1: absorption.outputs[0]})
    if kind == "HYBRID":
        scatter = tree.add("ShaderNodeVolumeScatter", 9, {
            "Color": _color(scatters), "Density": tree.math("MULTIPLY", 8, thick, camera),
            "Anisotropy": g})
        shader = tree.add("ShaderNodeAddShader", 11, {0: shader.outputs[0], 1: scatter.outputs[0]})
    tree.add("ShaderNodeOutputMaterial", 12, {"Volume": shader.outputs[0]})
