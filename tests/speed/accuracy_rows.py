"""The rows of accuracy.py: volumes, media, lights, and the files they need."""
import json
import os

VOLUMES = {
    "cloud": "cloud --voxels 40000",
    "shell": "shell --voxels 30000",
    "layers": "layers --voxels 30000",
    "sphere": "sphere --voxels 30000",
    "blobs": "blobs --voxels 30000",
}

# The mean column of the cloud has 4.31 optical depths for sigma_t 1.
WISPY, THICK = "--sigma-t 1.86", "--sigma-t 18.6"  # 8 and 80
DOWN, OBLIQUE, SKY = "--sun 0,0,-1", "--sun 1,0.5,-1", "--env 1"
BESIDE, ABOVE, WITHIN = "--scene @lamp_beside.json", "--scene @lamp_above.json", "--scene @lamp_within.json"
GROUND, PLATE = "--occluder @ground.obj --occluder-albedo 0.5", "--occluder @plate.obj"


def row(name, kind, volume, albedo, g, *rest, voxel_depth=None):
    """`@` stands for the cache folder; voxel_depth: of the densest voxel, sets --sigma-t."""
    scene = " ".join((f"--albedo {albedo} --g {g}",) + rest)
    return {"name": name, "kind": kind, "volume": volume, "scene": scene, "voxel_depth": voxel_depth}


ROWS = [
    row("wispy 1/0 sun", "wispy", "cloud", 1, 0, WISPY, DOWN),
    row("wispy 1/.85 sun", "wispy", "cloud", 1, 0.85, WISPY, DOWN),
    row("wispy .9/.85 sun", "wispy", "cloud", 0.9, 0.85, WISPY, DOWN),
    row("wispy .99/.5 oblique", "wispy", "cloud", 0.99, 0.5, WISPY, OBLIQUE),
    row("wispy 1/0 sky", "wispy", "cloud", 1, 0, WISPY, SKY),
    row("wispy .9/.5 sky", "wispy", "cloud", 0.9, 0.5, WISPY, SKY),
    row("wispy 1/.5 lamp above", "wispy", "cloud", 1, 0.5, WISPY, ABOVE),
    row("wispy 1/.85 sun ground", "wispy", "cloud", 1, 0.85, WISPY, DOWN, GROUND),
    row("wispy 1/.5 sky plate", "wispy", "cloud", 1, 0.5, WISPY, SKY, PLATE),
    row("thick 1/0 sun", "thick", "cloud", 1, 0, THICK, DOWN),
    row("thick .99/.85 sun", "thick", "cloud", 0.99, 0.85, THICK, DOWN),
    row("thick .9/0 sun", "thick", "cloud", 0.9, 0, THICK, DOWN),
    row("thick 1/.85 oblique", "thick", "cloud", 1, 0.85, THICK, OBLIQUE),
    row("thick .99/.5 sky", "thick", "cloud", 0.99, 0.5, THICK, SKY),
    row("thick .99/0 lamp beside", "thick", "cloud", 0.99, 0, THICK, BESIDE),
    row("thick .99/.5 oblique ground", "thick", "cloud", 0.99, 0.5, THICK, OBLIQUE, GROUND),
    row("shell 1/0 lamp within", "wispy", "shell", 1, 0, "--sigma-t 1", WITHIN),
    row("shell .9/.85 lamp within", "wispy", "shell", 0.9, 0.85, "--sigma-t 4", WITHIN),
    row("layers 1/0 sun", "wispy", "layers", 1, 0, "--sigma-t 1", DOWN),
    row("layers .99/.85 oblique", "wispy", "layers", 0.99, 0.85, "--sigma-t 4", OBLIQUE),
    row("sphere .9/0 glow", "wispy", "sphere", 0.9, 0, "--sigma-t 1", "--emission density"),
    row("sphere .9/.85 glow", "thick", "sphere", 0.9, 0.85, "--sigma-t 4", "--emission density"),
    row("blobs .99/.5 sun", "wispy", "blobs", 0.99, 0.5, "--sigma-t 1", DOWN),
    row("blobs 1/.85 oblique sky", "wispy", "blobs", 1, 0.85, "--sigma-t 0.6", OBLIQUE, SKY),
    row("sphere .99/0 sun", "thick", "sphere", 0.99, 0, DOWN, voxel_depth=1),
    row("sphere .99/0 sun", "thick", "sphere", 0.99, 0, DOWN, voxel_depth=2),
    row("sphere .99/0 sun", "thick", "sphere", 0.99, 0, DOWN, voxel_depth=10),
    row("cloud 1/.85 oblique", "thick", "cloud", 1, 0.85, OBLIQUE, voxel_depth=2),
    row("cloud 1/0 sun", "thick", "cloud", 1, 0, DOWN, voxel_depth=2),
    row("shell .99/.5 lamp within", "thick", "shell", 0.99, 0.5, WITHIN, voxel_depth=2),
    row("shell .99/.5 lamp within", "thick", "shell", 0.99, 0.5, WITHIN, voxel_depth=10),
]


def writeMeshes(folder):
    """The surfaces and lamps that the rows name, in world units; the cloud is 11 wide, 5 high and stands on 0."""
    quads = {"ground.obj": ((-30, -30, -0.7), (30, -30, -0.7), (30, 30, -0.7), (-30, 30, -0.7)),
             "plate.obj": ((5.3, -6, -1), (5.3, 6, -1), (5.3, 6, 6), (5.3, -6, 6))}
    for name, corners in quads.items():
        with open(os.path.join(folder, name), "w") as file:
            for corner in corners:
                file.write("v %g %g %g\n" % corner)
            file.write("f 1 2 3 4\n")
    lamps = {"lamp_beside.json": [-7.5, 1, 2], "lamp_above.json": [1, 0.5, 6.5], "lamp_within.json": [0, 0, 1]}
    for name, position in lamps.items():
        with open(os.path.join(folder, name), "w") as file:
            json.dump({"lights": [{"type": "point", "position": position, "intensity": 100}]}, file)
