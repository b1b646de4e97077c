"""The judgement of tests/benchmark/ratchet.py on counts of instructions. The counting itself takes minutes."""

import sys
import unittest

from support import SOURCE

sys.path.insert(0, str(SOURCE / "tests/benchmark"))
import ratchet  # noqa: E402


class Compare(unittest.TestCase):
    def test_three_in_a_hundred_more_fails_and_names_the_run(self):
        faults, kept = ratchet.compare({"glue": 1000, "rays": 1000}, {"glue": 1031, "rays": 1030})
        self.assertEqual(len(faults), 1)
        self.assertRegex(faults[0], r"^glue: 1,031 instructions, 3\.1% more than 1,000")
        self.assertEqual(kept, {"glue": 1000, "rays": 1000})

    def test_less_is_kept_from_then_on_and_a_little_less_is_not(self):
        faults, kept = ratchet.compare({"glue": 1000, "rays": 1000}, {"glue": 989, "rays": 991})
        self.assertEqual(faults, [])
        self.assertEqual(kept, {"glue": 989, "rays": 1000})

    def test_a_new_run_is_kept_and_one_that_was_not_counted_stays(self):
        self.assertEqual(ratchet.compare({"glue": 1000}, {"rays": 7}), ([], {"glue": 1000, "rays": 7}))

    def test_the_file_is_read_as_it_is_written(self):
        text = ratchet.COUNTS.read_text()
        counts = ratchet.read(text)
        self.assertLessEqual(set(counts), set(ratchet.RUNS))
        self.assertEqual(ratchet.written(counts), text)


if __name__ == "__main__":
    unittest.main()
