"""Driven bodies and moving surfaces: trays, turntables and belts."""

import copy
import pickle

import numpy as np
import pytest
import tumble

G = 9.81
TRAY = {"name": "tray", "box": [2, 2, 0.1], "mass": 5.0, "position": [0, 0, 0.95]}
CUBE = {"name": "cube", "box": [0.2, 0.2, 0.1], "mass": 1.0, "position": [0, 0, 1.05]}
GROUND = {"friction": 0.4}


def way(k, time_step=0.002):
    """Prescribed position of the tray [m]: forwards and back in 0.8 s."""
    t = k * time_step
    return np.interp(t, [0, 0.4, 0.8], [0, 0.1, 0])


def tray(**keywords):
    there = {"body": "tray", "times": [0, 0.4, 0.8], "positions": [[0, 0, 0.95], [0.1, 0, 0.95], [0, 0, 0.95]]}
    return tumble.Scene([TRAY, CUBE], GROUND, driven=[there], **keywords)


def test_a_tray_goes_its_way_and_the_cube_with_it():
    run = tray().run(450)
    np.testing.assert_allclose(run.positions[:, 0, 0], way(np.arange(451)), atol=1e-13)
    assert run.scene.joints == ["tray-drive"]
    # Nothing slips at constant speed, and the drive carries the weight of both.
    np.testing.assert_allclose(run.joints["tray-drive"]["force"][120:190, 2], 6 * G, rtol=1e-9)
    np.testing.assert_allclose(run.velocities[120:190, 1, 0], 0.25, atol=1e-9)
    assert run.stiffness.shape == (450,) and "stiffness" in run.steps_to_pandas()


def test_states_of_a_driven_scene_are_a_start_at_their_index():
    scene = tray()
    simulation = scene.simulate()
    for _ in range(150):
        simulation.step()
    other = tumble.Simulation(scene, simulation.states, index=150)
    assert other.index == 150
    for one in (simulation, other):
        one.run(100)
    np.testing.assert_allclose(other.states, simulation.states, atol=1e-9)
    np.testing.assert_allclose(other.states[0, 0], way(250), atol=1e-13)
    with pytest.raises(tumble.TumbleError, match="tray-drive is .* off at the start"):
        tumble.Simulation(scene, simulation.states, index=10)


def test_derivatives_of_a_driven_scene_are_those_of_their_step():
    scene = tray()
    run = scene.run(160)
    states = run.states[150]
    found = scene.jacobian(states, index=150)
    np.testing.assert_allclose(found.ends, run.states[151], atol=1e-9)
    # The cube sticks to the tray: its speed is that of the way, whatever its own.
    assert np.abs(found["states"][1, 6:9, 1, 6:9]).max() < 1e-9
    whole = scene.vjp(np.eye(12)[[0, 0]], states, steps=9, index=150)
    np.testing.assert_allclose(whole.ends, run.states[159], atol=1e-9)
    with pytest.raises(tumble.TumbleError, match="tray-drive is .* off at the start"):
        scene.jacobian(states, index=10)


def test_a_belt_takes_a_cube_to_its_speed():
    belt = {"name": "belt", "box": [4, 1, 0.1], "position": [1.5, 0, -0.05]}
    cube = {**CUBE, "position": [0, 0, 0.05]}
    surface = {"of": "belt", "velocity": [0.6, 0, 0]}
    scene = tumble.Scene([cube], {"friction": 0.4, "none": True}, [belt], surfaces=[surface])
    run = scene.run(300)
    expected = np.minimum(0.4 * G * run.time, 0.6)
    np.testing.assert_allclose(run.velocities[:, 0, 0], expected, atol=1e-9)
    # The slip is zero after 0.153 s, once the cube moves with the belt.
    slip = np.linalg.norm(run.contacts["slip"], axis=1)
    assert slip[run.contacts["k"] > 80].max() < 1e-9 < slip[run.contacts["k"] < 70].min()
    rolled = tumble.rollout(scene, steps=300)
    np.testing.assert_array_equal(rolled.states[0], run.states[1:])


def test_driven_scenes_are_saved_pickled_copied_and_rolled_out(tmp_path):
    scene = tray()
    run = scene.run(400)
    for one in (tumble.load(scene.save(tmp_path / "tray.toml")), pickle.loads(pickle.dumps(scene))):
        np.testing.assert_array_equal(one.run(400).states, run.states)
    np.testing.assert_array_equal(tumble.rollout(scene, steps=400).states[0], run.states[1:])
    simulation = scene.simulate()
    simulation.run(150)
    for other in (copy.copy(simulation), pickle.loads(pickle.dumps(simulation))):
        np.testing.assert_array_equal(other.run(250).states, run.states[150:])
    # run.json describes the prescribed motion for the whole run and for parts of it.
    for name, part in (("all", run), ("part", run[120:300])):
        files = part.to_csv(tmp_path / name)
        assert files[-1].name == "run.json"
        read = tumble.Trajectory.from_csv(scene, tmp_path / name)
        np.testing.assert_array_equal(read.states, part.states)
        np.testing.assert_array_equal(read.stiffness, part.stiffness)


def test_bodies_come_and_go_beside_a_tray_on_its_way():
    simulation = tray().simulate()
    simulation.run(100)
    simulation.add_body({"name": "late", "box": 0.1, "mass": 0.3, "position": [0.05 + 0.5, 0.4, 1.05]})
    simulation.remove_body("cube")
    other = pickle.loads(pickle.dumps(simulation))
    run = simulation.run(300)
    np.testing.assert_allclose(run.positions[:, 0, 0], way(100 + np.arange(301)), atol=1e-13)
    np.testing.assert_array_equal(other.run(300).states, run.states)
    with pytest.raises(tumble.TumbleError, match="tray is attached to tray-drive"):
        simulation.remove_body("tray")
    simulation.remove_body("tray", joints=True)
    assert simulation.run(100).positions[-1, 0, 2] < 0.96


def test_the_command_line_verifies_what_python_drove(tmp_path, tumbled):
    for name in ("tray-and-conveyor", "turntable"):
        simulation = tumble.load(tumbled.scenarios / f"{name}.toml").simulate()
        simulation.run(300)
        simulation.run(200).to_csv(tmp_path / name)
        done = tumbled("verify", str(tmp_path / name / "states.csv"))
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def tumbled(scenarios):
    """Runs the command line."""
    import os
    import shutil
    import subprocess

    program = os.environ.get("TUMBLE") or shutil.which("tumble")
    if program is None:
        pytest.skip("TUMBLE does not name the program of the command line")

    def run(*arguments):
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600)

    run.scenarios = scenarios
    return run


@pytest.mark.parametrize(
    "driven, words",
    [
        ({"body": "none", "spin": [0, 0, 1]}, 'driven.0. .none..body: unknown name "none"'),
        ({"body": "tray"}, "times: `times` with `positions`"),
        ({"body": "tray", "times": [0, 1], "positions": [[0, 0, 0.95]]}, "positions has 1 entries"),
        ({"body": "tray", "times": [0], "positions": [[0, 0, 1]]}, "5.000e-2 m and 0.000e0 rad"),
        ("tray", "driven is 'tray'; a list of dictionaries"),
    ],
)
def test_ways_that_cannot_be_are_refused(driven, words):
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.Scene([TRAY], GROUND, driven=driven if isinstance(driven, str) else [driven])
