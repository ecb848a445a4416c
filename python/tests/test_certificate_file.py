"""Files of step certificates: the reference checker agrees with the referee, and refuses planted errors."""

import ast
import copy
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tumble
from test_referee import rotation
from tumble import certificate_check, referee

STEPS = 250
"""Steps of each engine: 1000 of four."""
PARTS = certificate_check.PARTS


def tumbles():
    """Steps of tumble, with the motion at their end."""
    box = {"box": [0.2, 0.3, 0.1], "mass": 2.0, "position": [0, 0, 0.2], "velocity": [1.5, 0, -1], "spin": [3, 2, 1]}
    scene = tumble.Scene([box], ground={"friction": 0.4}, time_step=0.002, integrator="euler")
    run, inertia = scene.run(STEPS), scene.inertias[0]
    contacts = run.contacts

    def momentum(spin, sign):
        return np.linalg.solve(inertia, referee.step_momentum(inertia, spin, sign * scene.time_step))

    for k in range(STEPS):
        own = contacts["k"] == k
        start, end = run.states[k, 0], run.states[k + 1, 0]
        turn, turned = rotation(start[3:7]), rotation(end[3:7])
        points = contacts["point"][own]
        yield referee.certify_bodies(
            masses=scene.masses,
            inertias=scene.inertias,
            positions=[start[:3]],
            attitudes=[start[3:7]],
            # Angular momentum is balanced in the frame of the step's start.
            attitudes_after=[start[3:7]],
            velocities=[start[7:10]],
            velocities_after=[end[7:10]],
            spins=[turn @ momentum(start[10:13], -1.0)],
            spins_after=[turn @ momentum(end[10:13], 1.0)],
            points=points,
            normals=-contacts["normal"][own],
            pairs=np.tile([0, -1], (own.sum(), 1)),
            forces=contacts["force"][own],
            slips=-contacts["slip"][own],
            gaps=contacts["gap"][own],
            gaps_after=(end[:3] + (points - start[:3]) @ turn @ turned.T)[:, 2],
            friction=0.4,
            wrenches=[[0.0] * 6] if k % 2 else None,
            time_step=scene.time_step,
            names=["box"],
        )


MODEL = """
<mujoco>
  <option timestep="0.002" cone="elliptic" integrator="implicitfast"/>
  <worldbody>
    <geom type="plane" size="5 5 1" friction="0.6 0.005 0.001" condim="6"/>
    <body pos="0 0 0.15"><freejoint/><geom type="box" size="0.1 0.08 0.05" mass="1"/></body>
    <body pos="0.4 0 0.12"><freejoint/><geom type="sphere" size="0.1" mass="0.5" condim="6" friction="0.6 0.01 0.01"/></body>
    <body pos="1 0 0.5"><joint type="hinge" axis="0 1 0" range="-20 20" frictionloss="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
      <body pos="0.3 0 0"><joint name="free" type="slide" axis="1 0 0" frictionloss="0.2"/>
        <geom type="sphere" size="0.04" mass="0.2"/></body></body>
    <body pos="2 0 0.5"><joint name="driven" type="hinge" axis="0 1 0"/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
  </worldbody>
  <equality><joint joint1="driven" polycoef="0.2 0 0 0 0"/></equality>
</mujoco>
"""


def mujocos():
    """Steps of MuJoCo: contacts with rolling friction, limits, friction losses and a locked joint."""
    mujoco = pytest.importorskip("mujoco")
    from tumble.mujoco import certify

    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.qvel[:6] = [1.0, 0.5, 0.0, 1.0, 2.0, 3.0]
    for _ in range(STEPS):
        yield certify(model, data)
        mujoco.mj_step(model, data)


def pybullets():
    """Steps of PyBullet: two boxes that fall on each other."""
    pybullet = pytest.importorskip("pybullet")
    from tumble.referee_adapters import pybullet as adapter

    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81)
    pybullet.setTimeStep(0.002)
    pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
    for height, tilt in ((0.13, 0.1), (0.4, 0.3)):
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.1, 0.08, 0.1])
        turn = [0.0, math.sin(tilt / 2), 0.0, math.cos(tilt / 2)]
        box = pybullet.createMultiBody(2.0, shape, basePosition=[0, 0, height], baseOrientation=turn)
        pybullet.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
    try:
        for _ in range(STEPS):
            yield adapter.step(client)
    finally:
        pybullet.disconnect(client)


