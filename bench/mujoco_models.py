"""MJCF models of Python packages in tumble and in MuJoCo.

python bench/mujoco_models.py [--out bench/results] [--only PATTERN] [FOLDER ...]

Without folders these are the packages dm_control, gymnasium, gymnasium_robotics, metaworld and robosuite, as far as they
are installed. Every XML file is loaded in both engines. Where both load it, these are compared:

- the mass of all bodies that move, and the numbers of coordinates and rates;
- origins and attitudes of all bodies at ``qpos0``;
- mass matrix and bias forces at ``qpos0`` with random rates (standard deviation 0.5);
- mean accelerations over 1 ms, from rest and from these rates. Contacts, limits, dry friction, equalities and actuators
  are off.

The mean acceleration is the change of the coordinates beyond that of the initial rates, times 2 / (1 ms)². MuJoCo moves
by RK4 with 64 steps. The motion of tumble is extrapolated from 8, 16 and 32 steps, by
series in the step or in its square, whichever is closer. A model whose dampers or springs are
faster has a shorter time, 0.3 of their time constant. Below 33 µs its motion is not compared. Each difference is relative to
the largest value of its kind, or to 1.

``--out`` writes mujoco-models.md and mujoco-models.json. Each file has a process of its own with a time limit (``--limit``).
"""

import argparse
import json
import multiprocessing
import os
import re
import warnings
from collections import Counter
from importlib.util import find_spec
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tumble

PACKAGES = ("dm_control", "gymnasium", "gymnasium_robotics", "metaworld", "robosuite")
DURATION = 0.001
"""Longest time of the motion, s."""
SHORTEST = 3.3e-5
"""Shortest time of the motion, s."""
STEPS = (8, 16, 32)
TOLERANCE = {
    "mass": 1e-9,
    "frames": 1e-9,
    "mass matrix": 1e-9,
    "bias forces": 1e-9,
    "from rest": 1e-4,
    "from rates": 1e-4,
}
"""Largest differences of values that agree. To the motions RESIDUAL over the time is added."""
RESIDUAL = 1e-7
"""Change of a rate by steps that are solved to 1e-9 m/s, at short links. Over the time it is an acceleration."""
OFF = (
    '<option><flag contact="disable" limit="disable" frictionloss="disable" equality="disable" '
    'actuation="disable"/></option></mujoco>'
)
INTERMEDIATE = "act on one body"
"""Message about an intermediate link, which has a ten-thousandth of the mass below it."""
ELSEWHERE = ("agrees", "no moving body", "not loaded by MuJoCo")
"""Results that are counted but not listed."""
COPY = "tumble-compared.xml"
"""Copy of a file without contacts, beside it because of its relative paths."""


def relative(ours: Any, theirs: Any) -> float:
    """Largest difference, relative to the largest value or to 1."""
    theirs = np.asarray(theirs)
    return float(np.max(np.abs(np.asarray(ours) - theirs), initial=0.0) / max(1.0, np.max(np.abs(theirs), initial=0.0)))


def first_line(error: BaseException) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def loaded(path: Path, **settings: Any) -> tuple[tumble.Scene, list[str]]:
    """Scene of a file and its messages."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = tumble.load(path, point_contacts=True, **settings)
    return scene, [str(one.message) for one in caught]


def compare(path: Path) -> dict[str, Any]:
    """Result of one file: its status, and the differences if both engines load it."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except Exception as error:
        return {"status": "not loaded by MuJoCo", "reason": first_line(error)}
    if model.nv == 0:
        return {"status": "no moving body", "reason": ""}
    try:
        _, messages = loaded(path)
    except tumble.TumbleError as error:
        return {"status": "refused", "reason": str(error).replace(str(path.parent), "").strip()}
    result: dict[str, Any] = {"status": "loaded", "messages": messages}
    copy = path.with_name(f"{path.stem}-{COPY}")
    try:
        text = path.read_text(encoding="utf-8-sig")
        copy.write_text(OFF.join(text.rsplit("</mujoco>", 1)))
        result |= differences(copy)
    except tumble.TumbleError as error:
        result |= {"status": "refused without contacts", "reason": str(error)}
    finally:
        copy.unlink(missing_ok=True)
    return result


