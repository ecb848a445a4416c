"""Hard steps and certificates of MuJoCo models: closed forms, comparisons and robots."""

import copy
import importlib.util
import runpy
import warnings
from pathlib import Path

import numpy as np
import pytest
import tumble

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
tm = pytest.importorskip("tumble.mujoco")

GRAVITY = 9.81
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def load(body, option="", more=""):
    text = f"<mujoco><option {option}/><worldbody>{body}</worldbody>{more}</mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def on_floor(shape, height, option="", friction=0.5):
    return load(
        f"<geom name='floor' type='plane' size='5 5 1' friction='{friction}'/>"
        f"<body name='body' pos='0 0 {height}'><freejoint/>"
        f"<geom name='body' {shape} mass='2' friction='{friction}'/></body>",
        option,
    )


BOX = "type='box' size='.1 .1 .1'"


def tangents(model, data):
    """Tangents of the first contact of a body that rests on the floor (2, 3)."""
    height = data.qpos[2]
    data.qpos[2] -= 1e-9
    mujoco.mj_forward(model, data)
    data.qpos[2] = height
    return data.contact[0].frame.reshape(3, 3)[1:].copy()


def steps(model, data, count, **more):
    reports = []
    for _ in range(count):
        reports.append(tm.hard_step(model, data, unsolved="raise", **more))
        assert reports[-1].residual <= 1e-9
    return reports


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_a_box_slides_with_the_deceleration_of_coulomb(cone):
    model, data = on_floor(BOX, 0.1, f"cone='{cone}'", friction=0.3)
    data.qvel[:2] = 0.8, 0.6
    reports = steps(model, data, 100)
    np.testing.assert_allclose(np.hypot(*data.qvel[:2]), 1.0 - 0.3 * GRAVITY * 0.2, atol=1e-9)
    assert abs(data.qpos[2] - 0.1) < 1e-12 and data.time == pytest.approx(0.2)
    assert max(report.certificate().residual for report in reports) < 1e-9
    # The forces stand where MuJoCo's functions look for them.
    total, force = np.zeros(3), np.zeros(6)
    for place in range(data.ncon):
        mujoco.mj_contactForce(model, data, place, force)
        total += data.contact[place].frame.reshape(3, 3).T @ force[:3]
    np.testing.assert_allclose(total, [-0.3 * 2 * GRAVITY * 0.8, -0.3 * 2 * GRAVITY * 0.6, 2 * GRAVITY], atol=1e-6)
    np.testing.assert_allclose(data.qfrc_constraint[:3], total, atol=1e-6)


@pytest.mark.parametrize("slope, moves", [(0.29, False), (0.31, True)])
def test_a_box_on_a_slope_slips_beyond_the_angle_of_friction(slope, moves):
    angle = np.arctan(slope)
    pull = f"gravity='{GRAVITY * np.sin(angle)} 0 {-GRAVITY * np.cos(angle)}'"
    model, data = on_floor(BOX, 0.1, pull, friction=0.3)
    steps(model, data, 500)
    if moves:
        assert data.qvel[0] == pytest.approx(GRAVITY * np.cos(angle) * (slope - 0.3), rel=1e-6)
    else:
        assert abs(data.qpos[0]) < 1e-12


def test_friction_may_differ_along_the_tangents():
    pair = "<contact><pair geom1='floor' geom2='body' friction='0.2 0.6 0 0 0' condim='3'/></contact>"
    for direction, friction in ((0, 0.2), (1, 0.6)):
        model, data = load(
            f"<geom name='floor' type='plane' size='5 5 1'/><body pos='0 0 .1'><freejoint/><geom name='body' {BOX} mass='2'/></body>",
            "cone='elliptic'",
            pair,
        )
        data.qvel[:3] = tangents(model, data)[direction]
        steps(model, data, 50)
        assert np.linalg.norm(data.qvel[:2]) == pytest.approx(1.0 - friction * GRAVITY * 0.1, abs=1e-9)


@pytest.mark.parametrize("frictions", ["0.5 0.1", "0.1 0.5", "0 0.5"])
def test_slips_and_forces_of_two_coefficients_are_those_of_the_motion(frictions):
    pair = f"<contact><pair geom1='floor' geom2='body' friction='{frictions} 0 0 0' condim='3'/></contact>"
    model, data = load(
        f"<geom name='floor' type='plane' size='5 5 1'/><body pos='0 0 .1'><freejoint/><geom name='body' {BOX} mass='2'/></body>",
        "cone='elliptic'",
        pair,
    )
    second = tangents(model, data)[1]
    data.qvel[:3] = second
    friction = float(frictions.split()[1])
    certificate = steps(model, data, 1)[0].certificate()
    speed = 1.0 - friction * GRAVITY * 0.002
    assert second @ data.qvel[:3] == pytest.approx(speed, abs=1e-9)
    rows = [row for row in certificate.rows if row.kind == "contact" and row.force > 0.0]
    assert all(row.slip == pytest.approx(speed, abs=1e-6) for row in rows)
    assert sum(row.friction_force for row in rows) == pytest.approx(friction * 2 * GRAVITY, rel=1e-6)
    soft = tm.certify(model, data)
    mujoco.mj_step(model, data)
    # Its corners have the speed of the box and some of its rotation.
    found = max(row.slip for row in soft.rows if row.kind == "contact")
    assert found == pytest.approx(np.linalg.norm(data.qvel[:2]), rel=0.1)


