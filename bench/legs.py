"""Plans the acrobot's swing-up and the hopper's jump from 20 random starts each, and counts the solved ones.

    python bench/legs.py target/release/tumble
    python bench/legs.py target/release/tumble --only jump

Masses vary by 10 %. The rods of the acrobot start up to 0.1 rad from hanging, the hopper up to 3 cm
above the ground with up to 0.2 m/s. The seed is fixed. Each search uses one thread.
"""

import argparse
import json
import math
import random
import resource
import subprocess
import tempfile
import tomllib
from pathlib import Path
from typing import Any

SEED = 20261126
EACH = 20
PLANS = Path(__file__).resolve().parent.parent / "scenarios" / "plans"

Table = dict[str, Any]


def toml(value: Any) -> str:
    """Inline TOML of a value."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    return json.dumps(value)


def turned(point: list[float], pivot: list[float], angle: float) -> list[float]:
    """A point turned about the y axis through a pivot."""
    x, z = point[0] - pivot[0], point[2] - pivot[2]
    sin, cos = math.sin(angle), math.cos(angle)
    return [pivot[0] + x * cos + z * sin, point[1], pivot[2] - x * sin + z * cos]


def vary_rods(scene: Table, draw: random.Random) -> None:
    """Turns both rods about the shoulder, and the lower one about the elbow."""
    both, lower = draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)
    shoulder, elbow = scene["joints"]
    elbow["anchor"] = turned(elbow["anchor"], shoulder["anchor"], both)
    for body in scene["bodies"]:
        angle = both
        body["position"] = turned(body["position"], shoulder["anchor"], both)
        if body["name"] == "lower":
            body["position"] = turned(body["position"], elbow["anchor"], lower)
            angle += lower
        body["attitude"] = {"axis": [0, 1, 0], "degrees": math.degrees(angle)}


def vary_hopper(scene: Table, draw: random.Random) -> None:
    """Lifts the hopper and lets it move along x."""
    height, speed = draw.uniform(0, 0.03), draw.uniform(-0.2, 0.2)
    for body in scene["bodies"]:
        body["position"][2] += height
        body["velocity"] = [speed, 0, 0]
    for joint in scene["joints"]:
        joint["anchor"][2] += height


def varied(problem: str, draw: random.Random) -> tuple[Table, Table]:
    """Scene and problem of a random start."""
    search = tomllib.loads((PLANS / f"{problem}.toml").read_text())
    scene = tomllib.loads((PLANS / search["scene"]).read_text())
    for body in scene["bodies"]:
        body["mass"] *= draw.uniform(0.9, 1.1)
    vary = {"acrobot": vary_rods, "jump": vary_hopper}
    vary[problem](scene, draw)
    return scene, {**search, "scene": "scene.toml"}


def write(path: Path, table: Table) -> None:
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in table.items()))


def main() -> None:
    parser = argparse.ArgumentParser(description="Plans two problems from 20 random starts each.")
    parser.add_argument("tumble", type=Path, help="the program, for example target/release/tumble")
    parser.add_argument("--only", choices=["acrobot", "jump"], help="one problem")
    arguments = parser.parse_args()
    for problem in [arguments.only] if arguments.only else ["acrobot", "jump"]:
        draw = random.Random(f"{SEED} {problem}")
        solved, before = 0, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        for number in range(EACH):
            scene, search = varied(problem, draw)
            with tempfile.TemporaryDirectory() as folder:
                write(Path(folder) / "scene.toml", scene)
                write(Path(folder) / "problem.toml", search)
                command = [arguments.tumble, "plan", f"{folder}/problem.toml", "--threads", "1", "--quiet"]
                done = subprocess.run([*command, "--out", folder + "/out"], capture_output=True, text=True)
                if done.returncode not in (0, 3):
                    raise SystemExit(f"{problem} {number}: {done.stderr}")
                plan = json.loads((Path(folder) / "out/plan.json").read_text())
            solved += plan["status"] == "replayed"
            seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
            print(problem, number, plan["status"], f"J {plan['cost']:.4g}, {seconds:.0f} s so far,", plan["reason"], flush=True)
        print(f"{problem}: {solved} of {EACH} solved")


if __name__ == "__main__":
    main()