def drakes():
    """Steps of Drake: a ball that falls and rolls off with a push."""
    pytest.importorskip("pydrake")
    from pydrake import geometry, math
    from pydrake.multibody.math import SpatialVelocity
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder
    from tumble.referee_adapters import drake as adapter

    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.002)
    plant.set_contact_model(ContactModel.kPoint)
    surface = geometry.ProximityProperties()
    geometry.AddContactMaterial(dissipation=1.0, friction=CoulombFriction(0.5, 0.5), properties=surface)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(2.0, 0.1))
    plant.RegisterCollisionGeometry(ball, math.RigidTransform(), geometry.Sphere(0.1), "ball", surface)
    below = math.RigidTransform([0, 0, -0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), below, geometry.Box(10, 10, 1), "floor", surface)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, ball, math.RigidTransform([0, 0, 0.11]))
    plant.SetFreeBodySpatialVelocity(context=context, body=ball, V_JpJc=SpatialVelocity([0, 0, 3], [1, 0.5, 0]))
    for _ in range(STEPS):
        yield adapter.step(simulator, plant, scene_graph)


ENGINES = [
    pytest.param(tumbles, id="tumble"),
    pytest.param(mujocos, id="mujoco"),
    pytest.param(pybullets, id="pybullet", marks=pytest.mark.engines),
    pytest.param(drakes, id="drake", marks=pytest.mark.engines),
]


@pytest.mark.parametrize("steps", ENGINES)
def test_the_checker_agrees_with_the_referee(steps, tmp_path):
    certificates = list(steps())
    path = referee.export(tmp_path / "steps.jsonl", certificates, engine="an engine")
    results = list(certificate_check.check(path.read_text()))
    assert len(results) == STEPS == len(certificates)
    assert [reason for _, _, reason in results] == [""] * STEPS
    for certificate, (_, found, _) in zip(certificates, results):
        for part in PARTS:
            value = getattr(certificate, part)
            assert abs(found[part] - value) <= 1e-9 * max(1.0, value)
    assert sum(bool(certificate.rows) for certificate in certificates) > 50


def numbers_in(value, path=()):
    """Places of all numbers."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from numbers_in(part, (*path, key))
    elif isinstance(value, list):
        for place, part in enumerate(value):
            yield from numbers_in(part, (*path, place))
    elif isinstance(value, float):
        yield path


def changed(step, path, change):
    """Copy of a step with another value at a place."""
    copied = copy.deepcopy(step)
    inner = copied
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = change(inner[path[-1]])
    return copied


MASS = 5.0
"""Mass above those of all bodies, kg."""
PLANTED = {
    **dict.fromkeys(("velocity", "velocity_after", "spin_after"), lambda speed, h: speed),
    **dict.fromkeys(("impulse", "impulses"), lambda speed, h: MASS * speed),
    **dict.fromkeys(("force", "wrench"), lambda speed, h: MASS * speed / h),
    "residuals": lambda speed, h: 1e-6,
}
"""Size of a change of a field that misses Newton's law by more than a speed."""


