"""The add-on in a real Blender, without a window:

    blender -b --factory-startup --python-exit-code 1 -P tests/blender/addon_test.py [-- NAME ...]

with BLENDER_USER_SCRIPTS set to an empty folder. Cycles' own path tracing, all bounces, is the referee.
"""

import json
import os
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bpy
import numpy as np
import stage
from mathutils import Matrix, Vector

SUN = Vector((0.5, 0.3, -0.8))
CUMULUS_VOXEL = 0.0826367
TURNED = Matrix.Translation((3, -2, 5)) @ Matrix.Rotation(0.7, 4, (1, 0.5, -0.3)) @ Matrix.Scale(2.0, 4)


def near(name, value, expected, tolerance):
    off = value / expected - 1
    print(f"    {name}: {value:.5g}, expected {expected:.5g}: {100 * off:+.2f} %")
    assert abs(off) < tolerance, f"{name} is {100 * off:.2f} % off, more than {100 * tolerance:g} %"


def refused(words, call):
    """The operator reports an error that has these words."""
    try:
        call()
    except RuntimeError as error:
        assert words in str(error), f"'{words}' is not in: {error}"
    else:
        raise AssertionError(f"no error, but expected one with '{words}'")


def cloud(samples=16, light=True, matrix=Matrix(), path=None, **medium):
    scene = stage.emptyScene(samples)
    item = stage.addVolume(path or stage.data("cumulus.vdb"), matrix=matrix, **medium)
    if light:
        stage.addLamp("SUN", 3, direction=matrix.to_3x3() @ SUN)
    return scene, item, stage.addCamera(matrix)


def tracedPicture(scene, samples):
    """Full multiple scattering by Cycles, of what is there now."""
    before = scene.cycles.samples, scene.cycles.volume_bounces, scene.cycles.max_bounces
    scene.cycles.samples, scene.cycles.volume_bounces, scene.cycles.max_bounces = samples, 128, 128
    picture = stage.cyclesPicture("traced")
    scene.cycles.samples, scene.cycles.volume_bounces, scene.cycles.max_bounces = before
    return picture


def testMaterialShowsWhatRenderShows():
    """The same light by two programs. Cycles 3.4 draws a grid half a voxel too far along x, y and z."""
    _, item, start = cloud(samples=64, color=(0.95, 0.9, 0.8), matrix=TURNED)
    stage.addWorld((0.1, 0.2, 0.3))
    lit = stage.bake(item)
    shift = Vector((1, 1, 1)) * -CUMULUS_VOXEL / 2
    own = stage.ownPicture(lit, start, "--samples", "4", shift=shift)
    mean, rms = stage.difference(stage.cyclesPicture(), own)
    print(f"    mean {100 * mean:+.2f} %, RMS over pixels {100 * rms:.1f} %")
    assert abs(mean) < 0.02 and rms < 0.1


def testSunDirectionAndStrengthMatchCycles():
    scene, item, _ = cloud(matrix=TURNED)
    item.data.render.space = "WORLD"  # densities per world unit
    traced = tracedPicture(scene, 32)
    stage.bake(item)
    near("sun", stage.cyclesPicture().mean(), traced.mean(), 0.03)


def testLampsMatchCycles():
    """On a small cloud, since a bake marches from every voxel to every point of a lamp."""
    small = os.path.join(stage.FOLDER, "small.vdb")
    make = [stage.PROGRAM, "make", "cloud", "-o", small, "--voxels", "30000", "--seed", "3"]
    subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
    at, toward = TURNED @ Vector((-12, -16, 8)), TURNED.to_3x3() @ Vector((12, 16, -8))
    lamps = {
        "point": lambda: stage.addLamp("POINT", 20000, at, shadow_soft_size=0.1),
        "spot": lambda: stage.addLamp("SPOT", 20000, at, toward, shadow_soft_size=0.1, spot_size=0.5, spot_blend=0.5),
        "rectangle": lambda: stage.addLamp("AREA", 20000, at, toward, shape="RECTANGLE", size=3, size_y=1),
        "disk": lambda: stage.addLamp("AREA", 20000, at, toward, shape="DISK", size=3),
        "wide sun": lambda: stage.addLamp("SUN", 3, direction=toward, angle=0.8),
        "world": lambda: stage.addWorld((0.5, 0.5, 0.5)),
    }
    for name, add in lamps.items():
        scene, item, _ = cloud(light=False, matrix=TURNED, path=small)
        add()
        traced = tracedPicture(scene, 32)
        stage.bake(item)
        near(name, stage.cyclesPicture().mean(), traced.mean(), 0.04)