def test_a_frictionless_ball_is_stopped_by_torsional_resistance():
    model, data = on_floor(ROLLING.replace("6", "4", 1), 0.1, "", friction="0 0.01 0.01")
    data.qvel[5] = 10.0
    steps(model, data, 50)
    assert data.qvel[5] == pytest.approx(10.0 - 0.01 * GRAVITY * 0.1 / (0.4 * 0.01), abs=1e-6)


def test_one_coefficient_of_rolling_acts_about_its_tangent():
    pair = "<contact><pair geom1='floor' geom2='body' friction='.5 .5 0 0 .02' condim='6'/></contact>"
    model, data = load(
        "<geom name='floor' type='plane' size='5 5 1'/>"
        "<body pos='0 0 .1'><freejoint/><geom name='body' type='sphere' size='.1' mass='2'/></body>",
        "cone='elliptic'",
        pair,
    )
    first = tangents(model, data)[0]
    # Rolls along the first tangent, about the second.
    data.qvel[:3] = first
    data.qvel[3:] = np.cross([0.0, 0.0, 1.0], first) / 0.1
    steps(model, data, 100)
    assert first @ data.qvel[:3] == pytest.approx(1.0 - 0.02 * GRAVITY * 0.2 / (1.4 * 0.1), abs=1e-3)


@pytest.mark.parametrize("way", [0, 1])
def test_a_box_slides_straight_over_a_flat_height_field(way):
    model, data = load(
        "<geom name='floor' type='hfield' hfield='flat' friction='0.5'/>"
        f"<body pos='0.03 0.02 0.2'><freejoint/><geom name='body' {BOX} mass='2' friction='0.5'/></body>",
        more="<asset><hfield name='flat' nrow='20' ncol='20' size='2 2 .2 .1'/></asset>",
    )
    model.hfield_data[:] = 0.5
    data.qvel[way] = 1.0
    start = data.qpos[:2].copy()
    steps(model, data, 150)
    moved = data.qpos[:2] - start
    # v² / (2 μ g), to the first order of the time step.
    assert moved[way] == pytest.approx(0.10194, abs=2e-3) and abs(moved[1 - way]) < 1e-4
    # Box ahead of the field: no contact with the side of a cell.
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[0] = 0.2004, 2.0
    assert max((row.penetration for row in tm.certify(model, data).rows), default=0.0) == 0.0


def test_a_ball_lands_on_the_floor_and_bounces_with_restitution():
    model, data = on_floor("type='sphere' size='.1'", 0.3)
    steps(model, data, 300)
    assert abs(data.qpos[2] - 0.1) < 1e-12 and np.abs(data.qvel).max() < 1e-12
    model, data = on_floor("type='sphere' size='.1'", 0.3)
    while data.qvel[2] <= 0.0:
        before = data.qvel[2]
        steps(model, data, 1, restitution=0.5)
    assert data.qvel[2] == pytest.approx(-0.5 * before, rel=1e-9)


def test_energy_that_restitution_makes_is_noted():
    for condim, expected in (("1", False), ("6", True)):
        shape = f"type='box' size='.1 .05 .075' condim='{condim}'"
        model, data = on_floor(shape, 0.108, friction="0.2 0 0.04")
        data.qpos[3:] = np.array([-0.693, 0.601, -0.373, -0.140]) / np.linalg.norm([-0.693, 0.601, -0.373, -0.140])
        data.qvel[:] = 0.0, 0.6, -0.15, -8.5, 12.0, 16.0
        reports = steps(model, data, 20, restitution=0.9)
        assert any("make" in note and " J" in note for report in reports for note in report.notes) == expected


def test_the_contact_problem_of_a_step_has_its_velocities():
    model, data = on_floor(BOX, 0.1, friction=0.3)
    data.qvel[:2] = 0.8, 0.6
    (report,) = steps(model, data, 1)
    solution = report.problem().solve()
    np.testing.assert_allclose(solution.body_velocities, data.qvel, atol=1e-9)


def test_a_stack_of_boxes_rests_where_it_is():
    bodies = "".join(f"<body pos='0 0 {0.1 + 0.2 * place}'><freejoint/><geom {BOX}/></body>" for place in range(8))
    model, data = load("<geom type='plane' size='5 5 1'/>" + bodies)
    # Eight interfaces of four contacts at least.
    assert steps(model, data, 200)[-1].closed >= 32
    np.testing.assert_allclose(data.qpos.reshape(8, 7)[:, 2], 0.1 + 0.2 * np.arange(8), atol=1e-12)


def test_a_tumbling_rod_gains_no_energy():
    model, data = load(
        "<geom type='plane' size='5 5 1'/><body pos='0 0 .5'><freejoint/><geom type='capsule' size='.02 .3' friction='.6'/></body>",
        "timestep='.001'",
    )
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data.qvel[:] = 2.0, 0.0, 0.0, 3.0, 20.0, 1.0
    energies = []
    for _ in range(1500):
        steps(model, data, 1)
        energies.append(data.energy.sum())
    assert np.diff(energies).max() < 1e-6 and energies[-1] < 0.5 * energies[0]


def test_a_bullet_does_not_pass_a_thin_wall():
    model, data = load(
        "<geom type='box' size='.001 1 1' pos='1 0 0'/>"
        "<body><joint type='slide' axis='1 0 0'/><geom type='sphere' size='.01'/></body>"
    )
    data.qvel[0] = 100.0
    steps(model, data, 20)
    assert data.qpos[0] == pytest.approx(1.0 - 0.011, abs=1e-9)


