"""Environments for Gymnasium of robots from files: hopper, half-cheetah, walker and ant.

    >>> import gymnasium, tumble.locomotion
    >>> env = gymnasium.make("tumble/Hopper-v0")

Observations, actions, rewards and ends of episodes follow Gymnasium's environments of these names,
version 5, with its model files. Every step is exact and certified. Steps that did not converge are
counted in ``info["unsolved"]``. The ant has no contact forces in its observation and no contact
cost, as with ``include_cfrc_ext_in_observation=False`` and ``contact_cost_weight=0``. Keywords are
those of ``RobotEnv``, not those of version 5.

``RobotEnv`` is the base class for custom environments. ``RobotVectorEnv`` simulates many of them
on all cores; ``gymnasium.make_vec`` uses it for these environments.
"""

from __future__ import annotations

from functools import partial
from math import hypot
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from ._robot_env import EPISODE, Info, RobotEnv, RobotVectorEnv
from ._types import Floats

__all__ = ["EPISODE", "Ant", "HalfCheetah", "Hopper", "RobotEnv", "RobotVectorEnv", "Runner", "Walker2d", "model"]


def model(name: str) -> Path:
    """File of a model that comes with Gymnasium."""
    return Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / name


class Runner(RobotEnv):
    """Environment with a reward for speed along x and a control cost.

    Subclasses can require a healthy state.
    """

    forward = 0
    """Index of the coordinate along x."""
    hidden = 1
    """Number of coordinates along the ground, which are not observed."""
    up = 1
    control_cost = 1e-3
    healthy_reward = 0.0
    ends_unwell = True
    fastest = np.inf
    """Largest observed rate."""

    def observe(self) -> Floats:
        """Coordinates except those along the ground, and rates."""
        rates = np.clip(self.robot.v, -self.fastest, self.fastest)
        return np.concatenate([self.robot.q[self.hidden :], rates])

    def is_healthy(self) -> bool:
        """True if the robot is healthy."""
        return True

    def progress(self, before: Floats, after: Floats) -> Info:
        """Position and velocity along x, from the coordinates before and after an action, for the info."""
        x = float(after[self.forward])
        return {"x_position": x, "x_velocity": (x - float(before[self.forward])) / self.dt}

    def judge(self, before: Floats, action: Floats) -> tuple[float, bool, Info]:
        """Reward: speed along x, plus the healthy reward, minus the control cost."""
        after, well = self.robot.q, self.is_healthy()
        info = self.progress(before, after)
        speed = info["x_velocity"]
        survive = self.healthy_reward if well or not self.ends_unwell else 0.0
        cost = self.control_cost * float(np.square(action).sum())
        info.update(reward_forward=speed, reward_survive=survive, reward_ctrl=-cost)
        return speed + survive - cost, self.ends_unwell and not well, info


def _noisy(env: RobotEnv, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Start with uniform noise on the coordinates and normal noise on the rates."""
    q, v = RobotEnv.draw(env, rng)
    return q, env.noise * rng.standard_normal(len(v))


class Hopper(Runner):
    """Planar hopper of four links. The episode ends when it falls."""

    healthy_reward = 1.0
    fastest = 10.0

    def __init__(
        self, file: Any = None, frame_skip: int = 4, noise: float = 5e-3, substeps: int = 1, **keywords: Any
    ) -> None:
        file = model("hopper.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps, **keywords)

    def draw(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Uniform noise on coordinates and rates."""
        q, v = super().draw(rng)
        return q, rng.uniform(-self.noise, self.noise, len(v))

    def is_healthy(self) -> bool:
        """True if it is upright and no number exceeds 100."""
        q, v = self.robot.q, self.robot.v
        state = np.concatenate([q[2:], v])
        return bool(np.all(np.abs(state) < 100.0) and q[1] > 0.7 and abs(q[2]) < 0.2)

    def progress(self, before: Floats, after: Floats) -> Info:
        """Position and velocity along x, and height above the start of the file."""
        height = float(after[self.up] - self.robot.start[self.up])
        return {**super().progress(before, after), "z_distance_from_origin": height}


class Walker2d(Hopper):
    """Planar walker with two legs. The episode ends when it falls."""

    def __init__(
        self, file: Any = None, frame_skip: int = 4, noise: float = 5e-3, substeps: int = 1, **keywords: Any
    ) -> None:
        file = model("walker2d_v5.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps, **keywords)

    def is_healthy(self) -> bool:
        """True if it is upright."""
        q = self.robot.q
        return bool(0.8 < q[1] < 2.0 and -1.0 < q[2] < 1.0)


class HalfCheetah(Runner):
    """Planar half-cheetah. The episode never ends. Its fast feet need steps shorter than 10 ms."""

    control_cost = 0.1
    ends_unwell = False

    def __init__(
        self, file: Any = None, frame_skip: int = 5, noise: float = 0.1, substeps: int = 4, **keywords: Any
    ) -> None:
        file = model("half_cheetah.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps, **keywords)

    def draw(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Uniform noise on the coordinates, normal noise on the rates."""
        return _noisy(self, rng)


class Ant(Runner):
    """Ant with four legs. The episode ends when its torso is too low or too high."""

    hidden = 2
    up = 2
    control_cost = 0.5
    healthy_reward = 1.0

    def __init__(
        self, file: Any = None, frame_skip: int = 5, noise: float = 0.1, substeps: int = 1, **keywords: Any
    ) -> None:
        file = model("ant.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps, **keywords)

    def draw(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Uniform noise on the coordinates, normal noise on the rates."""
        return _noisy(self, rng)

    def is_healthy(self) -> bool:
        """True if its torso is 0.2 to 1 m high."""
        return bool(0.2 <= self.robot.q[2] <= 1.0)

    def progress(self, before: Floats, after: Floats) -> Info:
        """Position and velocity along x and y, and distance from the origin."""
        x, y = after[:2].tolist()
        along_y = {"y_position": y, "y_velocity": (y - float(before[1])) / self.dt}
        return {**super().progress(before, after), **along_y, "distance_from_origin": hypot(x, y)}


HopperVector = partial(RobotVectorEnv, Hopper)
HalfCheetahVector = partial(RobotVectorEnv, HalfCheetah)
Walker2dVector = partial(RobotVectorEnv, Walker2d)
AntVector = partial(RobotVectorEnv, Ant)

for _name in ("Hopper", "HalfCheetah", "Walker2d", "Ant"):
    gymnasium.register(
        id=f"tumble/{_name}-v0",
        entry_point=f"tumble.locomotion:{_name}",
        vector_entry_point=f"tumble.locomotion:{_name}Vector",
        max_episode_steps=EPISODE,
    )
