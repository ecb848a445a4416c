"""Environments of robots, single and many at once."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._actions import Actions, Range
from ._arrays import numbers
from ._checks import real, whole
from ._robot import Robot
from ._rollout import threads_of
from ._scene import Scene, load
from ._simulation import Simulation
from ._starts import place
from ._tumble import TumbleError, step_all
from ._types import ByJoint, Floats, Integers, Location
from ._window import Window

Flags = npt.NDArray[np.bool_]
Info = dict[str, Any]

EPISODE = 1000
"""Steps of an environment until an episode is truncated."""
DRAWS = 10
"""Largest number of starts drawn for an episode."""


class RobotEnv(gymnasium.Env):  # type: ignore[misc,type-arg,unused-ignore]
    """Environment of a robot, from its URDF, SDF or MJCF file, a scenario file or a Scene.

    One action lasts ``frame_skip`` time steps of the file, each divided into ``substeps``.
    Subclasses define observation and reward: ``observe``, ``judge``. The initial coordinates
    are those of ``draw``, clipped to the joints' ranges.

    :param noise: half the range of the noise on the initial coordinates.
    :param actions: "controls" of the file's actuators, the default if it has any; "torque";
        "pd", targets of motors with ``stiffness`` and ``damping``; or "position", coordinates
        at the end of the action.
    :param joints: driven joints, by default those with actuators, or all slides and hinges.
    :param ranges: ranges of actions by the name of the actuator or joint. The defaults are
        the control ranges of the file. Without them, they follow from force limits for forces,
        and from joint limits for targets.
    :param max_force: force limits of the motors of "pd" and "position", by default those of the file.
        Like ``stiffness`` and ``damping``, one number or numbers by joint.
    :param robot: prefix of the robot in a scene with several.
    :param packages: see ``tumble.load``, like ``leave_out``, ``point_contacts``, ``friction`` (of the ground)
        and ``time_step`` (s).
    :param render_mode: "rgb_array" for images of 480 pixels, "human" for a window (needs pygame),
        or None.
    :raises TumbleError: for a robot without actuators or declared actions, an action without a
        range, and an invalid file.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 50}
    up: int | None = None
    """Index of the coordinate that lifts the robot. A start that overlaps something is lifted out of it.

    The default is the height of a floating base.
    """

    def __init__(
        self,
        file: Location | Scene,
        frame_skip: int = 1,
        noise: float = 0.0,
        substeps: int = 1,
        *,
        actions: str | None = None,
        joints: list[str] | None = None,
        ranges: Mapping[str, Range] | None = None,
        stiffness: ByJoint | None = None,
        damping: ByJoint | None = None,
        max_force: ByJoint | None = None,
        robot: str | None = None,
        packages: Location | None = None,
        leave_out: list[str] | None = None,
        point_contacts: bool | None = None,
        friction: float | None = None,
        time_step: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, "rgb_array", "human"):
            raise TumbleError(f'render_mode is {render_mode!r}; "rgb_array", "human" or None is needed')
        reading: dict[str, Any] = {"packages": packages, "leave_out": leave_out, "point_contacts": point_contacts}
        reading.update(friction=friction, time_step=time_step)
        self.scene: Scene = _scene(file, whole("substeps", substeps, 1), reading)
        self.frame_skip = whole("frame_skip", frame_skip, 1) * substeps
        self.noise = real("noise", noise)
        if not 0.0 <= self.noise < np.inf:
            raise TumbleError(f"noise is {noise}; a finite number from 0 is needed")
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / self.dt))}
        self._window = Window("tumble", self.metadata["render_fps"]) if render_mode == "human" else None
        if type(self).judge is RobotEnv.judge:
            warnings.warn("every reward is 0: define judge in a subclass of RobotEnv", stacklevel=2)
        self._prefix = robot
        self.simulation: Simulation = self.scene.simulate()
        floats = bool(self.robot._core.joint_list) and self.robot._core.joint_list[0][1] == "free"
        if self.up is None and floats:
            self.up = 2
        self.actions = Actions(
            self.robot, actions, joints=joints, ranges=ranges, stiffness=stiffness, damping=damping, max_force=max_force
        )
        self.actions.begin(self.robot)
        low, high = (of.astype(np.float32) for of in (self.actions.low, self.actions.high))
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        shape = np.shape(self.observe())
        if not shape:
            raise TumbleError(f"observe returned {self.observe()!r}; an array is needed")
        self.observation_space = spaces.Box(-np.inf, np.inf, shape, np.float64)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.simulation.robot if self._prefix is None else self.simulation.robots[self._prefix]

    @property
    def dt(self) -> float:
        """Duration of a step of the environment, s."""
        return self.frame_skip * self.scene.time_step

    def observe(self) -> Floats:
        """Observation: all coordinates and rates."""
        return np.concatenate([self.robot.q, self.robot.v])

    def draw(self, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Random coordinates and rates at the start."""
        q, v = self.robot.start, np.zeros(self.robot.counts[1])
        return q + rng.uniform(-self.noise, self.noise, len(q)), v

    def judge(self, before: Floats, action: Floats) -> tuple[float, bool, Info]:
        """Reward of a step, True at the end of the episode, and info.

        ``before`` are the coordinates at the start of the step.
        """
        return 0.0, False, {}

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Floats, Info]:
        """Draws a new start, from the seed if there is one. ``options`` are ignored.

        The info has ``unsolved``, 0, as that of a step.
        """
        super().reset(seed=seed)
        for left in reversed(range(DRAWS)):
            self.simulation = self.scene.simulate()
            q, v = self._drawn()
            try:
                place(self.robot, q, v, self.up)
                break
            except TumbleError as error:
                if not left:
                    why = f"{DRAWS} drawn starts were refused, the last one for: {error}; change draw or noise"
                    raise TumbleError(why) from None
        self.actions.begin(self.robot)
        self._show()
        return self._observed(), {"unsolved": 0}

    def _drawn(self) -> tuple[Floats, Floats]:
        """Drawn coordinates, clipped to the joints' ranges, and rates."""
        q, v = _parts("draw", self.draw(self.np_random), "coordinates", "rates")
        coordinates, rates = self.robot.counts
        q, v = numbers("q of draw", q, (coordinates,)).copy(), numbers("v of draw", v, (rates,))
        for index, (_, kind, at, _, _) in enumerate(self.robot._core.joint_list):
            limits = self.robot._core.bounds(index)[0]
            if kind in ("slide", "hinge") and limits is not None:
                q[at] = min(max(q[at], limits[0]), limits[1])
        return q, v

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, Info]:
        """Takes the steps of one action.

        Returns observation, reward, True at the end of the episode, False (``gymnasium.make``
        truncates), and info.
        """
        action = self.actions.checked(action)
        before = self._begin(action)
        (unsolved,) = step_all([self.simulation._core], self.frame_skip, 1)
        observed, reward, over, info = self._end(before, action, unsolved)
        self._show()
        return observed, reward, over, False, info

    def render(self) -> Any:
        """Image of the current state, (480, 480, 3), or None without the render mode "rgb_array"."""
        return self.simulation.picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _show(self) -> None:
        if self._window is not None:
            self._window.show(self.simulation.picture())

    def _begin(self, action: Floats) -> Floats:
        """Applies an action. Returns the coordinates."""
        before = self.robot.q
        self.actions.apply(self.robot, action, self.dt)
        return before

    def _end(self, before: Floats, action: Floats, unsolved: int) -> tuple[Floats, float, bool, Info]:
        """Observation, reward, True at the end of the episode, and info after the steps."""
        reward, over, info = _parts("judge", self.judge(before, action), "reward", "end of the episode", "info")
        try:
            finite = isfinite(reward)
        except TypeError:
            finite = False
        if not finite or not isinstance(info, dict):
            raise TumbleError(f"judge returned {reward!r} and {info!r}; a finite reward and a dictionary are needed")
        info["unsolved"] = unsolved
        return self._observed(), reward, over, info

    def _observed(self) -> Floats:
        """Observation, with the shape of its space."""
        observed, shape = self.observe(), self.observation_space.shape
        if np.shape(observed) != shape:
            raise TumbleError(
                f"observe returned an array of shape {np.shape(observed)}; {shape} is needed, as at first"
            )
        return observed


