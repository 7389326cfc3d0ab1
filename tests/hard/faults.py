#!/usr/bin/env python3
"""Runs bakes under faults: outputs that cannot be written, full disks, little memory, signals at any moment,
inputs that change while they are read. One line per case; status 1 where any went wrong.

    faults.py PROGRAM [--times N] [--seed S] [--only GROUP...]     groups: outputs, full_disks, little_memory,
                                                                   surroundings, changing_input, signals

What must hold: an output that was there before is as it was or whole and new, no part of a file bears the
final name, nothing but a killed process leaves a temporary file, the exit status is the documented one, and a
failure is told in one line.
"""
import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

OLD = b"what was there before"


class Bench:
    """A folder with a volume to bake, and an output that was there before."""

    def __init__(self, program, large):
        self.folder = tempfile.mkdtemp(prefix="vdb_diffuse_faults_")
        self.program = shutil.copy(program, self.path("vdb_diffuse"))  # where another user can run it
        os.chmod(self.folder, 0o755)
        self.faults = 0
        self.make("small.vdb", 3000)
        self.make("large.vdb", large)

    def path(self, name):
        return os.path.join(self.folder, name)

    def make(self, name, voxels):
        words = [self.program, "make", "cloud", "-o", self.path(name), "--voxels", str(voxels)]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)

    def words(self, volume, out, *more):
        return [self.program, "bake", self.path(volume), "-o", out, "--sun", "1,0.5,-1", "--quiet", *more]

    def run(self, words, **options):
        done = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=120, **options)
        return done.returncode, done.stderr.decode(errors="replace")

    def old_output(self, name="out.vdb"):
        with open(self.path(name), "wb") as file:
            file.write(OLD)
        return self.path(name)

    def is_whole(self, path):
        words = [self.program, "info", path]
        return subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0

    def leftovers(self, folder=None, remove=True):
        folder = folder or self.folder
        names = [name for name in os.listdir(folder) if name.endswith(".tmp")]
        for name in names if remove else []:
            os.unlink(os.path.join(folder, name))
        return names

    def judge(self, case, status, error, expected, good=True, detail=""):
        lines = error.count("\n")
        faults = []
        if status not in expected:
            faults.append("status %s, not %s" % (status, " or ".join(map(str, expected))))
        if status > 0 and status != 4 and lines != 1:
            faults.append("%d lines on standard error" % lines)
        if not good:
            faults.append("the output is damaged")
        if faults:
            self.faults += 1
        told = error.strip().replace(self.folder + "/", "")[:110]
        print("%-4s %-44s %s" % ("FAIL" if faults else "ok", case, "; ".join(faults) or detail or told or "done"))
        sys.stdout.flush()


def kept(path):
    with open(path, "rb") as file:
        return file.read() == OLD


def outputs(bench):
    """Places where no output can be."""
    for case, out in [("folder of the output is missing", bench.path("none/out.vdb")),
                      ("output is a folder", bench.folder),
                      ("output ends in a slash", bench.path("out/")),
                      ("output is a device", "/dev/full"),
                      ("folder of the output is a file", bench.path("small.vdb") + "/out.vdb"),
                      ("name of the output is too long", bench.path("n" * 300 + ".vdb"))]:
        bench.judge(case, *bench.run(bench.words("small.vdb", out)), [5])
    locked = bench.path("locked")
    os.mkdir(locked)
    with open(os.path.join(locked, "out.vdb"), "wb") as file:
        file.write(OLD)
    os.chmod(locked, 0o555)
    nobody = {"user": 65534, "group": 65534} if os.getuid() == 0 else {}
    for name in ["new.vdb", "out.vdb"]:
        bench.judge("folder may not be written, " + name,
                    *bench.run(bench.words("small.vdb", os.path.join(locked, name)), **nobody), [5],
                    kept(os.path.join(locked, "out.vdb")))
    os.chmod(locked, 0o755)


def limited(kind, value):
    def limit():
        resource.setrlimit(kind, (value, value))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return limit


