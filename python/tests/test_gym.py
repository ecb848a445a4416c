"""Gymnasium's own check of the environment, and the vector environment with the same steps."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import tumble.gym
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode


def test_gymnasium_finds_nothing_wrong():
    check_env(gymnasium.make("tumble/PushCube-v0").unwrapped, skip_render_check=True)


def test_images_are_drawn_on_request():
    env = gymnasium.make("tumble/PushCube-v0", render_mode="rgb_array")
    env.reset(seed=1)
    assert env.render().shape == (480, 480, 3)
    with pytest.raises(tumble.TumbleError, match="render_mode is 'human'"):
        tumble.gym.PushCube(render_mode="human")


def test_a_straight_push_reaches_the_target():
    env = gymnasium.make("tumble/PushCube-v0")
    observation, _ = env.reset(seed=3)
    # Target speed proportional to the distance. The friction of 0.4 m g is 0.2 of the largest
    # force.
    for _ in range(200):
        way, velocity = observation[13:15], observation[7:9]
        distance = np.linalg.norm(way)
        speed = min(0.5, 2.0 * distance)
        push = (0.2 * way + 0.5 * speed * way) / distance - 0.5 * velocity
        observation, reward, terminated, truncated, info = env.step(
            np.clip(push, -1, 1).astype(np.float32)
        )
        assert info["unsolved"] == 0
        if terminated or truncated:
            break
    assert terminated and info["is_success"] and reward > 0.9


def test_a_push_moves_as_newton_says():
    """The speed along x after 50 ms is (F − μ m g)/m times that time."""
    env = tumble.gym.PushCube()
    env.reset(seed=0)
    observation, *_ = env.step(np.array([1.0, 0.0], np.float32))
    assert observation[7] == pytest.approx((20.0 - 0.4 * 9.81) * 0.05, rel=1e-3)


def test_the_vector_takes_the_same_steps():
    count = 5
    vector = tumble.gym.PushCubeVector(count, threads=2)
    envs = [tumble.gym.PushCube() for _ in range(count)]
    observations, _ = vector.reset(seed=11)
    for index, env in enumerate(envs):
        np.testing.assert_array_equal(env.reset(seed=11 + index)[0], observations[index])
    rng = np.random.default_rng(0)
    for _ in range(30):
        actions = rng.uniform(-1, 1, (count, 2)).astype(np.float32)
        observations, rewards, terminated, _, _ = vector.step(actions)
        for index, env in enumerate(envs):
            observation, reward, ended, _, _ = env.step(actions[index])
            np.testing.assert_array_equal(observation, observations[index])
            assert (reward, ended) == (rewards[index], terminated[index])
        if terminated.any():
            break


def test_the_vector_starts_anew_in_the_step_after_the_end():
    vector = gymnasium.make_vec(
        "tumble/PushCube-v0", num_envs=3, vectorization_mode="vector_entry_point"
    )
    assert vector.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    observations, _ = vector.reset(seed=5)
    assert vector.observation_space.contains(observations)
    nothing = np.zeros((3, 2), np.float32)
    for _ in range(199):
        *_, terminated, truncated, _ = vector.step(nothing)
        assert not (terminated | truncated).any()
    last, _, _, truncated, _ = vector.step(nothing)
    assert truncated.all()
    fresh, rewards, terminated, truncated, _ = vector.step(np.ones((3, 2), np.float32))
    assert not (terminated | truncated).any() and (rewards == 0.0).all()
    assert (fresh[:, 0:2] != last[:, 0:2]).all() and (fresh[:, 7:13] == 0.0).all()
    moved, *_ = vector.step(np.ones((3, 2), np.float32))
    assert (moved[:, 7] > 0).all()


@pytest.mark.parametrize("action", [0.5, [0.5], [0.5, 0.1, 0.0], [[0.5, 0.1]], [0.0, np.nan], "up"])
def test_an_action_of_another_shape_is_refused(action):
    env = tumble.gym.PushCube()
    env.reset(seed=0)
    with pytest.raises(tumble.TumbleError, match=r"^action"):
        env.step(action)


@pytest.mark.parametrize("actions", [np.zeros((3, 2)), np.zeros((1, 2)), np.zeros(2), np.full((2, 2), np.inf)])
def test_actions_for_another_number_of_cubes_are_refused(actions):
    env = tumble.gym.PushCubeVector(2)
    env.reset(seed=0)
    with pytest.raises(tumble.TumbleError, match=r"^actions"):
        env.step(actions)


def test_a_step_before_the_first_reset_is_refused():
    for env, action in ((tumble.gym.PushCube(), np.zeros(2)), (tumble.gym.PushCubeVector(2), np.zeros((2, 2)))):
        with pytest.raises(tumble.TumbleError, match="call reset first"):
            env.step(action)
        env.reset(seed=0)
        env.step(action)


def test_the_time_step_divides_a_push():
    env = gymnasium.make("tumble/PushCube-v0", friction=0.2, time_step=0.01).unwrapped
    env.reset(seed=1)
    env.step([1.0, 0.0])
    # The push of 20 N for 50 ms, less friction of 0.2 times the weight of 1 kg.
    assert np.linalg.norm(env._state[7:9]) == pytest.approx((20.0 - 0.2 * 9.81) * 0.05, rel=1e-9)
    with pytest.raises(tumble.TumbleError, match="time_step is 0.03 s; a whole number of time steps"):
        gymnasium.make("tumble/PushCube-v0", time_step=0.03)
