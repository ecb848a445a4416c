"""Errors of smooth motions against the time step and against the accuracy.

    python bench/accuracy.py target/release/tumble [MOTION...]
    python bench/accuracy.py target/release/tumble --known [MOTION...]

The argument is the program. The script prints the largest errors of positions and attitudes, and
of velocities, with steps of 10, 5, 2 and 1 ms, and the orders between them. The reference is a run
with the integrator leapfrog, extrapolated from steps of 0.1 and 0.2 ms, or twice as long ones. The last
line of a motion has the errors of runs that keep an accuracy of 1e-3 to 1e-7 m.

``--known`` compares runs that keep an accuracy with known ends (``known_motions.py``). It prints true errors
over those that were asked for, and over the estimates; ``!`` is a run with marks.
"""

import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from known_motions import KNOWN, Known

STEPS = (0.01, 0.005, 0.002, 0.001)
ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
SCENARIOS = Path(__file__).parent.parent / "scenarios"
GROUND = "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"body\"\nmass = 1.0\n"
HELD = "[ground]\nnone = true\nfriction = 0.3\n[[bodies]]\nname = \"body\"\nmass = 1.0\n"
SLOPE = (0.05 * math.sin(math.radians(15)), 0.05 * math.cos(math.radians(15)))


def shipped(name: str) -> str:
    """Text of a scenario without its name, steps and time step."""
    text = (SCENARIOS / f"{name}.toml").read_text()
    head, bodies = text.split("[ground]", 1)
    head = re.sub(r"(?m)^(name|steps|time_step) = .*\n", "", head)
    return head + "[ground]" + bodies


SLIDE = GROUND + "box = [0.4, 0.4, 0.2]\nposition = [0, 0, 0.1]\nvelocity = [3, 0, 0]\n"
PENDULUM = (
    HELD
    + "box = [0.05, 0.05, 1.0]\nposition = [0.4, 0, -0.3]\n"
    + "attitude = { axis = [0, 1, 0], degrees = -53.13010235415598 }\n[[joints]]\nname = \"hinge\"\n"
    + "type = \"revolute\"\nbodies = \"body\"\nanchor = [0, 0, 0]\naxis = [0, 1, 0]\n"
)
# Motion, its scene, and its duration, s.
MOTIONS = {
    "slide": (SLIDE, 0.4),
    "slide to rest": (SLIDE, 1.4),
    "oblique slide": (
        GROUND.replace("0.3\n", "0.3\nslope = 15\n")
        + f"box = [0.4, 0.4, 0.1]\nposition = [{SLOPE[0]!r}, 0, {SLOPE[1]!r}]\n"
        + "attitude = { axis = [0, 1, 0], degrees = 15 }\nvelocity = [0, 2, 0]\n",
        0.4,
    ),
    "spin and slide": (
        GROUND + "box = [0.4, 0.4, 0.1]\nposition = [0, 0, 0.05]\nvelocity = [2, 0, 0]\nspin = [0, 0, 8]\n",
        0.4,
    ),
    "slip to roll": (
        GROUND + "sphere = 0.1\nposition = [0, 0, 0.1]\nvelocity = [2, 0, 0]\nspin = [3, -5, 2]\n",
        0.3,
    ),
    "pendulum": (PENDULUM, 2.0),
    "sprung pendulum": (PENDULUM + "stiffness = 20.0\ndamping = 0.5\n", 1.0),
    "servo": (
        PENDULUM + '[[motors]]\njoint = "hinge"\nposition = 0.5\nstiffness = 60.0\ndamping = 2.0\nmax_force = 100\n',
        1.0,
    ),
    "double pendulum": (shipped("double-pendulum"), 0.6),
    "four-bar": (shipped("four-bar"), 0.4),
    "top": (
        HELD
        + "cylinder = { radius = 0.2, length = 0.05 }\nposition = [0, 0.3, 0.4]\n"
        + "attitude = { axis = [1, 0, 0], degrees = -36.86989764584402 }\nspin = [0, 0, 60]\n[[joints]]\n"
        + "name = \"tip\"\ntype = \"spherical\"\nbodies = \"body\"\nanchor = [0, 0, 0]\n",
        0.5,
    ),
}


def end(program: str, motion: str, h: float, setting: str) -> list[list[float]]:
    """Last states of a run: position, attitude, velocity and spin of each body."""
    text, duration = MOTIONS[motion]
    head = f'name = "motion"\nsteps = {round(duration / h) + 1}\ntime_step = {h!r}\n{setting}\n'
    with tempfile.TemporaryDirectory() as folder:
        scene, out = Path(folder) / "scene.toml", Path(folder) / "out"
        scene.write_text(head + text)
        subprocess.run([program, "run", scene, "--out", out, "--quiet"], check=True)
        with (out / "states.csv").open() as table:
            rows = list(csv.reader(table))[1:]
    return [[float(cell) for cell in row[3:16]] for row in rows if row[0] == rows[-1][0]]