def full_disks(bench):
    for size in [0, 1, 100, 4096, 20000]:
        out = bench.old_output()
        status, error = bench.run(bench.words("small.vdb", out), preexec_fn=limited(resource.RLIMIT_FSIZE, size))
        bench.judge("files of at most %d bytes" % size, status, error, [5], kept(out) and not bench.leftovers())
    out = bench.old_output()
    status, error = bench.run(bench.words("small.vdb", out, "--stats", "/dev/full"))
    bench.judge("statistics to a full device", status, error, [5], kept(out))
    disk = bench.path("disk")
    os.mkdir(disk)
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk], stderr=subprocess.DEVNULL)
    if mounted.returncode != 0:
        print("-    a full file system                           not tried: only root can mount one")
        return
    try:
        out = os.path.join(disk, "out.vdb")
        with open(out, "wb") as file:
            file.write(OLD)
        status, error = bench.run(bench.words("large.vdb", out))
        bench.judge("a full file system", status, error, [5], kept(out) and not bench.leftovers(disk))
    finally:
        subprocess.run(["umount", disk], check=True)


def little_memory(bench, short):
    """Each limit must end in a result, or in a foreseen (3) or met (5) lack of memory."""
    limits = [100, *range(150, 260, 5), 280, 300, 350, 400, 500, 700, 1000, 1500]
    for megabytes in limits[::5] if short else limits:
        for volume in ["large.vdb"] if short else ["small.vdb", "large.vdb"]:
            out = bench.old_output()
            status, error = bench.run(bench.words(volume, out),
                                      preexec_fn=limited(resource.RLIMIT_AS, megabytes << 20))
            good = kept(out) if status != 0 else bench.is_whole(out)
            # Below some size the libraries do not load or start, before any line of the program.
            version = bench.run([bench.program, "--version"], preexec_fn=limited(resource.RLIMIT_AS, megabytes << 20))
            expected = [status] if version[0] != 0 else [0, 3, 5]
            error = "\n" if version[0] != 0 else error
            bench.judge("%d MB of address space, %s" % (megabytes, volume), status, error, expected,
                        good and not bench.leftovers())


def signals(bench, times, chance):
    """Ended at random moments: the output is the old one, or the new one and whole."""
    start = time.time()
    bench.run(bench.words("large.vdb", bench.path("out.vdb")))
    seconds = time.time() - start
    start = time.time()
    subprocess.run([bench.program, "--version"], stdout=subprocess.DEVNULL)
    loading = 2 * (time.time() - start)  # until then a signal finds no one who would say 130
    for kind, expected in [(signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM), (signal.SIGHUP, -signal.SIGHUP),
                           (signal.SIGKILL, -signal.SIGKILL)]:
        ended = finished = damaged = left = wrong = 0
        told = ""
        for _ in range(times):
            out = bench.old_output()
            process = subprocess.Popen(bench.words("large.vdb", out), stdout=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE)
            # Half of the moments fall where the output is written and put in its place.
            wait = seconds * (chance.uniform(0, 1.1) if chance.random() < 0.5 else chance.uniform(0.8, 1.1))
            time.sleep(wait)
            process.send_signal(kind)
            error = process.communicate(timeout=60)[1].decode()
            status = process.returncode
            if status == -kind and wait < loading:
                status = expected
                error = "\n"
            ended += status == expected
            finished += status == 0
            if status not in (0, expected) or (status == 130 and error.count("\n") != 1):
                wrong += 1
                told = "status %d: %s" % (status, error.strip()[:100])
            is_old = kept(out)
            damaged += not is_old and not bench.is_whole(out)
            damaged += status == 0 and is_old
            left += len(bench.leftovers()) if kind != signal.SIGKILL else 0
            bench.leftovers()
        fault = damaged or left or wrong
        bench.faults += bool(fault)
        print("%-4s %-44s %d ended, %d had finished, %d damaged, %d temporary files left, %d wrong ends %s"
              % ("FAIL" if fault else "ok", "%s at %d random moments" % (kind.name, times), ended, finished,
                 damaged, left, wrong, told))
        sys.stdout.flush()


