"""Derivatives by the torques and targets of each step, compared with finite differences."""

from importlib.util import find_spec

import numpy as np
import pytest
import tumble
from tumble._autodiff import Differentiable

STEPS = 12
ARM = """<robot name="arm">
  <link name="world"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.014" iyz="0" izz="0.014"/></inertial></link>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 1"/><parent link="world"/><child link="upper"/>
    <axis xyz="0 -1 0"/><limit lower="-2" upper="2" effort="30" velocity="10"/></joint>
  <link name="fore"><inertial><origin xyz="0.2 0 0"/><mass value="0.8"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.011" iyz="0" izz="0.011"/></inertial></link>
  <joint name="elbow" type="revolute"><origin xyz="0.4 0 0"/><parent link="upper"/><child link="fore"/>
    <axis xyz="0 -1 0"/><limit lower="-2" upper="2" effort="20" velocity="10"/></joint>
</robot>"""
WEIGHTS = np.random.default_rng(7).normal(size=(2, STEPS, 2, 13))


def arm():
    return tumble.Scene.from_text(ARM, "arm.urdf", time_step=0.01)


def by_targets():
    """An arm with motors that stay below their force limits, and targets for it."""
    scene = arm().with_motors(stiffness=20.0, damping=1.0)
    return scene, {"motors": np.random.default_rng(2).uniform(-0.3, 0.3, (2, STEPS, 2))}


def by_torques():
    """An arm with torques, shared by two rollouts."""
    torques = np.random.default_rng(3).uniform(-4, 4, (1, STEPS, 2))
    return arm(), {"joint_forces": torques, "friction": np.array([0.3, 0.4])}


INSTALLED = [name for name in ("torch", "jax") if find_spec(name)]
"""The tests' environment has jax. torch is tested where it is installed."""
CASES = pytest.mark.parametrize("case", [by_targets, by_torques])


@CASES
@pytest.mark.parametrize("size", [1e-2, 1e-3, 1e-4])
def test_products_are_those_of_differences(case, size):
    scene, given = case()
    of = Differentiable(scene, None, 1)
    found = of.pull(given, of.states(given), WEIGHTS)
    name = next(iter(given))
    assert found[name].shape == given[name].shape
    rng = np.random.default_rng(5)
    for _ in range(3):
        direction = rng.normal(size=given[name].shape)

        def at(by, direction=direction):
            return float((WEIGHTS * of.states({**given, name: given[name] + by * direction})).sum())

        slope = (8 * (at(size) - at(-size)) - (at(2 * size) - at(-2 * size))) / (12 * size)
        # The difference has an error of order size⁴, and the rounding of the steps over the size.
        assert np.isclose((found[name] * direction).sum(), slope, rtol=10 * size**4 + 1e-10 / size, atol=1e-9 / size)


def test_a_torque_turns_its_axis():
    """The spin about the axis changes by h τ / I in each step."""
    scene = tumble.Scene(
        bodies=[{"name": "rod", "box": [0.4, 0.02, 0.02], "mass": 1.0, "position": [0, 0, 1]}],
        ground={"friction": 0.3},
        joints=[{"type": "revolute", "bodies": ["rod"], "anchor": [0, 0, 1], "axis": [0, 0, 1]}],
        time_step=0.01,
        integrator="euler",
    )
    ends = np.zeros((1, 1, 12))
    ends[0, 0, 11] = 1.0
    runs = tumble.rollout(scene, joint_forces=np.zeros((1, 3, 1)), gradients=ends)
    inertia = scene.inertias[0, 2, 2]
    assert np.allclose(runs.gradients["joint_forces"], 0.01 / inertia, rtol=1e-9)


def test_a_body_at_rest_has_the_derivatives_of_each_step():
    """An arm that its motors hold at rest, so that all steps are equal."""
    scene, _ = by_targets()
    held = tumble.rollout(scene, motors=np.zeros((1, 400, 2))).states[:, -1]
    ends = np.zeros((1, 2, 12))
    ends[0, 0, 2] = 1.0
    motors = np.zeros((1, 60, 2))
    exact = tumble.rollout(scene, held, motors=motors, gradients=ends).gradients["motors"]
    for step in (0, 30, 59):
        moved = motors.copy()
        moved[0, step, 0] = 1e-4
        ahead = tumble.rollout(scene, held, motors=moved).states[0, -1, 0, 2]
        back = tumble.rollout(scene, held, motors=-moved).states[0, -1, 0, 2]
        assert exact[0, step, 0] == pytest.approx((ahead - back) / 2e-4, rel=1e-5, abs=1e-8)


GEARED = {
    "bodies": [
        {"name": "one", "box": 0.2, "mass": 1.0, "position": [0, 0, 1]},
        {"name": "two", "box": 0.2, "mass": 2.0, "position": [1, 0, 1]},
    ],
    "ground": {"friction": 0.3},
    "joints": [
        {"name": "a", "type": "revolute", "bodies": ["one"], "anchor": [0, 0, 1], "axis": [0, 0, 1]},
        {"name": "b", "type": "revolute", "bodies": ["two"], "anchor": [1, 0, 1], "axis": [0, 0, 1]},
    ],
    "time_step": 0.01,
}


