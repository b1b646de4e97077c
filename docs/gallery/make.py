#!/usr/bin/env python3
"""Makes the gallery: stills and loops of presets, and its page, which names all presets: docs/gallery/make.py [PILESIM [WORK]]

PILESIM is the program (build/release/commands/pilesim), WORK a directory for what is simulated (out/gallery); what is there already is kept,
with its times. Needs ffmpeg. The page says how long it takes.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PRESETS = ROOT / "presets"
NEAR = "near"  # a camera of presets whose own one shows all

# Title: presets, each with the moment of its picture and a camera where they are not the last one and its own.
STILLS = {
    "Poured, dropped, stacked": {
        "impulse/jar": (),
        "impulse/looks": (),
        "impulse/rabbits_in_a_crate": (),
        "impulse/shapes": (),
        "impulse/rings_and_poles": (),
        "impulse/l_shapes_300": (),
        "hard/iron_on_gravel": (),
        "impulse/ragdolls": (),
    },
    "Hit, pulled, shaken": {
        "impulse/avalanche": ("2.7s",),
        "impulse/tablecloth": ("1.62s",),
        "impulse/wrecking_ball": ("1.25s",),
        "impulse/tower_of_boxes": ("3.1s",),
        "impulse/belt": ("17s",),
        "impulse/tumbling_drum": (),
        "impulse/vibrating_bowl": (),
        "hard/funnel": ("1.6s",),
    },
    "Held in a shape until they are hit": {
        "guides/letters": ("3.1s",),
        "guides/heart": ("2.9s",),
    },
    "Structures that stand": {
        "equilibrium/book_spiral": ("5.9s",),
        "equilibrium/card_tower": ("6.35s",),
        "equilibrium/stick_tower": ("5.4s",),
        "equilibrium/tyre_fan": ("5.4s",),
        "equilibrium/bananas_in_a_cart": (),
        "equilibrium/chair_pile": (),
        "hard/card_house": (),
        "hard/arch": (),
        "hard/pyramid": (),
        "hard/rings": (),
    },
    "Piles at an angle of repose": {
        "repose/rabbit_matrix_35": (),
        "repose/multiple_piles": (),
        "repose/multiple_sizes": (),
        "repose/rings_in_a_box": (),
        "repose/pile_hit": ("9.15s",),
    },
    "Fast: the statistical and the mixed mode": {
        "statistical/rabbits_10000": ("last", NEAR),
        "mixed/building": ("0.6s",),
        "mixed/crosses": ("4s",),
    },
}
# Name: title, preset, frames, frames a second, renderer, further arguments.
LOOPS = {
    "letters": ("Letters are hit", "guides/letters", "2.9s-4.9s", 15, "raster", ["--samples", 8]),
    "crate": ("A crate fills", "impulse/rabbits_in_a_crate", "0-150x3", 12, "raster", ["--samples", 8]),
    "avalanche": ("Rocks hit a wall", "impulse/avalanche", "0.8s-3.8s", 15, "raster", ["--samples", 8]),
    "tablecloth": ("A cloth is pulled away", "impulse/tablecloth", "1.4s-2.1sx2", 8, "rays", ["--samples", 8]),
}


def children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(*words):
    """The processor time that it took, s."""
    begin = children_s()
    subprocess.run([str(word) for word in words], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return children_s() - begin


def simulated(pilesim, work, name):
    """The directory of a preset's run, and its report."""
    out = work / name.replace("/", "_")
    if not (out / "report.json").exists():
        scene = PRESETS / f"{name}.json"
        config = json.loads(subprocess.check_output([str(pilesim), "validate", str(scene), "--print-config"]))
        run(pilesim, "direct-pile" if config.get("guide") or config.get("piles") else "simulate", scene, "-o", out, "--force", "-q")
    return out, json.loads((out / "report.json").read_text())


