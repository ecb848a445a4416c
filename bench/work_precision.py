"""Work–precision diagram: error of a motion against the processor time that it takes.

    python bench/work_precision.py DATA.json [PROBLEM...] [--draw]

The packages tumble, mujoco, drake (1.58 or later, Python 3.12), scipy and matplotlib are needed.
The script measures the problems, by default all, and stores the numbers in DATA.json. From these
it draws docs/pictures/work-precision.svg and prints the time to each error. ``--draw`` measures nothing.

The error is the largest difference of a position of a body's centre at the end, divided by the
longest edge or diameter of the bodies. The time is the processor time of the compiled stepping
loop on one thread, without the construction of the model: the shortest of at least three runs that
take at least 0.1 s together.

``exact_motions.py`` has the problems and their references. In the last three problems the impact
laws of the engines differ. Each engine is compared with its own finest run there, which has half
the smallest step or a tenth of the smallest accuracy.
"""

import argparse
import json
import math
import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"

import numpy as np
import tumble
from accuracy import SCENARIOS
from exact_motions import PROBLEMS, REFERENCES, SMOOTH, Problem, Tree

STEPS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4)
ACCURACIES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
LEVELS = (1e-3, 1e-4, 1e-5)
LONG = 0.02
"""Time step of runs with an accuracy, s: the longest substep."""
LEAST = 0.1
"""Shortest measurement, s."""
SLOW = 2.0
"""Time of a run after which an engine is not refined further, s."""
FLOOR = 1e-9
"""Smallest error that the diagram shows."""


# Engines. Each function returns a reset, the run and the positions at its end.

Run = tuple[Callable[[], None], Callable[[], Any], Callable[[], Any]]


def numbers(values: Any) -> str:
    """Numbers as text with all digits."""
    return " ".join(repr(float(value)) for value in np.ravel(values))


def run_tumble(problem: Problem, step: float) -> Run:
    """Leapfrog steps."""
    return run_scene(problem.at(step), problem.duration)


def run_accurate(problem: Problem, accuracy: float) -> Run:
    """Steps in substeps that keep an accuracy."""
    return run_scene(problem.at(LONG, accuracy=accuracy), problem.duration)


def run_scene(scene: tumble.Scene, duration: float) -> Run:
    """Steps in one call, which records states and no contacts."""
    steps = round(duration / scene.time_step)
    held: list[Any] = [None, None]

    def begin() -> None:
        held[0] = scene.simulate()

    def run() -> None:
        held[1] = held[0].run(steps, contacts=False)

    return begin, run, lambda: held[1].positions[-1]


def mjcf(problem: Problem, step: float, integrator: str, contact: str, closure: str) -> str:
    """Model with hinges and ball joints, and with attributes of contacts and of the closure of loops."""

    def body(index: int, parent: int, joint: str) -> str:
        turn = problem.turn[index] if parent < 0 else problem.turn[parent].inv() * problem.turn[index]
        geom, table = "", problem.bodies[index]
        if "box" in table:
            geom = f'<geom type="box" size="{numbers(problem.scene.extents[index])}"/>'
        elif "sphere" in table:
            geom = f'<geom type="sphere" size="{table["sphere"]!r}"/>'
        children = "".join(link(j) for j in problem.joints if j.parent == index and not j.closes)
        return f"""<body name="b{index}" pos="{numbers(problem.relative(parent, problem.place[index]))}"
            quat="{numbers(turn.as_quat(scalar_first=True))}">{joint}<inertial pos="0 0 0"
            mass="{float(problem.scene.masses[index])!r}" diaginertia="{numbers(problem.scene.inertias[index].diagonal())}"/>
            {"" if "none" in problem.ground else geom}{children}</body>"""

    def link(joint: Tree) -> str:
        kind = {"revolute": "hinge", "spherical": "ball"}[joint.kind]
        axis = problem.turn[joint.child].inv().apply(joint.axis)
        at = numbers(problem.relative(joint.child, joint.anchor))
        return body(joint.child, joint.parent, f'<joint type="{kind}" pos="{at}" axis="{numbers(axis)}"/>')

    joined = {joint.child for joint in problem.joints}
    free = [body(index, -1, "<freejoint/>") for index in range(len(problem.bodies)) if index not in joined]
    trees = [link(joint) for joint in problem.joints if joint.parent < 0 and not joint.closes]
    loops = "".join(
        f'<connect body1="b{joint.child}" body2="{"world" if joint.parent < 0 else f"b{joint.parent}"}"'
        f' anchor="{numbers(problem.relative(joint.child, joint.anchor))}" {closure}/>'
        for joint in problem.joints
        if joint.closes
    )
    attitude = numbers(problem.slope().as_quat(scalar_first=True))
    plane = "" if "none" in problem.ground else f'<geom type="plane" size="50 50 1" quat="{attitude}"/>'
    return f"""<mujoco><option timestep="{step!r}" integrator="{integrator}" gravity="{numbers(problem.scene.gravity)}"
        cone="elliptic" solver="Newton" tolerance="1e-12" iterations="100"><flag autoreset="disable"/></option>
        <default><geom condim="3" friction="{problem.scene.friction!r} 0 0" {contact}/></default>
        <worldbody>{plane}{"".join(free + trees)}</worldbody><equality>{loops}</equality></mujoco>"""