@pytest.mark.parametrize("steps", ENGINES)
def test_100_planted_errors_are_refused(steps, tmp_path):
    """Numbers chosen at random are changed so that the step misses Newton's law by more than it does."""
    found = [certificate for certificate in steps() if any(row.force > 0.0 for row in certificate.rows)]
    path = referee.export(tmp_path / "steps.jsonl", found[:: len(found) // 10], engine="an engine")
    head, *lines = path.read_text().splitlines()
    rng = np.random.default_rng(7)
    for _ in range(100):
        step = json.loads(lines[rng.integers(len(lines))])
        places = [place for place in numbers_in(step) if any(key in PLANTED for key in place)]
        place = places[rng.integers(len(places))]
        size = next(PLANTED[key] for key in place if key in PLANTED)
        # A radius of gyration is above 0.01 m.
        speed = 100.0 * (2.0 * step["residuals"]["dynamics"] + 1e-8)
        wrong = changed(step, place, lambda value: value + size(speed, step["time_step"]))
        ((_, _, reason),) = certificate_check.check(f"{head}\n{json.dumps(wrong)}\n")
        assert reason, place


BOX = {"mass": 2.0, "inertia": [1.0, 1.0, 1.0], "position": [0.0, 0.0, 0.1], "attitude": [1.0, 0.0, 0.0, 0.0]}
BOX |= {"velocity": [1.0, 0.0, 0.0], "spin": [0.0] * 3, "velocity_after": [1.0 - 0.04905, 0.0, 0.0], "spin_after": [0.0] * 3}
CONTACT = {"bodies": [0, -1], "point": [0.0, 0.0, 0.1], "normal": [0.0, 0.0, -1.0], "friction": 0.5, "gap": 0.0}
CONTACT |= {"impulse": [0.0981, 0.0, -0.1962]}
SLIDE = {
    "kind": "bodies",
    "time_step": 0.01,
    "gravity": [0.0, 0.0, -9.81],
    "bodies": [BOX],
    "contacts": [CONTACT],
    "residuals": dict.fromkeys(PARTS, 0.0),
}
"""The example of the page: a box of 2 kg slides with the full friction."""
LIMIT = {
    "kind": "matrices",
    "time_step": 0.1,
    "mass": [[2.0, 0.0], [0.0, 3.0]],
    "rows": [[1.0, 0.0], [0.0, 1.0]],
    "velocity": [-1.0, 2.0],
    "velocity_after": [-0.3, 2.0 - 0.5 / 3.0],
    "force": [0.0, 0.0],
    "impulses": [1.4, -0.5],
    "offsets": [0.3, 0.0],
    "laws": [{"law": "limit"}, {"law": "box", "least": -0.5, "most": 0.5}],
    "residuals": dict.fromkeys(PARTS, 0.0),
}
"""A limit that stops a mass, and a brake at its bound."""
HEAD = '{"format": "step-certificate 1", "engine": "mine"}'


def reason(step):
    """Why a step is refused."""
    ((_, _, said),) = certificate_check.check(f"{HEAD}\n{step if isinstance(step, str) else json.dumps(step)}\n")
    return said


def test_steps_whose_laws_hold_are_not_refused():
    assert reason(SLIDE) == reason(LIMIT) == ""
    # A length within the tolerance is scaled to 1.
    assert reason(changed(SLIDE, ("contacts", 0, "normal", 2), lambda _: -1.0 - 9e-7)) == ""
    # U+2028 ends a line of a text, but not of JSON.
    assert reason(json.dumps({**SLIDE, "names": ["\u2028"]}, ensure_ascii=False)) == ""


@pytest.mark.parametrize(
    "step, path, value, said",
    [
        (SLIDE, ("kind",), "soft", "the step has no kind bodies or matrices"),
        (SLIDE, ("time_step",), 0.0, "time_step is 0, which is too small"),
        (SLIDE, ("gravity",), [0.0, 0.0], "gravity has the shape (2,) instead of (3,)"),
        ({**SLIDE, "more": 0.0}, ("more",), 1.0, "the step has the unknown field more"),
        (SLIDE, ("bodies", 0, "mass"), -2.0, "bodies[0].mass is -2"),
        (SLIDE, ("bodies", 0, "mass"), True, "bodies[0].mass is not numbers"),
        (SLIDE, ("bodies", 0, "mass"), math.inf, "bodies[0].mass is not finite"),
        (SLIDE, ("bodies", 0, "mass"), 10**400, "bodies[0].mass is not numbers"),
        (SLIDE, ("bodies", 0, "inertia"), [1.0, 1.0, 3.0], "a moment above the sum of the two others"),
        (SLIDE, ("bodies", 0, "inertia"), [[1, 1, 0], [0, 1, 0], [0, 0, 1]], "is not symmetric"),
        (SLIDE, ("bodies", 0, "attitude"), [2.0, 0.0, 0.0, 0.0], "has the length 2 instead of 1"),
        (SLIDE, ("bodies", 0, "spin"), [0.0, "0", 0.0], "bodies[0].spin is not numbers"),
        (SLIDE, ("contacts", 0, "bodies"), [0, 0], "two different bodies are needed"),
        (SLIDE, ("contacts", 0, "bodies"), [0, 1], "a whole number from -1 to 0 is needed"),
        (SLIDE, ("contacts", 0, "normal"), [0.0, 0.0, -2.0], "has the length 2 instead of 1"),
        (SLIDE, ("contacts", 0, "normal"), [0.0, 0.0, 1.0], "penetration is 0 m/s|normal_law is"),
        (SLIDE, ("contacts", 0, "friction"), -0.5, "contacts[0].friction is -0.5"),
        (SLIDE, ("contacts", 0, "friction"), 0.4, "cone is 0.00981 m/s, not 0 as stated|friction_law is"),
        (SLIDE, ("contacts", 0, "friction"), 0.6, "friction_law is 0.00981 m/s, not 0 as stated"),
        (SLIDE, ("contacts", 0, "gap"), -1e-6, "penetration is 0.0001 m/s, not 0 as stated"),
        (SLIDE, ("contacts", 0, "gap"), 1e-6, "normal_law is 0.0001 m/s, not 0 as stated"),
        (SLIDE, ("residuals",), {"dynamics": 0.0}, "residuals has no cone"),
        (SLIDE, ("residuals", "cone"), -1.0, "residuals.cone is -1"),
        (SLIDE, ("residuals", "cone"), 1e-6, "cone is 0 m/s, not 1e-06 as stated"),
        (LIMIT, ("mass",), [[2.0, 1.0], [0.0, 3.0]], "mass is not symmetric"),
        (LIMIT, ("mass",), [[2.0, 3.0], [3.0, 3.0]], "the mass matrix is not positive definite"),
        (LIMIT, ("laws", 0), {"law": "soft"}, "laws[0] has no law of contact, moment"),
        (LIMIT, ("laws", 0), {"law": "limit", "least": 0.0}, "laws[0] has the unknown field least"),
        (LIMIT, ("laws", 0), {"law": "free"}, "constraint is 0.7 m/s, not 0 as stated"),
        (LIMIT, ("laws", 1, "least"), -1.0, "constraint is 0.166666666667 m/s, not 0 as stated"),
        (LIMIT, ("laws", 1), {"law": "moment", "contact": 0, "rolling": 0.1, "torsional": 0.1}, "laws[1].contact is not a contact"),
        (LIMIT, ("rows",), [[1.0, 0.0]], "rows has the shape (1, 2) instead of (2, 2)"),
        ({**LIMIT, "dimension": 3}, ("dimension",), 4, "dimension is 4; a whole number from 2 to 3 is needed"),
    ],
)
def test_what_is_wrong_is_named(step, path, value, said):
    wrong = changed(step, path, lambda _: value)
    assert any(part in reason(wrong) for part in said.split("|")), reason(wrong)


def test_the_example_of_the_page_is_accepted(root):
    page = (root / "docs" / "reference" / "certificate-format.md").read_text()
    head, example = (block.split("\n```")[0] for block in page.split("```json\n")[1:])
    ((_, found, said),) = certificate_check.check(f"{head}\n{example}\n")
    assert said == "" and max(found.values()) < 1e-15
    assert json.loads(example) == {**SLIDE, "bodies": [BOX], "contacts": [CONTACT]}


def test_lines_and_files_that_are_no_certificates_are_refused(tmp_path, capsys):
    assert "Expecting" in reason("{") and "no kind" in reason("[]")
    path = tmp_path / "steps.jsonl"
    for text, said in (("", "Expecting value"), ("{}", "has no engine"), (HEAD.replace("1", "2"), "is needed")):
        path.write_text(text)
        assert certificate_check.main([str(path)]) == 2
        assert said in capsys.readouterr().err
    with pytest.raises(tumble.TumbleError, match="certificates\\[0\\] is int; a Certificate is needed"):
        referee.export(path, [1], engine="none")


def test_the_checker_is_one_file_of_300_lines_that_imports_numpy_alone(tmp_path):
    source = Path(certificate_check.__file__).read_text()
    assert len(source.splitlines()) <= 300
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            names.add(node.module.split(".")[0])
    assert names - set(sys.stdlib_module_names) == {"numpy"}
    copied, steps = tmp_path / "checker.py", tmp_path / "steps.jsonl"
    copied.write_text(source)
    steps.write_text("\n".join([HEAD, json.dumps(SLIDE), json.dumps(LIMIT)]) + "\n")
    done = subprocess.run([sys.executable, "-I", copied, steps], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "2 steps, 0 refused" in done.stdout, done.stderr
    weak = changed(SLIDE, ("contacts", 0, "friction"), lambda _: 0.6)
    weak["residuals"]["friction_law"] = 0.00981
    steps.write_text("\n".join([HEAD, json.dumps(weak)]) + "\n")
    assert certificate_check.main([str(steps)]) == 0
    assert certificate_check.main(["--tolerance", "1e-6", str(steps)]) == 1
