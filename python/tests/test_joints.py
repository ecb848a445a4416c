"""Joints: scenes, trajectories, tables, motors in a loop and rollouts."""

import pickle

import numpy as np
import pytest
import tumble

ROD = {"name": "rod", "box": [1.0, 0.02, 0.02], "mass": 1.0, "position": [0.5, 0, 2.0]}
PIN = {"name": "pin", "type": "revolute", "bodies": ["rod"], "anchor": [0, 0, 2.0], "axis": [0, 1, 0]}
NO_GROUND = {"none": True, "friction": 0.5}


def pendulum(**fields):
    return tumble.Scene([ROD], NO_GROUND, joints=[{**PIN, **fields}], time_step=0.001)


def test_a_scene_has_its_joints():
    scene = pendulum()
    assert scene.joints == ["pin"] and scene.joint_axes == [[5]]
    run = scene.run(100)
    pin = run.joints["pin"]
    assert pin["coordinate"].shape == (101,) and pin["speed"].shape == (100,)
    assert pin["force"].shape == pin["torque"].shape == (100, 3)
    assert pin["place"].shape == pin["angles"].shape == (101, 3)
    np.testing.assert_allclose(np.diff(pin["coordinate"]), 0.001 * pin["speed"], atol=1e-15)
    assert np.abs(pin["place"]).max() < 1e-15 and pin["coordinate"][-1] > 0.05
    # The joint force equals the mass times the acceleration minus gravity, of the velocities of steps.
    middles = np.diff(run.positions[:, 0], axis=0) / 0.001
    change = np.diff(middles, axis=0) / 0.001 + [0, 0, 9.81]
    np.testing.assert_allclose(
        np.linalg.norm(pin["force"][1:], axis=1), np.linalg.norm(change, axis=1), atol=1e-8
    )
    with pytest.raises(ValueError):
        pin["coordinate"][0] = 1.0


def test_tables_and_copies_keep_joints(tmp_path):
    run = pendulum().run(20)
    files = [file.name for file in run.to_csv(tmp_path)]
    assert files == ["states.csv", "contacts.csv", "steps.csv", "joints.csv", "run.json"]
    for other in (tumble.Trajectory.from_csv(run.scene, tmp_path), pickle.loads(pickle.dumps(run))):
        for name, column in run.joints["pin"].items():
            np.testing.assert_array_equal(other.joints["pin"][name], column)
    part = run[5:11].joints["pin"]
    np.testing.assert_array_equal(part["coordinate"], run.joints["pin"]["coordinate"][5:11])
    np.testing.assert_array_equal(part["force"], run.joints["pin"]["force"][5:10])
    pandas = pytest.importorskip("pandas")
    frame, table = run.joints_to_pandas(), pandas.read_csv(tmp_path / "joints.csv")
    assert list(frame["joint"].unique()) == ["pin"] and len(frame) == 21
    for column in frame.columns[3:]:
        np.testing.assert_array_equal(frame[column], table[column])


def test_the_last_step_of_a_simulation():
    simulation = pendulum(friction=0.25).simulate()
    before = simulation.joints["pin"]
    assert before["coordinate"] == 0.0 and before["torque"][2] == 0.0
    simulation.step()
    after = simulation.joints["pin"]
    assert after["coordinate"] > 0.0
    assert after["torque"][2] == pytest.approx(-0.25)


def test_a_motor_is_driven_in_the_loop():
    scene = tumble.Scene(
        [ROD], NO_GROUND, joints=[PIN], motors=[{"joint": "pin", "speed": 1.0, "max_force": 50.0}], time_step=0.001
    )
    simulation = scene.simulate()
    simulation.run(50)
    assert simulation.joints["pin"]["speed"] == pytest.approx(1.0, abs=1e-9)
    simulation.set_motor("pin", speed=-2.0, max_force=50.0)
    simulation.run(50)
    assert simulation.joints["pin"]["speed"] == pytest.approx(-2.0, abs=1e-9)
    simulation.set_motor("pin", position=0.3, stiffness=4000.0, damping=200.0, max_force=500.0)
    simulation.run(3000)
    weight = 9.81 * 0.5 * np.cos(0.3)
    assert simulation.joints["pin"]["coordinate"] == pytest.approx(0.3 + weight / 4000.0, rel=1e-3)
    simulation.set_motor("pin")
    simulation.set_force("pin", 0.75)
    # A force acts from the middle of its first step on, half of the time of action.
    for torque in (0.375, 0.75):
        simulation.step()
        assert simulation.joints["pin"]["torque"][2] == pytest.approx(torque)
    for wrong in (
        lambda: simulation.set_motor("pan", speed=1.0, max_force=1.0),
        lambda: simulation.set_motor("pin", speed=1.0),
        lambda: simulation.set_motor("pin", speed=1.0, position=1.0, max_force=1.0),
        lambda: simulation.set_motor("pin", speed=1.0, max_force=-1.0),
        lambda: simulation.set_motor("pin", speed=1.0, max_force=1.0, axis="slide"),
        lambda: simulation.set_force("pin", float("nan")),
    ):
        with pytest.raises(tumble.TumbleError):
            wrong()


def test_rollouts_are_the_numbers_of_a_loop():
    scene = pendulum(friction=0.1)
    starts = np.repeat(scene.states[None], 3, axis=0)
    runs = tumble.rollout(scene, steps=50, initial_states=starts)
    np.testing.assert_array_equal(runs.states[2], scene.run(50).states[1:])