def changing_input(bench, times, chance):
    """The input is cut, overwritten, deleted or replaced while it is read."""
    with open(bench.path("large.vdb"), "rb") as file:
        large = file.read()
    with open(bench.path("small.vdb"), "rb") as file:
        small = file.read()
    victim = bench.path("victim.vdb")

    def cut():
        os.truncate(victim, chance.randrange(len(large)))

    def overwrite():
        with open(victim, "r+b") as file:
            file.seek(chance.randrange(len(large)))
            file.write(os.urandom(20000))

    def delete():
        os.unlink(victim)

    def replace():
        with open(victim + ".new", "wb") as file:
            file.write(small)
        os.rename(victim + ".new", victim)

    def grow():
        with open(victim, "ab") as file:
            file.write(large)

    for change in [cut, overwrite, delete, replace, grow]:
        counts = {}
        wrong = damaged = 0
        told = ""
        for _ in range(times):
            with open(victim, "wb") as file:
                file.write(large)
            out = bench.old_output()
            timer = threading.Timer(chance.random() * 0.1, change)
            timer.start()
            status, error = bench.run(bench.words("victim.vdb", out, "--sweeps", "0"))
            timer.join()
            counts[status] = counts.get(status, 0) + 1
            if status not in (0, 3) or error.count("\n") != (status != 0):
                wrong += 1
                told = error.strip()[:150]
            damaged += not (bench.is_whole(out) if status == 0 else kept(out)) or bool(bench.leftovers())
        bench.faults += bool(wrong or damaged)
        print("%-4s %-44s %s, %d wrong ends, %d damaged outputs %s"
              % ("FAIL" if wrong or damaged else "ok", "input is changed while read: " + change.__name__,
                 ", ".join("status %d: %d" % item for item in sorted(counts.items())), wrong, damaged, told))
        sys.stdout.flush()


def surroundings(bench):
    out = bench.path("out.vdb")
    many = bench.words("small.vdb", out, "--threads", "100")
    bench.judge("more threads than cores", *bench.run(many), [0], bench.is_whole(out))
    gone = dict(os.environ, TMPDIR=bench.path("none"), TEMP="/nowhere", TMP="/nowhere")
    bench.judge("TMPDIR is missing", *bench.run(bench.words("small.vdb", out), env=gone), [0])
    bench.judge("no environment at all", *bench.run(bench.words("small.vdb", out), env={}), [0])
    with open("/dev/full", "w") as full:
        words = bench.words("small.vdb", out)
        words.remove("--quiet")
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE)
        bench.judge("standard output is full", done.returncode, done.stderr.decode(), [5], bench.is_whole(out))
    closed = subprocess.run(["sh", "-c", '"$0" "$@" <&- >&- 2>&-', *bench.words("small.vdb", out)])
    bench.judge("standard files are closed", closed.returncode, "", [0], bench.is_whole(out))
    limit = bench.run(bench.words("small.vdb", out), preexec_fn=limited(resource.RLIMIT_NOFILE, 12))
    bench.judge("twelve open files at most", *limit, [0, 3, 5])
    for number in [2, 4]:
        done = bench.run(bench.words("small.vdb", out, "--threads", str(number)),
                         preexec_fn=limited(resource.RLIMIT_STACK, 256 << 10))
        bench.judge("a stack of 256 kB, %d threads" % number, *done, [0, 3, 5])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--times", type=int, default=50, help="signals and changes of the input, of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", metavar="GROUP", help="of the faults, not all")
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    short = arguments.times < 20
    bench = Bench(arguments.program, 12000 if short else 60000)
    try:
        for group, more in [(outputs, []), (full_disks, []), (little_memory, [short]), (surroundings, []),
                            (changing_input, [arguments.times, chance]), (signals, [arguments.times, chance])]:
            if not arguments.only or group.__name__ in arguments.only:
                group(bench, *more)
    finally:
        shutil.rmtree(bench.folder)
    print("%d faults" % bench.faults)
    return 1 if bench.faults else 0


if __name__ == "__main__":
    sys.exit(main())
