"""Environments for Gymnasium: a cube is pushed over the ground to a target.

    >>> import gymnasium, tumble.gym
    >>> env = gymnasium.make("tumble/PushCube-v0")

``PushCube`` is one environment. ``PushCubeVector`` simulates many of them in one batch of
rollouts, with the same steps to the last bit. Every step is exact and certified. Steps that did
not converge are counted in ``info["unsolved"]``.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._arrays import numbers
from ._checks import real
from ._rollout import Rollouts, rollout
from ._scene import Scene
from ._tumble import TumbleError
from ._types import Floats

Observation = npt.NDArray[np.float32]
Flags = npt.NDArray[np.bool_]
Info = dict[str, Any]

SIDE = 0.1
"""Side of the cube, m. Its mass is 1 kg."""
LARGEST_FORCE = 20.0
"""Largest push along x or y, N: twice the weight, five times the friction."""
PUSH = 0.05
"""Duration of a push, which is a step of the environment, s."""
EPISODE = 200
"""Steps of the environment until an episode is truncated: 10 s."""
NEAR = 0.02
"""Largest distance from the target, m, for a cube at the target. It is also slower than SLOW."""
SLOW = 0.05
"""Largest speed of a cube at the target, m/s."""
FARTHEST = 2.0
"""Distance from the origin, m, beyond which the cube is lost."""
RANGE = 0.5
"""Half the range of starts and targets along x and y, m."""


def scene(friction: float = 0.4, time_step: float = 0.005) -> Scene:
    """Scene of the cube on the ground. A whole number of time steps (s) makes a push."""
    if not real("time_step", time_step) > 0.0 or abs(PUSH / time_step - round(PUSH / time_step)) > 1e-9:
        raise TumbleError(f"time_step is {time_step} s; a whole number of time steps in {PUSH} s is needed")
    return Scene(
        bodies=[{"name": "cube", "box": SIDE, "mass": 1.0, "position": [0.0, 0.0, SIDE / 2]}],
        ground={"friction": friction},
        time_step=time_step,
        name="push-cube",
    )


def _observation_space() -> spaces.Box:
    """Observation space, far larger than 20 N can move the cube before it is lost."""
    largest = np.array([10.0] * 3 + [1.0] * 4 + [100.0] * 3 + [1000.0] * 3 + [20.0] * 2, np.float32)
    # A unit quaternion in single precision may be slightly longer.
    largest[3:7] += np.float32(1e-6)
    return spaces.Box(-largest, largest, dtype=np.float32)


def _action_space() -> spaces.Box:
    return spaces.Box(-1.0, 1.0, (2,), np.float32)


def _observed(states: Floats, targets: Floats) -> Observation:
    """Observations (B, 15): state of the cube (13) and vector from it to the target (x, y)."""
    way = targets - states[:, 0:2]
    observed: Observation = np.concatenate([states, way], axis=1).astype(np.float32)
    return observed


def _drawn(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Random start, turned about the vertical, and random target at least 0.1 m away."""
    position, target = rng.uniform(-RANGE, RANGE, (2, 2))
    while np.hypot(*(target - position)) < 0.1:
        target = rng.uniform(-RANGE, RANGE, 2)
    half_turn = rng.uniform(-np.pi, np.pi) / 2
    state = np.zeros(13)
    state[0:3] = [*position, SIDE / 2]
    state[3], state[6] = np.cos(half_turn), np.sin(half_turn)
    return state, target


def _pushed(scene: Scene, states: Floats, actions: Floats, threads: int) -> Rollouts:
    """Simulates a push from ``states`` (B, 13) under ``actions`` (B, 2)."""
    if not states.any():
        raise TumbleError("the environment has no start for a step; call reset first")
    forces = LARGEST_FORCE * np.clip(actions, -1.0, 1.0)
    controls = np.zeros((len(states), round(PUSH / scene.time_step), 6))
    controls[:, :, 0:2] = forces[:, np.newaxis, :]
    return rollout(scene, states, controls, threads=threads)


def _judged(states: Floats, targets: Floats) -> tuple[Floats, Flags, Flags]:
    """Reward, True if the cube is at the target, and True if it is lost: each (B,).

    The reward is minus the distance in m, and 1 more at the target.
    """
    distances = np.hypot(*(targets - states[:, 0:2]).T)
    speeds = np.linalg.norm(states[:, 7:10], axis=1)
    there = (distances < NEAR) & (speeds < SLOW)
    lost = np.linalg.norm(states[:, 0:2], axis=1) > FARTHEST
    rewards: Floats = there.astype(np.float64) - distances
    return rewards, there, lost


