"""Environments for Gymnasium of robots from files: hopper, half-cheetah, walker and ant.

    >>> import gymnasium, tumble.locomotion
    >>> env = gymnasium.make("tumble/Hopper-v0")

Observations, actions, rewards and ends of episodes follow Gymnasium's environments of these names,
version 5, with its model files. Every step is exact and certified. Steps that did not converge are
counted in ``info["unsolved"]``. The ant has no contact forces in its observation and no contact
cost, as with ``include_cfrc_ext_in_observation=False`` and ``contact_cost_weight=0``. ``RobotEnv``
is the base class for custom environments.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Dict, Optional, Tuple, Union

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from ._robot import Robot
from ._scene import Scene, load
from ._simulation import Simulation
from ._tumble import TumbleError

Floats = npt.NDArray[np.float64]
Info = Dict[str, Any]

EPISODE = 1000
"""Steps of an environment until an episode is truncated."""


def model(name: str) -> Path:
    """File of a model that comes with Gymnasium."""
    return Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / name


class RobotEnv(gymnasium.Env):  # type: ignore[misc,type-arg,unused-ignore]
    """Environment of a robot with actuators.

    One action lasts ``frame_skip`` time steps of the file, each divided into ``substeps``.
    Subclasses define observation and reward: ``observe``, ``judge``. The initial coordinates
    are those of ``draw``, clipped to the joints' ranges.
    """

    metadata: Dict[str, Any] = {"render_modes": []}
    up: Optional[int] = None
    """Index of the coordinate that lifts the robot. A start below the ground is lifted to it."""

    def __init__(
        self,
        file: Union[str, "os.PathLike[str]"],
        frame_skip: int,
        noise: float,
        substeps: int = 1,
    ) -> None:
        # The file's own time step. The deviations of the file are warnings of `load` alone.
        step = Scene.from_text(Path(file).read_text("utf-8"), file).time_step
        self.scene: Scene = load(file, time_step=step / substeps)
        self.frame_skip = frame_skip * substeps
        self.noise = noise
        self.simulation: Simulation = self.scene.simulate()
        ranges = self.robot.control_ranges
        if None in ranges:
            raise TumbleError("file: every actuator needs a control range")
        low, high = np.array(ranges, np.float32).reshape(-1, 2).T
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        size = len(self.observe())
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float64)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot

    @property
    def dt(self) -> float:
        """Duration of a step of the environment, s."""
        return self.frame_skip * self.scene.time_step

    def observe(self) -> Floats:
        """Observation: all coordinates and rates."""
        return np.concatenate([self.robot.q, self.robot.v])

    def draw(self, rng: np.random.Generator) -> Tuple[Floats, Floats]:
        """Random coordinates and rates at the start."""
        q, v = self.robot.start, np.zeros(self.robot.counts[1])
        return q + rng.uniform(-self.noise, self.noise, len(q)), v

    def judge(self, before: Floats, action: Floats) -> Tuple[float, bool, Info]:
        """Reward of a step, True at the end of the episode, and info.

        ``before`` are the coordinates at the start of the step.
        """
        return 0.0, False, {}

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Info] = None
    ) -> Tuple[Floats, Info]:
        """Draws a new start, from the seed if there is one. ``options`` are ignored."""
        super().reset(seed=seed)
        self.simulation = self.scene.simulate()
        q, v = self.draw(self.np_random)
        q = np.array(q)
        for index, (_, kind, at, _, _) in enumerate(self.robot.joint_list):
            limits = self.robot.bounds(index)[0]
            if kind in ("slide", "hinge") and limits is not None:
                q[at] = min(max(q[at], limits[0]), limits[1])
        lowest = self.robot.lowest(self.robot.placed(q, v, self.simulation.states))
        if self.up is not None and lowest < 0.0:
            q[self.up] -= lowest
        self.robot.set(q, v)
        return self.observe(), {}

    def step(self, action: Any) -> Tuple[Floats, float, bool, bool, Info]:
        """Takes the steps of one action.

        Returns observation, reward, True at the end of the episode, False (``gymnasium.make``
        truncates), and info.
        """
        before = self.robot.q
        action = np.asarray(action, dtype=np.float64)
        self.robot.controls = action
        ended = [self.simulation.step() for _ in range(self.frame_skip)]
        reward, over, info = self.judge(before, action)
        info["unsolved"] = sum(not step.ok for step in ended)
        return self.observe(), reward, over, False, info


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

    def judge(self, before: Floats, action: Floats) -> Tuple[float, bool, Info]:
        """Reward: speed along x, plus the healthy reward, minus the control cost."""
        after, well = self.robot.q, self.is_healthy()
        speed = float((after - before)[self.forward] / self.dt)
        survive = self.healthy_reward if well or not self.ends_unwell else 0.0
        cost = self.control_cost * float(np.square(action).sum())
        info = {
            "x_position": float(after[self.forward]),
            "x_velocity": speed,
            "reward_forward": speed,
            "reward_survive": survive,
            "reward_ctrl": -cost,
        }
        return speed + survive - cost, self.ends_unwell and not well, info


def _noisy(env: RobotEnv, rng: np.random.Generator) -> Tuple[Floats, Floats]:
    """Start with uniform noise on the coordinates and normal noise on the rates."""
    q, v = RobotEnv.draw(env, rng)
    return q, env.noise * rng.standard_normal(len(v))


class Hopper(Runner):
    """Planar hopper of four links. The episode ends when it falls."""

    healthy_reward = 1.0
    fastest = 10.0

    def __init__(
        self, file: Any = None, frame_skip: int = 4, noise: float = 5e-3, substeps: int = 1
    ) -> None:
        file = model("hopper.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps)

    def draw(self, rng: np.random.Generator) -> Tuple[Floats, Floats]:
        """Uniform noise on coordinates and rates."""
        q, v = super().draw(rng)
        return q, rng.uniform(-self.noise, self.noise, len(v))

    def is_healthy(self) -> bool:
        """True if it is upright and no number exceeds 100."""
        q, v = self.robot.q, self.robot.v
        state = np.concatenate([q[2:], v])
        return bool(np.all(np.abs(state) < 100.0) and q[1] > 0.7 and abs(q[2]) < 0.2)


class Walker2d(Hopper):
    """Planar walker with two legs. The episode ends when it falls."""

    def __init__(
        self, file: Any = None, frame_skip: int = 4, noise: float = 5e-3, substeps: int = 1
    ) -> None:
        file = model("walker2d_v5.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps)

    def is_healthy(self) -> bool:
        """True if it is upright."""
        q = self.robot.q
        return bool(0.8 < q[1] < 2.0 and -1.0 < q[2] < 1.0)


class HalfCheetah(Runner):
    """Planar half-cheetah. The episode never ends. Its fast feet need steps shorter than 10 ms."""

    control_cost = 0.1
    ends_unwell = False

    def __init__(
        self, file: Any = None, frame_skip: int = 5, noise: float = 0.1, substeps: int = 4
    ) -> None:
        file = model("half_cheetah.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps)

    def draw(self, rng: np.random.Generator) -> Tuple[Floats, Floats]:
        """Uniform noise on the coordinates, normal noise on the rates."""
        return _noisy(self, rng)


class Ant(Runner):
    """Ant with four legs. The episode ends when its torso is too low or too high."""

    hidden = 2
    up = 2
    control_cost = 0.5
    healthy_reward = 1.0

    def __init__(
        self, file: Any = None, frame_skip: int = 5, noise: float = 0.1, substeps: int = 1
    ) -> None:
        file = model("ant.xml") if file is None else file
        super().__init__(file, frame_skip, noise, substeps)

    def draw(self, rng: np.random.Generator) -> Tuple[Floats, Floats]:
        """Uniform noise on the coordinates, normal noise on the rates."""
        return _noisy(self, rng)

    def is_healthy(self) -> bool:
        """True if its torso is 0.2 to 1 m high."""
        return bool(0.2 <= self.robot.q[2] <= 1.0)


for _name in ("Hopper", "HalfCheetah", "Walker2d", "Ant"):
    gymnasium.register(
        id=f"tumble/{_name}-v0",
        entry_point=f"tumble.locomotion:{_name}",
        max_episode_steps=EPISODE,
    )
