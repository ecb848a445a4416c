"""Placing a robot at the start of an episode, without overlaps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._robot import Robot
from ._tumble import TumbleError

if TYPE_CHECKING:
    from ._types import Floats

FIRST_LIFT = 1e-3
"""First trial of a lift, m. Later ones are twice as high."""
HIGHEST_LIFT = 0.512
"""Largest lift, m: 2⁹ times the first trial, about the height of a quadruped."""
ACCURACY = 1e-4
"""Largest distance of a lift from the least one, m. A fall from there has 4 cm/s."""
ROUNDING = 1e-9
"""Rounding error of positions, m."""


def place(robot: Robot, q: Floats, v: Floats, up: int | None) -> None:
    """Sets coordinates and rates, lifted out of the ground, other bodies, fixed pieces and terrain.

    ``up`` is the index of the coordinate that lifts the robot, or None.

    :raises TumbleError: for an overlap that a lift does not remove.
    """
    lowest = robot.lowest(q, v)
    if up is not None and lowest < 0.0:
        q[up] -= lowest
    refusal = _refusal(robot, q, v)
    if refusal is not None and up is None:
        raise refusal
    if up is None or (refusal is None and not _is_parted(robot, q, v)):
        return

    def fits(lift: float) -> bool:
        lifted = _lifted(q, up, bottom + lift)
        return _refusal(robot, lifted, v) is None and not _is_parted(robot, lifted, v)

    bottom, low, high = q[up], 0.0, FIRST_LIFT
    while not fits(high):
        low, high = high, 2.0 * high
        if high > HIGHEST_LIFT:
            if refusal is not None:
                raise refusal
            robot.set(q, v)
            return
    while high - low > ACCURACY:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    robot.set(_lifted(q, up, bottom + high), v)


def _is_parted(robot: Robot, q: Floats, v: Floats) -> bool:
    """True if the simulation moved bodies out of a small overlap when these coordinates and rates were set."""
    places = robot._placed(q, v)[:, :3]
    return float(np.abs(robot.simulation.states[:, :3] - places).max()) > ROUNDING


def _lifted(q: Floats, up: int, height: float) -> Any:
    lifted = q.copy()
    lifted[up] = height
    return lifted


def _refusal(robot: Robot, q: Floats, v: Floats) -> TumbleError | None:
    """Sets coordinates and rates. Returns the error of a simulation that refuses them."""
    try:
        robot.set(q, v)
    except TumbleError as error:
        return error
    return None