def differences(path: Path) -> dict[str, Any]:
    """Differences of a file whose contacts are off."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    first = loaded(path)[0]
    robot = first.simulate().robot
    moving = model.body_treeid >= 0
    result: dict[str, Any] = {
        "counts": [[model.nq, model.nv], list(robot.counts)],
        "links": [model.nbody, len(robot.links)],
    }
    result["mass"] = relative(first.masses.sum(), model.body_mass[moving].sum())
    if tuple(robot.counts) != (model.nq, model.nv):
        return result
    q, v = model.qpos0.copy(), 0.5 * np.random.default_rng(1).normal(size=model.nv)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    links = robot.kinematics(q)
    if len(robot.links) == model.nbody:
        result["frames"] = max(relative(links.positions, data.xpos), min_turn(links.attitudes, data.xquat))
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    result["mass matrix"] = relative(robot.mass_matrix(q), mass)
    # MuJoCo has gravity compensation among its passive forces.
    result["bias forces"] = relative(robot.bias_forces(q, v), data.qfrc_bias - data.qfrc_gravcomp)
    duration = min(DURATION, 0.3 / fastest(model, mass))
    result["duration"] = duration
    if duration < SHORTEST:
        return result
    scenes = [loaded(path, time_step=duration / steps)[0] for steps in STEPS]
    for name, rates in (("from rest", np.zeros(model.nv)), ("from rates", v)):
        result[name] = motion(model, scenes, q, rates, duration)
    return result


def fastest(model: Any, mass: Any) -> float:
    """Largest rate of joint dampers and springs, 1/s."""
    rates = []
    stiffness = np.zeros(model.nv)
    for joint in range(model.njnt):
        at, size = model.jnt_dofadr[joint], {0: 6, 1: 3}.get(int(model.jnt_type[joint]), 1)
        stiffness[at : at + size] = np.ravel(model.jnt_stiffness)[joint * model.jnt_stiffness.size // model.njnt]
    damping = np.asarray(model.dof_damping).reshape(model.nv, -1)[:, 0]
    for values, power in ((damping, 1.0), (stiffness, 0.5)):
        rates.append(float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(mass, np.diag(values)))))) ** power)
    return max(1.0, *rates)


def min_turn(ours: Any, theirs: Any) -> float:
    """Largest difference of unit quaternions of either sign."""
    return float(np.max(np.minimum(np.abs(ours - theirs).max(axis=1), np.abs(ours + theirs).max(axis=1)), initial=0.0))


def motion(model: Any, scenes: list[tumble.Scene], q: Any, v: Any, duration: float) -> float:
    """Largest difference of the mean accelerations, relative to the largest initial acceleration or to 1."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    scale = max(1.0, float(np.max(np.abs(data.qacc))))
    model.opt.timestep = duration / 64
    for _ in range(64):
        mujoco.mj_step(model, data)
    changes = []
    for scene, steps in zip(scenes, STEPS, strict=True):
        simulation = scene.simulate()
        simulation.robot.set(q, v)
        for _ in range(steps):
            simulation.step()
        change = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, change, 1.0, data.qpos, simulation.robot.q)
        changes.append(change)
    # The scheme has errors of second order in the step, its joint dampers of first order.
    found = min(float(np.max(np.abs(extrapolated(changes, orders)))) for orders in ((1, 2), (2, 4)))
    return found * 2.0 / duration**2 / scale


def extrapolated(values: list[Any], orders: tuple[int, ...]) -> Any:
    """Limit of values with halved steps whose errors have terms of these orders in the step."""
    for order in orders:
        values = [(2.0**order * fine - coarse) / (2.0**order - 1.0) for coarse, fine in pairwise(values)]
    return values[0]


def work(path: Path, pipe: Connection) -> None:
    try:
        pipe.send(compare(path))
    except Exception as error:
        pipe.send({"status": "error", "reason": f"{type(error).__name__}: {first_line(error)}"})


