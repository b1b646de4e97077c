"""Fitted signatures as a user makes and inspects them."""

import unittest

from support import SOURCE, CommandTest

BOX = SOURCE / "assets" / "box.obj"
RING = SOURCE / "assets" / "ring.obj"
STICK = SOURCE / "assets" / "stick.obj"


class FitBspline(CommandTest):
    def setUp(self):
        super().setUp()
        self.succeed(
            "sample-signature", BOX, "-o", "box.sig", "--trials", "6", "--exemplars", "0",
            "--no-accuracy", "--pours", "0",
        )

    def test_a_fit_is_small_and_inspected_the_same(self):
        fitted = self.succeed("fit-bspline", "box.sig", "-o", "box.fit.sig").stdout
        self.assertIn("residuals, fit less table", fitted)
        inspected = self.succeed("inspect", "box.fit.sig", "--plot", "pictures").stdout
        self.assertIn("mean: 4 x 4 x 4 x 4 control points of 6 values", inspected)
        self.assertIn(inspected.split("pictures/")[0], fitted)
        size = (self.dir / "box.fit.sig").stat().st_size
        self.assertLess(50 * size, 20 * (self.dir / "box.sig").stat().st_size)
        picture = (self.dir / "pictures" / "response_mean.png").read_bytes()
        self.assertTrue(picture.startswith(b"\x89PNG"))

    def test_max_bytes_is_kept_and_measured(self):
        fitted = self.succeed(
            "fit-bspline", "box.sig", "-o", "box.fit.sig", "--max-bytes", "5000", "--mesh", BOX,
            "--plot", "pictures",
        ).stdout
        self.assertLessEqual((self.dir / "box.fit.sig").stat().st_size, 5000)
        for line in ("size against error", "chosen", "table, normal", "fit  ", "noise floor"):
            self.assertIn(line, fitted)
        for name in ("fit_mean", "fit_curve"):
            data = (self.dir / "pictures" / f"{name}.png").read_bytes()
            self.assertTrue(data.startswith(b"\x89PNG"), name)

    def test_max_bytes_holds_rest_drops(self):
        # 16 poses by geometry and as many by simulation.
        self.succeed(
            "sample-signature", STICK, "-o", "stick.sig", "--trials", "6", "--exemplars", "0",
            "--no-accuracy", "--pours", "0", "--rest-drops", "400",
        )
        self.succeed(
            "fit-bspline", "stick.sig", "-o", "stick.fit.sig", "--max-bytes", "5000", "--mesh", STICK
        )
        self.assertLessEqual((self.dir / "stick.fit.sig").stat().st_size, 5000)
        refused = self.expect_exit(
            2, "fit-bspline", "stick.sig", "-o", "x.sig", "--max-bytes", "1000"
        ).stderr
        least = int(refused.split("expected at least ")[1].split(":")[0])
        self.succeed("fit-bspline", "stick.sig", "-o", "x.sig", "--max-bytes", str(least))
        self.assertLessEqual((self.dir / "x.sig").stat().st_size, least)

    def test_threads_do_not_change_the_bytes(self):
        for threads in ("1", "3"):
            self.succeed(
                "fit-bspline", "box.sig", "-o", f"{threads}.sig", "--max-bytes", "4000",
                "--threads", threads,
            )
        self.assertEqual((self.dir / "1.sig").read_bytes(), (self.dir / "3.sig").read_bytes())

    def test_bad_input_is_named(self):
        self.succeed("fit-bspline", "box.sig", "-o", "box.fit.sig")
        cases = [
            (3, ["box.fit.sig"], "a signature that is fitted already"),
            (2, ["box.sig", "--degree", "0"], "degree 0"),
            (2, ["box.sig", "--control-points", "3"], "3 control points of degree 3"),
            (2, ["box.sig", "--control-points", "8"], "which has 7 nodes"),
            (2, ["box.sig", "--control-points", "4,4"], "one number for all axes, or four"),
            (2, ["box.sig", "--max-bytes", "100"], "--max-bytes 100"),
            (2, ["box.sig", "--max-bytes", "5000", "--max-error", "0.1"], "--max-error"),
            (2, ["box.sig", "--max-error", "0.1"], "--mesh"),
            (5, ["box.sig", "--max-error", "0.0001", "--mesh", BOX], "--max-error"),
            (3, ["box.sig", "--mesh", RING], "the mesh that was sampled, box.obj"),
            (2, ["box.sig", "--precision", "0"], "--precision: '0' is not a number above 0"),
        ]
        for code, arguments, words in cases:
            result = self.expect_exit(code, "fit-bspline", *arguments, "-o", "x.sig")
            self.assertIn(words, result.stderr)
        self.assertFalse((self.dir / "x.sig").exists())
        self.expect_exit(2, "fit-bspline", "box.sig", "-o", "box.fit.sig")


if __name__ == "__main__":
    unittest.main()