def run_mujoco(problem: Problem, step: float, integrator: str, stiff: bool) -> Run:
    """MuJoCo with its default constraints, or with stiff ones.

    Stiff contacts have a time constant of 2 ms, and stiff loops none. MuJoCo takes at least two steps.
    """
    import mujoco

    rigid = 'solimp="0.99 0.9999 0.001"'
    contact, closure = (f'solref="0.002 1" {rigid}', f'solref="1e-9 1" {rigid}') if stiff else ("", "")
    if problem.name == "bounce":
        # An elastic impact takes 20 steps.
        contact = f'solref="{-((math.pi / (20 * step)) ** 2)!r} 0" solimp="0.9999 0.9999 0.001"'
    model = mujoco.MjModel.from_xml_string(mjcf(problem, step, integrator, contact, closure))
    data, steps = mujoco.MjData(model), round(problem.duration / step)
    # Trees of joints begin at rest, and free bodies and the top with velocities of their own frames.
    states, joined = problem.scene.states, bool(problem.joints)

    def begin() -> None:
        mujoco.mj_resetData(model, data)
        data.qvel[:] = np.zeros(model.nv) if joined else states[:, 7:].ravel()
        if joined and model.nv == 3:
            data.qvel[:] = states[0, 10:]

    def places() -> Any:
        mujoco.mj_kinematics(model, data)
        return data.xpos[1:].copy()

    return begin, lambda: mujoco.mj_step(model, data, nstep=steps), places