def timed(path: Path, limit: float) -> dict[str, Any]:
    """Result of a file by a process of its own."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(target=work, args=(path, theirs))
    child.start()
    theirs.close()
    try:
        result: dict[str, Any] = ours.recv() if ours.poll(limit) else {"status": "time limit", "reason": f"{limit:g} s"}
    except EOFError:
        result = {"status": "crash", "reason": "the process ended"}
    child.kill()
    child.join()
    path.with_name(f"{path.stem}-{COPY}").unlink(missing_ok=True)
    return result


def allowed(name: str, result: dict[str, Any]) -> float:
    """Largest difference that agrees."""
    return TOLERANCE[name] + (RESIDUAL / result["duration"] if name.startswith("from") else 0.0)


def verdict(result: dict[str, Any]) -> str:
    """Status, or what differs."""
    if result["status"] != "loaded":
        return str(result["status"])
    if result["counts"][0] != result["counts"][1]:
        return "other coordinates"
    beyond = [name for name in TOLERANCE if name in result and not result[name] <= allowed(name, result)]
    if beyond and INTERMEDIATE in " ".join(result["messages"]) and result["mass matrix"] <= 1e-4:
        return "intermediate link: " + ", ".join(beyond)
    return "agrees" if not beyond else "differs: " + ", ".join(beyond)


def table(results: dict[str, dict[str, dict[str, Any]]]) -> str:
    """Counts by package, then the files that are refused or differ."""
    verdicts = {
        package: Counter(verdict(one).partition(":")[0] for one in files.values()) for package, files in results.items()
    }
    columns = list(dict.fromkeys(name for counts in verdicts.values() for name, _ in counts.most_common()))
    lines = [
        "# MJCF models of Python packages",
        "",
        f"tumble {tumble.__version__}, MuJoCo {mujoco.__version__}:",
        "",
        "    python bench/mujoco_models.py --out bench/results",
        "",
        f"| package | files | {' | '.join(columns)} |",
    ]
    lines.append("|---" * (len(columns) + 2) + "|")
    for package, counts in verdicts.items():
        lines.append(f"| {package} | {counts.total()} | {' | '.join(str(counts[name]) for name in columns)} |")
    kinds = list(TOLERANCE)
    agreeing = [one for files in results.values() for one in files.values() if verdict(one) == "agrees"]
    lines += [
        "",
        f"Largest differences of the {len(agreeing)} files that agree:",
        "",
        f"| {' | '.join(kinds)} |",
        "|---" * len(kinds) + "|",
    ]
    largest = (max((one[kind] for one in agreeing if kind in one), default=0.0) for kind in kinds)
    lines += [f"| {' | '.join(f'{value:.1e}' for value in largest)} |", ""]
    lines += ["| file | result | differences, messages or reason |", "|---|---|---|"]
    for package, files in results.items():
        for name, one in files.items():
            said = verdict(one)
            if said in ELSEWHERE:
                continue
            numbers = [
                f"{kind} {one[kind]:.1e}" for kind in kinds if kind in one and not one[kind] <= allowed(kind, one)
            ]
            notes = [
                message for message in one.get("messages", []) if INTERMEDIATE in message or "times as heavy" in message
            ]
            detail = one.get("reason") or "; ".join([*numbers, *notes])
            lines.append(f"| {package}/{name} | {said.partition(':')[0]} | {detail.replace('|', '/')[:400]} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", default="", help="regular expression of file names")
    parser.add_argument("--limit", type=float, default=120.0)
    args = parser.parse_args()
    specs = {name: find_spec(name) for name in PACKAGES}
    roots = {path.name: path for path in args.folders} or {
        name: Path(spec.submodule_search_locations[0])
        for name, spec in specs.items()
        if spec and spec.submodule_search_locations
    }
    results: dict[str, dict[str, dict[str, Any]]] = {}
    for package, root in roots.items():
        results[package] = {}
        for path in sorted(root.rglob("*.xml")):
            name = os.fspath(path.relative_to(root))
            if not re.search(args.only, name) or name.endswith(COPY):
                continue
            results[package][name] = timed(path, args.limit)
            print(f"{package}/{name}: {verdict(results[package][name])}", flush=True)
            if args.out is not None:
                args.out.mkdir(parents=True, exist_ok=True)
                (args.out / "mujoco-models.json").write_text(json.dumps(results, indent=1))
    text = table(results)
    if args.out is None:
        print(text)
    else:
        (args.out / "mujoco-models.md").write_text(text)


if __name__ == "__main__":
    main()