def test_a_hinge_stops_at_its_limit():
    model, data = load(
        "<body><joint type='hinge' axis='0 1 0' limited='true' range='-20 20'/><geom type='sphere' size='.05' pos='.5 0 0'/></body>",
        "gravity='0 0 -9.81'",
    )
    steps(model, data, 500)
    assert data.qpos[0] == pytest.approx(np.radians(20), abs=1e-12) and abs(data.qvel[0]) < 1e-12
    # The limit carries the torque of gravity.
    mass = model.body_mass[1]
    assert data.qfrc_constraint[0] == pytest.approx(-mass * GRAVITY * 0.5 * np.cos(np.radians(20)), rel=1e-6)


def test_a_limit_that_is_exceeded_at_the_start_is_named():
    model, data = load(
        "<body><joint name='elbow' type='hinge' axis='0 1 0' limited='true' range='30 60'/>"
        "<geom type='sphere' size='.05' pos='.5 0 0'/></body>"
    )
    report = tm.hard_step(model, data)
    assert report.solved and report.notes == (
        "elbow starts 0.52 rad or m beyond its limit, which is removed over several steps",
    )
    assert steps(model, data, 2000)[-1].notes == ()


@pytest.mark.parametrize("name", ["qpos", "qvel", "ctrl"])
def test_numbers_that_are_not_finite_are_refused(name):
    model, data = load(
        "<body><joint name='hinge'/><geom size='.1'/></body>", more="<actuator><motor joint='hinge'/></actuator>"
    )
    steps(model, data, 3)
    getattr(data, name)[0] = np.nan
    with pytest.raises(tumble.TumbleError, match=rf"data.{name}\[0\] is nan; finite numbers are needed"):
        tm.hard_step(model, data)
    assert data.time == pytest.approx(3 * model.opt.timestep)


def test_a_ball_joint_stops_at_its_limit():
    model, data = load(
        "<body><joint type='ball' limited='true' range='0 30'/><geom type='sphere' size='.05' pos='.5 0 0'/></body>"
    )
    steps(model, data, 500)
    angle = 2.0 * np.arccos(min(1.0, abs(data.qpos[0])))
    assert angle == pytest.approx(np.radians(30), abs=1e-6)


def test_a_pendulum_by_a_connect_constraint_keeps_its_length_and_energy():
    model, data = load(
        "<body name='bob' pos='.5 0 0'><freejoint/><geom type='sphere' size='.05' mass='1'/></body>",
        "timestep='0.0005'",
        "<equality><connect body1='bob' anchor='-.5 0 0'/></equality>",
    )
    lengths, energies = [], []
    for _ in range(2000):
        steps(model, data, 1)
        lengths.append(np.linalg.norm(data.qpos[:3]))
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_energyPos(model, data)
        mujoco.mj_energyVel(model, data)
        energies.append(data.energy.sum())
    assert np.abs(np.array(lengths) - 0.5).max() < 1e-5
    assert np.abs(np.diff(energies)).max() < 0.02 and abs(energies[-1] - energies[0]) < 0.1


@pytest.mark.parametrize("force, moves", [(0.9, False), (1.1, True)])
def test_a_friction_loss_holds_up_to_its_force(force, moves):
    model, data = load(
        "<body><joint type='slide' axis='1 0 0' frictionloss='1'/><geom type='sphere' size='.1' mass='1'/></body>"
    )
    data.qfrc_applied[0] = force
    steps(model, data, 100)
    assert data.qvel[0] == pytest.approx(0.2 * (force - 1.0), rel=1e-9) if moves else abs(data.qpos[0]) < 1e-12


HAS_DISCRETE = hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE")
needs_discrete = pytest.mark.skipif(not HAS_DISCRETE, reason="MuJoCo 3.13 has it")


@pytest.mark.parametrize(
    "integrator", ["Euler", "implicit", "implicitfast", "RK4", pytest.param("discrete", marks=needs_discrete)]
)
def test_without_contacts_the_steps_are_those_of_mujoco(integrator):
    model, data = load(
        "<body><joint name='a' type='hinge' axis='0 1 0' damping='0.3' stiffness='2'/><geom type='capsule' size='.05 .2' pos='.2 0 0'/>"
        "<body pos='.4 0 0'><joint type='hinge' axis='0 1 0' damping='0.1' armature='.01'/><geom type='capsule' size='.04 .2' pos='.2 0 0'/></body></body>",
        f"integrator='{integrator}'",
        "<actuator><general joint='a' dyntype='filter' dynprm='0.1' gainprm='3'/></actuator>",
    )
    data.ctrl[0] = 1.0
    other = mujoco.MjData(model)
    other.ctrl[0] = 1.0
    report = steps(model, data, 200)[-1]
    for _ in range(200):
        mujoco.mj_step(model, other)
    # implicit and RK4 are replaced by integrators of lower order.
    near = 1e-11 if integrator in ("Euler", "implicitfast", "discrete") else 0.05
    np.testing.assert_allclose(data.qpos, other.qpos, atol=near)
    np.testing.assert_allclose(data.act, other.act, atol=1e-3 if integrator == "RK4" else 1e-14)
    assert data.time == other.time and report.solved
    assert bool(report.notes) == (integrator in ("implicit", "RK4"))