def run_drake(problem: Problem, accuracy: float, stiff: bool) -> Run:
    """Drake's CENIC. Boxes stand on points at their corners, and touch each other by hydroelastic contact."""
    import pydrake.geometry as geometry
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.math import SpatialVelocity
    from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
    from pydrake.multibody.tree import BallRpyJoint, FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder

    builder, scene = DiagramBuilder(), problem.scene
    plant, _ = AddMultibodyPlant(
        MultibodyPlantConfig(time_step=0.0, stiction_tolerance=1e-6 if stiff else 1e-4),
        geometry.SceneGraphConfig(),
        builder,
    )
    plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
    elastic, several = problem.name == "bounce", len(problem.bodies) > 1

    def properties(hydroelastic: bool, rigid: bool) -> Any:
        made, friction = geometry.ProximityProperties(), CoulombFriction(scene.friction, scene.friction)
        point = {"point_stiffness": 1e7} if stiff else {"point_stiffness": 1e4} if elastic else {}
        geometry.AddContactMaterial(properties=made, friction=friction, dissipation=0.0 if elastic else None, **point)
        if hydroelastic and rigid:
            geometry.AddRigidHydroelasticProperties(1.0, made)
        elif hydroelastic:
            geometry.AddCompliantHydroelasticProperties(0.01, 1e9 if stiff else 1e7, made)
        return made

    def pose(body: int) -> Any:
        return RigidTransform(RotationMatrix(problem.turn[body].as_matrix()), problem.place[body])

    def register(body: Any, at: Any, shape: Any, name: str, *kind: bool) -> None:
        plant.RegisterCollisionGeometry(body, RigidTransform(at), shape, name, properties(*kind))

    bodies, contact = [], "none" not in problem.ground
    for k, (name, table) in enumerate(zip(scene.bodies, problem.bodies)):
        unit = UnitInertia(*(scene.inertias[k].diagonal() / scene.masses[k]))
        bodies.append(plant.AddRigidBody(name, SpatialInertia(scene.masses[k], np.zeros(3), unit)))
        if contact and "box" in table and not several:
            radius = 1e-6
            for corner in np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * scene.extents[k]:
                inside = corner - [0.0, 0.0, math.copysign(radius, corner[2])]
                register(bodies[k], inside, geometry.Sphere(radius), f"{corner}", False, False)
        elif contact and "box" in table:
            register(bodies[k], np.zeros(3), geometry.Box(*(2.0 * scene.extents[k])), "box", True, False)
        elif contact:
            register(bodies[k], np.zeros(3), geometry.Sphere(table["sphere"]), "ball", False, False)
    if contact:
        attitude = RigidTransform(RotationMatrix(problem.slope().as_matrix()), np.zeros(3))
        register(plant.world_body(), attitude, geometry.HalfSpace(), "ground", several, True)
    joints = []
    for k, joint in enumerate(problem.joints):
        pair = (joint.parent, joint.child)
        owners = [plant.world_body() if body < 0 else bodies[body] for body in pair]
        if joint.closes:
            points = [problem.relative(body, joint.anchor) for body in pair]
            plant.AddBallConstraint(owners[1], points[1], owners[0], points[0])
            continue
        at = RigidTransform(joint.anchor)
        frames = [
            plant.AddFrame(
                FixedOffsetFrame(f"{k} {end}", owner.body_frame(), at if body < 0 else pose(body).inverse() @ at)
            )
            for end, (owner, body) in enumerate(zip(owners, pair))
        ]
        made = (
            BallRpyJoint(f"j{k}", *frames) if joint.kind == "spherical" else RevoluteJoint(f"j{k}", *frames, joint.axis)
        )
        joints.append(plant.AddJoint(made))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    ApplySimulatorConfig(
        SimulatorConfig(integration_scheme="cenic", accuracy=accuracy, use_error_control=True), simulator
    )
    root = simulator.get_mutable_context()
    context = plant.GetMyContextFromRoot(root)
    spins = problem.turn.apply(scene.states[:, 10:13])
    if not joints:
        for k, body in enumerate(bodies):
            plant.SetFreeBodyPose(context, body, pose(k))
            plant.SetFreeBodySpatialVelocity(
                context=context, body=body, V_JpJc=SpatialVelocity(spins[k], scene.states[k, 7:10])
            )
    elif problem.name == "top":
        joints[0].set_angular_velocity(context, spins[0])
    start = root.Clone()

    def begin() -> None:
        root.SetTimeStateAndParametersFrom(start)
        simulator.Initialize()

    def places() -> Any:
        return np.array([plant.EvalBodyPoseInWorld(context, body).translation() for body in bodies])

    return begin, lambda: simulator.AdvanceTo(problem.duration), places


class Engine(NamedTuple):
    """Curve of the diagram."""

    run: Callable[..., Run]
    settings: tuple[Any, ...]
    precisions: tuple[float, ...]
    colour: str
    dashed: bool


ENGINES = {
    "tumble": Engine(run_tumble, (), STEPS, "#1f5fbf", False),
    "tumble, accuracy": Engine(run_accurate, (), ACCURACIES, "#1f5fbf", True),
    "MuJoCo, implicitfast": Engine(run_mujoco, ("implicitfast", False), STEPS, "#d9822b", False),
    "MuJoCo, implicitfast, stiff": Engine(run_mujoco, ("implicitfast", True), STEPS, "#d9822b", True),
    "MuJoCo, RK4": Engine(run_mujoco, ("RK4", False), STEPS, "#3a9a4c", False),
    "MuJoCo, RK4, stiff": Engine(run_mujoco, ("RK4", True), STEPS, "#3a9a4c", True),
    "Drake, CENIC": Engine(run_drake, (False,), ACCURACIES, "#8a3fa0", False),
    "Drake, CENIC, stiff": Engine(run_drake, (True,), ACCURACIES, "#8a3fa0", True),
}


