"""Locomotion environments follow the documentation of Gymnasium's own ones."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
locomotion = pytest.importorskip("tumble.locomotion")

SIZES = {"Hopper": (11, 3), "HalfCheetah": (17, 6), "Walker2d": (17, 6), "Ant": (27, 8)}

pytestmark = pytest.mark.skipif(
    not locomotion.model("hopper.xml").is_file(), reason="this Gymnasium has no models"
)


@pytest.mark.parametrize("name", SIZES)
def test_environments_are_as_documented(name):
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(f"tumble/{name}-v0")
    size, controls = SIZES[name]
    assert env.observation_space.shape == (size,) and env.action_space.shape == (controls,)
    check_env(env.unwrapped)
    first, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    np.testing.assert_array_equal(first, again)
    before = env.unwrapped.robot.q
    action = env.action_space.sample()
    _, reward, _, _, info = env.step(action)
    after = env.unwrapped.robot.q
    speed = (after[0] - before[0]) / env.unwrapped.dt
    cost = env.unwrapped.control_cost * np.square(np.asarray(action, float)).sum()
    assert info["x_velocity"] == pytest.approx(speed)
    assert reward == pytest.approx(speed + info["reward_survive"] - cost)
    assert info["unsolved"] == 0


def test_an_episode_of_each_is_solved():
    for name in SIZES:
        env = gymnasium.make(f"tumble/{name}-v0")
        env.reset(seed=1)
        env.action_space.seed(1)
        unsolved = taken = 0
        for _ in range(60):
            _, _, over, cut, info = env.step(env.action_space.sample())
            unsolved += info["unsolved"]
            taken += 1
            if over or cut:
                env.reset()
        # Torques of 150 N m accelerate the ant's light feet strongly, so some steps may fail.
        most = 0.02 if name == "Ant" else 0.0
        assert unsolved <= most * taken * env.unwrapped.frame_skip, (name, unsolved, taken)


def test_a_hopper_that_falls_is_over():
    env = locomotion.Hopper()
    env.reset(seed=0)
    for _ in range(400):
        _, _, over, _, info = env.step(np.zeros(3))
        if over:
            break
    assert over and info["reward_survive"] == 0.0