def test_the_directions_of_contacts_are_those_of_mujoco():
    model, data = on_floor("type='capsule' size='.1 .2'", 0.08)
    data.qpos[3:7] = [0.7, 0.1, 0.7, 0.1]
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qpos[2] = 0.05
    mujoco.mj_forward(model, data)
    rows = tm.HardStepper(model).collector.contacts(data)
    assert len(rows.index)
    for J, place in zip(rows.J, rows.index):
        contact, by_point = data.contact[int(place)], np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, by_point, None, contact.pos, model.geom_bodyid[contact.geom[1]])
        np.testing.assert_allclose(J, contact.frame.reshape(3, 3) @ by_point, atol=1e-14)


@pytest.mark.parametrize("integrator", ["Euler", pytest.param("discrete", marks=needs_discrete)])
def test_sensors_and_callbacks_work(integrator):
    model, data = load(
        f"<geom type='plane' size='5 5 1'/><body pos='0 0 .1'><freejoint/><geom {BOX} mass='2'/>"
        "<site name='s' type='box' size='.11 .11 .11'/></body>",
        f"integrator='{integrator}'",
        "<sensor><touch site='s'/><accelerometer site='s'/></sensor>",
    )
    called = []
    mujoco.set_mjcb_control(lambda model, data: called.append(data.time))
    try:
        steps(model, data, 10)
    finally:
        mujoco.set_mjcb_control(None)
    np.testing.assert_allclose(data.sensordata, [2 * GRAVITY, 0.0, 0.0, GRAVITY], atol=1e-9)
    assert len(called) == 10


def test_a_conveyor_carries_a_box():
    floor = "<geom type='plane' size='5 5 1' surfacevel='.5 0 0'/>"
    try:
        model, data = load(f"{floor}<body pos='0 0 .1'><freejoint/><geom {BOX} mass='2'/></body>")
    except ValueError:
        pytest.skip("this version of MuJoCo has no surface velocities")
    steps(model, data, 20)
    assert data.qvel[0] == pytest.approx(GRAVITY * 0.04, abs=1e-9)
    steps(model, data, 100)
    assert data.qvel[0] == pytest.approx(0.5, abs=1e-9)


def test_sparse_and_dense_rows_agree():
    body = (
        "<geom type='plane' size='5 5 1'/><body name='a' pos='0 0 .1'><freejoint/><geom type='box' size='.1 .1 .1'/></body>"
        "<body name='b' pos='.3 0 .1'><freejoint/><geom type='box' size='.1 .1 .1'/></body>"
    )
    more = "<equality><weld body1='a' body2='b'/></equality>"
    ends = []
    for kind in ("dense", "sparse"):
        model, data = load(body, f"jacobian='{kind}'", more)
        data.qvel[:3] = 1.0, 0.5, 2.0
        steps(model, data, 300)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(ends[0][:3] - ends[0][7:10]), 0.3, atol=1e-3)


@pytest.mark.parametrize("integrator", ["RK4", pytest.param("discrete", marks=needs_discrete)])
def test_the_model_is_as_it_was_after_a_step(integrator):
    model, data = on_floor(BOX, 0.1, f"integrator='{integrator}'")

    def options():
        return model.opt.integrator, model.opt.o_margin, model.opt.disableflags

    before, margins = options(), model.geom_margin.copy()
    steps(model, data, 3)
    tm.certify(model, data)
    assert (model.geom_margin == margins).all() and options() == before


def test_a_certificate_shows_the_creep_and_overlap_of_soft_contacts():
    model, data = on_floor(BOX, 0.1, "cone='elliptic' gravity='2 0 -9.81'")
    for _ in range(1000):
        mujoco.mj_step(model, data)
    start = data.qpos.copy()
    certificate = tm.certify(model, data)
    assert (data.qpos == start).all()
    assert certificate.dynamics < 1e-7 and certificate.cone < 1e-9
    # It rests inside the floor, by the depth that MuJoCo's own contacts have.
    depth = max(-row.gap for row in certificate.rows)
    assert depth == pytest.approx(-data.contact.dist.min(), rel=1e-3) and depth > 5e-5
    assert certificate.penetration == pytest.approx(depth / 0.002, rel=1e-2)
    assert str(certificate).startswith("contact floor–body ends the step ") and "inside" in str(certificate)
    # It creeps although its friction force is smaller than the largest one.
    before = data.qpos[0]
    mujoco.mj_step(model, data)
    creep = (data.qpos[0] - before) / 0.002
    assert max(row.slip for row in certificate.rows) == pytest.approx(creep, rel=1e-3) and creep > 1e-4
    assert max(row.ratio for row in certificate.rows) < 0.6


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_certificates_of_mujocos_steps_meet_newtons_law(cone):
    model, data = on_floor("type='box' size='.1 .15 .05'", 0.3, f"cone='{cone}'")
    data.qvel[:] = 1.0, 0.3, 0.0, 3.0, 2.0, 1.0
    for _ in range(300):
        # MuJoCo's solver stops at a tolerance.
        assert tm.certify(model, data).dynamics < 1e-4
        mujoco.mj_step(model, data)


