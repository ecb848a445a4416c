"""Locomotion environments follow the documentation of Gymnasium's own ones."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
locomotion = pytest.importorskip("tumble.locomotion")

SIZES = {"Hopper": (11, 3), "HalfCheetah": (17, 6), "Walker2d": (17, 6), "Ant": (27, 8)}

PLACES = {
    "HalfCheetah": lambda before, after, dt: {"x_position": after[0], "x_velocity": (after[0] - before[0]) / dt},
    "Hopper": lambda before, after, dt: {
        **PLACES["HalfCheetah"](before, after, dt),
        "z_distance_from_origin": after[1] - 1.25,
    },
    "Walker2d": lambda before, after, dt: PLACES["Hopper"](before, after, dt),
    "Ant": lambda before, after, dt: {
        **PLACES["HalfCheetah"](before, after, dt),
        "y_position": after[1],
        "y_velocity": (after[1] - before[1]) / dt,
        "distance_from_origin": np.hypot(after[0], after[1]),
    },
}
"""Infos about the place of a robot, by its coordinates before and after an action that lasts dt."""

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
    place = {name: value for name, value in info.items() if "position" in name or "origin" in name or "_vel" in name}
    assert place == pytest.approx(PLACES[name](before, after, env.unwrapped.dt))


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


@pytest.mark.parametrize("name", SIZES)
def test_infos_are_those_of_version_5(name):
    pytest.importorskip("mujoco")
    own = {"include_cfrc_ext_in_observation": False, "contact_cost_weight": 0.0} if name == "Ant" else {}
    theirs, ours = gymnasium.make(f"{name}-v5", **own), gymnasium.make(f"tumble/{name}-v0")
    assert ours.observation_space.shape == theirs.observation_space.shape
    for env in (theirs, ours):
        env.reset(seed=0)
    action = np.zeros(ours.action_space.shape, np.float32)
    infos = [set(env.step(action)[-1]) - {"TimeLimit.truncated"} for env in (theirs, ours)]
    assert infos[1] - infos[0] <= {"unsolved", "reward_survive"} and infos[0] - infos[1] <= {"reward_contact"}
