"""Some of the kills and full disks that kill_and_fill.py tries in full."""

import random
import shutil
import tempfile
import unittest
from pathlib import Path

from bench import Bench, adopt_orphans
from cases import CASES
from kill_and_fill import every_change, every_change_that_takes_room

SAMPLE = 1  # of each accident, a case
CHOSEN = ("simulate impulse", "direct-pile guide", "render video", "sample-signature",
          "simulate impulse resumed", "direct-pile guide resumed", "render resumed", "batch")


class Accidents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        adopt_orphans()

    def setUp(self):
        self.base = Path(tempfile.mkdtemp(prefix="pilesim-test-")).resolve()
        self.addCleanup(shutil.rmtree, self.base)

    def test_nothing_is_lost_and_nothing_half_written_taken_for_whole(self):
        for case in CASES:
            if case.name not in CHOSEN:
                continue
            rng = random.Random(case.name)
            bench = Bench(case, self.base)
            start = bench.starts()[-1]
            changes = bench.changes(start)
            accidents = {
                "kill": (bench.kill_at_a_change, list(every_change(changes))),
                "fill": (bench.fill_at_a_change, every_change_that_takes_room(changes)),
            }
            for name, (accident, numbers) in accidents.items():
                for number in rng.sample(numbers, SAMPLE):
                    with self.subTest(f"{case.name}: {name} at {number}, {changes[number - 1]}"):
                        bench.restore(start)
                        accident(number)
                        bench.bring_to_its_end()


if __name__ == "__main__":
    unittest.main()
