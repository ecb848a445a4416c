"""Plans 100 random problems, 20 of each of five families, and counts the solved ones.

    python bench/plans.py target/release/tumble
    python bench/plans.py target/release/tumble --stages sample,shoot --only swing

The seed is fixed, so that all calls have the same problems. Each search uses one thread. Swings
use 2000 sampled runs.
"""

import argparse
import json
import math
import random
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

SEED = 20261124
EACH = 20
GRAVITY = 9.81

Problem = tuple[str, str, str]
"""Name, scene and problem file without its first line."""


def draw_size(draw: random.Random, *ranges: tuple[float, float]) -> tuple[float, ...]:
    return tuple(round(draw.uniform(*ends), 3) for ends in ranges)


def box(size: tuple[float, ...], mass: float, friction: float, height: float) -> str:
    x, y, z = size
    return f"""time_step = 0.02
[ground]
friction = {friction:.3f}
[[bodies]]
name = "box"
box = [{x:.3f}, {y:.3f}, {z:.3f}]
mass = {mass:.3f}
position = [0, 0, {height!r}]
[solver]
name = "native"
"""


def pushes(draw: random.Random) -> Iterator[Problem]:
    """Pushes of a box to a pose at one face, with free or frictional tangential forces."""
    for i in range(EACH):
        size = draw_size(draw, (0.2, 0.4), (0.2, 0.4), (0.1, 0.25))
        mass, friction = draw.uniform(0.6, 1.6), draw.uniform(0.2, 0.6)
        weight = mass * GRAVITY
        tangential = f"tangential = [{-0.6 * weight:.2f}, {0.6 * weight:.2f}]"
        if i % 2:
            tangential = f"friction = {draw.uniform(0.3, 0.7):.2f}\ntangential = [-1, 1]"
        problem = f"""steps = 60
[[controls]]
kind = "push"
face = "-x"
at = [{-size[0] / 2!r}, 0, {-size[2] / 4!r}]
normal = [0, {2 * weight:.2f}]
{tangential}
offset = [{-size[1] / 2!r}, {size[1] / 2!r}]
knots = 30
[target]
position = [{draw.uniform(0.3, 0.7):.3f}, {draw.uniform(-0.25, 0.25):.3f}]
turn = {draw.uniform(-80, 80):.1f}
speed = 0
tolerance = {{ position = 5e-3, turn = 1, speed = 2e-2 }}
"""
        yield f"push-{i:02}", box(size, mass, friction, size[2] / 2), problem


def throws(draw: random.Random) -> Iterator[Problem]:
    """Throws of a box onto a side at a place, by velocity and spin."""
    for i in range(EACH):
        size = draw_size(draw, (0.15, 0.3), (0.15, 0.3), (0.15, 0.3))
        mass, friction, height = draw.uniform(0.6, 1.6), draw.uniform(0.25, 0.6), round(draw.uniform(0.4, 0.6), 3)
        problem = f"""steps = 60
[[controls]]
kind = "start"
of = "velocity"
x = [0, 4]
y = [-2, 2]
z = [0, 4]
[[controls]]
kind = "start"
of = "spin"
x = [-12, 12]
y = [-12, 12]
z = [-5, 5]
[target]
position = [{draw.uniform(0.6, 1.4):.3f}, {draw.uniform(-0.4, 0.4):.3f}]
down = "{draw.choice(["+x", "-x", "+y", "-y"])}"
speed = 0
"""
        yield f"throw-{i:02}", box(size, mass, friction, height), problem