@pytest.mark.skipif(not hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"), reason="older versions have no sleep")
def test_sleeping_bodies_meet_newtons_law():
    bodies = "".join(f"<body pos='{x} 0 .1'><freejoint/><geom {BOX}/></body>" for x in (0, 1))
    model, _ = load("<geom type='plane' size='5 5 1'/>" + bodies)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    data = mujoco.MjData(model)
    data.qvel[6] = 3.0
    asleep = 0
    for _ in range(1000):
        mujoco.mj_step(model, data)
        asleep += data.ntree_awake == 1
        if 0 < asleep < 100:
            # MuJoCo's solver stops at a tolerance.
            assert tm.certify(model, data).dynamics < 1e-4
    assert asleep


def test_a_comparison_has_a_table_and_a_page(tmp_path):
    model, data = on_floor(BOX, 0.1, "gravity='2 0 -9.81'")
    found = tm.compare(model, data, 50)
    assert found.unsolved == 0 and found.residual[:, 1].max() < 1e-9 < found.residual[:, 0].max()
    assert found.creep[:, 1].max() < 1e-12 and found.creep[-1, 0] > 1e-4 and found.cost_ratio > 0.0
    assert "largest residual, m/s" in found.table() and "contact floor–body" in found.table()
    assert str(found) == found.table()
    found.page(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert page.count("<svg") == 5 and "http" not in page
    assert (data.qpos == mujoco.MjData(model).qpos).all()


def test_overlap_of_the_start_is_removed_slowly():
    model, data = on_floor(BOX, 0.09)
    report = steps(model, data, 1)[0]
    assert report.overlap == pytest.approx(0.01) and data.qvel[2] == pytest.approx(0.2, abs=1e-9)
    assert "inside" in str(report.certificate())
    steps(model, data, 200)
    assert abs(data.qpos[2] - 0.1) < 1e-9


def test_a_body_between_two_walls_keeps_its_overlap():
    wall = "<geom type='box' size='.1 1 1' pos='{} 0 0'/>"
    model, data = load(
        wall.format(-0.19) + wall.format(0.19) + "<body><freejoint/><geom type='sphere' size='.1'/></body>",
        "gravity='0 0 0'",
    )
    steps(model, data, 5)
    assert abs(data.qpos[0]) < 1e-9


def test_what_is_left_out_is_listed():
    model, data = load(
        "<geom type='plane' size='5 5 1' condim='6'/>"
        "<body pos='0 0 .1'><joint type='slide' axis='1 0 0'/><geom type='sphere' size='.11'/></body>"
    )
    report = steps(model, data, 1)[0]
    assert any("√3" in note for note in report.notes) and any("no joint moves" in note for note in report.notes)


ROLLING = "type='sphere' size='.1' condim='6'"


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_a_ball_is_stopped_by_rolling_resistance(cone):
    model, data = on_floor(ROLLING, 0.1, f"cone='{cone}'", friction="0.8 0.01 0.01")
    data.qvel[[0, 4]] = 1.0, 10.0
    for _ in range(5):
        report = steps(model, data, 1)[0]
        assert report.certificate().residual < 1e-9 and "√3" in report.notes[0]
    force, normal = np.zeros(6), 2 * GRAVITY
    mujoco.mj_contactForce(model, data, 0, force)
    moment = data.contact[0].frame.reshape(3, 3).T @ force[3:]
    np.testing.assert_allclose(moment, [0.0, -0.01 * normal, 0.0], atol=1e-9)
    while data.qvel[0] > 1e-9 and data.time < 2.0:
        steps(model, data, 1)
    # Slowing μ_r g / (1.4 r): 1.4271 s and 0.71357 m, to the order of the time step.
    assert data.time == pytest.approx(1.4271, abs=0.002) and data.qpos[0] == pytest.approx(0.71357, abs=0.002)
    assert np.abs(data.qvel).max() < 1e-12


def test_a_ball_is_stopped_by_torsional_resistance():
    model, data = on_floor(ROLLING.replace("6", "4", 1), 0.1, "", friction="0.8 0.01 0.01")
    data.qvel[5] = 10.0
    while data.qvel[5] > 1e-9 and data.time < 1.0:
        steps(model, data, 1)
    # Slowing μ_s g / (0.4 r²).
    assert data.time == pytest.approx(0.4077, abs=0.002) and abs(data.qvel[5]) < 1e-12


def test_different_coefficients_of_rolling_are_an_ellipse():
    pair = "<contact><pair geom1='floor' geom2='body' friction='1 1 0 .01 .04' condim='6'/></contact>"
    model, data = load(
        "<geom name='floor' type='plane' size='5 5 1'/>"
        "<body pos='0 0 .1'><freejoint/><geom name='body' type='sphere' size='.1' mass='2'/></body>",
        "cone='elliptic'",
        pair,
    )
    data.qvel[[0, 1, 3, 4]] = 0.5, 0.5, -5.0, 5.0
    steps(model, data, 2)
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, force)
    # The moment opposes the turn in the metric of the ellipse: m_k = −μ_k² ω_k f_n / ‖(μ_1 ω_1, μ_2 ω_2)‖.
    turn = data.contact[0].frame.reshape(3, 3)[1:] @ data.qvel[3:]
    limits = np.array([0.01, 0.04])
    expected = -(limits**2) * turn * force[0] / np.linalg.norm(limits * turn)
    np.testing.assert_allclose(force[4:], expected, rtol=1e-6)


@pytest.mark.parametrize("condim", [4, 6])
def test_piles_with_moments_are_solved(condim):
    shapes = ("sphere' size='.08", "box' size='.1 .06 .04", "capsule' size='.04 .08", "cylinder' size='.07 .05")
    for seed in range(3):
        rng = np.random.default_rng(seed)
        geom = f"condim='{condim}' friction='{rng.uniform(0.2, 1)} {rng.uniform(0, 0.05)} {rng.uniform(0, 0.03)}'"
        bodies = [f"<geom type='plane' size='5 5 1' {geom}/>"]
        for place, shape in enumerate(rng.permutation(shapes)):
            at, turn = (0.1 * rng.normal(), 0.1 * rng.normal(), 0.15 + 0.25 * place), rng.normal(size=4)
            body = f"<body pos='{' '.join(map(str, at))}' quat='{' '.join(map(str, turn))}'>"
            bodies.append(f"{body}<freejoint/><geom type='{shape}' {geom}/></body>")
        model, data = load("".join(bodies))
        data.qvel[:] = rng.normal(size=model.nv)
        reports = steps(model, data, 250)
        certificates = [report.certificate() for report in reports[::25]]
        assert max(certificate.residual for certificate in certificates) < 1e-9
        assert max(row.power for certificate in certificates for row in certificate.rows if row.kind == "moment") < 1e-9


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_moments_of_mujocos_steps_are_in_the_certificate(cone):
    model, data = on_floor(ROLLING, 0.0999, f"cone='{cone}' tolerance='1e-14' iterations='500'", "0.8 0.01 0.01")
    data.qvel[:] = 0.5, 0.2, 0.0, 1.0, 3.0, 5.0
    for _ in range(20):
        mujoco.mj_step(model, data)
    certificate = tm.certify(model, data)
    # Newton's law holds with the forces of all rows, so signs and axes are MuJoCo's.
    assert certificate.dynamics < 1e-10, certificate.table()
    contact, moment = certificate.rows
    assert (contact.kind, moment.kind, moment.name) == ("contact", "moment", contact.name)
    assert 0.0 < moment.ratio < 2.0 and moment.power < 0.0
    exact = certificate.measured().exact()
    assert exact.solved and len(exact.impulses) == 6


def test_position_errors_that_contradict_each_other_are_kept_and_said():
    model, data = load(
        "<body name='a'><joint name='x' type='slide' axis='1 0 0'/><geom type='sphere' size='.1'/></body>",
        "",
        "<equality><joint joint1='x' polycoef='1 0 0 0 0'/><joint joint1='x' polycoef='-1 0 0 0 0'/></equality>",
    )
    report = steps(model, data, 1)[0]
    assert "overlaps that cannot be removed are kept" in report.notes and data.qpos[0] == 0.0


def test_unsolved_steps_are_said():
    model, data = on_floor(BOX, 0.1)
    data.qvel[:] = 1.0, 0.2, 0.0, 0.0, 0.0, 1.0
    # No double has this residual.
    stepper = tm.HardStepper(model, residual=1e-30)
    with pytest.warns(tm.UnsolvedStep, match="the step to 0.002 s is not solved: residual"):
        assert not stepper.step(data).solved
    stepper.configure(restitution=0.0, unsolved="raise")
    with pytest.raises(tumble.TumbleError, match='is not solved: .*; unsolved="warn" takes such steps'):
        stepper.step(data)
    with pytest.raises(tumble.TumbleError, match="unsolved is 'no'"):
        tm.hard_step(model, data, unsolved="no")
    with pytest.raises(tumble.TumbleError, match="restitution is 2"):
        tm.hard_step(model, data, restitution=2)


def test_wrong_arguments_are_named():
    model, data = on_floor(BOX, 0.1)
    other = load("<body><joint/><geom size='.1'/></body>")[0]
    for call, said in (
        (lambda: tm.hard_step(3, data), "model is int; a mujoco.MjModel is needed"),
        (lambda: tm.hard_step(model, None), "data is NoneType; a mujoco.MjData is needed"),
        (lambda: tm.certify(other, data), "data belongs to another model; mujoco.MjData(model) is needed"),
        (lambda: tm.compare(model, data, 0), "steps is 0; a whole number from 1 is needed"),
        (lambda: tm.HardStepper(model, recovery=0), "recovery is 0; a positive number is needed"),
    ):
        with pytest.raises(tumble.TumbleError) as error:
            call()
        assert str(error.value) == said


def test_a_model_without_joints_is_stepped():
    model, data = load("<geom size='.1'/><body><geom size='.1'/></body>")
    assert steps(model, data, 1)[0].certificate().residual == 0.0 and data.time == 0.002
    assert tm.certify(model, data).rows == ()


ROBOTS = ["ant", "half_cheetah", "hopper", "humanoid"]


@pytest.mark.parametrize("name", ROBOTS)
def test_gymnasiums_robots_are_stepped_for_a_second(name):
    folder = importlib.util.find_spec("gymnasium")
    if folder is None or folder.origin is None:
        pytest.skip("gymnasium is not installed")
    path = Path(folder.origin).parent / "envs" / "mujoco" / "assets" / f"{name}.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    data, rng = mujoco.MjData(model), np.random.default_rng(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        while data.time < 1.0:
            data.ctrl[:] = rng.uniform(*model.actuator_ctrlrange.T)
            report = tm.hard_step(model, data)
            assert report.solved and report.residual <= 1e-9
    assert np.isfinite(data.qpos).all()


def test_the_program_that_measures_prints_a_table(tmp_path, monkeypatch, capsys):
    (tmp_path / "ball.xml").write_text(
        "<mujoco><worldbody><geom type='plane' size='5 5 1'/><body pos='0 0 .1'><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
    )
    monkeypatch.setattr("sys.argv", ["measure_mujoco.py", str(tmp_path / "ball.xml"), "--seconds", "0.1"])
    runpy.run_path(str(EXAMPLES / "measure_mujoco.py"), run_name="__main__")
    cells = capsys.readouterr().out.splitlines()[-1].split("|")
    assert [cell.strip() for cell in cells[1:6]] == ["ball", "6", "50", "1", "0"]


def test_the_pinched_capsule_creeps_with_soft_contacts_alone():
    example = runpy.run_path(str(EXAMPLES / "pinched_capsule.py"))
    speeds = [example["creep"](impratio, 0.5) for impratio in (10.0, 100.0)]
    np.testing.assert_allclose(speeds, [184e-6, 18.4e-6], rtol=0.05)
    moved, residual = example["hard_drop"](2.0)
    assert moved < 1e-12 and residual < 1e-9


ARM = (
    "<body><joint name='a' axis='0 1 0' damping='.3' stiffness='20' springref='40'/><geom size='.1' pos='.2 0 0'/>"
    "<body pos='.4 0 0'><joint name='b' axis='0 1 0' damping='.1' armature='.01'/>"
    "<geom type='capsule' size='.1 .2' pos='.2 0 0'/>{}</body></body>"
)
WRIST = (
    "<body pos='.4 0 0'><joint type='ball' stiffness='3' damping='.2'/>"
    "<geom type='box' size='.05 .1 .02' pos='.2 0 0'/></body>"
)
FREE = "<body pos='0 2 .2'>{}<geom type='box' size='.1 .2 .05' pos='.1 0 0'/><site name='q' pos='.1 .1 0'/></body>"
COUPLED = (
    "<tendon><fixed name='t' stiffness='1000' damping='1' springlength='.1'><joint joint='a' coef='1'/>"
    "<joint joint='b' coef='-1'/></fixed></tendon>"
)
SERVOS = (
    "<actuator><position joint='b' kp='1000' kv='20'/><velocity joint='a' kv='3'/>"
    "<general joint='a' dyntype='filter' dynprm='.1' gainprm='3'/></actuator>"
)
ROPE = (
    "<tendon><spatial stiffness='50' damping='2' springlength='.3'><site site='p'/><site site='q'/></spatial></tendon>"
)
SPINNING = FREE.format("<freejoint/>")
SMOOTH = {
    "springs of joints": (ARM.format(WRIST), "", ""),
    "tendon": (ARM.format(WRIST), "", COUPLED),
    "servos": (ARM.format(WRIST), "", SERVOS),
    "tendon and servos, PGS": (ARM.format(WRIST), "solver='PGS'", COUPLED + SERVOS),
    "spinning body": (SPINNING, "", ""),
    "spinning body on a spring": (FREE.format("<joint type='free' stiffness='4' damping='.1'/>"), "", ""),
    "spinning body on a rope": ("<site name='p' pos='0 2 1'/>" + SPINNING, "", ROPE),
    "spinning body and arm, sparse": (SPINNING + ARM.format(WRIST), "jacobian='sparse'", COUPLED + SERVOS),
    "drag": (SPINNING + ARM.format(""), "viscosity='.1' density='1.2' wind='1 0 0'", ""),
    "lift": (SPINNING.replace("<geom", "<geom fluidshape='ellipsoid'"), "density='20' wind='3 0 0'", ""),
}
CLOTH = (
    "<flexcomp name='f' type='grid' count='4 4 1' spacing='.05 .05 .05' pos='0 0 .5' radius='.005' dim='2' mass='.5'>"
    "<edge equality='false'/><contact selfcollide='none'/>"
    "<elasticity young='1e4' poisson='0.1' thickness='.01' elastic2d='{}'/></flexcomp>"
)


def pushed(model, data, seed):
    """Sets random velocities and controls, and returns a copy of ``data``."""
    rng = np.random.default_rng(seed)
    data.qvel[:] = 2.0 * rng.normal(size=model.nv)
    data.ctrl[:] = rng.normal(size=model.nu)
    return copy.copy(data)


# MuJoCo solves with coupled terms up to its tolerance.
TIGHT = "tolerance='1e-15' timestep='0.005'"


@needs_discrete
@pytest.mark.parametrize("integrator", ["discrete", "implicitfast"])
@pytest.mark.parametrize("name", SMOOTH)
def test_implicit_steps_without_contacts_are_those_of_mujoco(name, integrator):
    body, option, more = SMOOTH[name]
    model, data = load(body, f"integrator='{integrator}' {TIGHT} {option}", more)
    other = pushed(model, data, 1)
    for _ in range(60):
        certificate = tm.certify(model, other)
        # Rounding, with condition numbers up to 1e3 of the mass matrices.
        assert certificate.residual < 1e-12, str(certificate)
        steps(model, data, 1)
        mujoco.mj_step(model, other)
        np.testing.assert_allclose(data.qvel, other.qvel, atol=1e-10)
        np.testing.assert_allclose(data.qpos, other.qpos, atol=1e-10)


@needs_discrete
@pytest.mark.parametrize("stretch", ["bend", "both"])
def test_discrete_steps_of_cloth_are_those_of_mujoco(stretch):
    model, data = load(CLOTH.format(stretch), "integrator='discrete' tolerance='1e-12'")
    data.qvel[:] = 0.1 * np.random.default_rng(2).normal(size=model.nv)
    other = copy.copy(data)
    for _ in range(10):
        assert tm.certify(model, other).residual < 1e-10
        steps(model, data, 1)
        mujoco.mj_step(model, other)
    np.testing.assert_allclose(data.qvel, other.qvel, atol=1e-10)


@needs_discrete
def test_the_mass_of_a_discrete_step_has_damping_and_stiffness():
    """M + h D + h² K from the numbers of the model."""
    h = 0.02
    model, data = load(ARM.format(""), f"integrator='discrete' timestep='{h}'", COUPLED + SERVOS)
    data.qpos[:], data.qvel[:], data.ctrl[:] = (0.4, -0.2), (0.5, -1.0), (0.3, 0.1, 0.2)
    before = data.qvel.copy()
    mujoco.mj_forward(model, data)
    mass = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, mass)
    row = np.array([1.0, -1.0])
    damping = np.diag([0.3 + 3.0, 0.1 + 20.0]) + 1.0 * np.outer(row, row)
    stiffness = np.diag([20.0, 1000.0]) + 1000.0 * np.outer(row, row)
    effective = mass + h * damping + h * h * stiffness
    force = data.qfrc_smooth - h * stiffness @ before
    (report,) = steps(model, data, 1)
    np.testing.assert_allclose(report.problem().matrix("M"), effective, rtol=1e-13)
    np.testing.assert_allclose(data.qvel, before + h * np.linalg.solve(effective, force), atol=1e-12)
    np.testing.assert_allclose(data.qacc, (data.qvel - before) / h, atol=1e-10)


