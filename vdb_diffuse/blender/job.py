"""The vdb_diffuse program in the background, and what it says. No bpy, so that it can be tested alone."""

import json
import os
import signal
import subprocess
import threading

# Where each phase begins and ends in the whole, roughly as long as they take on a cloud of a million voxels.
PHASES = {"read": (0.0, 0.05), "source": (0.05, 0.3), "surface": (0.3, 0.32), "solve": (0.32, 0.5),
          "sweeps": (0.5, 0.95), "write": (0.95, 1.0)}


class Report:
    """What the lines on standard error have said so far."""

    def __init__(self):
        self.fraction = 0.0  # of the whole; never falls, though phases come again for each colour
        self.phase = "starting"
        self.warnings, self.errors, self.outputs = [], [], []

    def take(self, line):
        line = line.strip()
        if not line.startswith("{"):
            if line:
                self.warnings.append(line)
            return
        try:
            step = json.loads(line)
        except ValueError:  # a message that happens to begin with a brace
            self.warnings.append(line)
            return
        self.phase = step.get("phase", self.phase)
        if self.phase == "failed":
            self.errors.append(step.get("error", "failed without a word"))
        if self.phase in ("done", "skipped"):
            self.outputs.append(step.get("output", ""))
        begin, end = PHASES.get(self.phase, (1.0, 1.0))
        within = begin + (end - begin) * float(step.get("fraction", 0))
        whole = (step.get("index", 0) + within) / max(step.get("frames", 1), 1)
        self.fraction = max(self.fraction, min(whole, 1.0))


class Job:
    """A running bake. Ask running() now and then; status is None until it has ended."""

    def __init__(self, command):
        self.report = Report()
        self.cancelled = False
        self._lock = threading.Lock()
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.PIPE, encoding="utf-8", errors="replace")
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stderr:
            with self._lock:
                self.report.take(line)

    def running(self):
        if self._process.poll() is None:
            return True
        self._reader.join()  # what is still in the pipe
        self._process.stderr.close()
        return False

    def progress(self):
        with self._lock:
            return self.report.fraction, self.report.phase

    def cancel(self):
        """Asks the program to end; it does within a second and leaves no part of a file."""
        self.cancelled = True
        if self._process.poll() is None:
            if os.name == "nt":
                self._process.terminate()
            else:
                self._process.send_signal(signal.SIGINT)

    def wait(self):
        self._process.wait()
        self.running()
        return self.status

    @property
    def status(self):
        return self._process.returncode


def bakeCommand(program, source, output, scene, sweeps, flux, frames=None):
    """Lighting grids are widened by two voxels: interpolation at the edge then finds light, not zero."""
    grids = "density,diffuse,direct" + (",flux" if flux else "")
    command = [program, "bake", source, "-o", output, "--scene", scene, "--sweeps", str(sweeps), "--grids", grids,
               "--keep", "all", "--dilate", "2", "--progress", "json"]
    return command + (["--frames", frames] if frames else [])
