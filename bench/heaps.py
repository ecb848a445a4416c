"""Settling heaps beside MuJoCo: processor time a step, as a ratio of one run.

python bench/heaps.py [--count 100] [--seeds 1,2,3,4] [--steps 1200] [--residuals 1e-9,1e-6] [--out FILE]

With MuJoCo, numpy, and tumble's program examples/several_bodies.rs (BENCH_BOXES). Boxes of 0.2 to 0.31 m and 1 to 2 kg in
random attitudes fall above each other, once onto the open ground and once into a bin of 2 m. tumble solves each step to a
residual, MuJoCo by its elliptic cone and Newton's method; both run one after the other. Each line is written as it ends.
"""

import argparse
import json
import os
import time
from pathlib import Path

import mujoco
import numpy as np
from engines.base import ask
from engines.mujoco import BODY, MODEL, numbers
from scene import Scene, at_rest, solid

PROGRAM = os.environ.get("BENCH_BOXES", "target/release/examples/several_bodies")
WALL = """
    <geom type="box" size="{half}" pos="{centre}"/>"""


def heap(seed: int, count: int, steps: int) -> Scene:
    """Boxes in layers of nine, as a seed draws them."""
    draws = np.random.RandomState(seed)
    boxes = []
    for k in range(count):
        attitude = draws.normal(size=4)
        sides, mass = draws.uniform(0.2, 0.31, size=3), draws.uniform(1.0, 2.0)
        aside = draws.uniform(-0.02, 0.02, size=2)
        place = (0.62 * (k % 3 - 1) + aside[0], 0.62 * (k // 3 % 3 - 1) + aside[1], 0.5 + 0.55 * (k // 9))
        start = at_rest(place, attitude / np.linalg.norm(attitude))
        boxes.append(solid(sides, float(mass), start))
    return Scene(f"heap-{seed}", "several", steps, 0.002, tuple(boxes), 0.5)


def walls(count: int) -> list[dict]:
    """A bin of 2 m, higher than what falls into it."""
    half = 0.275 * (count // 9) + 1.5
    sides = [((0.1, 1.2, half), (x, 0.0, half)) for x in (1.1, -1.1)]
    sides += [((1.2, 0.1, half), (0.0, y, half)) for y in (1.1, -1.1)]
    return [{"half_sides": list(size), "centre": list(centre)} for size, centre in sides]


def by_tumble(scene: Scene, around: list[dict], residual: float) -> dict:
    """Mean and slowest step, s; steps that are not solved."""
    asked = {"record": False, "each": True, "residual": residual, "walls": around}
    done = ask(PROGRAM, scene.request() | asked)
    return {
        "mean": done["seconds"] / scene.steps,
        "slowest": done["slowest_seconds"],
        "failed": done["failed"],
        "residual": done["residual"],
        "iterations": done["iterations"] / scene.steps,
    }


def by_mujoco(scene: Scene, around: list[dict]) -> dict:
    """Mean and slowest step, s."""
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    numbers_of = lambda kind: lambda text: [kind(part) for part in text.split(",")]  # noqa: E731
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--seeds", type=numbers_of(int), default=[1, 2, 3, 4])
    parser.add_argument("--residuals", type=numbers_of(float), default=[1e-9, 1e-6])
    parser.add_argument("--out", type=Path, help="a line of JSON for each run is added to this file")
    args = parser.parse_args()
    print(f"MuJoCo {mujoco.__version__}; {args.count} boxes, {args.steps} steps of 2 ms; times in ms")
    print("| heap | residual, m/s | tumble, mean | slowest | MuJoCo, mean | slowest | ratio of means | not solved | largest residual, m/s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for seed in args.seeds:
        for kind in ("open", "bin"):
            scene = heap(seed, args.count, args.steps)
            around = walls(args.count) if kind == "bin" else []
            theirs = by_mujoco(scene, around)
            for residual in args.residuals:
                ours = by_tumble(scene, around, residual)
                a, b, c, d = (1e3 * of[what] for of in (ours, theirs) for what in ("mean", "slowest"))
                print(
                    f"| {kind} {seed} | {residual:g} | {a:.2f} | {b:.0f} | {c:.2f} | {d:.1f} | {a / c:.1f} "
                    f"| {ours['failed']} | {ours['residual']:.1e} |",
                    flush=True,
                )
                if args.out:
                    run = {"heap": kind, "seed": seed, "count": args.count, "steps": args.steps}
                    line = run | {"asked": residual, "tumble": ours, "mujoco": theirs}
                    with args.out.open("a") as file:
                        file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
