"""Certificates: closed forms, tumble's own steps and refusals."""

import numpy as np
import pytest
import tumble
from tumble import referee

GRAVITY = 9.81
BOX = {
    "masses": [2.0],
    "inertias": [np.eye(3)],
    "positions": [[0, 0, 0.1]],
    "attitudes": [[1, 0, 0, 0]],
    "velocities": [[1, 0, 0]],
    "spins": [[0, 0, 0]],
    "spins_after": [[0, 0, 0]],
    # At the centre of mass, so that friction does not turn the box.
    "points": [[0, 0, 0.1]],
    "normals": [[0, 0, -1]],
    "pairs": [[0, -1]],
    "friction": 0.5,
    "time_step": 0.01,
    "names": ["box"],
}


def slide(deceleration=0.5 * GRAVITY, height=0.0, **more):
    """Certificate of a box that is braked by friction alone."""
    return referee.certify_bodies(
        **{
            **BOX,
            "velocities_after": [[1 - 0.01 * deceleration, 0, -height / 0.01]],
            "forces": [[-2 * deceleration, 0, 2 * GRAVITY - 2 * height / 0.01**2]],
            "gaps": [height],
            **more,
        }
    )


def rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_a_block_that_slides_with_the_deceleration_of_coulomb_is_certified():
    certificate = slide()
    assert certificate.residual < 1e-15 and str(certificate).startswith("all laws hold to ")
    (row,) = certificate.rows
    assert row.name == "box–world" and row.kind == "contact"
    assert row.force == pytest.approx(2 * GRAVITY) and row.friction_force == pytest.approx(GRAVITY)
    assert row.ratio == pytest.approx(1.0) and row.slip == pytest.approx(1 - 0.005 * GRAVITY)


def test_a_block_that_slides_inside_its_cone_is_named():
    certificate = slide(deceleration=0.4 * GRAVITY)
    # The friction force falls short of the cone by a fifth: w (μ p_n - p_t) = 0.1 g h.
    assert certificate.friction_law == pytest.approx(0.1 * GRAVITY * 0.01)
    assert certificate.residual == certificate.friction_law and certificate.dynamics < 1e-15
    assert certificate.worst == "friction law at contact box–world"
    assert str(certificate) == "contact box–world slips 961 mm/s inside its cone (ratio 0.8)"
    assert "contact box–world" in certificate.table() and "friction law" in certificate.table()


def test_each_fault_has_its_sentence():
    beyond = slide(deceleration=0.6 * GRAVITY)
    assert beyond.cone == pytest.approx(0.1 * GRAVITY * 0.01)
    assert str(beyond) == "contact box–world has a friction force beyond its cone (ratio 1.2)"
    fast = slide(forces=[[-GRAVITY, 0, 2 * GRAVITY - 2.0]])
    assert fast.dynamics == pytest.approx(0.01) and str(fast) == "the velocities miss Newton's law by 10 mm/s"
    assert fast.worst == "dynamics"
    inside = slide(gaps=[-1e-5])
    assert inside.penetration == pytest.approx(1e-3) and inside.normal_law == pytest.approx(1e-3)
    assert str(inside) == "contact box–world ends the step 10 µm inside"
    apart = slide(gaps=[1e-5])
    assert apart.penetration == 0.0 and apart.normal_law == pytest.approx(1e-3)
    assert str(apart) == "contact box–world pushes with 19.6 N and ends the step 10 µm apart"
    pulled = slide(velocities_after=[[1, 0, -0.01 * GRAVITY - 0.02]], forces=[[0, 0, -4.0]], gaps=[1.0])
    assert str(pulled) == "contact box–world pulls with 4 N"


def test_a_body_that_lands_closes_its_gap_exactly():
    # The floor takes the weight but for the force that stops a fall of 0.1 mm in 10 ms, 1 m/s².
    landed = slide(height=1e-4, deceleration=0.5 * (GRAVITY - 1.0))
    assert landed.residual < 1e-14 and landed.rows[0].gap_speed < 1e-14


