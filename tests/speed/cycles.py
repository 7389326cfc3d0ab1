"""Cycles' path tracing against a baked volume, at equal noise, the bake's time included:

    BLENDER_USER_SCRIPTS=$(mktemp -d) blender -b --factory-startup -noaudio -P tests/speed/cycles.py -- -o FOLDER

Every way to render is first tried at a few samples, then rendered twice, with two seeds, with as many as bring the
noise to --noise: RMS over the cloud's pixels, of its mean there. `off` is what a way is off the path tracing of 1024
bounces when all noise is taken out: with A, B the two pictures of a way and R, S those of the reference,

    sqrt( <(A - R)(B - S)> ) / <R>,         noises of different seeds do not meet.

Wall seconds are of a machine that may be shared; processor seconds are of Blender and the program alone. Leaves
table.txt and cycles.png: above, path tracing of 4, 32 and 128 bounces in the processor seconds that the first baked
way took, its bake included; below, path tracing of 1024 bounces and the two baked ways, at --noise. Not a test.
"""

import argparse
import os
import platform
import resource
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "blender"))
import bpy
import numpy as np
import stage

PILOT = 16  # samples
FEWEST = 4  # samples, for smooth edges
BOUNCES = (4, 32, 128, 1024)  # the last is the reference
HD = 1920 * 1080


class Watch:
    """Wall and processor seconds since it was made."""

    def __init__(self):
        self.wall, self.processor = time.time(), self._processor()

    @staticmethod
    def _processor():
        uses = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return sum(use.ru_utime + use.ru_stime for use in uses)

    def read(self):
        return np.array([time.time() - self.wall, self._processor() - self.processor])


class Way:
    """One way to render the cloud: a number of bounces, and how its volume was baked."""

    def __init__(self, name, bounces, kind=None):
        self.name, self.bounces, self.kind = name, bounces, kind
        self.bake_seconds = np.zeros(2)

    def prepare(self, item):
        cycles = bpy.context.scene.cycles
        cycles.volume_bounces, cycles.max_bounces = self.bounces, max(self.bounces, 1)
        if self.kind:
            watch = Watch()
            stage.bake(item, material_kind=self.kind)
            self.bake_seconds = watch.read()

    def render(self, samples):
        """Two pictures, and the seconds of one."""
        cycles = bpy.context.scene.cycles
        cycles.samples, self.samples = samples, samples
        watch, self.pictures = Watch(), []
        for seed in (1, 2):
            cycles.seed = seed
            self.pictures.append(stage.cyclesPicture("speed"))
        self.seconds = watch.read() / 2

    def noise(self, cloud):
        a, b = (picture[cloud] for picture in self.pictures)
        return float(np.sqrt(((a - b) ** 2).mean() / 2) / b.mean())

    def renderToNoise(self, cloud, noise):
        self.render(PILOT)
        cloud = cloud if cloud is not None else cloudOf(self.pictures)
        self.render(max(FEWEST, round(PILOT * (self.noise(cloud) / noise) ** 2)))

    def total(self):
        return self.bake_seconds + self.seconds


def cloudOf(pictures):
    """Where the cloud is: pixels of more than a twentieth of the brightest."""
    mean = (pictures[0] + pictures[1]).sum(axis=2)
    return mean > 0.05 * np.percentile(mean, 99.5)


def off(way, reference, cloud):
    (a, b), (r, s) = ([p[cloud] for p in pictures] for pictures in (way.pictures, reference.pictures))
    return float(np.sqrt(max(0, ((a - r) * (b - s)).mean())) / r.mean())


