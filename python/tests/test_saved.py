"""Saved and copied simulations continue with the same numbers to the last bit."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
import tumble

CUBE = {"box": 0.2, "mass": 2.0}


def stack(height=4, **keywords):
    bodies = [
        {**CUBE, "name": f"cube-{level}", "position": [0.01 * (level % 2), 0, 0.1 + 0.2 * level]}
        for level in range(height)
    ]
    return tumble.Scene(bodies, {"friction": 0.5}, **keywords)


def heap():
    """Cubes that fall on each other, rotated and bouncing."""
    place = {"position": [0, 0, 0.4], "attitude": "random", "jitter": 0.02, "velocity": [0.3, 0, -1]}
    copies = {"count": [2, 2, 3], "step": [0.4, 0.4, 0.4]}
    return tumble.Scene(
        [{**CUBE, **place, "copies": copies}], {"friction": 0.4, "restitution": 0.5}, seed=5
    )


def same(one, other, steps=60):
    for _ in range(steps):
        assert one.step() == other.step()
        np.testing.assert_array_equal(one.states, other.states)
        np.testing.assert_array_equal(one.forces, other.forces)


@pytest.mark.parametrize("after", [0, 1, 90, 200])
def test_copies_go_on_alike(after):
    simulation = heap().simulate()
    for step in range(after):
        simulation.step(np.full((12, 6), 0.1) if step == 30 else None)
    copies = [copy.copy(simulation), copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    for other in copies:
        assert (other.index, other.time) == (simulation.index, simulation.time)
        np.testing.assert_array_equal(other.forces, simulation.forces)
        assert other.contacts.keys() == simulation.contacts.keys()
        for name, column in simulation.contacts.items():
            np.testing.assert_array_equal(other.contacts[name], column)
    kept = pickle.dumps(simulation)
    for other in copies:
        same(other, pickle.loads(kept))
    same(simulation, pickle.loads(kept))


def test_a_robot_keeps_its_turns_gains_and_targets(tmp_path):
    (tmp_path / "wheel.xml").write_text(WHEEL)
    simulation = tumble.load(tmp_path / "wheel.xml").simulate()
    robot = simulation.robot
    robot["hub"].hold_speed(10.0, max_force=50.0)
    for _ in range(500):
        simulation.step()
        robot.q
    robot.set_gains(stiffness=80.0, damping=3.0, max_force=60.0)
    robot["hub"].target = 12.0
    # The actuator of the file replaces the motor.
    robot.controls = [0.5]
    assert robot["hub"].target is None
    robot["hub"].target = 11.0
    assert robot.q[0] > 2 * np.pi
    simulation.save(tmp_path / "state.bin")
    others = [copy.copy(simulation), pickle.loads(pickle.dumps(simulation))]
    others.append(tumble.Simulation.restore(simulation.scene, tmp_path / "state.bin"))
    for other in others:
        assert other.robot["hub"].target == 11.0
        np.testing.assert_array_equal(other.robot.q, robot.q)
        np.testing.assert_array_equal(other.robot.controls, [0.5])
    for which in (simulation, *others):
        which.robot["hub"].target = 9.0
    for other in others:
        same(other, pickle.loads(pickle.dumps(simulation)))


WHEEL = """
<mujoco>
  <worldbody><body><joint name="hub" axis="0 0 1"/><geom type="box" size=".3 .2 .1" mass="2"/></body></worldbody>
  <actuator><motor joint="hub"/></actuator>