def errors(states: list[list[float]], reference: list[list[float]]) -> tuple[float, float]:
    """Largest differences of poses and of velocities."""

    def largest(part: slice) -> float:
        pairs = (zip(a[part], b[part], strict=True) for a, b in zip(states, reference, strict=True))
        return max(abs(a - b) for pair in pairs for a, b in pair)

    return largest(slice(0, 7)), largest(slice(7, 13))


def main(program: str, motions: list[str]) -> None:
    """Print one row for each motion and integrator."""
    for motion in motions or MOTIONS:
        finest = 0.0001 if MOTIONS[motion][1] < 1.5 else 0.0002
        ends = [end(program, motion, finest * times, 'integrator = "leapfrog"') for times in (1, 2)]
        # Fourth order in h, but for the attitudes, whose norms stay near 1.
        pairs = zip(*ends, strict=True)
        reference = [[a + (a - b) / 3.0 for a, b in zip(fine, coarse, strict=True)] for fine, coarse in pairs]
        for integrator in ("euler", "leapfrog"):
            setting = f'integrator = "{integrator}"'
            found = [errors(end(program, motion, h, setting), reference) for h in STEPS]
            pose, velocity = zip(*found, strict=True)
            order = [
                math.log(pose[k] / pose[k + 1]) / math.log(STEPS[k] / STEPS[k + 1]) for k in range(len(STEPS) - 1)
            ]
            numbers = [" ".join(f"{x:.1e}" for x in of) for of in (pose, velocity)]
            orders = " ".join(f"{x:.2f}" for x in order)
            print(f"{motion:16} {integrator:9} {numbers[0]} | velocity {numbers[1]} | orders {orders}", flush=True)
        runs = [end(program, motion, 0.01, f"accuracy = {accuracy!r}") for accuracy in ACCURACIES]
        found = " ".join(f"{errors(run, reference)[0]:.1e}" for run in runs)
        print(f"{motion:16} accuracy  {found}", flush=True)


def judged(program: str, known: Known, accuracy: float) -> tuple[float, float, bool, int]:
    """True error of a run, its estimate, whether it has marks, and its intervals."""
    steps = round(known.duration / known.time_step) + 1
    head = f'name = "motion"\nsteps = {steps}\ntime_step = {known.time_step!r}\naccuracy = {accuracy!r}\n'
    with tempfile.TemporaryDirectory() as folder:
        scene, out = Path(folder) / "scene.toml", Path(folder) / "out"
        scene.write_text(head + known.text)
        ended = subprocess.run([program, "run", scene, "--out", out, "--quiet"], check=False)
        if ended.returncode not in (0, 3):
            sys.exit(f"{scene.read_text()}\nends with {ended.returncode}")
        with (out / "states.csv").open() as table:
            last = list(csv.reader(table))[-1]
        with (out / "steps.csv").open() as table:
            rows = [float(row["error_m"] or 0.0) for row in csv.DictReader(table)]
        marks = json.loads((out / "run.json").read_text())["summary"]
    true = max(abs(float(x) - y) for x, y in zip(last[3:], known.end, strict=False))
    return true, sum(rows), bool(ended.returncode or marks.get("coarse") or marks.get("ambiguous")), len(rows)


def judge(program: str, motions: list[str]) -> None:
    """Prints a row for each known motion, and the shares of runs that keep their accuracy."""
    asked, estimated, marks, growths = [], [], 0, 0
    for motion in motions or KNOWN:
        known = KNOWN[motion]()
        runs = [judged(program, known, accuracy) for accuracy in ACCURACIES]
        limits = [accuracy * known.duration for accuracy in ACCURACIES]
        ratios = [true / limit for (true, *_), limit in zip(runs, limits, strict=True)]
        # An error far below what was asked for says nothing about the estimate.
        honest = [
            true / max(estimate, 0.1 * limit) for (true, estimate, *_), limit in zip(runs, limits, strict=True)
        ]
        flags = [marked for _, _, marked, _ in runs]
        numbers = " ".join(f"{x:8.2g}{'!' if marked else ' '}" for x, marked in zip(ratios, flags, strict=True))
        others = " ".join(f"{x:8.2g}" for x in honest)
        print(f"{motion:24} {numbers} | {others} | {' '.join(f'{count:6}' for *_, count in runs)}", flush=True)
        asked += zip(ratios, flags, strict=True)
        estimated += honest
        marks += sum(flags)
        errors = [true for true, *_ in runs]
        growths += sum(b > 3.0 * a and b > limit for a, b, limit in zip(errors, errors[1:], limits[1:], strict=False))
    count = len(asked)
    print(f"{count} runs: {sum(x <= 1.0 for x, _ in asked)} keep what was asked, {sum(x <= 3.0 for x, _ in asked)} 3 times it,")
    print(f"{sum(x <= 10.0 for x, _ in asked)} 10 times it; {sum(x > 10.0 and not marked for x, marked in asked)} miss it unmarked; {marks} marked;")
    print(f"{sum(x <= 10.0 for x in estimated)} at most 10 times the estimate; {growths} errors grow with a smaller accuracy")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if sys.argv[2:3] == ["--known"]:
        judge(sys.argv[1], sys.argv[3:])
    else:
        main(sys.argv[1], sys.argv[2:])