def testWorldImageKeepsItsDirections():
    """A sky that is bright at -x and black at +x, around a volume that is turned."""
    scene, item, _ = cloud(light=False, matrix=TURNED)
    tree = stage.addWorld((0, 0, 0)).node_tree
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    ramp = tree.nodes.new("ShaderNodeVectorMath")
    ramp.operation, ramp.inputs[1].default_value = "DOT_PRODUCT", (-1, 0, 0)
    positive = tree.nodes.new("ShaderNodeMath")
    positive.operation, positive.inputs[1].default_value = "MAXIMUM", 0.0
    tree.links.new(coordinates.outputs["Generated"], ramp.inputs[0])
    tree.links.new(ramp.outputs["Value"], positive.inputs[0])
    tree.links.new(positive.outputs[0], tree.nodes["Background"].inputs["Strength"])
    tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    traced = tracedPicture(scene, 32)
    stage.bake(item)
    picture = stage.cyclesPicture()
    near("mean", picture.mean(), traced.mean(), 0.03)
    half = stage.SIZE // 2
    near("left half", picture[:, :half].mean(), traced[:, :half].mean(), 0.03)
    near("right half", picture[:, half:].mean(), traced[:, half:].mean(), 0.03)


def testOccludersHideAndReflect():
    """A white floor and a plate in the sun's way. The floor is not seen, but lights the cloud."""
    def addPlane(name, size, place, base):
        bpy.ops.mesh.primitive_plane_add(size=size, location=place)
        plane = bpy.context.object
        plane.name, plane.visible_camera = name, False
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
        diffuse.inputs["Color"].default_value = (base, base, base, 1)
        material.node_tree.links.new(diffuse.outputs[0], output.inputs[0])
        plane.data.materials.append(material)
        occluders.objects.link(plane)

    scene, item, _ = cloud()
    occluders = bpy.data.collections.new("occluders")
    scene.collection.children.link(occluders)
    addPlane("floor", 40, (0, 0, -1.5), 0.7)
    addPlane("plate", 4, (-1, 0, 6), 0.0)
    bpy.context.view_layer.objects.active = item
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 128
    traced = tracedPicture(scene, 32)
    stage.bake(item, occluders=occluders, sweeps=4)
    near("with floor and plate", stage.cyclesPicture().mean(), traced.mean(), 0.05)


def testHybridMatchesCycles():
    for g, tolerance in ((0.0, 0.02), (0.6, 0.07)):
        scene, item, _ = cloud(samples=32, g=g)
        traced = tracedPicture(scene, 64)
        stage.bake(item, material_kind="HYBRID")
        near(f"g {g}", stage.cyclesPicture().mean(), traced.mean(), tolerance)


def testHybridScattersOnceWhateverTheBounces():
    scene, item, _ = cloud(samples=32)
    stage.bake(item, material_kind="HYBRID")
    once = stage.cyclesPicture().mean()
    scene.cycles.volume_bounces = 64
    near("64 bounces", stage.cyclesPicture().mean(), once, 0.02)


def paintedCloud():
    """Cumulus with a colour grid `direct_paint`: the orange light of a sun, .8, .5 and .2 where nothing shades it."""
    path = os.path.join(stage.FOLDER, "painted.vdb")
    lamp = {"type": "sun", "group": "paint", "irradiance": [10, 6, 3], "direction": [1, 0, -1]}
    scene = {"medium": {"sigma_s": 0.15, "sigma_a": 0.0}, "lights": [lamp]}
    with open(path + ".json", "w", encoding="utf-8") as file:
        json.dump(scene, file)
    subprocess.run([stage.PROGRAM, "bake", stage.data("cumulus.vdb"), "-o", path, "--scene", path + ".json",
                    "--light-groups", "--grids", "density,direct", "--quiet"], check=True)
    return path