def drawn(pilesim, out, picture, frames, size, arguments, encoding):
    """Draws frames into a file, unless it is there. The processor time that it took, s."""
    about = out / f"{picture.name}.json"
    if not (about.exists() and picture.exists()):
        folder = out / picture.name
        took = run(pilesim, "render", out, "-o", folder, "--frames", frames, "--size", size, *arguments, "--no-video", "--force", "-q")
        (folder,) = folder.rglob("frames")
        run("ffmpeg", "-loglevel", "error", "-y", *encoding[0], "-pattern_type", "glob", "-i", folder / "*.png", *encoding[1], picture)
        about.write_text(json.dumps(took))
    return json.loads(about.read_text())


def still(pilesim, work, name, moment="last", camera="camera"):
    out, report = simulated(pilesim, work, name)
    picture = HERE / f"{out.name}.jpg"
    arguments = ["--camera", camera, "--renderer", "rays"]
    return report, drawn(pilesim, out, picture, moment, "800x450", arguments, ([], ["-q:v", "4"]))


def loop(pilesim, work, name):
    _, preset, frames, rate, renderer, arguments = LOOPS[name]
    out, report = simulated(pilesim, work, preset)
    encoding = (["-framerate", rate], ["-c:v", "libwebp_anim", "-quality", "75", "-loop", "0"])
    return report, drawn(pilesim, out, HERE / f"{name}.webp", frames, "640x360", ["--renderer", renderer, *arguments], encoding)


def seconds(value):
    return f"{value:.1f} s" if value < 10 else f"{value:.0f} s"


def cell(picture, preset, title, report, took):
    return (
        f"![{title}]({picture})<br>[`{preset}`](../../presets/{preset}.json): {title}<br>"
        f"{report['counts']['dynamic_bodies']:,} bodies; simulated in {seconds(report['time']['cpu_s'])}, drawn in {seconds(took)}"
    )


def table(cells):
    return ["", "| | |", "|---|---|", *(f"| {' | '.join((*cells[i : i + 2], '')[:2])} |" for i in range(0, len(cells), 2))]


def main():
    pilesim = (ROOT / (sys.argv[1] if len(sys.argv) > 1 else "build/release/commands/pilesim")).resolve()
    work = (ROOT / (sys.argv[2] if len(sys.argv) > 2 else "out/gallery")).resolve()
    names = [line.split()[0] for line in subprocess.check_output([str(pilesim), "presets"], text=True).splitlines()]
    shown = {name for presets in STILLS.values() for name in presets}
    if unknown := shown - set(names):
        sys.exit(f"no presets: {', '.join(sorted(unknown))}")
    stills = {name: still(pilesim, work, name, *shot) for presets in STILLS.values() for name, shot in presets.items()}
    loops = {name: loop(pilesim, work, name) for name in LOOPS}
    took = sum(took for _, took in (*stills.values(), *loops.values())) + sum(report["time"]["cpu_s"] for report, _ in stills.values())
    lines = [
        "# Gallery",
        "",
        f"Presets in pictures, made by `docs/gallery/make.py` in {took / 60:.0f} minutes of processor time. Below each stand the",
        "processor times of `pilesim simulate` (`direct-pile` for held and directed piles) after its set-up, and of the",
        f"picture, by rays. Measured in {time.strftime('%B %Y')} on two cores at 2.5 GHz, beside much other work, which doubles them.",
        "",
        "    pilesim presets copy impulse/jar",
        "    pilesim simulate jar.json -o out/jar",
        "    pilesim render out/jar --renderer rays --frames last --no-video",
        "",
        "## It moves",
        *table([cell(f"{name}.webp", LOOPS[name][1], LOOPS[name][0], *told) for name, told in loops.items()]),
    ]
    for title, presets in STILLS.items():
        lines += ["", f"## {title}", *table([cell(name.replace("/", "_") + ".jpg", name, stills[name][0]["scene"]["name"], *stills[name]) for name in presets])]
    lines += ["", "## More presets", ""]
    lines += [f"- [`{name}`](../../presets/{name}.json)" for name in names if name not in shown]
    (HERE / "README.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
