"""Derivatives by parameters of a case: an engine's own ones, or central differences of its runs."""

from __future__ import annotations

import numpy as np

from .._types import Floats
from ._case import COMPONENTS, Case, Gradient
from .engines import Engine, Sensitivities

_STATE = {name: place if place < 3 else place + 4 for place, name in enumerate(COMPONENTS)}
"""Place of a component in a state of 13 numbers."""


def derivative(engine: Engine, case: Case, gradient: Gradient) -> tuple[float, str, Floats | None]:
    """Derivative, the method (``own`` or ``differences``), and the end states of the differences, (2, N, 13)."""
    component = _STATE[gradient.component]
    found = engine.sensitivities(case.scene(), gradient.body, component)
    own = None if found is None else _chained(case, gradient, found)
    if own is not None:
        return own, "own", None
    at = case.parameters[gradient.by]
    motions = [engine.run(case.scene(**{gradient.by: at + sign * gradient.step})) for sign in (1.0, -1.0)]
    ends = np.array([motion.states[-1] for motion in motions])
    return difference(ends, gradient), "differences", ends


def difference(ends: Floats, gradient: Gradient) -> float:
    """Central difference of end states (2, N, 13) above and below the parameter."""
    above, below = (float(end[gradient.body, _STATE[gradient.component]]) for end in ends)
    return (above - below) / (2.0 * gradient.step)


def _chained(case: Case, gradient: Gradient, found: Sensitivities) -> float | None:
    """Sum of the derivatives by all inputs that depend on the parameter; None if one of them is unknown.

    Inputs are at most linear in a parameter of a gradient, so their central differences are exact.
    """
    at = case.parameters[gradient.by]
    above, below = (case.scene(**{gradient.by: at + sign * gradient.step}) for sign in (1.0, -1.0))
    middle = case.scene()
    states = middle.states

    def forces(step: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return (above.wrenches(step, states) - below.wrenches(step, states))[:, :3]

    inputs = [
        (found.position, above.states[:, :3] - below.states[:, :3]),
        (found.velocity, above.states[:, 7:10] - below.states[:, 7:10]),
        (found.friction, np.array(above.friction - below.friction)),
        (found.gravity, above.gravity - below.gravity),
        (found.mass, np.array([a.mass - b.mass for a, b in zip(above.free, below.free)])),
        (found.force, np.array([forces(step) for step in range(middle.steps)])),
    ]
    total = 0.0
    for sensitivity, change in inputs:
        if not np.any(change):
            continue
        if sensitivity is None:
            return None
        total += float(np.sum(np.asarray(sensitivity) * change)) / (2.0 * gradient.step)
    return total
