#!/usr/bin/env python3
"""Makes the gallery, of all presets but those in LEFT_OUT: docs/gallery/make.py [PILESIM [WORK]]

PILESIM is the program (build/release/commands/pilesim), WORK a directory for what is simulated (out/gallery); what is there already is kept,
with its times. Needs ffmpeg. About twenty minutes on two cores.
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

LEFT_OUT = {
    "batch/bins.plan": "is a plan of many runs, not a scene",
    "finish/rabbits_100000": "takes minutes",
    "hard/contact_on_edge": "is a test of few bodies, as all of `hard/` that is left out",
    "hard/friction_0": "",
    "hard/friction_2": "",
    "hard/heavy_on_light": "",
    "hard/millimetres_and_100_m": "",
    "hard/resting": "",
    "hard/restitution": "",
    "hard/spinning": "",
    "hard/thin_wall": "",
    "hard/zero_gravity": "",
    "mixed/flight": "takes minutes",
    "statistical/boxes_1000000": "takes a minute, and more memory than most machines have for its pictures",
}
# The moment of the picture where it is not the last one: what is held until it is hit, while it stands or breaks.
WHEN = {
    "equilibrium/book_spiral": "4.9s",
    "equilibrium/books_upside_down": "5.9s",
    "equilibrium/card_tower": "5.5s",
    "equilibrium/rough_crates": "4.9s",
    "equilibrium/stick_tower": "4.9s",
    "equilibrium/tyre_fan": "4.9s",
    "guides/arch": "2.9s",
    "guides/column": "2.9s",
    "guides/cut_sphere": "2.9s",
    "guides/figure": "2.9s",
    "guides/heart": "2.9s",
    "guides/l": "2.9s",
    "guides/letters": "3.3s",
    "guides/spiral_tower": "2.9s",
    "guides/t": "2.9s",
    "guides/torus": "2.9s",
    "impulse/tower_of_boxes": "2.9s",
    "repose/pile_hit": "9.3s",
}
# How fast it is, which differs by a factor of two from one to the next and from day to day.
MACHINE = "`exact_benchmark --hulls 1000 --mesh bunny.obj --step 60 exact` takes 0.84 s there."
TITLES = {
    "artist": "An artist's own things",
    "impulse": "Exact: the impulse mode",
    "finish": "Simulated fast, finished exactly",
    "equilibrium": "Structures that stand until they are hit",
    "guides": "Piles held in a shape",
    "repose": "Piles that take an angle of repose",
    "statistical": "Fast: the statistical mode",
    "mixed": "Both at once: the mixed mode",
    "hard": "Scenes that break simulators",
    "compare": "Scenes to compare modes with",
    "batch": "Scenes to run a thousand times",
}


def children_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(*words):
    """The processor time that it took, s."""
    begin = children_s()
    subprocess.run([str(word) for word in words], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return children_s() - begin


def make(pilesim, work, name):
    """Its picture, and what the page says of it."""
    out = work / name.replace("/", "_")
    about = out / "gallery.json"
    picture = HERE / f"{out.name}.jpg"
    if about.exists() and picture.exists():
        return json.loads(about.read_text())
    scene = PRESETS / f"{name}.json"
    directed = json.loads(subprocess.check_output([str(pilesim), "validate", str(scene), "--print-config"]))
    command = "direct-pile" if directed.get("guide") or directed.get("piles") else "simulate"
    simulated = run(pilesim, command, scene, "-o", out, "--force", "-q")
    drawn = run(
        pilesim, "render", out, "--frames", WHEN.get(name, "last"), "--renderer", "rays", "--size", "640x360",
        "--no-video", "--force", "-q",
    )  # fmt: skip
    (frame,) = (out / "frames").glob("*.png")
    run("ffmpeg", "-loglevel", "error", "-y", "-i", frame, "-q:v", "5", picture)
    frame.unlink()
    report = json.loads((out / "report.json").read_text())
    told = {
        "title": report["scene"]["name"],
        "bodies": report["counts"]["dynamic_bodies"],
        "mode": report["mode"],
        "scene_s": directed["duration_s"],
        "simulated_s": simulated,
        "drawn_s": drawn,
        "command": command,
    }
    about.write_text(json.dumps(told))
    return told


def seconds(value):
    return f"{value:.1f} s" if value < 10 else f"{value:.0f} s"


def cell(name, told):
    picture = name.replace("/", "_") + ".jpg"
    return (
        f"![{told['title']}]({picture})<br>[`{name}`](../../presets/{name}.json): {told['title']}<br>"
        f"{told['bodies']:,} bodies, {told['scene_s']:.3g} s; simulated in {seconds(told['simulated_s'])}, "
        f"drawn in {seconds(told['drawn_s'])}"
    )


def main():
    pilesim = (ROOT / (sys.argv[1] if len(sys.argv) > 1 else "build/release/commands/pilesim")).resolve()
    work = (ROOT / (sys.argv[2] if len(sys.argv) > 2 else "out/gallery")).resolve()
    names = [line.split()[0] for line in subprocess.check_output([str(pilesim), "presets"], text=True).splitlines()]
    unknown = set(LEFT_OUT) - set(names)
    if unknown:
        sys.exit(f"no presets: {', '.join(sorted(unknown))}")
    groups = {}
    for name in names:
        if name not in LEFT_OUT:
            groups.setdefault(name.split("/")[0], []).append(name)
    lines = [
        "# Gallery",
        "",
        "Every preset that makes a picture, made by `docs/gallery/make.py`. The processor times are those of `pilesim simulate`",
        "(`direct-pile` for held and directed piles) with its set-up, and of one picture of 640 x 360 by rays. Two cores take",
        f"about half of it. Measured in {time.strftime('%B %Y')} on cores at 2.5 GHz.",
        MACHINE,
        "",
        "    pilesim presets copy impulse/rabbits_in_a_crate",
        "    pilesim simulate rabbits_in_a_crate.json -o out/crate",
        "    pilesim render out/crate --renderer rays --size 640x360 --frames last --no-video",
    ]
    for group, title in TITLES.items():
        cells = [cell(name, make(pilesim, work, name)) for name in groups.pop(group, [])]
        lines += ["", f"## {title}", "", "| | |", "|---|---|"]
        lines += [f"| {' | '.join((*cells[i : i + 2], '')[:2])} |" for i in range(0, len(cells), 2)]
    if groups:
        sys.exit(f"no title for {', '.join(groups)}")
    lines += ["", "## Left out", ""]
    lines += [f"- `{name}`" + (f" {why}" if why else "") for name, why in LEFT_OUT.items()]
    (HERE / "README.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
