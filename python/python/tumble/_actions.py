"""Actions of a robot's environment: controls of its file, torques, or targets of motors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ._arrays import numbers
from ._checks import name_list
from ._names import by_name, unknown
from ._robot import Robot
from ._tumble import TumbleError
from ._types import ByJoint, Floats

Range = tuple[float, float]
USED = {
    "controls": (),
    "torque": ("joints",),
    "pd": ("joints", "stiffness", "damping", "max_force"),
    "position": ("joints", "max_force"),
}
"""Options of each kind of actions, besides ranges."""


class Actions:
    """Names and ranges of an environment's actions, and their effect on a robot.

    - ``controls``: controls of the file's actuators;
    - ``torque``: force (N) or torque (N m) of each joint;
    - ``pd``: target coordinate (m or rad) of each joint's motor with stiffness and damping;
    - ``position``: coordinate of each joint at the end of the action. Motors approach it at
      constant speed, as far as their force limits allow.
    """

    def __init__(
        self,
        robot: Robot,
        kind: str | None = None,
        *,
        joints: Iterable[str] | None = None,
        ranges: Mapping[str, Range] | None = None,
        stiffness: ByJoint | None = None,
        damping: ByJoint | None = None,
        max_force: ByJoint | None = None,
    ) -> None:
        if kind is None:
            if not robot.actuators:
                raise TumbleError(
                    f'{robot.name}: the robot has no actuators; declare its actions: actions="torque", '
                    '"pd" (with stiffness and damping) or "position"'
                )
            kind = "controls"
        if kind not in tuple(USED):
            raise TumbleError(f"actions is {kind!r}; one of {', '.join(USED)} is needed")
        if kind == "controls" and not robot.actuators:
            raise TumbleError(f'{robot.name}: the robot has no actuators; use actions="torque", "pd" or "position"')
        if kind == "pd" and stiffness is None:
            raise TumbleError('actions="pd": stiffness is needed; give one number, or numbers by joint')
        gains = {"stiffness": stiffness, "damping": damping, "max_force": max_force}
        for option, value in {"joints": joints, **gains}.items():
            if value is not None and option not in USED[kind]:
                users = " or ".join(f'"{name}"' for name in USED if option in USED[name])
                raise TumbleError(f'actions="{kind}" does not use {option}; leave it out, or use actions={users}')
        self.kind = kind
        self.names = robot.actuators if kind == "controls" else _driven(robot, joints)
        self._joints = [] if kind == "controls" else self.names
        self._gains = {
            option: by_name(option, value, self.names, each=option != "max_force")
            for option, value in gains.items()
            if value is not None
        }
        if ranges is not None and not isinstance(ranges, Mapping):
            raise TumbleError(f"ranges is {ranges!r}; a dictionary is needed, with the names {', '.join(self.names)}")
        given = by_name("ranges", ranges or {}, self.names)
        limits = _control_range if kind == "controls" else _force_range if kind == "torque" else _target_range
        found = [
            _pair(name, given[name]) if name in given else limits(robot, index, name)
            for index, name in enumerate(self.names)
        ]
        self.low, self.high = np.array(found, np.float64).reshape(-1, 2).T

    def begin(self, robot: Robot) -> None:
        """Prepares the joints at the start of an episode."""
        for name in self._joints:
            joint = robot[name]
            joint.target = None
            joint.set_force(0.0)
            for option, values in self._gains.items():
                if name in values:
                    setattr(joint, option, values[name])
            if self.kind != "torque" and joint.max_force is None:
                raise TumbleError(f"max_force of {name}, the force limit of its motor, is needed; give max_force")

    def checked(self, action: Any) -> Floats:
        """``action`` as one finite number for each name."""
        found: Floats = numbers("action", action, (len(self.names),))
        return found

    def apply(self, robot: Robot, action: Floats, duration: float) -> None:
        """Sets the drives for an action that lasts ``duration`` s. It is clipped to its range."""
        if self.kind == "controls":
            # Actuators clip their controls as the file says.
            robot.controls = action
            return
        q = robot.q if self.kind == "position" else None
        for name, number in zip(self._joints, np.clip(action, self.low, self.high).tolist()):
            joint = robot[name]
            if self.kind == "torque":
                joint.set_force(number)
            elif self.kind == "pd":
                joint.target = number
            elif q is not None:
                joint.hold_speed((number - float(q[joint.place])) / duration)


def _pair(name: str, given: Any) -> Range:
    """A given range: two finite numbers, the lower one first."""
    low, high = numbers(f"range of {name}", given, (2,)).tolist()
    if not low < high:
        raise TumbleError(f"range of {name} is {low} to {high}; the lower end goes first")
    return low, high


def _driven(robot: Robot, joints: Iterable[str] | None) -> list[str]:
    """Names of the driven joints: ``joints``, those with actuators, or all slides and hinges."""
    every = [joint.name for joint in robot.slides_and_hinges]
    if joints is not None:
        wanted = name_list("joints", joints)
        if not wanted:
            raise TumbleError(f"joints is empty; name a slide or hinge, or leave it out (known: {', '.join(every)})")
        for place, name in enumerate(wanted):
            if name not in every:
                raise unknown("slide or hinge", name, every)
            if name in wanted[:place]:
                raise TumbleError(f"joints has {name!r} twice; name each joint once")
        return wanted
    names = robot.joints
    actuated = {names[joint] for parts in robot._core.actuator_list for joint, _ in parts[0]}
    followers = {names[joint] for joint in robot._core.followers}
    found = [name for name in every if name not in followers and (not actuated or name in actuated)]
    if not found:
        raise TumbleError(f"{robot.name}: the robot has no slides or hinges to drive; use a robot with joints")
    return found


def _joint(robot: Robot, name: str) -> tuple[list[float] | None, list[float] | None]:
    return robot._core.bounds(robot.joints.index(name))


def _force_range(robot: Robot, index: int, name: str) -> Range:
    effort = _joint(robot, name)[1]
    if effort is None:
        raise _no_range(robot, name, "force limit")
    return effort[0], effort[1]


def _target_range(robot: Robot, index: int, name: str) -> Range:
    limits = _joint(robot, name)[0]
    if limits is None:
        raise _no_range(robot, name, "limits")
    return limits[0], limits[1]


def _control_range(robot: Robot, index: int, name: str) -> Range:
    """Control range of an actuator, or the one that follows from its limits.

    A position actuator reaches the limits of its joint. Another one has its force range, or the
    force limits of its joint.
    """
    own = robot.control_ranges[index]
    if own is not None:
        return own[0], own[1]
    joints, gear, gain, bias, force = robot._core.actuator_list[index]
    limits, effort = robot._core.bounds(joints[0][0]) if len(joints) == 1 else (None, None)
    factor = gear * (joints[0][1] if len(joints) == 1 else 1.0)
    ends: list[float] | None = None
    if bias[1] != 0.0:
        # Control at which the force is zero at a limit: gain u + b₀ + b₁ gear x = 0.
        ends = None if limits is None else [-(bias[0] + bias[1] * factor * x) / gain for x in limits]
    elif bias[2] == 0.0 and force is not None:
        ends = [(f - bias[0]) / gain for f in force]
    elif bias[2] == 0.0 and effort is not None:
        ends = [(f / factor - bias[0]) / gain for f in effort]
    if ends is None:
        raise _no_range(robot, name, "control range, and none follows from its limits")
    return min(ends), max(ends)


def _no_range(robot: Robot, name: str, what: str) -> TumbleError:
    return TumbleError(f"{robot.name}: {name} has no {what}; give ranges={{{name!r}: (low, high)}}")