</mujoco>
"""


def test_another_process_goes_on(tmp_path):
    simulation = heap().simulate()
    for _ in range(120):
        simulation.step()
    (tmp_path / "there.pickle").write_bytes(pickle.dumps(simulation))
    program = (
        "import pickle, sys, numpy as np\n"
        "simulation = pickle.load(open(sys.argv[1], 'rb'))\n"
        "for _ in range(100): simulation.step()\n"
        "np.save(sys.argv[2], simulation.states)\n"
    )
    states = tmp_path / "states.npy"
    subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "there.pickle"), str(states)], check=True
    )
    for _ in range(100):
        simulation.step()
    np.testing.assert_array_equal(np.load(states), simulation.states)


def test_a_file_goes_on(tmp_path):
    scene = stack()
    simulation = scene.simulate()
    for _ in range(40):
        simulation.step()
    path = simulation.save(tmp_path / "state.bin")
    again = tumble.Simulation.restore(scene, path, threads=2)
    assert again.index == 40
    same(simulation, again)
    other = stack(height=3)
    with pytest.raises(tumble.TumbleError, match="state.bin.*4 bodies; the world has 3"):
        tumble.Simulation.restore(other, path)
    content = path.read_bytes()
    for wrong, words in [(content[:99], "cut off"), (content[:-9] + b"!" + content[-8:], "damaged")]:
        path.write_bytes(wrong)
        with pytest.raises(tumble.TumbleError, match=words):
            tumble.Simulation.restore(scene, path)
    with pytest.raises(OSError):
        tumble.Simulation.restore(scene, tmp_path / "nowhere")


def test_a_start_has_an_index():
    simulation = stack().simulate(index=500)
    assert simulation.index == 500 and simulation.time == pytest.approx(1.0)
    simulation.step()
    assert simulation.index == 501
    with pytest.raises(tumble.TumbleError, match="index"):
        stack().simulate(index=-1)


def test_states_are_set():
    simulation = stack().simulate()
    for _ in range(20):
        simulation.step()
    away = simulation.states[3].copy()
    away[:3] += [3, 0, 2]
    simulation.set_state("cube-3", away)
    np.testing.assert_array_equal(simulation.states[3], away)
    simulation.step()
    assert simulation.states[3, 9] == pytest.approx(away[9] - 9.81 * 0.002)
    simulation.states = stack().states
    np.testing.assert_array_equal(simulation.states, stack().states)
    assert simulation.step().ok
    for body, words in [("nobody", "cube-0"), (4, "body"), (-1, "body")]:
        with pytest.raises(tumble.TumbleError, match=words):
            simulation.set_state(body, away)
    inside = simulation.states[1]
    with pytest.raises(tumble.TumbleError, match="overlap"):
        simulation.set_state(2, inside)
    with pytest.raises(tumble.TumbleError, match="states"):
        simulation.states = np.zeros((3, 13))


def test_every_state_of_a_run_is_a_start():
    scene = heap()
    run = scene.run(300)
    for states in run.states[::5]:
        assert scene.simulate(states).step().status is not tumble.Status.FAILED


TIED = """
steps = 5
[ground]
friction = 0.5
[[bodies]]
name = "cup"
box = [0.2, 0.2, 0.2]
mass = 1.0
position = [0, 0, 0.5]
[[bodies]]
name = "saucer"
box = [0.2, 0.2, 0.2]
mass = 1.0
position = [0, 0, 1.0]
"""
HOOK = """
[[joints]]
name = "hook"
type = "spherical"
bodies = ["cup", "saucer"]
anchor_a = [0, 0, 0.25]
anchor_b = [0, 0, -0.25]
"""


def test_states_that_cannot_be_are_refused_by_names():
    free = tumble.Scene.from_text(TIED, "free.toml")
    inside = free.simulate().states.copy()
    inside[1, 2] = 0.6
    refusal = "cup and saucer overlap by 1.000e-1 m at the start"
    with pytest.raises(tumble.TumbleError, match=refusal):
        free.simulate().states = inside
    with pytest.raises(tumble.TumbleError, match=refusal):
        tumble.Simulation(free, states=inside)
    with pytest.raises(tumble.TumbleError, match="rollout 0: " + refusal):
        tumble.rollout(free, inside[None], steps=3)
    hanging = tumble.Scene.from_text(TIED + HOOK, "tied.toml").simulate()
    apart = hanging.states.copy()
    apart[1, 2] = 1.1
    with pytest.raises(tumble.TumbleError, match="joint hook is 1.000e-1 m and"):
        hanging.states = apart
    with pytest.raises(tumble.TumbleError, match="cup is attached to joint hook;"):
        hanging.hold("cup")


def test_a_body_is_held_and_released():
    simulation = stack().simulate()
    for _ in range(20):
        simulation.step()
    place = simulation.states[1, :7]
    simulation.hold("cube-1")
    for other in (simulation, copy.copy(simulation)):
        for _ in range(40):
            other.step()
        np.testing.assert_array_equal(other.states[1, :7], place)
        assert other.held == ["cube-1"]
    with pytest.raises(tumble.TumbleError, match="overlap"):
        simulation.release(1)
    for body in (2, 3):
        state = simulation.states[body].copy()
        state[:3] = [3 + body, 0, 1]
        simulation.set_state(body, state)
    simulation.release(1)
    assert simulation.step().ok and simulation.held == []
    assert simulation.forces[1, 2] == pytest.approx(2 * 9.81, rel=1e-6)