def test_generalised_coordinates_have_the_laws_of_contact_problems():
    given = {"M": np.diag([2.0, 3.0]), "velocity_before": [1.0, 2.0], "time_step": 0.1, "force": [0.0, 0.0]}
    J, laws = np.eye(2), [["limit"], [("box", -0.5, 0.5)]]
    problem = tumble.ContactProblem(M=given["M"], H=J.T, f=[-2.0, 6.0], w=[0.3, 0.0], laws=laws)
    solution = problem.solve()
    given["velocity_before"] = [-1.0, 2.0]
    certificate = referee.certify(
        **given, J=J, laws=laws, w=[0.3, 0.0], velocity_after=solution.body_velocities, impulses=solution.impulses
    )
    assert certificate.residual < 1e-12
    limit, brake = certificate.rows
    assert (limit.kind, brake.kind) == ("limit", "box") and limit.gap == pytest.approx(0.03)
    assert brake.force == pytest.approx(-5.0) and limit.force == pytest.approx(14.0)
    locked = referee.certify(
        **given, J=J, laws=[["locked", "free"]], velocity_after=[-1.0, 2.0], impulses=[0.0, 0.0], names=["joint"]
    )
    assert locked.constraint == 1.0 and str(locked) == "locked joint misses its law by 1 m/s"


def test_random_solutions_of_tumble_are_certified():
    rng = np.random.default_rng(3)
    for _ in range(20):
        contacts, size = int(rng.integers(1, 5)), int(rng.integers(12, 20))
        root = rng.normal(size=(size, size))
        M, J = root @ root.T + np.eye(size), rng.normal(size=(3 * contacts, size))
        before, w, mu = rng.normal(size=size), rng.normal(size=3 * contacts), rng.uniform(0.1, 0.8, contacts)
        w.reshape(-1, 3)[:, 1:] = 0.0
        solution = tumble.ContactProblem(M=M, H=J.T, f=M @ before, w=w, mu=mu).solve()
        assert solution.solved
        certificate = referee.certify(
            M=M, J=J, laws=list(mu), w=w, velocity_before=before, velocity_after=solution.body_velocities,
            impulses=solution.impulses, force=np.zeros(size), time_step=1.0,
        )  # fmt: skip
        assert certificate.residual < 1e-9


@pytest.mark.parametrize("size", [0.2, [0.2, 0.3, 0.1]])
def test_the_steps_of_a_thrown_box_are_certified(size):
    box = {"box": size, "mass": 2.0, "position": [0, 0, 0.3], "velocity": [1.5, 0, -1], "spin": [3, 2, 1]}
    scene = tumble.Scene([box], ground={"friction": 0.4}, time_step=0.002, integrator="euler")
    run, inertia = scene.run(400), scene.inertias[0]
    assert run.unsolved == []

    def momentum(spin, sign):
        return np.linalg.solve(inertia, referee.step_momentum(inertia, spin, sign * scene.time_step))

    contacts, touched = run.contacts, 0
    for k in range(400):
        own = contacts["k"] == k
        start, end = run.states[k, 0], run.states[k + 1, 0]
        turn, turned = rotation(start[3:7]), rotation(end[3:7])
        points = contacts["point"][own]
        ends = end[:3] + (points - start[:3]) @ turn @ turned.T
        certificate = referee.certify_bodies(
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
            gaps_after=ends[:, 2],
            friction=0.4,
            time_step=scene.time_step,
            gravity=scene.gravity,
        )
        assert certificate.residual < 1e-9, (k, certificate.table())
        touched += any(row.force > 0.0 for row in certificate.rows)
    assert touched > 100


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"masses": [0.0]}, "masses has 0 kg; positive masses are needed"),
        ({"time_step": 0.0}, "time_step is 0; a positive number is needed"),
        ({"time_step": "fast"}, "time_step is 'fast'; a number is needed"),
        ({"forces": [[1.0, 2.0]]}, "forces has shape (1, 2); (1, 3) is needed"),
        ({"velocities_after": [[np.nan, 0, 0]]}, "velocities_after[0, 0] is nan; finite numbers are needed"),
        ({"attitudes": [[2, 0, 0, 0]]}, "attitudes has a quaternion of length 2; 1 is needed"),
        ({"normals": [[0, 0, 2]]}, "normals has a vector of length 2; 1 is needed"),
        ({"pairs": [[0, 1]]}, "pairs has body 1; -1 to 0 are needed"),
        ({"pairs": [[0.0, -1.0]]}, "whole numbers (1, 2) are needed"),
        ({"names": ["a", "b"]}, "names has 2 entries; 1 are needed"),
        ({"pairs": [[0, 0]]}, "pairs has body 0 twice in a contact; two bodies are needed"),
        ({"friction": -0.5}, "friction has -0.5; coefficients from 0 are needed"),
        ({"friction": np.nan}, "friction is nan; finite numbers are needed"),
        ({"inertias": [np.zeros((3, 3))]}, "inertias[0] is not a symmetric matrix with positive moments"),
        ({"inertias": [np.eye(3) + np.eye(3, k=1)]}, "inertias[0] is not a symmetric matrix with positive moments"),
        ({"inertias": [np.diag([1, 1, 100])]}, "inertias[0] has a moment above the sum of the two others"),
    ],
)
def test_what_is_wrong_is_named(wrong, said):
    with pytest.raises(tumble.TumbleError) as error:
        slide(**wrong)
    assert said in str(error.value) and "\n" not in str(error.value)


