"""Environments for Stable-Baselines3: its base class, or one with the same methods where it is not installed."""

import sys
from importlib.util import find_spec
from types import ModuleType

import gymnasium
import numpy as np
import pytest
import tumble.locomotion  # noqa: F401  registers the environments


class VecEnv:
    """The part of Stable-Baselines3's base class that subclasses use."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self._reset_seeds()
        self.render_mode = self.get_attr("render_mode")[0]

    def _reset_seeds(self):
        self._seeds = [None] * self.num_envs

    def _reset_options(self):
        self._options = [{}] * self.num_envs

    def _get_indices(self, indices):
        return range(self.num_envs) if indices is None else [indices] if isinstance(indices, int) else indices

    def seed(self, seed):
        self._seeds = [seed + index for index in range(self.num_envs)]

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()


@pytest.fixture
def adapter(monkeypatch):
    """The class RobotVecEnv."""
    if not find_spec("stable_baselines3"):
        parts = {"common.monitor": {"Monitor": type("Monitor", (), {})}, "common.vec_env": {"VecEnv": VecEnv}}
        for name in ("", "common", *parts):
            module = ModuleType(f"stable_baselines3.{name}".rstrip("."))
            module.__dict__.update(parts.get(name, {}))
            monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.delitem(sys.modules, "tumble.sb3", raising=False)
    from tumble.sb3 import RobotVecEnv

    return RobotVecEnv


def hoppers():
    return gymnasium.make_vec("tumble/Hopper-v0", num_envs=3, vectorization_mode="vector_entry_point").unwrapped


def test_episodes_are_those_of_single_environments(adapter):
    """Each episode ends in the step in which that of a single environment ends, and the next begins at once."""
    many = adapter(hoppers())
    many.seed(5)
    singles = [gymnasium.make("tumble/Hopper-v0", max_episode_steps=None) for _ in range(3)]
    observed = [env.reset(seed=5 + index)[0] for index, env in enumerate(singles)]
    np.testing.assert_array_equal(many.reset(), observed)
    draws, ends = np.random.default_rng(0), 0
    for _ in range(120):
        actions = draws.uniform(-1.0, 1.0, (3, 3)).astype(np.float32)
        seen, rewards, done, infos = many.step(actions)
        for index, env in enumerate(singles):
            own, reward, over, _, _ = env.step(actions[index])
            assert (rewards[index], done[index]) == (reward, over)
            if over:
                ends += 1
                np.testing.assert_array_equal(infos[index]["terminal_observation"], own)
                assert infos[index]["TimeLimit.truncated"] is False
                own, _ = env.reset()
            np.testing.assert_array_equal(seen[index], own)
    assert ends > 3


def test_infos_and_attributes(adapter):
    robots = hoppers()
    robots.max_episode_steps = 2
    many = adapter(robots)
    many.seed(1)
    many.reset()
    still = np.zeros((3, 3), np.float32)
    _, first, done, infos = many.step(still)
    assert not done.any() and [info["unsolved"] for info in infos] == [0, 0, 0]
    _, second, done, infos = many.step(still)
    assert done.all() and all(info["TimeLimit.truncated"] for info in infos)
    assert [info["episode"]["l"] for info in infos] == [2, 2, 2]
    np.testing.assert_allclose([info["episode"]["r"] for info in infos], first + second)
    assert many.get_attr("frame_skip", 1) == [robots.envs[1].frame_skip]
    many.set_attr("mark", 7, [0, 2])
    assert robots.envs[2].mark == 7 and not hasattr(robots.envs[1], "mark")
    assert len(many.env_method("reset", indices=[0])) == 1
    many.close()