# Measurements.


def measured(run: Run) -> tuple[float, Any]:
    """Processor time of a run, s, and the positions at its end."""
    begin, advance, places = run
    times: list[float] = []
    while len(times) < 3 or sum(times) < LEAST:
        begin()
        start = time.process_time()
        advance()
        times.append(time.process_time() - start)
        if times[-1] > SLOW:
            break
    return min(times), places()


def curve(problem: Problem, name: str, engine: Engine, reference: Any) -> dict[str, Any]:
    """Times and errors of an engine, and its positions at the finest precision."""
    precisions = engine.precisions
    if reference is None:
        precisions = (*precisions, precisions[-1] * (0.5 if engine.precisions is STEPS else 0.1))
    rows = []
    for precision in precisions:
        try:
            seconds, places = measured(engine.run(problem, precision, *engine.settings))
        except RuntimeError as error:
            print(f"{problem.name}, {name}, {precision:g}: {str(error).splitlines()[0][:200]}", flush=True)
            continue
        rows.append((precision, seconds, places))
        if seconds > SLOW:
            break
    if reference is None:
        *rows, (_, _, reference) = rows
    errors = [float(np.abs(places - reference).max()) / problem.length for _, _, places in rows]
    points = [(p, s, e) for (p, s, _), e in zip(rows, errors) if math.isfinite(e)]
    for precision, seconds, error in points:
        print(f"{problem.name:16} {name:28} {precision:8.1e} {seconds * 1e3:11.4f} ms {error:9.2e}", flush=True)
    return {"points": points, "finest": np.asarray(reference).tolist()}


def engines_of(problem: Problem) -> dict[str, Engine]:
    """Engines of a problem. The stiffness of contacts matters only where there are contacts or loops."""
    contact = "none" not in problem.ground
    loop = any(joint.closes for joint in problem.joints)
    return {
        name: engine
        for name, engine in ENGINES.items()
        if ("stiff" not in name or contact or (loop and "MuJoCo" in name))
        # The default contact of MuJoCo does not bounce.
        and not (problem.name == "bounce" and "MuJoCo" in name and "stiff" not in name)
    }


def milliseconds(seconds: float) -> str:
    """Time in ms with two digits."""
    return f"{seconds * 1e3:.0f}" if seconds >= 0.01 else f"{seconds * 1e3:.2g}"


def reached(points: list[tuple[float, float, float]], level: float) -> tuple[float, str]:
    """Time from which on all errors are at most ``level``, s and as text in ms, by interpolation of logarithms."""
    last = max((k for k, point in enumerate(points) if point[2] > level), default=-1)
    if last + 1 == len(points):
        return math.inf, "–"
    after = points[last + 1]
    if last < 0:
        return after[1], f"< {milliseconds(after[1])}"
    before = points[last]
    low, high = math.log(max(after[2], 1e-16)), math.log(before[2])
    part = (high - math.log(level)) / (high - low)
    seconds = before[1] ** (1.0 - part) * after[1] ** part
    return seconds, milliseconds(seconds)


def table(data: dict[str, Any]) -> str:
    """Markdown table of the times to each error, ms, with the better of the default and the stiff contact."""
    names = [name for name in ENGINES if "stiff" not in name]
    lines, wins = ["| problem | " + " | ".join(names) + " |", "|---" * (1 + len(names)) + "|"], []
    for problem, curves in data.items():
        best = [
            [
                min(reached(curves[label]["points"], level) for label in (name, f"{name}, stiff") if label in curves)
                for level in LEVELS
            ]
            if name in curves or f"{name}, stiff" in curves
            else []
            for name in names
        ]
        lines.append(f"| {problem} | " + " | ".join(", ".join(text for _, text in times) for times in best) + " |")
        fastest = [min((times[k], name) for name, times in zip(names, best) if times)[1] for k in range(len(LEVELS))]
        wins.append((problem in SMOOTH, [name.startswith("tumble") for name in fastest]))
    for what, won in (("all", [row for _, row in wins]), ("smooth", [row for smooth, row in wins if smooth])):
        lines.append(f"tumble takes the least time in {np.sum(won, axis=0)} of {what} {len(won)} problems")
    return "\n".join(lines)