def flips(draw: random.Random) -> Iterator[Problem]:
    """Flips of a box over an edge, half of them to a place, by a force and a torque."""
    for i in range(EACH):
        size = draw_size(draw, (0.2, 0.35), (0.2, 0.35), (0.15, 0.3))
        mass = draw.uniform(0.6, 1.6)
        weight = mass * GRAVITY
        torque = 0.7 * weight * size[0]
        side = draw.choice(["+x", "-x"])
        place, tolerance = "", ""
        if i % 2:
            place = f"x = {draw.uniform(0.2, 0.6) * (1 if side == '+x' else -1):.3f}"
            tolerance = "position = 1e-2, "
        problem = f"""steps = 60
[[controls]]
kind = "force"
x = [{-weight:.2f}, {weight:.2f}]
knots = 20
[[controls]]
kind = "torque"
y = [{-torque:.3f}, {torque:.3f}]
knots = 20
[target]
{place}
down = "{side}"
speed = 0
spin = 0
tolerance = {{ {tolerance}down = 1, speed = 2e-2, spin = 5e-2 }}
"""
        yield f"flip-{i:02}", box(size, mass, draw.uniform(0.35, 0.7), size[2] / 2), problem


def motor(joint: str, most: float, knots: int) -> str:
    return f"""[[controls]]
kind = "motor"
joint = "{joint}"
force = [{-most:.4f}, {most:.4f}]
knots = {knots}
"""


def rod(name: str, length: float, mass: float, top: tuple[float, float]) -> str:
    y, z = top
    return f"""[[bodies]]
name = "{name}"
box = [0.04, 0.04, {length}]
mass = {mass}
position = [0, {y}, {z - length / 2!r}]
"""


def hinge(name: str, bodies: str, place: tuple[float, float], limits: tuple[float, float], rest: str) -> str:
    y, z = place
    return f"""[[joints]]
name = "{name}"
type = "revolute"
bodies = {bodies}
anchor = [0, {y}, {z!r}]
axis = [0, 1, 0]
limits = [{limits[0]!r}, {limits[1]!r}]
{rest}
"""


def swings(draw: random.Random) -> Iterator[Problem]:
    """Swings of a pendulum or double pendulum up to rest against its stops, by weak motors."""
    opening = "time_step = 0.005\n[ground]\nnone = true\nfriction = 0.5\n"
    top = 1.2
    for i in range(EACH):
        stop = math.pi + round(draw.uniform(0.06, 0.15), 3)
        length, mass = round(draw.uniform(0.3, 0.6), 3), round(draw.uniform(0.3, 0.8), 3)
        end = (-length * math.sin(stop), top - length * math.cos(stop))
        if i % 2 == 0:
            most = draw.uniform(0.35, 0.8) * mass * GRAVITY * length / 2
            damping = draw.uniform(0.005, 0.02) * mass
            friction = draw.uniform(0, 0.04) * most if i % 4 else 0.0
            drive = f"damping = {damping:.4f}\nfriction = {friction:.4f}"
            scene = rod("rod", length, mass, (0, top)) + hinge("hinge", '"rod"', (0, top), (-stop, stop), drive)
            controls, body = motor("hinge", most, 30), "rod"
            goal = (end[0] / 2, (top + end[1]) / 2)
        else:
            second, small = round(draw.uniform(0.25, 0.45), 3), round(draw.uniform(0.2, 0.5), 3)
            elbow = round(draw.uniform(0.06, 0.15), 3)
            weights = GRAVITY * (mass * length / 2 + small * (length + second / 2)), GRAVITY * small * second / 2
            most = draw.uniform(0.5, 0.9) * weights[0]
            least = draw.uniform(0.6, 1.1) * weights[1]
            scene = (
                rod("upper", length, mass, (0, top))
                + rod("lower", second, small, (0.05, top - length))
                + hinge("shoulder", '"upper"', (0, top), (-stop, stop), "damping = 0.02")
                + hinge("elbow", '["lower", "upper"]', (0.025, top - length), (-2.5, elbow), "damping = 0.02")
            )
            controls, body = motor("shoulder", most, 25) + motor("elbow", least, 25), "lower"
            turn = stop + elbow
            goal = (end[0] - second / 2 * math.sin(turn), end[1] - second / 2 * math.cos(turn))
        problem = f"""steps = 500
{controls}[target]
body = "{body}"
x = {goal[0]:.5f}
z = {goal[1]:.5f}
speed = 0
spin = 0
tolerance = {{ position = 1e-2, speed = 2e-2, spin = 5e-2 }}
weight = {{ position = 500, speed = 4, spin = 0.5 }}
[cost]
effort = 1e-5
[search]
runs = 2000
"""
        yield f"swing-{i:02}", opening + scene, problem