def test_a_motor_of_a_gear():
    motor = {"position": 0.2, "stiffness": 3.0, "damping": 0.1, "max_force": 5.0}
    gear = {"joints": ["a", "b"], "ratio": 0.5, "motor": motor}
    scene = tumble.Scene(**GEARED, gears=[gear])
    motors = np.full((1, 8, 1), 0.2)
    ends = np.zeros((1, 2, 12))
    ends[0, 0, 11], ends[0, 1, 5] = 1.0, 2.0

    def at(by):
        states = tumble.rollout(scene, motors=motors + by * np.arange(8)[None, :, None]).states[0, -1]
        return states[0, 12] + 2.0 * 2.0 * np.arctan2(states[1, 6], states[1, 3])

    found = tumble.rollout(scene, motors=motors, gradients=ends).gradients["motors"]
    slope = (at(1e-4) - at(-1e-4)) / 2e-4
    assert (found[0, :, 0] * np.arange(8)).sum() == pytest.approx(slope, rel=1e-7)


def test_a_robot_without_motors_is_told_what_to_do():
    with pytest.raises(tumble.TumbleError, match="Scene.with_motors adds them"):
        tumble.rollout(arm(), motors=np.zeros((1, 3, 2)))
    with pytest.raises(tumble.TumbleError, match="slide or hinge 'knee' is unknown"):
        arm().with_motors(stiffness=1.0, joints=["knee"])
    with pytest.raises(tumble.TumbleError, match=r"joints is 'elbow'; a list of names is needed: \['elbow'\]"):
        arm().with_motors(stiffness=1.0, joints="elbow")
    with pytest.raises(tumble.TumbleError, match="stiffness is 0.0; a number above 0"):
        arm().with_motors(stiffness=0.0)
    with pytest.raises(tumble.TumbleError, match="stiffness of elbow is 0.0; a number above 0"):
        arm().with_motors(stiffness={"shoulder": 1.0, "elbow": 0.0})
    with pytest.raises(tumble.TumbleError, match="stiffness has no number for elbow"):
        arm().with_motors(stiffness={"shoulder": 1.0})
    with pytest.raises(tumble.TumbleError, match="name in max_force 'elbw' is unknown.*did you mean"):
        arm().with_motors(stiffness=1.0, max_force={"elbw": 1.0})
    limited = tumble.Scene.from_text(ARM.replace('effort="20" ', ""), "arm.urdf")
    assert len(limited.with_motors(stiffness=1.0, max_force=5.0).motor_axes) == 2


def test_gains_may_differ_by_joint():
    scene = arm().with_motors(stiffness={"shoulder": 30.0, "elbow": 10.0}, damping=1.0, max_force={"elbow": 5.0})
    simulation = arm().simulate()
    robot = simulation.robot
    robot.set_gains(stiffness={"shoulder": 30.0, "elbow": 10.0}, damping=1.0, max_force={"elbow": 5.0})
    assert (robot["elbow"].stiffness, robot["elbow"].max_force, robot["shoulder"].max_force) == (10.0, 5.0, 30.0)
    robot["shoulder"].target, robot["elbow"].target = 0.3, -0.4
    motors = np.tile([0.3, -0.4], (20, 1))
    np.testing.assert_array_equal(scene.run(20, motors=motors).states, simulation.run(20).states)


def test_motors_of_a_scene_are_those_of_its_robot():
    """A simulation whose robot has these targets takes the same steps."""
    scene = arm().with_motors(stiffness=20.0, damping=1.0, joints=["elbow"])
    assert [axis for axis in scene.motor_axes] == [arm().driven_axes[1]]
    simulation = arm().simulate()
    elbow = simulation.robot["elbow"]
    elbow.stiffness, elbow.damping, elbow.target = 20.0, 1.0, 0.5
    run = simulation.run(20)
    states = tumble.rollout(scene, motors=np.full((1, 20, 1), 0.5)).states
    assert np.array_equal(states[0], run.states[1:])


@CASES
@pytest.mark.parametrize("name", INSTALLED)
def test_torch_and_jax_have_the_same_numbers(case, name):
    scene, given = case()
    of = Differentiable(scene, None, 1)
    own = of.pull(given, of.states(given), WEIGHTS)
    found = {"torch": through_torch, "jax": through_jax}[name](scene, given)
    for argument, by in own.items():
        assert np.allclose(found[argument], by, rtol=1e-14, atol=0), argument


def split(given):
    """Arrays of motors and joint forces, and the constants."""
    inputs = ("motors", "joint_forces")
    return {name: given[name] for name in inputs if name in given}, {k: v for k, v in given.items() if k not in inputs}


def through_torch(scene, given):
    import torch
    import tumble.torch

    tensors = {name: torch.tensor(array, requires_grad=True) for name, array in given.items()}
    inputs, constants = split(tensors)
    states = tumble.torch.rollout(scene, **inputs, parameters=constants)
    (torch.tensor(WEIGHTS) * states).sum().backward()
    return {name: tensor.grad.numpy() for name, tensor in tensors.items()}


def through_jax(scene, given):
    import jax
    import tumble.jax

    jax.config.update("jax_enable_x64", True)

    def summed(arrays):
        inputs, constants = split(arrays)
        return (WEIGHTS * tumble.jax.rollout(scene, **inputs, parameters=constants)).sum()

    found = jax.jit(jax.grad(summed))({name: jax.numpy.asarray(array) for name, array in given.items()})
    return {name: np.asarray(by) for name, by in found.items()}