def testAlbedoGrid():
    """A colour that a grid gives, by node and by name, in both materials; and the same set in the panel."""
    for by_name, kind, tolerance in ((False, "BAKED", 0.03), (True, "HYBRID", 0.03)):
        scene, item, _ = cloud(path=paintedCloud(), samples=32)
        tree = item.material_slots[0].material.node_tree
        principled = tree.nodes["Principled Volume"]
        if by_name:
            principled.inputs["Color Attribute"].default_value = "direct_paint"
        else:
            attribute = tree.nodes.new("ShaderNodeAttribute")
            attribute.attribute_name = "direct_paint"
            tree.links.new(attribute.outputs["Color"], principled.inputs["Color"])
        traced = tracedPicture(scene, 32)
        stage.bake(item, material_kind=kind)
        picture = stage.cyclesPicture()
        for channel, name in enumerate(("red", "green", "blue")):
            near(f"{kind} {name}", picture[:, :, channel].mean(), traced[:, :, channel].mean(), tolerance)
    stage.bake(item, medium_from="PANEL", material_kind="HYBRID", albedo_grid="direct_paint")
    near("by the panel", stage.cyclesPicture().mean(), picture.mean(), 1e-3)
    stage.bake(item, medium_from="MATERIAL")
    principled.inputs["Absorption Color"].default_value = (1, 0, 0, 1)
    refused("has to be black", bpy.ops.vdb_diffuse.bake)


def testSecondBakeStartsFromTheSource():
    _, item, _ = cloud()
    source, material = item.data.filepath, item.material_slots[0].material
    lit = stage.bake(item)
    first = stage.cyclesPicture().mean()
    assert os.path.basename(lit) == "cumulus_lit.vdb", lit
    bpy.data.lights[0].energy *= 2
    assert stage.bake(item) == lit
    near("twice the sun", stage.cyclesPicture().mean(), 2 * first, 1e-3)
    assert item.data.vdb_diffuse.source == source
    bpy.ops.vdb_diffuse.restore()
    assert item.data.filepath == source and item.material_slots[0].material == material
    assert abs(item.data.render.clipping - 0.001) < 1e-6


def testTwoVolumesOfOneFileKeepTheirLight():
    """One in the sun's light, one in none: the second bake must not write over the first."""
    _, first, _ = cloud()
    lit = stage.bake(first)
    bpy.data.lights.remove(bpy.data.lights[0])
    second = stage.addVolume(stage.data("cumulus.vdb"))
    assert stage.bake(second) != lit and first.data.filepath == lit
    assert stage.bake(second) == second.data.filepath != lit
    first.hide_render, second.hide_render = False, True
    assert stage.cyclesPicture().mean() > 0


def testMediumOfOtherNodes():
    """Volume Scatter and Absorption, their density an Attribute times a number, are the Principled Volume's like."""
    from vdb_diffuse.medium import mediumOf
    stage.emptyScene(1)
    material = bpy.data.materials.new("parts")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "soot"
    times = tree.nodes.new("ShaderNodeMath")
    times.operation, times.inputs[1].default_value = "MULTIPLY", 3.0
    tree.links.new(attribute.outputs["Fac"], times.inputs[0])
    both = tree.nodes.new("ShaderNodeAddShader")
    for i, (kind, color) in enumerate((("Scatter", 0.5), ("Absorption", 0.9))):
        node = tree.nodes.new("ShaderNodeVolume" + kind)
        node.inputs["Color"].default_value = (color, color, color, 1)
        tree.links.new(times.outputs[0], node.inputs["Density"])
        tree.links.new(node.outputs[0], both.inputs[i])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(both.outputs[0], output.inputs["Volume"])
    medium = mediumOf(material, print)
    assert medium["density"] == "soot", medium
    assert np.allclose(medium["sigma_s"], 1.5) and np.allclose(medium["sigma_a"], 0.3), medium


def testMediaOfMixedColourAreRefused():
    """Only what the bake can do is taken: one grid for all colours, and no colour of absorption beside it."""
    from vdb_diffuse.errors import BakeError
    from vdb_diffuse.medium import mediumOf
    stage.emptyScene(1)

    def told(colour_grids, absorption=0.0):
        material = bpy.data.materials.new("mixed")
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        both = tree.nodes.new("ShaderNodeAddShader")
        for i, grid in enumerate(colour_grids):
            node = tree.nodes.new("ShaderNodeVolumePrincipled")
            node.inputs["Density Attribute"].default_value = "density"
            node.inputs["Color Attribute"].default_value = grid
            node.inputs["Absorption Color"].default_value = (absorption, absorption, absorption, 1)
            tree.links.new(node.outputs[0], both.inputs[i])
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(both.outputs[0], output.inputs["Volume"])
        try:
            return mediumOf(material, print)
        except BakeError as error:
            return str(error)

    assert told(("Cd", "Cd"))["albedo_grid"] == "Cd"
    assert "one part's colour comes from a grid" in told(("Cd", ""))
    assert "one part's colour comes from a grid" in told(("Cd", "soot"))
    assert "has to be black" in told(("Cd", "Cd"), absorption=0.2)


