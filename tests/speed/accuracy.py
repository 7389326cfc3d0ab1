#!/usr/bin/env python3
"""How far `bake` is from Monte Carlo, over a range of volumes, media and lights.

    python3 tests/speed/accuracy.py --program build/vdb_diffuse --cache /tmp/accuracy

Every row is a volume of `make`, a medium and a light (accuracy_rows.py). Two references R, S of different seeds
are made once and kept in the cache; then it is baked with 0, 1, 2 and 4 sweeps. The error of a bake A is

    sqrt( <A - R, A - S> / <R, R> ),    <A - R, A - S> = ( |A - R|^2 + |A - S|^2 - |R - S|^2 ) / 2,

of `diffuse` on cells of 4^3 voxels, weighted with the density. The noises of R and S are independent and drop
out, whatever the path of a walker does to neighbouring voxels alike; |R - S| / 2, the noise of their mean,
stands beside the errors. The table goes to table.txt and, with a line for each bake, to table.csv in the cache.

Not a test: seconds and errors are for reading. Errors that miss their goal are marked with `!`.
"""
import argparse
import csv
import hashlib
import json
import math
import os
import shlex
import subprocess
import sys
import time

from accuracy_rows import ROWS, VOLUMES, writeMeshes

BLOCK = 4  # voxels; cells of fewer are noise, of more hide what the light does at an edge
# At each number of sweeps: the most relative RMS in thick and in wispy media, from two sweeps on for voxels of up
# to two optical depths. Anywhere, sweeps may add a hundredth to what diffusion alone has, and no more.
GOALS = {0: {"thick": 0.10, "wispy": 0.20}, 1: {"thick": 0.08, "wispy": 0.08}, 4: {"thick": 0.03, "wispy": 0.03}}
THIN_ENOUGH = 2.05
SLACK = 0.01


def run(command, must_succeed=True):
    done = subprocess.run(command, capture_output=True, text=True)
    if must_succeed and done.returncode not in (0, 4):  # 4: not converged, and said so in the statistics
        sys.exit(f"{shlex.join(command)}: {done.stderr.strip()}")
    return done.stdout


def load(path):
    with open(path) as file:
        return json.load(file)


class Row:
    """One volume under one light, with the files that belong to it."""

    def __init__(self, row, options):
        self.name, self.kind, self.voxel_depth = row["name"], row["kind"], row.get("voxel_depth")
        self.options = options
        self.volume = os.path.join(options.cache, row["volume"] + ".vdb")
        self.shape = [options.reference_program, "make"] + VOLUMES[row["volume"]].split() + ["-o", self.volume]
        self.light = row["scene"].replace("@", options.cache + "/").split()
        if not os.path.exists(self.volume):
            run(self.shape)
        if self.voxel_depth is None:  # of the densest voxel
            self.voxel_depth = self.densestVoxel() * self.extinction()
        else:
            self.light += ["--sigma-t", f"{self.voxel_depth / self.densestVoxel():.6g}"]
        told = " ".join(self.shape[1:] + self.light).replace(options.cache, "") + f" {options.noise}"
        key = f"{self.name} {self.voxel_depth:.3g} {hashlib.sha1(told.encode()).hexdigest()[:8]}"
        key = key.replace(" ", "_").replace("/", "_")
        self.references = [os.path.join(options.cache, f"{key}.{seed}.vdb") for seed in (1, 2)]

    def densestVoxel(self):
        for line in run([self.options.reference_program, "info", self.volume]).splitlines():
            if "in the densest voxel" in line:
                return float(line.split("sigma_t 1:")[1].split()[0])
        sys.exit(f"{self.volume}: info does not tell the densest voxel's optical depth")

    def extinction(self):
        return float(self.light[self.light.index("--sigma-t") + 1])

    def referenceCommand(self, n):
        return [self.options.reference_program, "reference", self.volume, "-o", self.references[n], "--quiet",
                "--seed", str(n + 1), "--noise", str(self.options.noise), "--seconds", str(self.options.seconds),
                "--grids", "diffuse", "--stats", self.references[n] + ".json"] + self.light

    def bakeCommand(self, sweeps):
        return [self.options.program, "bake", self.volume, "-o", self.options.lit, "--quiet", "--sweeps",
                str(sweeps), "--stats", self.options.lit + ".json"] + self.light + self.options.bake

    def compareCommand(self, a, b):
        return [self.options.reference_program, "compare", a, b, "--weight", self.volume + ":density", "--block",
                str(BLOCK), "--json"]

    def compare(self, a, b):
        norms = json.loads(run(self.compareCommand(a, b)))
        return {key: float("inf") if value is None else value for key, value in norms.items()}

    def makeReferences(self):
        for n, path in enumerate(self.references):
            if not os.path.exists(path):
                run(self.referenceCommand(n))
        self.reference_seconds = sum(load(path + ".json")["seconds"]["total"] for path in self.references)
        self.apart = self.compare(*self.references)["rel_rms"]

    def bake(self, sweeps):
        run(self.bakeCommand(sweeps))
        stats = load(self.options.lit + ".json")
        norms = [self.compare(self.options.lit, path) for path in self.references]
        square = (norms[0]["rel_rms"] ** 2 + norms[1]["rel_rms"] ** 2 - self.apart ** 2) / 2
        seconds = stats["seconds"]
        return {"row": self.name, "kind": self.kind, "voxel_depth": round(self.voxel_depth, 3), "sweeps": sweeps,
                "rms": math.sqrt(max(0.0, square)), "bias": (norms[0]["bias"] + norms[1]["bias"]) / 2,
                "p99": min(norms[0]["p99"], norms[1]["p99"]), "noise": self.apart / 2,
                "seconds": seconds["total"] - seconds["read"] - seconds["write"],
                "iterations": stats["iterations"], "closure": stats["energy"]["closure"],
                "negative_voxels": stats["negative_voxels"], "converged": stats["converged"],
                "estimated_error": stats["estimated_error"],
                "reference_seconds": self.reference_seconds,
                "command": shlex.join(self.bakeCommand(sweeps))}