def shared_style(group: re.Match[str]) -> str:
    """Group of SVG markers with the style of its first one."""
    style = re.search(r' style="[^"]*"', group[2])
    return f"{group[1]}{style[0] if style else ''}>" + re.sub(r' style="[^"]*"', "", group[2])


def draw(data: dict[str, Any], path: Path) -> None:
    """Draws a panel for each problem."""
    import matplotlib
    import matplotlib.pyplot as plt

    matplotlib.rcParams.update(
        {"svg.hashsalt": "tumble", "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9}
    )
    figure, axes = plt.subplots(4, 3, figsize=(10, 12.5), sharey=True)
    for panel, name in zip(axes.flat, PROBLEMS):
        panel.set_title(name + ("" if name in REFERENCES else " (own finest run)"), fontsize=10)
        for engine, found in data.get(name, {}).items():
            times, errors = [p[1] * 1e3 for p in found["points"]], [max(p[2], FLOOR) for p in found["points"]]
            style, face = ENGINES[engine], "white" if ENGINES[engine].dashed else ENGINES[engine].colour
            panel.loglog(
                times, errors, "--" if style.dashed else "-", color=style.colour, label=engine,
                marker="o", markersize=3, markerfacecolor=face, linewidth=1.3, zorder=3 if engine == "tumble" else 2,
            )  # fmt: skip
        panel.minorticks_off()
        panel.set_ylim(FLOOR / 2, 3.0)
        panel.grid(color="#dddddd", linewidth=0.6)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
    for panel in axes[-1]:
        panel.set_xlabel("processor time, ms")
    for panel in axes[:, 0]:
        panel.set_ylabel("error / length")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=4, frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 0.955))
    figure.savefig(path, facecolor="white", metadata={"Date": None})
    # Fewer digits, no names of groups, a font that every reader has, and one style for the markers of a curve.
    text = re.sub(r"\d+\.\d{3,}", lambda found: f"{float(found[0]):.1f}", path.read_text())
    text = re.sub(r'<!--.*?-->|(?<=<g) id="[^"]*"(?=>)', "", text)
    text = text.replace("font-family: 'DejaVu Sans'\"", 'font-family: sans-serif"')
    text = re.sub(r'(<g clip-path="[^"]*")>((?:\s*<use [^>]*/>)+)', shared_style, text)
    path.write_text(re.sub(r"\n\s*", "\n", text))


def main() -> None:
    """Measures, stores, draws and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("problems", nargs="*", metavar="PROBLEM", help=", ".join(PROBLEMS))
    parser.add_argument("--draw", action="store_true", help="draw and print the stored numbers")
    parser.add_argument("--engines", default="", help="beginnings of names, with commas between: measure these only")
    options = parser.parse_args()
    data = json.loads(options.data.read_text()) if options.data.exists() else {}
    for name in [] if options.draw else options.problems or PROBLEMS:
        problem = Problem(name)
        reference = REFERENCES[name](problem) if name in REFERENCES else None
        for label, engine in engines_of(problem).items():
            if label.startswith(tuple(options.engines.split(","))):
                data.setdefault(name, {})[label] = curve(problem, label, engine, reference)
        options.data.write_text(json.dumps(data))
    data = {name: data[name] for name in PROBLEMS if name in data}
    draw(data, SCENARIOS.parent / "docs/pictures/work-precision.svg")
    print(table(data))
    for name in [name for name in data if name not in REFERENCES and "tumble" in data[name]]:
        own = np.array(data[name]["tumble"]["finest"])
        for label, found in data[name].items():
            gap = np.abs(np.array(found["finest"]) - own).max() / Problem(name).length
            print(f"{name}: finest run of {label} is {gap:.1e} from that of tumble")


if __name__ == "__main__":
    main()
