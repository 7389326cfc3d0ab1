"""What a volume's material says about the medium: density grid, sigma_s, sigma_a, g, albedo grid.

    Principled Volume    sigma_s = d c, sigma_a = d max(0, 1 - c) max(0, 1 - sqrt(absorption colour))
    Volume Scatter       sigma_s = d c                     d: Density, c: Color
    Volume Absorption    sigma_a = d max(0, 1 - c)

as in Cycles, per unit of the grid that d is proportional to. Add Shader and Mix Shader combine them.

A grid, such as Cd, may give or multiply the colour c of a Principled Volume that absorbs in black: then its extinction
is d whatever the grid says, and the grid multiplies sigma_s, as `albedo_grid` of vdb_diffuse does.
"""

from .errors import BakeError


class _Found:
    def __init__(self, name):
        self.name, self.grid = name, None
        self.albedo_grids = set()  # of each part that scatters; None: by no grid
        self.sigma_s, self.sigma_a, self.g_sigma_s = [0.0] * 3, [0.0] * 3, 0.0

    def refuse(self, what):
        raise BakeError(f"material '{self.name}': {what}; or set the medium in the panel")

    def setGrid(self, grid):
        if self.grid not in (None, grid):
            self.refuse(f"densities from two grids, '{self.grid}' and '{grid}': use one")
        self.grid = grid


def _source(socket):
    """The node and socket that feed an input, through reroutes; None, None where nothing does."""
    while socket.is_linked:
        link = socket.links[0]
        if link.from_node.type != "REROUTE":
            return link.from_node, link.from_socket
        socket = link.from_node.inputs[0]
    return None, None


def _factor(socket, found):
    """Value of a density input, per unit of the grid behind it, and the grid's name or None."""
    node, output = _source(socket)
    if node is None:
        return float(socket.default_value), None
    if node.type == "VALUE":
        return float(output.default_value), None
    if node.type == "ATTRIBUTE":
        return 1.0, node.attribute_name
    if node.type == "VOLUME_INFO":
        return 1.0, output.name.lower()
    if node.type == "MATH" and node.operation in ("MULTIPLY", "DIVIDE") and not node.use_clamp:
        (a, grid_a), (b, grid_b) = (_factor(node.inputs[i], found) for i in (0, 1))
        if node.operation == "MULTIPLY" and not (grid_a and grid_b):
            return a * b, grid_a or grid_b
        if node.operation == "DIVIDE" and not grid_b and b:
            return a / b, grid_a
    found.refuse(f"node '{node.name}' feeds a density, which has to be an Attribute times a number")


def _color(node, found):
    """Colour of a Principled Volume, and the grid that multiplies it or None."""
    attribute = node.inputs["Color Attribute"].default_value
    source, _ = _source(node.inputs["Color"])
    if source is None or source.type != "ATTRIBUTE":
        return _constant(node.inputs["Color"], found), attribute or None
    if attribute:
        found.refuse(f"node '{node.name}' multiplies two grids, '{source.attribute_name}' and '{attribute}': clear one")
    return [1.0, 1.0, 1.0], source.attribute_name


def _constant(socket, found):
    node, output = _source(socket)
    if node is None:
        value = socket.default_value
    elif node.type in ("RGB", "VALUE"):
        value = output.default_value
    else:
        found.refuse(f"node '{node.name}' feeds '{socket.name}', which has to be constant")
    return list(value)[:3] if hasattr(value, "__len__") else float(value)


def _add(node, weight, found, warn):
    if node is None:
        return
    kind = node.type
    if kind == "ADD_SHADER":
        for socket in node.inputs:
            _add(_source(socket)[0], weight, found, warn)
        return
    if kind == "MIX_SHADER":
        share = min(max(_constant(node.inputs[0], found), 0), 1)
        _add(_source(node.inputs[1])[0], weight * (1 - share), found, warn)
        _add(_source(node.inputs[2])[0], weight * share, found, warn)
        return
    if kind == "EMISSION":
        warn(f"material '{found.name}': emission is left out of the bake and of the new material")
        return
    if kind not in ("PRINCIPLED_VOLUME", "VOLUME_SCATTER", "VOLUME_ABSORPTION"):
        found.refuse(f"node '{node.name}' is not understood")
    density, grid = _factor(node.inputs["Density"], found)
    if kind == "PRINCIPLED_VOLUME":
        attribute = node.inputs["Density Attribute"].default_value
        if attribute and grid:
            found.refuse(f"node '{node.name}' multiplies two grids, '{grid}' and '{attribute}': clear one")
        grid = grid or attribute
        if node.inputs["Emission Strength"].default_value or node.inputs["Blackbody Intensity"].default_value:
            warn(f"material '{found.name}': emission is left out of the bake and of the new material")
    if not grid:
        found.refuse(f"node '{node.name}': no grid feeds its density")
    found.setGrid(grid)
    albedo_grid = None
    if kind == "PRINCIPLED_VOLUME":
        color, albedo_grid = _color(node, found)
    else:
        color = _constant(node.inputs["Color"], found)
    absorbing = [max(0, 1 - c) for c in color]
    if kind == "PRINCIPLED_VOLUME":
        left = _constant(node.inputs["Absorption Color"], found)
        if albedo_grid and max(left) > 0:
            found.refuse(f"node '{node.name}': its Absorption Color has to be black where a grid gives its colour")
        absorbing = [a * max(0, 1 - max(c, 0) ** 0.5) for a, c in zip(absorbing, left)]
    if kind != "VOLUME_ABSORPTION":
        scattering = [weight * density * c for c in color]
        found.sigma_s = [s + t for s, t in zip(found.sigma_s, scattering)]
        found.albedo_grids.add(albedo_grid)
        found.g_sigma_s += _constant(node.inputs["Anisotropy"], found) * sum(scattering)
    if kind != "VOLUME_SCATTER":
        found.sigma_a = [s + weight * density * a for s, a in zip(found.sigma_a, absorbing)]


def mediumOf(material, warn):
    """Medium of a material, per world unit and unit of the grid. Raises BakeError where it is not understood."""
    if material is None or not material.use_nodes:
        raise BakeError("the volume has no material with nodes: add Principled Volume, or set the medium in the panel")
    found = _Found(material.name)
    output = material.node_tree.get_output_node("CYCLES")
    if output is None or not output.inputs["Volume"].is_linked:
        found.refuse("nothing is linked to its Volume output")
    _add(_source(output.inputs["Volume"])[0], 1.0, found, warn)
    if not found.grid:
        found.refuse("no Principled Volume, Volume Scatter or Volume Absorption in it")
    if len(found.albedo_grids) > 1:
        found.refuse("one part's colour comes from a grid and another's does not: use the same for all")
    scattering = sum(found.sigma_s)
    g = found.g_sigma_s / scattering if scattering > 0 else 0.0
    return _medium(found.grid, found.sigma_s, found.sigma_a, min(max(g, -0.99), 0.99),
                   next(iter(found.albedo_grids), None))


def _medium(density, sigma_s, sigma_a, g, albedo_grid):
    medium = {"density": density, "sigma_s": sigma_s, "sigma_a": sigma_a, "g": g}
    return {**medium, "albedo_grid": albedo_grid} if albedo_grid else medium


def panelMedium(settings):
    return _medium("density", [settings.density * a for a in settings.albedo],
                   [settings.density * (1 - a) for a in settings.albedo], settings.anisotropy, settings.albedo_grid)