@needs_discrete
def test_a_stiff_servo_presses_a_box_without_creep():
    """ωh of the servo is 30; explicit springs are stable up to 2."""
    model, data = load(
        "<geom name='floor' type='plane' size='5 5 1'/>"
        "<body pos='0 0 .1'><freejoint/><geom name='box' type='box' size='.1 .1 .1' mass='1'/></body>"
        "<body pos='0 0 .3'><joint name='z' type='slide' axis='0 0 1'/><geom name='ram' size='.1' mass='.1'/></body>",
        "integrator='discrete' timestep='0.01'",
        "<actuator><position joint='z' kp='1e6' kv='100'/></actuator>",
    )
    data.ctrl[0] = -1e-4
    reports = steps(model, data, 100)
    assert max(report.certificate().residual for report in reports) < 1e-9
    # The servo is 0.1 mm from its target, and the ram rests on the box.
    floor = sum(row.force for row in reports[-1].certificate().rows if "floor" in row.name)
    assert floor == pytest.approx(1.1 * GRAVITY + 100.0, rel=1e-6)
    assert np.abs(data.qvel).max() < 1e-9 and abs(data.qpos[2] - 0.1) < 1e-9


@needs_discrete
@pytest.mark.parametrize("integrator", ["discrete", "implicitfast"])
def test_certificates_of_implicit_steps_of_a_tumbling_box_meet_newtons_law(integrator):
    option = f"cone='elliptic' tolerance='1e-12' iterations='200' integrator='{integrator}'"
    model, data = on_floor("type='box' size='.1 .15 .05'", 0.3, option)
    data.qvel[:] = 1.0, 0.3, 0.0, 6.0, 4.0, 2.0
    for _ in range(300):
        # MuJoCo's solver stops at a tolerance of the cost.
        assert tm.certify(model, data).dynamics < 1e-7
        mujoco.mj_step(model, data)


