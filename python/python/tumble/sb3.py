"""Robots for Stable-Baselines3, which needs vector environments of its own kind.

    >>> from stable_baselines3 import PPO
    >>> from tumble.sb3 import RobotVecEnv
    >>> PPO("MlpPolicy", RobotVecEnv(RobotVectorEnv(Trot, num_envs=8))).learn(100_000)

Episodes begin anew in the step that ends one, whose info has ``terminal_observation`` and ``TimeLimit.truncated``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv

from ._robot_env import RobotVectorEnv
from ._types import Floats

Indices = int | Iterable[int] | None


class RobotVecEnv(VecEnv):  # type: ignore[misc,unused-ignore]
    """The environments of a ``RobotVectorEnv``, with their steps on all its threads."""

    def __init__(self, robots: RobotVectorEnv) -> None:
        self.robots = robots
        self._actions: Any = None
        self._returns = np.zeros(robots.num_envs)
        super().__init__(robots.num_envs, robots.single_observation_space, robots.single_action_space)

    def reset(self) -> Floats:
        """Draws new starts, from the seeds given to ``seed``."""
        observed, _ = self.robots.reset(seed=self._seeds)
        self._returns[:] = 0.0
        self._reset_seeds()
        self._reset_options()
        return observed

    def step_async(self, actions: Any) -> None:
        """Notes the actions of the next ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> tuple[Floats, Floats, Any, list[dict[str, Any]]]:
        """Takes the steps of the actions. Returns observations, rewards, ends of episodes and one info for each."""
        observed, rewards, terminated, truncated, arrays = self.robots.step(self._actions)
        ended, taken = terminated | truncated, self.robots.episode_steps
        self._returns += rewards
        infos = [_of_one(arrays, index) for index in range(self.num_envs)]
        for index in np.flatnonzero(ended).tolist():
            infos[index]["terminal_observation"] = observed[index].copy()
            infos[index]["TimeLimit.truncated"] = bool(truncated[index] and not terminated[index])
            infos[index]["episode"] = {"r": float(self._returns[index]), "l": int(taken[index])}
            observed[index] = self.robots.restart(index)
        self._returns[ended] = 0.0
        return observed, rewards, ended, infos

    def close(self) -> None:
        """Closes the environments."""
        self.robots.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Attribute of the environments at ``indices``, of all by default."""
        return [getattr(self.robots.envs[index], attr_name) for index in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Sets an attribute of the environments at ``indices``."""
        for index in self._get_indices(indices):
            setattr(self.robots.envs[index], attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Results of a method of the environments at ``indices``."""
        chosen = [self.robots.envs[index] for index in self._get_indices(indices)]
        return [getattr(env, method_name)(*method_args, **method_kwargs) for env in chosen]

    def env_is_wrapped(self, wrapper_class: type, indices: Indices = None) -> list[bool]:
        """True for the monitor, because infos have the returns of episodes. The environments have no wrappers."""
        return [issubclass(wrapper_class, Monitor) for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[Any]:
        """Images of the environments."""
        return self.robots.render() or [None] * self.num_envs


def _of_one(arrays: dict[str, Any], index: int) -> dict[str, Any]:
    """Info of one environment. Gymnasium's has an array for each entry, and a mask of those that have it."""
    present = {name: arrays.get(f"_{name}") for name in arrays if not name.startswith("_")}
    return {name: arrays[name][index] for name, mask in present.items() if mask is None or mask[index]}