def testSequence():
    """Files 1 and 3 of 1 to 3: the gap is told, the others are baked, and Blender shows the right one."""
    folder = os.path.join(stage.FOLDER, "sequence")
    os.makedirs(folder)
    shutil.copy(stage.data("blobs.vdb"), os.path.join(folder, "smoke_0001.vdb"))
    shutil.copy(stage.data("shell.vdb"), os.path.join(folder, "smoke_0003.vdb"))
    scene = stage.emptyScene(4)
    item = stage.addVolume(os.path.join(folder, "smoke_0001.vdb"))
    volume = item.data
    volume.is_sequence, volume.frame_start, volume.frame_duration = True, 11, 3
    sun = stage.addLamp("SUN", 1, direction=SUN)
    for frame, energy in ((11, 1.0), (13, 4.0)):
        sun.data.energy = energy
        sun.data.keyframe_insert("energy", frame=frame)
    start = stage.addCamera()
    scene.frame_set(11)
    stage.bake(item, animated_lights=True)
    scene.frame_set(13)
    names = sorted(name for name in os.listdir(stage.FOLDER) if name.startswith("smoke"))
    assert names == ["smoke_lit_0001.vdb", "smoke_lit_0003.vdb"], names
    own = stage.ownPicture(os.path.join(stage.FOLDER, names[1]), start)
    animated = stage.cyclesPicture().mean()
    near("frame 13", animated, own.mean(), 0.03)
    scene.frame_set(11)
    own = stage.ownPicture(os.path.join(stage.FOLDER, names[0]), start)
    near("frame 11", stage.cyclesPicture().mean(), own.mean(), 0.03)
    stage.bake(item, animated_lights=False)  # with the sun of frame 11, a quarter of that of frame 13
    scene.frame_set(13)
    near("frame 13, lights of frame 11", stage.cyclesPicture().mean(), animated / 4, 1e-3)


def testWhatIsWrongIsTold():
    _, item, _ = cloud()
    material = item.material_slots[0].material
    item.scale = (1, 1, 2)
    bpy.context.view_layer.update()
    refused("stretched or mirrored", bpy.ops.vdb_diffuse.bake)
    item.scale = (1, 1, 1)
    bpy.context.view_layer.update()

    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    density = material.node_tree.nodes["Principled Volume"].inputs["Density"]
    material.node_tree.links.new(noise.outputs["Fac"], density)
    refused("'Noise Texture' feeds a density", bpy.ops.vdb_diffuse.bake)
    material.node_tree.nodes.remove(noise)

    preferences = bpy.context.preferences.addons["vdb_diffuse"].preferences
    preferences.program = "/nowhere/vdb_diffuse"
    refused("is not a program", bpy.ops.vdb_diffuse.bake)
    preferences.program = stage.PROGRAM

    gone = os.path.join(stage.FOLDER, "gone.vdb")
    item.data.filepath = gone
    refused("gone.vdb", bpy.ops.vdb_diffuse.bake)
    assert item.data.filepath == gone and item.material_slots[0].material == material
    assert not os.path.exists(os.path.join(stage.FOLDER, "gone_lit.vdb"))


def testSwitchingOffLeavesNothing():
    bpy.ops.preferences.addon_disable(module="vdb_diffuse")
    assert not hasattr(bpy.types.Volume, "vdb_diffuse") and not hasattr(bpy.types, "VDB_DIFFUSE_PT_volume")
    bpy.ops.preferences.addon_enable(module="vdb_diffuse")
    assert hasattr(bpy.types, "VDB_DIFFUSE_PT_volume")


def main():
    asked = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    stage.installAddon()
    tests = {name: test for name, test in globals().items() if name.startswith("test")}
    failed = []
    for name in asked or tests:
        print(f"{name}")
        begin = time.time()
        try:
            tests[name]()
            print(f"    passed, {time.time() - begin:.1f} s")
        except (AssertionError, RuntimeError) as error:
            print(f"    FAILED: {error}")
            failed.append(name)
        sys.stdout.flush()
    shutil.rmtree(stage.FOLDER, ignore_errors=True)
    if failed:
        raise SystemExit(f"failed: {', '.join(failed)}")
    print(f"{len(asked or tests)} tests passed")


main()