def pairs(draw: random.Random) -> Iterator[Problem]:
    """Moves of a box to a place by another box, which is shot at it or pushed against it."""
    for i in range(EACH):
        first, second = draw_size(draw, (0.08, 0.14), (0.16, 0.24))
        masses = draw.uniform(0.6, 1.6), draw.uniform(0.6, 1.6)
        friction = draw.uniform(0.2, 0.5)
        gap = draw.uniform(0.2, 0.5) if i % 2 == 0 else draw.uniform(0.02, 0.15)
        scene = f"""time_step = 0.02
[ground]
friction = {friction:.3f}
[[bodies]]
name = "cue"
box = [{first}, {first}, {first}]
mass = {masses[0]:.3f}
position = [{-(first + second) / 2 - gap:.4f}, 0, {first / 2!r}]
[[bodies]]
name = "object"
box = [{second}, {second}, 0.1]
mass = {masses[1]:.3f}
position = [0, 0, 0.05]
"""
        if i % 2 == 0:
            steps, far = 90, (0.2, 0.9)
            control = 'kind = "start"\nof = "velocity"\nx = [0.5, 8]\ny = [-2, 2]'
            rest, tolerance = "", "position = 1e-3"
        else:
            steps, far = 60, (0.2, 0.6)
            force = sum(masses) * GRAVITY
            ranges = f"x = [{-force:.2f}, {force:.2f}]\ny = [{-force / 2:.2f}, {force / 2:.2f}]"
            control = f'kind = "force"\n{ranges}\nknots = 20'
            rest, tolerance = "speed = 0", "position = 5e-3, speed = 2e-2"
        problem = f"""steps = {steps}
[[controls]]
body = "cue"
{control}
[target]
body = "object"
position = [{draw.uniform(*far):.3f}, {draw.uniform(-0.08, 0.08):.3f}]
{rest}
tolerance = {{ {tolerance} }}
"""
        yield f"pair-{i:02}", scene, problem


def planned(tumble: Path, problem: Problem, stages: str, folder: Path) -> tuple[str, float]:
    """Status and cost of the plan of a problem."""
    name, scene, text = problem
    (folder / "scene.toml").write_text(scene)
    if stages:
        search = "" if "[search]" in text else "[search]\n"
        text += f"{search}stages = {json.dumps(stages.split(','))}\n"
    file = folder / f"{name}.toml"
    file.write_text(f'scene = "scene.toml"\n{text}')
    out = folder / name
    arguments = ["plan", file, "--threads", "1", "--quiet", "--out", out]
    done = subprocess.run([tumble, *arguments], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(f"{name}: {done.stderr}")
    plan = json.loads((out / "plan.json").read_text())
    return plan["status"], plan["cost"]


def main() -> None:
    parser = argparse.ArgumentParser(description="Plans 100 drawn problems and counts the solved ones.")
    parser.add_argument("tumble", type=Path, help="the program, for example target/release/tumble")
    parser.add_argument("--stages", default="", help="stages with commas, instead of the default ones")
    parser.add_argument("--only", default="", help="family: push, throw, flip, swing or pair")
    arguments = parser.parse_args()
    draw = random.Random(SEED)
    problems = [problem for family in (pushes, throws, flips, swings, pairs) for problem in family(draw)]
    solved: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        for problem in problems:
            family = problem[0].split("-")[0]
            if arguments.only not in ("", family):
                continue
            start = time.perf_counter()
            status, cost = planned(arguments.tumble, problem, arguments.stages, Path(folder))
            solved[family] = solved.get(family, 0) + (status == "replayed")
            print(f"{problem[0]} {status} J {cost:.6g}, {time.perf_counter() - start:.1f} s", flush=True)
    for family, count in solved.items():
        print(f"{family}: {count} of {EACH} solved")


if __name__ == "__main__":
    main()