def missesGoal(bake, without_sweeps):
    goal = GOALS.get(bake["sweeps"], {}).get(bake["kind"], math.inf)
    if bake["sweeps"] > 1 and bake["voxel_depth"] > THIN_ENOUGH:
        goal = math.inf
    return not bake["rms"] <= min(goal, without_sweeps["rms"] + SLACK)


def percent(value):
    return f"{100 * value:5.1f}"


def heading(sweeps):
    return (f"{'row':32} {'kind':5} {'depth':>6} {'noise':>5} |"
            + "".join(f" {'K=' + str(k) + ' rms':>8} {'bias':>5}" for k in sweeps)
            + " | " + " ".join(f"{'s K=' + str(k):>6}" for k in sweeps)
            + " | iterations, worst closure, most negative voxels")


def line(bakes):
    first = bakes[0]
    text = f"{first['row']:32} {first['kind']:5} {first['voxel_depth']:6.2f} {percent(first['noise'])} |"
    for bake in bakes:
        text += f"   {percent(bake['rms'])}{'!' if missesGoal(bake, first) else ' '}{percent(bake['bias'])}"
    text += " | " + " ".join(f"{bake['seconds']:6.2f}" for bake in bakes)
    text += " | " + ",".join(str(bake["iterations"]) + ("" if bake["converged"] else "*") for bake in bakes)
    return text + (f" {max(abs(bake['closure']) for bake in bakes):.0e}"
                   f" {max(bake['negative_voxels'] for bake in bakes)}")


def parseOptions():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/vdb_diffuse", help="the vdb_diffuse that bakes")
    parser.add_argument("--reference-program", help="the one that makes volumes and references (--program)")
    parser.add_argument("--cache", default="accuracy_out", help="folder for volumes, references and table.csv")
    parser.add_argument("--rows", default="", help="only rows whose name contains this")
    parser.add_argument("--sweeps", default="0,1,2,4", help="numbers of sweeps, comma-separated")
    parser.add_argument("--noise", type=float, default=0.05, help="of a reference, per voxel")
    parser.add_argument("--seconds", type=float, default=120, help="after which a reference ends anyway")
    parser.add_argument("--bake", default="", type=shlex.split, help="further options of every bake")
    parser.add_argument("--references-only", action="store_true", help="fill the cache, bake nothing")
    parser.add_argument("--print-commands", action="store_true", help="print what would be run, and run nothing")
    options = parser.parse_args()
    options.reference_program = options.reference_program or options.program
    options.cache = os.path.abspath(options.cache)
    options.lit = os.path.join(options.cache, "lit.vdb")
    options.sweeps = [int(k) for k in options.sweeps.split(",")]
    return options


def main():
    options = parseOptions()
    os.makedirs(options.cache, exist_ok=True)
    writeMeshes(options.cache)
    rows = [Row(row, options) for row in ROWS if options.rows in row["name"]]
    if options.print_commands:
        for row in rows:
            commands = [row.shape, row.referenceCommand(0), row.referenceCommand(1),
                        *(row.bakeCommand(sweeps) for sweeps in options.sweeps),
                        *(row.compareCommand(options.lit, path) for path in row.references),
                        row.compareCommand(*row.references)]
            print(f"# {row.name}", *map(shlex.join, commands), sep="\n")
        return
    start = time.monotonic()
    bakes = []
    table = open(os.path.join(options.cache, "table.txt"), "w")

    def tell(text):
        print(text, flush=True)
        print(text, file=table, flush=True)

    tell(heading(options.sweeps))
    for row in rows:
        row.makeReferences()
        if options.references_only:
            continue
        of_row = [row.bake(sweeps) for sweeps in options.sweeps]
        tell(line(of_row))
        bakes += of_row
        with open(os.path.join(options.cache, "table.csv"), "w", newline="") as file:
            writer = csv.DictWriter(file, fieldnames=list(bakes[0]))
            writer.writeheader()
            writer.writerows(bakes)
    tell(f"{len(rows)} rows in {time.monotonic() - start:.0f} s; errors, biases and noise in %, depth: optical, of "
          "the densest voxel; !: misses its goal; *: not converged")


if __name__ == "__main__":
    main()