class RobotVectorEnv(VectorEnv):  # type: ignore[misc,type-arg,unused-ignore]
    """Many environments of robots, with the steps of all of them on ``threads`` threads.

    ``make`` creates one of them, for example a subclass of RobotEnv, from the keywords. The
    results are those of the single environments, to the last bit. Observations, rewards and
    actions are computed one after the other.

    Autoreset is gymnasium's ``NEXT_STEP``: the step after an episode's end ignores the
    action, draws a new start, and has reward 0. Episodes are truncated after
    ``max_episode_steps``. Environment i draws its starts from seed + i.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": ["rgb_array"]}

    def __init__(
        self,
        make: Callable[..., RobotEnv],
        num_envs: int = 16,
        *,
        threads: int | None = None,
        max_episode_steps: int = EPISODE,
        **keywords: Any,
    ) -> None:
        self.num_envs = whole("num_envs", num_envs, 1)
        self.max_episode_steps = whole("max_episode_steps", max_episode_steps, 1)
        self.threads = threads_of(threads)
        if not callable(make):
            raise TumbleError(f"make is {make!r}; a function that creates a RobotEnv is needed")
        self.envs = [make(**keywords) for _ in range(num_envs)]
        _check_alike(self.envs)
        first = self.envs[0]
        if first.render_mode == "human":
            raise TumbleError(
                'render_mode is "human", which would open one window for each robot; "rgb_array" or None is needed'
            )
        self.metadata = {**self.metadata, "render_fps": first.metadata["render_fps"]}
        self.render_mode = first.render_mode
        self.single_observation_space = first.observation_space
        self.single_action_space = first.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._taken = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    def reset(self, *, seed: Any = None, options: Info | None = None) -> tuple[Floats, Info]:
        """Draws new starts, from one seed for all or one for each. ``options`` are ignored."""
        if seed is None or isinstance(seed, (int, np.integer)):
            seeds = [None if seed is None else int(seed) + index for index in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise TumbleError(f"seed has {len(seeds)} seeds; {self.num_envs} are needed")
        infos: Info = {}
        observed = []
        for index, (env, own) in enumerate(zip(self.envs, seeds)):
            observation, info = env.reset(seed=own)
            observed.append(observation)
            infos = self._add_info(infos, info, index)
        self._taken[:], self._ended[:] = 0, False
        return np.stack(observed), infos

    def step(self, actions: Any) -> tuple[Floats, Floats, Flags, Flags, Info]:
        """Takes the steps of one action in each environment.

        Returns observations (B, ...), rewards, terminated and truncated flags, and info.
        """
        actions = numbers("actions", actions, (self.num_envs, len(self.envs[0].actions.names)))
        fresh, kept = self._ended.copy(), np.flatnonzero(~self._ended)
        begun = [self.envs[index]._begin(actions[index]) for index in kept]
        unsolved = step_all(
            [self.envs[index].simulation._core for index in kept], self.envs[0].frame_skip, self.threads
        )
        observed: list[Any] = [None] * self.num_envs
        rewards = np.zeros(self.num_envs)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        infos: Info = {}
        parts = dict(zip(kept.tolist(), zip(begun, unsolved)))
        for index, env in enumerate(self.envs):
            if fresh[index]:
                observed[index], info = env.reset()
            else:
                before, failed = parts[index]
                observed[index], rewards[index], terminated[index], info = env._end(before, actions[index], failed)
            infos = self._add_info(infos, info, index)
        self._taken = np.where(fresh, 0, self._taken + 1)
        truncated = self._taken >= self.max_episode_steps
        self._ended = terminated | truncated
        return np.stack(observed), rewards, terminated, truncated, infos

    @property
    def episode_steps(self) -> Integers:
        """Actions taken in the episode of each environment: (B,)."""
        return self._taken.copy()

    def restart(self, index: int) -> Floats:
        """Begins a new episode of one environment, at once instead of in the next step. Returns its observation."""
        self._taken[index], self._ended[index] = 0, False
        return self.envs[index].reset()[0]

    def render(self) -> Any:
        """Images of the environments, or None without a render mode."""
        return None if self.render_mode is None else tuple(env.render() for env in self.envs)


def _parts(method: str, returned: Any, *parts: str) -> Any:
    """The ``parts`` that a method of a subclass returned."""
    if not isinstance(returned, (tuple, list)) or len(returned) != len(parts):
        raise TumbleError(f"{method} returned {returned!r}; {len(parts)} values are needed: {', '.join(parts)}")
    return returned


def _check_alike(envs: list[RobotEnv]) -> None:
    """Refuses environments whose actions, observations or steps differ from those of the first one."""
    for index, env in enumerate(envs):
        if not isinstance(env, RobotEnv):
            raise TumbleError(f"make returned {env!r}; a RobotEnv is needed, without wrappers")
        for name, own in _shared(env).items():
            first = _shared(envs[0])[name]
            if own != first:
                raise TumbleError(
                    f"{name} of environment {index} is {own}, and {first} of environment 0; make them equal"
                )


def _shared(env: RobotEnv) -> Info:
    """Properties that environments must share to be simulated together."""
    names = ("frame_skip", "dt", "render_mode", "observation_space", "action_space")
    return {**{name: getattr(env, name) for name in names}, "list of actions": env.actions.names}


def _loaded(file: Location, reading: Mapping[str, Any]) -> Scene:
    """Scene of a file, with warnings unless it is a known model, of Gymnasium."""
    if not (isinstance(file, (str, Path)) and Path(file).is_relative_to(Path(gymnasium.__file__).parent)):
        return load(file, **reading)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load(file, **reading)


def _scene(file: Any, substeps: int, reading: Mapping[str, Any]) -> Scene:
    """Scene of ``file`` with its time step divided by ``substeps``."""
    if isinstance(file, Scene):
        given = [name for name, value in reading.items() if value is not None]
        if given:
            raise TumbleError(f"{', '.join(given)}: the scene is read already; give them to tumble.load")
        scene = file
    else:
        scene = _loaded(file, reading)
    if substeps == 1:
        return scene
    text, path, settings = scene._source
    return Scene.from_text(text, path, **{**settings, "time_step": scene.time_step / substeps})
