#!/usr/bin/env python3
"""Bakes random volumes of random media under random lights and holds each result to what must always hold:
status 0, every number finite, no light below zero, energy balanced, no file left behind.

    soak.py PROGRAM [--runs N] [--seed S] [--seconds T]

Every run is made from its seed alone: --runs 1 --seed S repeats run S. Ends after N runs or T seconds.
"""
import argparse
import json
import math
import os
import random
import re
import resource
import shlex
import signal
import subprocess
import sys
import tempfile
import time

SHAPES = ["cloud", "sphere", "box", "shell", "layers", "checkerboard", "sheet", "blobs"]
TOLERANCE = 1e-4


def log_uniform(chance, low, high):
    return math.exp(chance.uniform(math.log(low), math.log(high)))


def number(value):
    return "%.6g" % value


def grey_or_rgb(chance, low, high):
    if chance.random() < 0.7:
        return number(log_uniform(chance, low, high))
    return ",".join(number(log_uniform(chance, low, high)) for _ in range(3))


def direction(chance):
    return [chance.gauss(0, 1) for _ in range(3)]


def volume(chance, path):
    shape = chance.choice(SHAPES)
    words = ["make", shape, "-o", path, "--voxels", str(int(log_uniform(chance, 1, 20000))),
             "--seed", str(chance.randrange(1000))]
    size = 1.0
    if chance.random() < 0.5:  # of a voxel, in the place of a shape some ten units wide
        size = log_uniform(chance, 1e-4, 1e6)
        words += ["--voxel-size", number(size)]
    return words, size


def light(chance, folder, size):
    """Words of the light; a scene file where there is more than a sun and a sky."""
    words = []
    kinds = chance.sample(["sun", "env", "scene"], chance.choice([1, 1, 2]))
    if "sun" in kinds:
        words += ["--sun=" + ",".join(map(number, direction(chance))),
                  "--sun-irradiance", grey_or_rgb(chance, 1e-6, 1e6)]
    if "env" in kinds:
        words += ["--env", grey_or_rgb(chance, 1e-6, 1e6)]
    if "scene" in kinds:
        place = [chance.uniform(-12, 12) for _ in range(3)]
        lights = [{"type": "point", "position": place, "intensity": log_uniform(chance, 1e-3, 1e3),
                   "radius": chance.choice([0, 0.5])},
                  {"type": "spot", "position": place, "direction": direction(chance), "angle": chance.uniform(5, 170)},
                  {"type": "sun", "direction": direction(chance), "angle": chance.uniform(0, 20)},
                  {"type": "area", "mesh": "plate.obj", "radiance": log_uniform(chance, 1e-3, 1e3)}]
        scene = {"lights": chance.sample(lights, chance.choice([1, 2]))}
        if chance.random() < 0.5:
            scene["surfaces"] = [{"mesh": "plate.obj", "albedo": chance.choice([0, 0.5, 1])}]
        with open(os.path.join(folder, "plate.obj"), "w") as file:
            corners = [[chance.uniform(-9, 9) for _ in range(3)] for _ in range(3)]
            file.write("".join("v %g %g %g\n" % tuple(corner) for corner in corners) + "f 1 2 3\n")
        path = os.path.join(folder, "scene.json")
        with open(path, "w") as file:
            json.dump(scene, file)
        words += ["--scene", path]
    return words


def medium(chance, size):
    """Optics that make a voxel of density 1 from a thousandth of an optical depth to thirty deep."""
    per_length = log_uniform(chance, 1e-3, 30) / size if size != 1 else log_uniform(chance, 1e-3, 30)
    words = ["--sigma-s", number(per_length)]
    if chance.random() < 0.3:
        words[1] = ",".join(number(per_length * chance.uniform(0.2, 1)) for _ in range(3))
    if chance.random() < 0.7:
        words += ["--sigma-a", number(per_length * log_uniform(chance, 1e-6, 10))]
    if chance.random() < 0.6:
        words += ["--g=" + number(chance.uniform(-0.95, 0.95))]
    return words


def method(chance):
    words = chance.choice([[], [], ["--sweeps", "0"], ["--sweeps", "1"], ["--sweeps", "5"], ["--model", "p1"],
                           ["--method", "blobs", "--blobs", "40"], ["--exact-shadows", "--sweeps", "0"]])
    if chance.random() < 0.3:
        words = words + ["--grids", "density,diffuse,direct,flux,source"]
    if chance.random() < 0.2:
        words = words + ["--half"]
    return words + ["--threads", str(chance.choice([1, 2, 5]))]


def finite(value):
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def faults_of(program, folder, status, error):
    if status == -signal.SIGKILL:
        return ["took more than a minute of the processor's time"]
    if status != 0:
        return ["status %d: %s" % (status, error.strip()[:200])]
    faults = []
    with open(os.path.join(folder, "stats.json")) as file:
        stats = json.load(file)
    if not finite(stats) or any(value is None for value in stats["energy"].values()):
        faults.append("a number of the statistics is not finite")
    elif abs(stats["energy"]["closure"]) > 10 * TOLERANCE:
        faults.append("energy closes to %g" % stats["energy"]["closure"])
    if not stats["converged"]:
        faults.append("not converged")
    info = subprocess.run([program, "info", os.path.join(folder, "out.vdb")], stdout=subprocess.PIPE).stdout.decode()
    grids = re.split(r"^grid ", info, flags=re.MULTILINE)[1:]
    for grid in grids:
        name = grid.split(":")[0]
        bad = re.search(r"(\d+) negative, (\d+) not finite", grid)
        if bad and (int(bad.group(2)) or (int(bad.group(1)) and name != "flux")):
            faults.append("grid %s: %s" % (name, bad.group(0)))
    if not {"diffuse", "direct"} <= {grid.split(":")[0] for grid in grids}:
        faults.append("grids are missing: " + info[:100])
    left = set(os.listdir(folder)) - {"in.vdb", "out.vdb", "stats.json", "scene.json", "plate.obj"}
    if left:
        faults.append("left behind: " + " ".join(left))
    return faults


def soak(program, seed):
    """Makes one run; its command and what was wrong."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory(prefix="vdb_diffuse_soak_") as folder:
        make, size = volume(chance, os.path.join(folder, "in.vdb"))
        subprocess.run([program] + make, check=True, stdout=subprocess.DEVNULL)
        words = [program, "bake", os.path.join(folder, "in.vdb"), "-o", os.path.join(folder, "out.vdb"), "--stats",
                 os.path.join(folder, "stats.json"), *light(chance, folder, size), *medium(chance, size),
                 *method(chance)]
        try:
            done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=1800,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (60, 60)))
            faults = faults_of(program, folder, done.returncode, done.stderr.decode(errors="replace"))
        except subprocess.TimeoutExpired:
            faults = ["took longer than half an hour"]
        shown = [shlex.join(part).replace(folder + "/", "") for part in (make, words[1:])]
        return " && ".join(shown), faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=600)
    arguments = parser.parse_args()
    start = time.time()
    runs = failed = 0
    while runs < arguments.runs and (time.time() - start < arguments.seconds or runs == 0):
        command, faults = soak(os.path.abspath(arguments.program), arguments.seed + runs)
        if faults:
            failed += 1
            print("seed %d: %s\n  %s" % (arguments.seed + runs, "; ".join(faults), command))
            sys.stdout.flush()
        runs += 1
    print("%d runs with seeds from %d in %.0f s, %d failed" % (runs, arguments.seed, time.time() - start, failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