@needs_discrete
def test_discrete_steps_of_a_tumbling_arm_and_box_are_hard():
    body = "<geom name='floor' type='plane' size='5 5 1' pos='0 0 -.2'/>" + ARM.format(WRIST) + SPINNING
    model, data = load(body, "integrator='discrete' timestep='0.005'", COUPLED + SERVOS)
    pushed(model, data, 3)
    reports = steps(model, data, 200)
    assert max(report.closed for report in reports) > 2
    assert max(report.residual for report in reports) < 1e-9
    # Gaps at the end of a step; overlaps by turned corners are removed in the next steps.
    assert max(report.certificate().friction_law for report in reports) < 1e-9


@needs_discrete
@pytest.mark.parametrize("path", ["data/robots/hopper.xml", "scenarios/robots/crawler.xml"])
def test_discrete_steps_of_robots_are_hard(path, root):
    model = mujoco.MjModel.from_xml_path(str(root / path))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    data, rng, closed = mujoco.MjData(model), np.random.default_rng(0), 0
    for k in range(300):
        if k % 10 == 0:
            data.ctrl[:] = rng.uniform(*model.actuator_ctrlrange.T)
        (report,) = steps(model, data, 1)
        certificate = report.certificate()
        assert max(certificate.dynamics, certificate.friction_law, certificate.cone) < 1e-9, str(certificate)
        closed = max(closed, report.closed)
    assert closed > 1


@needs_discrete
def test_options_without_a_hard_step_are_refused():
    model, data = on_floor(BOX, 0.1, "")
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_IPC)
    with pytest.raises(tumble.TumbleError, match="the flag ipc has no hard step yet; switch it off"):
        tm.hard_step(model, data)
    # The conjugate-gradient solver does not assemble flexes that only bend.
    model, data = load(CLOTH.format("bend"), "integrator='discrete' solver='CG'")
    data.qvel[:] = 0.1 * np.random.default_rng(2).normal(size=model.nv)
    for call in (tm.hard_step, tm.certify):
        with pytest.raises(tumble.TumbleError, match="does not store the stiffness of these flexes; use"):
            call(model, data)


def test_a_certificate_outlives_the_data_of_its_step():
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>")
    data = mujoco.MjData(model)
    certificate = tumble.mujoco.certify(model, data)
    mujoco.mj_step(model, data, 10)
    assert certificate.measured().before[2] == 0.0 and data.qvel[2] < -0.1
    assert certificate.measured().certificate().dynamics == certificate.dynamics < 1e-15
