"""How high does a heap of boxes stand, by friction? Run it in a directory of your own:

    PYTHONPATH=python python3 python/example.py
"""

import numpy

import pilesim

# 1. A scene is a dictionary with the keys of docs/scene.md; here boxes that are poured on the ground.
scene = {
    "version": 1,
    "duration_s": 8,
    "until": "settled",
    "frame_rate": 30,
    "materials": {"box": {"restitution": 0.2, "density_kg_m3": 700}},
    "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [0.1, 0.08, 0.06]}},
    "bodies": [{"name": "ground", "shape": "ground", "material": "box", "role": "static"}],
    "emitters": [{"name": "heap", "type": "disk", "shape": "box", "material": "box", "count": 60,
                  "rate_hz": 20, "centre": [0, 0.5, 0], "radius": 0.1, "height": 0.1}],
    "render": {"size": [320, 240]},
}

# 2. The program checks it. A slip is an error that names the place and the remedy.
try:
    pilesim.check({**scene, "duraton_s": 5})
except pilesim.PilesimError as error:
    print(error)

# 3. Runs differ in values; each has a directory. Results are the same on every machine.
runs = {}
for friction in (0.1, 0.4, 0.8):
    runs[friction] = pilesim.simulate(scene, f"heap_{friction}", seed=1, force=True,
                                      values={"/materials/box/friction": friction})

# 4. Poses are arrays of numpy: here the height of the highest centre, and the mean distance from the middle.
for friction, run in runs.items():
    end = run.position[-1][run.moves & run.present[-1]]
    spread = numpy.hypot(end[:, 0], end[:, 2]).mean()
    print(f"friction {friction}: {end[:, 1].max():.3f} m high, {spread:.3f} m wide, "
          f"deepest overlap {run.report['quality_at_end']['deepest_penetration_diameters']:.2g} D, "
          f"{run.time_s[-1]:.1f} s")

# 5. Pictures are arrays, too: the ends side by side, and one heap from eight sides.
ends = numpy.concatenate([run.picture(size=(320, 240)) for run in runs.values()], axis=1)
print("ends:", ends.shape, ends.dtype)
around = runs[0.8].pictures(size=(320, 240), options=["--orbit", "0.25s"])
print("around:", around.shape)