def table(ways, reference, cloud, pixels):
    """Processor seconds, but for one column."""
    def hd(way):
        return way.bake_seconds[1] + way.seconds[1] * HD / pixels

    lines = [f"{'':26}{'samples':>8}{'bake':>7}{'render':>8}{'total':>8}{'wall':>8}{'ratio':>7}{'in HD':>7}"
             f"{'noise':>8}{'mean':>8}{'off':>7}"]
    for way in ways:
        mean = np.mean(np.array(way.pictures)[:, cloud]) / np.mean(np.array(reference.pictures)[:, cloud])
        lines.append(f"{way.name:26}{way.samples:8d}{way.bake_seconds[1]:7.1f}{way.seconds[1]:8.2f}"
                     f"{way.total()[1]:8.2f}{way.total()[0]:8.1f}{reference.total()[1] / way.total()[1]:7.1f}"
                     f"{hd(reference) / hd(way):7.0f}{100 * way.noise(cloud):7.1f}%{100 * (mean - 1):+7.1f}%"
                     + ("" if way is reference else f"{100 * off(way, reference, cloud):6.1f}%"))
    lines.append("bake, render, total: processor seconds; wall: total on the clock; ratio: total of the longest path")
    lines.append("tracing over that of the line; in HD: the same for 1920x1080 pixels at that noise, reckoned by pixel")
    return lines


def savePicture(path, rows, white):
    image = np.concatenate([np.concatenate(row, axis=1) for row in reversed(rows)], axis=0)
    display = np.clip(image / white, 0, 1) ** (1 / 2.2)
    picture = bpy.data.images.new("cycles", display.shape[1], display.shape[0])
    picture.pixels = np.dstack([display, np.ones(display.shape[:2])]).ravel()
    picture.filepath_raw, picture.file_format = path, "PNG"
    picture.save()


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return f"{len(names)} threads of {names[0] if names else platform.processor()}, Blender {bpy.app.version_string}"


def options():
    parser = argparse.ArgumentParser(prog="cycles.py", description="Cycles' path tracing against a baked volume")
    parser.add_argument("-o", "--output", required=True, help="folder")
    parser.add_argument("--volume", default=stage.data("cumulus.vdb"))
    parser.add_argument("--noise", type=float, default=0.02)
    parser.add_argument("--density", type=float, default=3.0)
    parser.add_argument("--albedo", type=float, default=1.0)
    parser.add_argument("--g", type=float, default=0.0)
    parser.add_argument("--size", default="160x90")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:])


def main():
    chosen = options()
    os.makedirs(chosen.output, exist_ok=True)
    stage.installAddon()
    scene = stage.emptyScene(PILOT)
    scene.render.resolution_x, scene.render.resolution_y = map(int, chosen.size.split("x"))
    item = stage.addVolume(chosen.volume, color=[chosen.albedo] * 3, density=chosen.density, g=chosen.g)
    stage.addLamp("SUN", 3, direction=(0.5, 0.3, -0.8))
    stage.addWorld((0.12, 0.16, 0.24))
    stage.addCamera()

    traced = [Way(f"path tracing, {n} bounces", n) for n in BOUNCES]
    baked = [Way("all baked", 0, "BAKED"), Way("single scattering traced", 0, "HYBRID")]
    reference, cloud = traced[-1], None
    for way in reversed(traced):
        way.prepare(item)
        way.renderToNoise(cloud, chosen.noise)
        cloud = cloudOf(reference.pictures)
    for way in baked:
        way.prepare(item)
        way.renderToNoise(cloud, chosen.noise)
    bpy.ops.vdb_diffuse.restore()
    hurried = []
    for way in traced[:3]:
        again = Way(way.name, way.bounces)
        again.prepare(item)
        again.render(max(1, round(way.samples * baked[0].total()[1] / way.seconds[1])))
        hurried.append(again.pictures[0])

    lines = [f"{os.path.basename(chosen.volume)}, density x {chosen.density:g}, albedo {chosen.albedo:g}, "
             f"g {chosen.g:g}, sun and sky, {chosen.size} pixels", machine(), ""]
    lines += table(traced + baked, reference, cloud, hurried[0].shape[0] * hurried[0].shape[1])
    text = "\n".join(lines)
    print(text)
    with open(os.path.join(chosen.output, "table.txt"), "w", encoding="utf-8") as file:
        file.write(text + "\n")
    rows = [hurried, [way.pictures[0] for way in [reference] + baked]]
    savePicture(os.path.join(chosen.output, "cycles.png"), rows, np.percentile(reference.pictures[0][cloud], 99))


main()
