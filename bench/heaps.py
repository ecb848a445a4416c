"""Settling heaps: mean and slowest time per step in tumble and in MuJoCo with elliptic cones.

Boxes of 0.2 to 0.31 m and 1 to 2 kg in random attitudes fall above each other. They fall onto open
ground or into a bin of 2 m. tumble solves each step to a given residual. MuJoCo uses Newton's
method. The engines run one after the other, and processor time is measured.
"""

import statistics
import time

import numpy as np
from engines.base import ask
from engines.tumble import LIBRARY
from scene import Scene, at_rest, solid
from tables import NOTHING, table

STEPS = 1200
RESIDUALS = (1e-9, 1e-6)  # m/s
KINDS = ("open", "bin")
WALL = """
    <geom type="box" size="{half}" pos="{centre}"/>"""


def heap(seed: int, count: int) -> Scene:
    """Boxes in layers of nine, drawn with `seed`."""
    draws = np.random.RandomState(seed)
    boxes = []
    for k in range(count):
        attitude = draws.normal(size=4)
        sides, mass = draws.uniform(0.2, 0.31, size=3), draws.uniform(1.0, 2.0)
        aside = draws.uniform(-0.02, 0.02, size=2)
        place = (0.62 * (k % 3 - 1) + aside[0], 0.62 * (k // 3 % 3 - 1) + aside[1], 0.5 + 0.55 * (k // 9))
        start = at_rest(place, attitude / np.linalg.norm(attitude))
        boxes.append(solid(sides, float(mass), start))
    return Scene(f"heap-{seed}", "several", STEPS, 0.002, tuple(boxes), 0.5)


def walls(count: int) -> list[dict]:
    """Walls of a bin of 2 m, higher than the falling boxes."""
    half = 0.275 * (count // 9) + 1.5
    sides = [((0.1, 1.2, half), (x, 0.0, half)) for x in (1.1, -1.1)]
    sides += [((1.2, 0.1, half), (0.0, y, half)) for y in (1.1, -1.1)]
    return [{"half_sides": list(size), "centre": list(centre)} for size, centre in sides]


def by_tumble(scene: Scene, around: list[dict], residual: float) -> dict:
    """Mean and slowest step (s), unsolved steps, largest residual (m/s) and mean iterations."""
    asked = {"record": False, "each": True, "residual": residual, "walls": around}
    done = ask(LIBRARY, scene.request() | asked)
    return {
        "mean": done["seconds"] / scene.steps,
        "slowest": done["slowest_seconds"],
        "failed": done["failed"],
        "residual": done["residual"],
        "iterations": done["iterations"] / scene.steps,
    }


def by_mujoco(scene: Scene, around: list[dict]) -> dict:
    """Mean and slowest step (s)."""
    import mujoco
    from engines.mujoco import BODY, MODEL, numbers

    fixed = [WALL.format(half=numbers(wall["half_sides"]), centre=numbers(wall["centre"])) for wall in around]
    moving = [
        BODY.format(mass=box.mass, inertia=numbers(box.inertia), half=numbers(box.sides / 2))
        for box in scene.boxes
    ]
    text = MODEL.format(
        h=scene.step_seconds,
        gravity=numbers(scene.gravity),
        option='cone="elliptic" solver="Newton"',
        mu=scene.friction,
        contact="",
        bodies="".join(fixed + moving),
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    starts = np.array([box.start for box in scene.boxes])
    data.qpos[:], data.qvel[:] = starts[:, :7].ravel(), starts[:, 7:].ravel()
    taken = []
    for _ in range(scene.steps):
        clock = time.process_time()
        mujoco.mj_step(model, data)
        taken.append(time.process_time() - clock)
    return {"mean": sum(taken) / scene.steps, "slowest": max(taken)}


def run(seeds: list[int], count: int, engines: list[str], keep) -> list[dict]:
    """Runs one round of all heaps and passes each result to `keep`."""
    found = []
    for seed in seeds:
        for kind in KINDS:
            scene, around = heap(seed, count), walls(count) if kind == "bin" else []
            print(f"heap: {kind} {seed}", flush=True)
            one = {"heap": kind, "seed": seed, "count": count, "steps": STEPS, "tumble": {}}
            one["mujoco"] = by_mujoco(scene, around) if "mujoco" in engines else None
            if "tumble" in engines:
                one["tumble"] = {f"{r:g}": by_tumble(scene, around, r) for r in RESIDUALS}
            keep({"heap": one})
            found.append(one)
    return found


def tables(rounds: list[list[dict]]) -> str:
    """Medians over the rounds, and ratios within each round."""
    heads = ["residual, m/s", "tumble: mean, ms", "slowest", "iterations", "not solved", "largest residual, m/s"]
    heads += ["MuJoCo: mean, ms", "slowest", "ratio of means"]
    rows, ratios = [], {}
    for runs in zip(*rounds):
        name = f"{runs[0]['heap']} {runs[0]['seed']}"
        for asked in runs[0]["tumble"] or [None]:
            ours, theirs = [run["tumble"].get(asked) for run in runs], [run["mujoco"] for run in runs]
            row = [NOTHING] * 6
            if asked:
                row = [asked, middle(ours, "mean"), middle(ours, "slowest")]
                row += [f"{statistics.median(one['iterations'] for one in ours):.0f}"]
                row += [str(max(one["failed"] for one in ours)), f"{max(one['residual'] for one in ours):.1e}"]
            row += [middle(theirs, "mean"), middle(theirs, "slowest")] if theirs[0] else [NOTHING] * 2
            ratio = NOTHING
            if asked and theirs[0]:
                value = statistics.median(a["mean"] / b["mean"] for a, b in zip(ours, theirs))
                ratios.setdefault((runs[0]["heap"], asked), []).append(value)
                ratio = f"{value:.1f}"
            rows.append([name, *row, ratio])
    ranges = [
        f"- {kind}, {asked} m/s: {min(values):.1f} to {max(values):.1f} of MuJoCo's mean, {statistics.mean(values):.1f} on average of "
        f"{len(values)} seeds."
        for (kind, asked), values in ratios.items()
    ]
    return "\n\n".join([table(heads, rows), "\n".join(ranges)]).rstrip()


def middle(runs: list[dict], what: str) -> str:
    return f"{1e3 * statistics.median(one[what] for one in runs):.3g}"
