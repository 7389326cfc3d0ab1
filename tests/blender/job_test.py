"""What of the add-on needs no Blender: running the program, and names of files.

    python3 tests/blender/job_test.py PROGRAM
"""

import os
import sys
import tempfile
import time
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "vdb_diffuse", "blender"))
import job
import sequence

PROGRAM = sys.argv.pop(1) if len(sys.argv) > 1 else os.path.join(ROOT, "build", "vdb_diffuse")
CUMULUS = os.path.join(ROOT, "data", "cumulus.vdb")


class Names(unittest.TestCase):
    def testLitFileLiesBesideItsSource(self):
        self.assertEqual(sequence.litPath("/a/cumulus.vdb", "", False), "/a/cumulus_lit.vdb")
        self.assertEqual(sequence.litPath("/a/v12.vdb", "/b", False), "/b/v12_lit.vdb")

    def testSequencesKeepTheirNumberLast(self):
        self.assertEqual(sequence.litPath("/a/smoke_0007.vdb", "", True), "/a/smoke_lit_0007.vdb")
        self.assertEqual(sequence.pattern("/a1/smoke_lit_0007.vdb"), "/a1/smoke_lit_####.vdb")
        self.assertEqual(sequence.framePath("smoke_0007.vdb", 123), "smoke_0123.vdb")
        self.assertIsNone(sequence.pattern("/a/smoke.vdb"))

    def testFramesAreWrittenAsRanges(self):
        self.assertEqual(sequence.ranges([1, 2, 3, 5, 7, 8]), "1-3,5,7-8")
        self.assertEqual(sequence.ranges([]), "")


class Progress(unittest.TestCase):
    def testRisesToOneAndNeverFalls(self):
        report, before = job.Report(), 0
        for phase in ("read", "source", "surface", "solve", "sweeps", "solve", "sweeps", "write"):
            for fraction in (0, 0.5, 1):
                report.take(f'{{"phase":"{phase}","fraction":{fraction}}}')
                self.assertGreaterEqual(report.fraction, before)
                before = report.fraction
        self.assertEqual(report.fraction, 1)

    def testFramesShareTheBar(self):
        report = job.Report()
        report.take('{"frame":7,"index":2,"frames":4,"phase":"done","status":0,"output":"lit.0007.vdb"}')
        self.assertEqual(report.fraction, 0.75)
        self.assertEqual(report.outputs, ["lit.0007.vdb"])

    def testKeepsMessagesAndErrors(self):
        report = job.Report()
        for line in ("vdb_diffuse bake: warning: no light", "{ not json", '{"phase":"failed","status":3,"error":"x"}'):
            report.take(line)
        self.assertEqual(report.warnings, ["vdb_diffuse bake: warning: no light", "{ not json"])
        self.assertEqual(report.errors, ["x"])


class Program(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.scene = os.path.join(self.folder.name, "scene.json")
        self.output = os.path.join(self.folder.name, "lit.vdb")
        with open(self.scene, "w", encoding="utf-8") as file:
            file.write('{"lights": [{"type": "sun", "direction": [0, 0, -1]}, {"type": "dome", "radiance": 1}]}')

    def tearDown(self):
        self.folder.cleanup()

    def start(self, source=CUMULUS, sweeps=0):
        return job.Job(job.bakeCommand(PROGRAM, source, self.output, self.scene, sweeps, False))

    def testRunsToTheEnd(self):
        running = self.start()
        self.assertEqual(running.wait(), 0, running.report.warnings)
        self.assertEqual(running.progress(), (1.0, "done"))
        self.assertEqual(running.report.outputs, [self.output])
        self.assertTrue(os.path.exists(self.output))

    def testTellsWhatIsWrong(self):
        running = self.start(source=self.scene)
        self.assertEqual(running.wait(), 3)
        self.assertIn("scene.json", running.report.errors[0])

    def testCancelsWithinSecondsAndLeavesNothing(self):
        running = self.start(sweeps=100)
        while running.progress()[1] != "sweeps":
            self.assertTrue(running.running(), "ended before the sweeps")
            time.sleep(0.01)
        asked = time.time()
        running.cancel()
        self.assertEqual(running.wait(), 130)
        self.assertLess(time.time() - asked, 5)
        self.assertEqual(os.listdir(self.folder.name), ["scene.json"])


unittest.main()