class PushCube(gymnasium.Env):  # type: ignore[misc,type-arg,unused-ignore]
    """A cube of 0.1 m and 1 kg is pushed to a target on the ground.

    - Action (2,): horizontal force at its centre for 50 ms, world frame, from -1 to 1 times
      20 N.
    - Observation (15,): the cube's state (position m, quaternion w x y z, velocity m/s, spin
      rad/s in the body frame) and the vector to the target (x, y, m).
    - Reward: minus the distance to the target in m, and 1 more at the target.
    - End: the cube is slow at the target, or lost at 2 m from the origin.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(self, friction: float = 0.4, time_step: float = 0.005, render_mode: str | None = None) -> None:
        if render_mode not in (None, "rgb_array"):
            raise TumbleError(f'render_mode is {render_mode!r}; "rgb_array" or None is needed')
        self.render_mode = render_mode
        self.scene = scene(friction, time_step)
        self.observation_space = _observation_space()
        self.action_space = _action_space()
        self._state = np.zeros(13)
        self._target = np.zeros(2)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Draws a new start and target, from the seed if there is one.

        The info has ``target``, (2,), m. ``options`` are ignored.
        """
        super().reset(seed=seed)
        self._state, self._target = _drawn(self.np_random)
        return self._observation(), {"target": self._target.copy()}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, Info]:
        """Pushes for 50 ms.

        Returns observation, reward, True at the end of the episode, False (``gymnasium.make``
        truncates), and info. The info has ``unsolved``, the number of steps that failed or
        are wild, and ``is_success``.
        """
        action = numbers("action", action, (2,))
        pushed = _pushed(self.scene, self._state[np.newaxis], action[np.newaxis], 1)
        self._state = pushed.states[0, -1, 0].copy()
        reward, there, lost = _judged(self._state[np.newaxis], self._target[np.newaxis])
        info = {"unsolved": len(pushed.unsolved), "is_success": bool(there[0])}
        ended = bool(there[0] or lost[0])
        return self._observation(), float(reward[0]), ended, False, info

    def render(self) -> Any:
        """Image of the cube, (480, 480, 3), or None without the render mode "rgb_array"."""
        if self.render_mode is None:
            return None
        return self.scene.simulate(self._state[np.newaxis]).picture()

    def _observation(self) -> Observation:
        row: Observation = _observed(self._state[np.newaxis], self._target[np.newaxis])[0]
        return row


class PushCubeVector(VectorEnv):  # type: ignore[misc,type-arg,unused-ignore]
    """Many cubes, pushed together on ``threads`` threads: one batch of rollouts per step.

    Autoreset is gymnasium's ``NEXT_STEP``: the step after an episode's end ignores the
    action, draws a new start and target, and has reward 0. Episodes are truncated after
    ``max_episode_steps``. Environment i draws its starts from seed + i.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(
        self,
        num_envs: int = 16,
        friction: float = 0.4,
        threads: int = 1,
        max_episode_steps: int = EPISODE,
        time_step: float = 0.005,
    ) -> None:
        self.num_envs = num_envs
        self.scene = scene(friction, time_step)
        self.threads = threads
        self.max_episode_steps = max_episode_steps
        self.single_observation_space = _observation_space()
        self.single_action_space = _action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._states = np.zeros((num_envs, 13))
        self._targets = np.zeros((num_envs, 2))
        self._taken = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    def reset(self, *, seed: Any = None, options: Info | None = None) -> tuple[Observation, Info]:
        """Draws new starts and targets, from one seed for all or one for each.

        ``options`` are ignored.
        """
        if seed is not None:
            one = isinstance(seed, (int, np.integer))
            seeds = [int(seed) + i for i in range(self.num_envs)] if one else list(seed)
            self._generators = [np_random(each)[0] for each in seeds]
        for index in range(self.num_envs):
            self._draw(index)
        return _observed(self._states, self._targets), {}

    def step(self, actions: Any) -> tuple[Observation, Floats, Flags, Flags, Info]:
        """Pushes each cube for 50 ms.

        Returns observations (B, 15), rewards, terminated and truncated flags, and info. The
        info has ``unsolved`` and ``is_success`` of PushCube, each (B,).
        """
        actions = numbers("actions", actions, (self.num_envs, 2))
        fresh = self._ended.copy()
        unsolved = np.zeros(self.num_envs, dtype=np.int64)
        pushed = np.flatnonzero(~fresh)
        if len(pushed) > 0:
            result = _pushed(self.scene, self._states[pushed], actions[pushed], self.threads)
            self._states[pushed] = result.states[:, -1, 0]
            self._taken[pushed] += 1
            for step in result.unsolved:
                unsolved[pushed[step.rollout]] += 1
        for index in np.flatnonzero(fresh):
            self._draw(int(index))
        rewards, there, lost = _judged(self._states, self._targets)
        rewards[fresh] = 0.0
        terminated = (there | lost) & ~fresh
        truncated = (self._taken >= self.max_episode_steps) & ~terminated
        self._ended = terminated | truncated
        info = {"unsolved": unsolved, "is_success": there & ~fresh}
        return _observed(self._states, self._targets), rewards, terminated, truncated, info

    def _draw(self, index: int) -> None:
        self._states[index], self._targets[index] = _drawn(self._generators[index])
        self._taken[index] = 0
        self._ended[index] = False


gymnasium.register(
    id="tumble/PushCube-v0",
    entry_point="tumble.gym:PushCube",
    vector_entry_point="tumble.gym:PushCubeVector",
    max_episode_steps=EPISODE,
)