def test_a_step_without_contacts_has_dynamics_alone():
    none = {name: np.zeros((0, 3)) for name in ("points", "normals", "forces")}
    certificate = slide(**none, pairs=[], gaps=[], friction=[], velocities_after=[[1, 0, -0.01 * GRAVITY]])
    assert certificate.rows == () and certificate.residual < 1e-15 and certificate.worst == "dynamics"


@pytest.mark.engines
def test_a_step_of_pybullet_is_certified():
    pybullet = pytest.importorskip("pybullet", reason="pybullet is not installed")
    from tumble.referee_adapters import pybullet as adapter

    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -GRAVITY)
        pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
        box = pybullet.createMultiBody(2.0, shape, basePosition=[0, 0, 0.5])
        pybullet.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
        falls = adapter.step(client)
        assert falls.rows == () and falls.residual < 1e-12
        for _ in range(240):
            rests = adapter.step(client)
        assert sum(row.force for row in rests.rows) == pytest.approx(2 * GRAVITY, rel=1e-2)
        assert 1e-6 < rests.penetration < 1.0 and rests.cone < 1e-9
    finally:
        pybullet.disconnect(client)


@pytest.mark.engines
def test_a_step_of_drake_is_certified():
    pytest.importorskip("pydrake", reason="drake is not installed")
    from pydrake import geometry, math
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
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, ball, math.RigidTransform([0, 0, 0.101]))
    falls = adapter.step(simulator, plant, scene_graph)
    assert falls.rows == () and falls.residual < 1e-12
    for _ in range(1000):
        rests = adapter.step(simulator, plant, scene_graph)
    (row,) = rests.rows
    assert row.name == "ball–world" and row.force == pytest.approx(2 * GRAVITY, rel=1e-3)
    assert rests.dynamics < 1e-6 and rests.penetration > 1e-6


@pytest.mark.engines
def test_a_step_of_newton_is_certified():
    newton = pytest.importorskip("newton", reason="newton is not installed")
    import warp
    from tumble.referee_adapters import newton as adapter

    builder = newton.ModelBuilder()
    builder.add_ground_plane()
    box = builder.add_body(xform=warp.transform((0, 0, 0.1), warp.quat_identity()), label="box")
    builder.add_shape_box(box, hx=0.1, hy=0.1, hz=0.1)
    model = builder.finalize(device="cpu")
    solver, start, end, contacts = newton.solvers.SolverXPBD(model), model.state(), model.state(), model.contacts()
    observables = solver.observables({solver.ObservableKind.CONTACT_F}, contacts=contacts)
    for _ in range(200):
        start.clear_forces()
        model.collide(start, contacts)
        certificate = adapter.step(solver, start, end, model.control(), contacts, 0.002, observables)
        # Single precision.
        assert certificate.dynamics < 1e-3
        start, end = end, start
    assert sum(row.force for row in certificate.rows) == pytest.approx(8 * GRAVITY, rel=1e-2)
    assert certificate.penetration > 1e-3 and "inside" in str(certificate)
