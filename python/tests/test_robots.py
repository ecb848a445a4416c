"""Robots from files: coordinates, joints, motors and forces."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import tumble

MODELS = Path(__file__).parents[2] / "data" / "robots"
LEGS = ["fl", "fr", "rl", "rr"]


def standing(**fields):
    bent = {f"{leg}_pitch": 0.8 for leg in LEGS} | {f"{leg}_knee": -1.6 for leg in LEGS}
    table = {"file": "quadruped.urdf", "position": [0, 0, 0.35], "coordinates": bent, **fields}
    return tumble.Scene([], {"friction": 0.7}, robots=[table], folder=MODELS)


def test_a_file_is_a_scene():
    scene = tumble.load(MODELS / "quadruped.urdf")
    assert scene.name == "quadruped" and len(scene.bodies) == 13 and scene.robots == [""]
    robot = scene.simulate().robot
    assert robot.counts == (19, 18) and robot.joints[:2] == ["root", "fl_roll"]
    assert robot["fl_knee"].range == (-2.6, -0.8) and robot["fl_knee"].max_force == 35.0
    assert "velocity" in " ".join(robot.notes)
    with pytest.warns(UserWarning) as warned:
        tumble.load(MODELS / "quadruped.urdf")
    assert [str(one.message) for one in warned] == [f"quadruped: {note}" for note in robot.notes]
    assert {Path(one.filename).name for one in warned} == {"test_robots.py"}
    with pytest.warns(UserWarning, match="a.quadruped: velocity limits have no effect"):
        standing(prefix="a.")
    with pytest.raises(tumble.TumbleError, match="fl_kne"):
        robot["fl_kne"]
    with pytest.raises(tumble.TumbleError, match="is not a slide or hinge"):
        robot["root"]


def test_a_file_is_read_as_is_said(tmp_path):
    wedge = (MODELS / "parts" / "wedge.obj").read_bytes()
    for folder in (tmp_path / "arm", tmp_path / "there" / "leg"):
        folder.mkdir(parents=True)
        (folder / "wedge.obj").write_bytes(wedge)
    text = (
        "<robot name='m'><link name='a'><inertial><mass value='1'/><inertia ixx='0.4' iyy='0.4' izz='0.4'"
        " ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><mesh filename='package://NAME/wedge.obj'/>"
        "</geometry></collision></link></robot>"
    )
    (tmp_path / "arm.urdf").write_text(text.replace("NAME", "arm"))
    (tmp_path / "leg.urdf").write_text(text.replace("NAME", "leg"))
    assert len(tumble.load(tmp_path / "arm.urdf").bodies) == 1
    with pytest.raises(tumble.TumbleError, match="packages"):
        tumble.load(tmp_path / "leg.urdf")
    scene = tumble.load(tmp_path / "leg.urdf", packages=tmp_path / "there")
    assert pickle.loads(pickle.dumps(scene)).bodies == scene.bodies
    ball = tmp_path / "ball.xml"
    ball.write_text(
        "<mujoco><worldbody><body name='a'><freejoint/><geom size='0.1' condim='6'/></body>"
        "<body name='b'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    )
    assert tumble.load(ball).bodies == ["a", "b"]
    assert tumble.load(ball, point_contacts=True).bodies == ["a", "b"]
    assert tumble.load(ball, leave_out=["body:a"]).bodies == ["b"]


def test_of_a_scene_with_a_robot_what_came_later_can_go():
    scene = standing()
    simulation, other = scene.simulate(), scene.simulate()
    for joints in (False, True):
        with pytest.raises(tumble.TumbleError, match="cannot be removed|attached"):
            simulation.remove_body("trunk", joints=joints)
    simulation.add_body({"box": 0.1, "mass": 1.0, "name": "later", "position": [3, 0, 0.05]})
    simulation.run(5)
    simulation.remove_body("later")
    other.run(5)
    np.testing.assert_array_equal(simulation.robot.q, other.robot.q)


def test_a_target_uses_the_gains_of_the_scene():
    # The force limit of 35 N m is that of the file.
    motor = {"joint": "fl_knee", "position": -1.6, "stiffness": 40.0, "damping": 1.5}
    scene = tumble.Scene(
        [], {"friction": 0.7}, robots=[{"file": "quadruped.urdf", "position": [0, 0, 0.45]}], motors=[motor], folder=MODELS
    )
    knee = scene.simulate().robot["fl_knee"]
    assert (knee.stiffness, knee.damping, knee.max_force, knee.target) == (40.0, 1.5, 35.0, -1.6)
    assert scene.simulate().robot["fr_knee"].target is None
    # A motor that is set by other means is the joint's too, also after a copy and a reset.
    simulation = scene.simulate()
    knee = simulation.robot["fl_knee"]
    simulation.set_motor("fl_knee", position=-1.2, stiffness=9.0, max_force=1.0)
    assert knee.target == copy.copy(simulation).robot["fl_knee"].target == -1.2
    knee.hold_speed(0.1)
    assert knee.target is None
    simulation.reset()
    assert (knee.target, knee.stiffness) == (-1.6, 40.0)
    rod = {"name": "rod", "box": 0.1, "mass": 1.0, "position": [0, 0, 1]}
    hinge = {"name": "pin", "type": "revolute", "bodies": ["rod"], "anchor": [0, 0, 1], "axis": [0, 1, 0]}
    with pytest.raises(tumble.TumbleError, match="max_force: required; the joint has no limit in a file"):
        tumble.Scene([rod], {"friction": 0.7}, joints=[hinge], motors=[{"joint": "pin", "speed": 1.0}])


def test_torques_drive_the_joints():
    # Friction of 0.1 N m and damping of the knees oppose the torque; in the air the forces of contacts are zero.
    simulation = standing(position=[0, 0, 1.0]).simulate()
    robot = simulation.robot
    robot.torques = np.full(len(robot.slides_and_hinges), 0.05)
    assert simulation.step().ok
    assert np.all(np.abs(robot.torques) < 1e-9)
    knee = robot["fl_knee"]
    knee.torque = 3.0
    for _ in range(10):
        assert simulation.step().ok
    assert knee.speed > 0.0 and 2.0 < knee.torque < 3.0
    assert knee.torque == robot.torques[robot.slides_and_hinges.index(knee)]
    np.testing.assert_array_equal(robot.contact_forces["fl_shank", "ground"], np.zeros(3))
    with pytest.raises(tumble.TumbleError, match="object 'grond' is unknown; did you mean `ground`?"):
        robot.contact_forces["fl_shank", "grond"]


def test_a_robot_stands_by_its_motors():
    simulation = standing().simulate()
    robot = simulation.robot
    robot.set_gains(stiffness=80.0, damping=3.0, max_force=25.0)
    for leg in LEGS:
        robot[f"{leg}_roll"].target = 0.0
        robot[f"{leg}_pitch"].target = 0.8
        robot[f"{leg}_knee"].target = -1.6
    for _ in range(1500):
        assert simulation.step().ok
    weight = 9.81 * simulation.scene.masses.sum()
    forces = robot.contact_forces
    assert {pair[1] for pair in forces} == {"ground"} and len(forces) == 4
    assert sum(forces.values())[2] == pytest.approx(weight, rel=1e-9)
    # Motor torques and foot forces carry the weight, also in generalised coordinates.
    q = robot.q
    needed = robot.bias_forces(q)
    links = robot.links_now
    for (name, _), force in forces.items():
        foot = name.replace("shank", "foot")
        index = robot.links.index(foot)
        assert links.positions[index, 2] == pytest.approx(0.02, abs=1e-4)
        # Contact point below the ball of the foot.
        point = rotation(links.attitudes[index]).T @ np.array([0, 0, -0.02])
        needed = needed - robot.jacobian(foot, point, q)[0].T @ force
    np.testing.assert_allclose(needed[:6], 0.0, atol=1e-6)
    knee = robot["fl_knee"]
    held = knee.stiffness * (knee.target - knee.coordinate)
    assert held == pytest.approx(needed[robot["fl_knee"].place - 1], abs=0.11)


def rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_coordinates_are_set_and_read():
    simulation = standing().simulate()
    robot = simulation.robot
    q, v = robot.start.copy(), np.linspace(-0.4, 0.5, 18)
    q[:3] = [0.1, 0.2, 1.0]
    q[3:7] = [0.8, 0.0, 0.6, 0.0]
    q[7] = 0.25
    robot.set(q, v)
    np.testing.assert_allclose(robot.q, q, atol=1e-13)
    np.testing.assert_allclose(robot.v, v, atol=1e-12)
    links = robot.kinematics(q, v)
    np.testing.assert_allclose(robot.links_now.positions, links.positions, atol=1e-13)
    # The Jacobian times the rates equals the velocity.
    place, turn = robot.jacobian("rr_foot", [0, 0, 0], q)
    foot = robot.links.index("rr_foot")
    np.testing.assert_allclose(place @ v, links.velocities[foot], atol=1e-12)
    np.testing.assert_allclose(turn @ v, links.spins[foot], atol=1e-12)
    mass = robot.mass_matrix(q)
    np.testing.assert_allclose(mass, mass.T, atol=1e-14)
    assert mass[0, 0] == pytest.approx(simulation.scene.masses.sum())


def test_hinges_count_their_turns_while_nobody_looks(tmp_path):
    path = tmp_path / "spin.urdf"
    path.write_text(
        """<robot name="r"><link name="world"/>
        <link name="b"><inertial><mass value="1"/>
        <inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="continuous"><parent link="world"/><child link="b"/><axis xyz="0 1 0"/></joint></robot>"""
    )
    simulation = tumble.load(path).simulate()
    robot = simulation.robot
    robot.v = [20.0]
    simulation.run(300)
    hinge = robot["j"]
    # 20 rad/s for 0.6 s with a third-order error of the Cayley map.
    assert abs(hinge.coordinate - 12.0) < 0.01
    assert abs(hinge.coordinate - simulation.joints["j"]["coordinate"]) < 1e-12
    copied = copy.copy(simulation)
    assert copied.robot["j"].coordinate == hinge.coordinate
    # A motor that holds the current angle keeps the number of turns.
    hinge.stiffness, hinge.damping, hinge.max_force = 50.0, 5.0, 100.0
    robot.v = [0.0]
    hinge.target = held = hinge.coordinate
    simulation.run(100)
    assert abs(hinge.coordinate - held) < 1e-6


def test_controls_drive_actuators():
    scene = tumble.load(MODELS / "hopper.xml")
    simulation = scene.simulate()
    robot = simulation.robot
    assert robot.actuators == ["hip", "knee"]
    robot.controls = [0.5, -1.0]
    np.testing.assert_array_equal(robot.controls, [0.5, -1.0])
    before = simulation.joints["hip"]["coordinate"]
    assert simulation.step().ok
    assert simulation.joints["hip"]["coordinate"] != before
    with pytest.raises(tumble.TumbleError, match="controls"):
        robot.controls = [1.0]
    # Controls change by assignment alone.
    given = np.array([0.1, 0.2])
    robot.controls = given
    given[0] = 9.0
    np.testing.assert_array_equal(robot.controls, [0.1, 0.2])
    for each in (robot, copy.copy(simulation).robot, scene.simulate().robot):
        with pytest.raises(ValueError, match="read-only"):
            each.controls[0] = 1.0


GRIPPER = """<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody>
<body><joint name="l" type="slide" axis="0 1 0"/><geom size="0.02" mass="0.1"/></body>
<body pos="1 0 0"><joint name="r" type="slide" axis="0 1 0"/><geom size="0.02" mass="0.3"/></body></worldbody>
<tendon><fixed name="split"><joint joint="l" coef="0.5"/><joint joint="r" coef="0.5"/></fixed></tendon>
<actuator><position name="grip" tendon="split" kp="100" kv="20" forcerange="-2 2"/></actuator></mujoco>"""


def test_controls_close_a_gripper(tmp_path):
    (tmp_path / "gripper.xml").write_text(GRIPPER)
    simulation = tumble.load(tmp_path / "gripper.xml").simulate()
    simulation.robot.controls = [0.04]
    assert simulation.step().ok
    # The force on both joints is equal.
    light, heavy = simulation.robot.q
    assert light > 0.0 and light == pytest.approx(3.0 * heavy, rel=1e-9)
    assert simulation.run(3000).residuals.max() <= 1e-9
    assert simulation.robot.q.mean() == pytest.approx(0.04, abs=1e-6)
    again = pickle.loads(pickle.dumps(simulation))
    simulation.set_gear_motor(0, position=-0.01, stiffness=100.0, damping=20.0, max_force=5.0)
    again.set_gear_motor(0)
    last = simulation.robot.q.copy()
    assert simulation.run(3000).residuals.max() <= 1e-9 and again.run(3000).residuals.max() <= 1e-9
    # The gear's coordinate q_l - r q_r has the ratio -1.
    assert simulation.robot.q.sum() == pytest.approx(-0.01, abs=1e-6)
    np.testing.assert_allclose(again.robot.q, last, atol=1e-6)
    with pytest.raises(tumble.TumbleError, match="gear"):
        simulation.set_gear_motor(3)
    scene = simulation.scene
    assert (scene.motor_axes, scene.motor_gears) == ([], [0])
    # The sum q_l + q_r reaches the target of each rollout.
    targets = np.array([0.03, -0.05])
    ends = tumble.rollout(scene, motors=np.repeat(targets[:, None, None], 3000, axis=1)).states[:, -1]
    starts = tumble.load(tmp_path / "gripper.xml").simulate().states
    np.testing.assert_allclose((ends - starts)[:, :, 1].sum(axis=1), targets, atol=1e-6)
    with pytest.raises(tumble.TumbleError, match="max_force"):
        simulation.set_gear_motor(0, speed=1.0)


def test_several_and_copies():
    table = {"file": "quadruped.urdf", "position": [0, 0, 0.6]}
    scene = tumble.Scene(
        [{"name": "crate", "box": 0.3, "mass": 5.0, "position": [3, 0, 0.15]}],
        {"friction": 0.7},
        robots=[{**table, "prefix": "a."}, {**table, "prefix": "b.", "position": [0, 1, 0.6]}],
        apart=[{"between": ["a.trunk", "crate"]}],
        folder=MODELS,
    )
    simulation = scene.simulate()
    assert list(simulation.robots) == ["a.", "b."]
    with pytest.raises(tumble.TumbleError, match="has 2"):
        simulation.robot
    np.testing.assert_allclose(simulation.robots["b."].q[:3], [0, 1, 0.6], atol=1e-15)
    simulation.robots["b."].set_gains(stiffness=50.0)
    simulation.robots["b."]["fl_knee"].target = -1.0
    other = pickle.loads(pickle.dumps(simulation))
    third = copy.copy(simulation)
    for each in (simulation, other, third):
        each.run(20)
    np.testing.assert_array_equal(simulation.states, other.states)
    np.testing.assert_array_equal(simulation.states, third.states)


@pytest.mark.parametrize(
    "gains, said",
    [
        ({"stiffness": -80.0}, "stiffness is -80.0; a number above 0"),
        ({"stiffness": "a"}, "stiffness is 'a'; a number is needed"),
        ({"stiffness": 80.0, "damping": -3.0}, "damping is -3.0; a number from 0"),
        ({"stiffness": 80.0, "max_force": -3.0}, "max_force is -3.0; a number from 0"),
        ({"stiffness": float("nan")}, "stiffness is nan"),
    ],
)
def test_gains_that_are_refused_change_nothing(gains, said):
    robot = standing().simulate().robot
    robot.set_gains(stiffness=50.0, damping=1.0, max_force=20.0)
    with pytest.raises(tumble.TumbleError, match=said):
        robot.set_gains(**gains)
    assert {(joint.stiffness, joint.damping, joint.max_force) for joint in robot.slides_and_hinges} == {(50.0, 1.0, 20.0)}


HELD = """<robot name='arm'><link name='base_link'>
<collision><origin xyz='0 0 0.1'/><geometry><box size='0.4 0.4 0.2'/></geometry></collision></link>
<link name='fore'><inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='lift' type='prismatic'><parent link='base_link'/><child link='fore'/><origin xyz='0 3 1'/>
<axis xyz='0 0 1'/><limit lower='0' upper='1' effort='9' velocity='1'/></joint></robot>"""


def test_a_held_link_feels_its_contacts(tmp_path):
    (tmp_path / "arm.urdf").write_text(HELD)
    parcel = {"name": "parcel", "box": 0.1, "mass": 0.5, "position": [0, 0, 0.25]}
    arm = {"file": "arm.urdf", "prefix": "arm.", "fixed": True}
    rub = [{"between": ["parcel", "arm.base_link"], "coefficient": 0.9}]
    scene = tumble.Scene([parcel], {"friction": 0.5}, robots=[arm], friction=rub, folder=tmp_path)
    assert scene.fixed == ["arm.base_link"]
    simulation = scene.simulate()
    simulation.run(20)
    robot, weight = simulation.robot, 0.5 * 9.81
    forces = robot.contact_forces
    assert list(forces) == [("arm.base_link", "parcel")]
    np.testing.assert_allclose(forces["arm.base_link", "parcel"], [0, 0, -weight], atol=1e-6)
    assert robot.touch("base_link", "parcel") == pytest.approx(weight, rel=1e-6)


@pytest.mark.parametrize("field", ["stiffness", "damping", "max_force"])
def test_a_gain_is_refused_where_it_is_assigned(field):
    joint = standing().simulate().robot["fl_knee"]
    before = getattr(joint, field)
    for value in (-5.0, float("nan"), float("inf")):
        with pytest.raises(tumble.TumbleError, match=f"{field} of fl_knee is {value}; a number from 0"):
            setattr(joint, field, value)
    assert getattr(joint, field) == before
    joint.max_force = None


def test_sensors_at_rest():
    """A resting robot measures its weight: upwards in the accelerometer and in its feet."""
    simulation = standing().simulate()
    robot = simulation.robot
    robot.set_gains(stiffness=80.0, damping=2.0, max_force=25.0)
    for joint in robot.slides_and_hinges:
        joint.target = joint.coordinate
    with pytest.raises(tumble.TumbleError, match="no step"):
        robot.imu("trunk")
    assert robot.touch("fl_foot") == 0.0
    simulation.run(4000)
    turned = np.sqrt(0.5) * np.array([1, 1, 0, 0])
    read = robot.imu("trunk", point=[0.1, 0.0, 0.05], attitude=turned)
    up = robot.site("trunk", attitude=turned)
    np.testing.assert_allclose(read.gyroscope, 0.0, atol=1e-9)
    w, x, y, z = up.attitude
    third_row = [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    np.testing.assert_allclose(read.accelerometer, 9.81 * np.array(third_row), atol=1e-6)
    forces = sum(force[2] for (_, other), force in robot.contact_forces.items() if other == "ground")
    felt = [robot.touch(link, "ground") for link in robot.links]
    by_body = {body: touch for body, touch in zip(robot.bodies, felt) if body is not None}
    assert abs(sum(by_body.values()) - forces) < 1e-9 * forces
    name = max(zip(felt, robot.links))[1]
    assert robot.touch(name, point=[0, 0, 0], radius=10.0) == robot.touch(name) > 0
    assert robot.touch(name, point=[0, 0, 5], radius=1.0) == 0.0 == robot.touch(name, "trunk")
    for arguments, match in [
        ({"partner": "moon"}, "moon"),
        ({"point": [0, 0, 0]}, "radius"),
        ({"point": [0, 0, 0], "radius": -1.0}, "radius"),
    ]:
        with pytest.raises(tumble.TumbleError, match=match):
            robot.touch(name, **arguments)
    with pytest.raises(tumble.TumbleError, match="attitude"):
        robot.site(name, attitude=[0, 0, 0, 0])


def test_sensors_in_motion(tmp_path):
    """A falling box measures no acceleration at its centre. A rotating arm measures ω² r inwards.
    """
    box = "<geom type='box' size='.1 .2 .3' mass='1'/>"
    (tmp_path / "box.xml").write_text(
        f"<mujoco><option timestep='0.001'/><worldbody><body name='b' pos='0 0 5'><freejoint/>{box}</body></worldbody></mujoco>"
    )
    simulation = tumble.load(tmp_path / "box.xml").simulate()
    robot = simulation.robot
    robot.v = [1, 2, 3, 0.5, -1, 2]
    run = simulation.run(50)
    np.testing.assert_allclose(robot.imu("b").accelerometer, 0.0, atol=1e-11)
    read = robot.imu("b", before=run.states[9], after=run.states[10])
    np.testing.assert_allclose(read.gyroscope, run.states[10, 0, 10:], atol=1e-14)
    now = robot.site("b", [0.1, 0.2, 0.3])
    later = robot.site("b", [0.1, 0.2, 0.3], states=simulation.run(1).states[-1])
    mean = (now.velocity + later.velocity) / 2
    np.testing.assert_allclose((later.position - now.position) / 1e-3, mean, atol=1e-4)
    (tmp_path / "arm.xml").write_text(
        "<mujoco><option timestep='0.0001' gravity='0 0 0'/><worldbody><body name='arm' pos='0 0 5'><joint name='pivot' axis='0 0 1'/>"
        "<geom type='capsule' size='.05' fromto='0 0 0 1 0 0' mass='1'/>"
        "<site name='tip' pos='.8 0 0'/></body></worldbody></mujoco>"
    )
    simulation = tumble.load(tmp_path / "arm.xml").simulate()
    robot = simulation.robot
    robot.v = [3.0]
    run = simulation.run(10000)
    read = robot.imu("arm", [0.8, 0, 0])
    np.testing.assert_allclose(read.accelerometer, [-9 * 0.8, 0, 0], atol=9 * 0.8 * 3 * 1e-4)
    np.testing.assert_allclose(read.gyroscope, [0, 0, 3], atol=3 * (3e-4) ** 2)
    assert robot.sites == {"tip": ("arm", [0.8, 0, 0], [1, 0, 0, 0])}
    for own, named in zip(read, robot.imu(*robot.sites["tip"])):
        np.testing.assert_array_equal(own, named)
    # Columns have joint names, and angles count full turns.
    table = robot.to_pandas(run)
    assert list(table.columns) == ["k", "time_s", "pivot", "pivot.rate"] and len(table) == 10001
    np.testing.assert_allclose(table["pivot"], 3 * table["time_s"], atol=1e-3)
    free = tumble.load(tmp_path / "box.xml").simulate()
    table = free.robot.to_pandas(free.run(2))
    assert table.columns[2].endswith(".x") and table.columns[-1].endswith(".wz") and table.shape == (3, 15)


def test_a_robot_and_its_joints_are_pickled_with_their_simulation(root):
    simulation = tumble.load(root / "data/robots/quadruped.urdf").simulate()
    robot = simulation.robot
    robot.set_gains(stiffness=80.0, damping=2.0, max_force=25.0)
    robot["fl_knee"].target = -1.0
    simulation.run(10)
    knee, other = pickle.loads(pickle.dumps((robot["fl_knee"], robot)))
    assert other["fl_knee"] is knee and other.simulation is not simulation and knee.target == -1.0
    assert copy.copy(robot) is robot and copy.deepcopy(robot) is not robot
    simulation.run(5), other.simulation.run(5)
    np.testing.assert_array_equal(other.q, robot.q)


def test_targets_and_torques_are_vectors(root):
    simulation = tumble.load(root / "data/robots/quadruped.urdf", integrator="euler").simulate()
    robot, joints = simulation.robot, simulation.robot.slides_and_hinges
    assert np.isnan(robot.targets).all() and robot.targets.shape == (len(joints),)
    robot.set_gains(stiffness=80.0, damping=2.0, max_force=1000.0)
    targets = [joint.coordinate + 0.01 * (place + 1) for place, joint in enumerate(joints)]
    robot.targets = targets
    np.testing.assert_array_equal(robot.targets, targets)
    before = np.array([joint.coordinate for joint in joints])
    simulation.step()
    rates = np.array([joint.speed for joint in joints])
    h = simulation.scene.time_step
    # The joints of the file have a damping of 0.02 N m s/rad and a friction of 0.1 N m.
    expected = 80.0 * (targets - before - h * rates) - 2.02 * rates - 0.1 * np.sign(rates)
    is_free = [joint.range is None or min(abs(joint.coordinate - limit) for limit in joint.range) > 0.1 for joint in joints]
    assert np.sum(is_free) >= 8
    np.testing.assert_allclose(robot.torques[is_free], expected[is_free], rtol=1e-6, atol=1e-6)
    with pytest.raises(tumble.TumbleError, match="targets has shape"):
        robot.targets = targets[1:]
