"""The walk of a robot on four legs, as a task for any engine, and its environment in tumble.

learn_walk.py and walk_mujoco.py use it. A policy has actions from -1 to 1, every 0.02 s. They move the
targets of the twelve motors away from a trot in place. The reward of an action is at most 1.5:
1.5 at the speed of 0.5 m/s along x, and 0.5 at rest.
"""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import tumble
from tumble.locomotion import RobotEnv, RobotVectorEnv

Floats = npt.NDArray[np.float64]

STAND = np.array([0.0, 0.8, -1.6] * 4)
"""Joint angles of the standing pose: hip, thigh and calf of each leg."""
HEIGHT = 0.32
"""Height of the trunk at the start, m. The feet are a few centimetres above the ground."""
REACH = np.array([0.2, 0.5, 0.5] * 4)
"""Largest change of the targets by an action, rad."""
LIFT = np.array([0.0, 0.3, -0.6])
"""Change of the targets of a leg that lifts its foot, rad."""
PAIRS = np.array([1.0, -1.0, -1.0, 1.0])
"""Diagonal pairs of legs."""
STRIDE = 25
"""Number of actions in a stride."""
STIFFNESS, DAMPING = 30.0, 0.8
"""Gains of the motors, N m/rad and N m s/rad."""
SPEED = 0.5
PERIOD = 0.02
"""Duration of an action, s."""
TIME_STEP = 0.005
EPISODE = 500
"""Number of actions in an episode."""


def targets(seen: Floats, actions: Floats) -> Floats:
    """Targets (B, 12) of the motors, for observations and actions of a policy.

    Without actions, the robot lifts its diagonal pairs of feet in turn.
    """
    lifted = np.maximum(0.0, seen[:, :1] * PAIRS)[:, :, None] * LIFT
    found: Floats = STAND + lifted.reshape(-1, len(STAND)) + REACH * np.clip(actions, -1.0, 1.0)
    return found


def rotation(q: Floats) -> Floats:
    """Matrix (3, 3) of the trunk's attitude, trunk to world."""
    w, x, y, z = q[3:7]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Task:
    """Start, observation and reward, for coordinates and rates in the order of MuJoCo."""

    def __init__(self) -> None:
        self.last, self.clock = np.zeros(len(STAND)), 0

    def start(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Standing pose with noise on attitude, angles and rates."""
        self.last, self.clock = np.zeros(len(STAND)), 0
        attitude = np.concatenate([[1.0], rng.uniform(-0.1, 0.1, 3) / 2.0])
        joints = STAND + rng.uniform(-0.1, 0.1, len(STAND))
        q = np.concatenate([[0.0, 0.0, HEIGHT], attitude / np.linalg.norm(attitude), joints])
        return q, rng.uniform(-0.1, 0.1, 6 + len(STAND))

    def observation(self, q: Floats, v: Floats) -> Floats:
        """The clock of the stride; directions up and ahead and velocities in the trunk's frame; joints; last action."""
        turn, angle = rotation(q), 2.0 * np.pi * self.clock / STRIDE
        clock = [np.sin(angle), np.cos(angle)]
        joints = [q[7:] - STAND, 0.05 * v[6:]]
        return np.concatenate([clock, turn[2], turn[0], turn.T @ v[:3], 0.25 * v[3:6], *joints, self.last])

    def judge(self, q: Floats, v: Floats, aimed: Floats) -> tuple[float, bool, dict[str, Any]]:
        """Reward after motors had the targets ``aimed``, True after a fall, and info."""
        turn, action = rotation(q), (aimed - STAND) / REACH
        pace = 1.5 - abs(v[0] - SPEED) / SPEED
        drift = 0.5 * abs(v[1]) + 0.5 * turn[1, 0] ** 2
        shaking = 0.5 * v[2] ** 2 + 0.025 * (v[3] ** 2 + v[4] ** 2)
        tilt = turn[2, 0] ** 2 + turn[2, 1] ** 2
        crouch = 20.0 * min(q[2] - 0.25, 0.0) ** 2
        jerk = 0.02 * np.square(action - self.last).sum()
        self.last, self.clock = action, self.clock + 1
        fell = bool(q[2] < 0.15 or turn[2, 2] < 0.6)
        reward = pace - drift - shaking - tilt - crouch - jerk - 5.0 * fell
        return float(reward), fell, {"x": float(q[0])}


class Walk(RobotEnv):
    """The walk in tumble. An action has the targets of the motors."""

    def __init__(self, scene: tumble.Scene) -> None:
        self.task = Task()
        steps = round(PERIOD / scene.time_step)
        super().__init__(scene, steps, actions="pd", stiffness=STIFFNESS, damping=DAMPING)

    def draw(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Start of the task."""
        return self.task.start(rng)

    def observe(self) -> Floats:
        """Observation of the task."""
        return self.task.observation(self.robot.q, self.robot.v)

    def judge(self, before: Floats, action: Floats) -> tuple[float, bool, dict[str, Any]]:
        """Reward of the task."""
        return self.task.judge(self.robot.q, self.robot.v, action)


def tumbling(file: str | os.PathLike[str], number: int, friction: float = 1.0) -> RobotVectorEnv:
    """Environments in tumble."""
    with warnings.catch_warnings():
        # The file has elements of Gazebo, and meshes for pictures.
        warnings.simplefilter("ignore")
        scene = tumble.load(file, time_step=TIME_STEP, friction=friction)
    return RobotVectorEnv(Walk, number, scene=scene, threads=1, max_episode_steps=EPISODE)