def test_what_is_wrong_is_named(scenarios):
    for fields, words in [
        ({"bodies": ["leg"]}, "pin.*leg"),
        ({"anchor_b": [0, 0, 1.9]}, "pin is 1.000e-1 m"),
        ({"colour": 1}, "colour"),
    ]:
        with pytest.raises(tumble.TumbleError, match=words):
            pendulum(**fields)
    with pytest.raises(tumble.TumbleError, match="joints"):
        tumble.Scene([ROD], NO_GROUND, joints=PIN)
    assert len(tumble.load(scenarios / "chain.toml").joints) == 20


def test_gears_follow(tmp_path):
    wheels = [
        {"name": name, "box": [0.2, 0.2, 0.1], "mass": 1.0, "position": [x, 0, 0]}
        for name, x in (("one", 0.0), ("two", 1.0))
    ]
    shafts = [
        {"name": f"shaft-{wheel['name']}", "type": "revolute", "bodies": wheel["name"],
         "anchor": wheel["position"], "axis": [0, 0, 1], "force": force}
        for wheel, force in zip(wheels, (0.1, 0.0))
    ]
    gear = {"joints": ["shaft-two", "shaft-one"], "ratio": -2.0}
    scene = tumble.Scene(wheels, NO_GROUND, joints=shafts, gears=[gear], time_step=0.001)
    assert scene.gears == [("shaft-two", "shaft-one")]
    run = scene.run(100)
    two, one = (run.joints[name]["coordinate"] for name in scene.gears[0])
    np.testing.assert_allclose(two, -2.0 * one, atol=1e-13)
    np.testing.assert_array_equal(run.gears["coordinates"][:, 0], np.stack([two, one], axis=-1))
    # With I = m a²/6 about the axes, the first wheel has α = τ/(5 I) and the second -2 of it by the
    # gear.
    assert one[-1] == pytest.approx(0.5 * 0.1 / (5 * 0.04 / 6) * 0.1 * 0.1, rel=1e-4)
    np.testing.assert_allclose(run.gears["force"][:, 0], -2 * 0.1 / 5, rtol=1e-3)
    files = [file.name for file in run.to_csv(tmp_path)]
    assert files[3:] == ["joints.csv", "gears.csv", "run.json"]
    for other in (tumble.Trajectory.from_csv(scene, tmp_path), pickle.loads(pickle.dumps(run))):
        np.testing.assert_array_equal(other.gears["force"], run.gears["force"])


def test_rollouts_drive_motors_and_vary_joints():
    motor = {"joint": "pin", "position": 0.0, "stiffness": 200.0, "damping": 20.0, "max_force": 500.0}
    scene = tumble.Scene([ROD], NO_GROUND, joints=[PIN], motors=[motor], time_step=0.001)
    assert scene.motor_axes == scene.driven_axes == [("pin", 5)]
    targets = np.linspace(0, [[0.2], [0.4]], 50, axis=1)
    pushes = np.full((1, 50, 1), 0.3)
    friction = np.array([[0.0], [0.5]])
    out = tumble.rollout(
        scene, motors=targets, joint_forces=pushes, parameters={"joint_friction": friction}
    )
    assert out.states.shape == (2, 50, 1, 13)
    # A loop over single steps.
    for rollout in range(2):
        own = tumble.Scene(
            [ROD], NO_GROUND, joints=[{**PIN, "friction": friction[rollout, 0]}], motors=[motor], time_step=0.001
        )
        simulation = own.simulate()
        gains = {"stiffness": 200.0, "damping": 20.0, "max_force": 500.0}
        for step in range(50):
            simulation.set_motor("pin", position=targets[rollout, step, 0], **gains)
            simulation.set_force("pin", 0.3)
            simulation.step()
            np.testing.assert_array_equal(simulation.states, out.states[rollout, step])
    with pytest.raises(tumble.TumbleError, match="each rollout had its own joint_friction"):
        out[0]
    with pytest.raises(tumble.TumbleError, match="motors"):
        tumble.rollout(scene, motors=targets[:, :, [0, 0]])
    with pytest.raises(tumble.TumbleError, match="joint_forces has 49 steps, but motors has 50"):
        tumble.rollout(scene, motors=targets, joint_forces=pushes[:, 1:])


def test_runs_take_targets_and_forces_of_every_step():
    motor = {"joint": "pin", "position": 0.0, "stiffness": 200.0, "damping": 20.0, "max_force": 500.0}
    scene = tumble.Scene([ROD], NO_GROUND, joints=[PIN], motors=[motor], time_step=0.001)
    targets = np.linspace(0, [[0.2], [0.4]], 50, axis=1)
    pushes = np.sin(np.arange(50.0)).reshape(1, 50, 1)
    out = tumble.rollout(scene, motors=targets, joint_forces=pushes)
    for rollout in range(2):
        run = out[rollout]
        np.testing.assert_array_equal(run.states[1:], out.states[rollout])
        again = scene.run(50, motors=targets[rollout], joint_forces=pushes[0])
        np.testing.assert_array_equal(again.states, run.states)
    with pytest.raises(tumble.TumbleError, match=r"motors has shape \(49, 1\); \(50, 1\) is needed"):
        scene.run(50, motors=targets[0, 1:])
    with pytest.raises(tumble.TumbleError, match=r"joint_forces has shape \(50, 2\); \(50, 1\) is needed"):
        scene.run(50, joint_forces=np.zeros((50, 2)))
