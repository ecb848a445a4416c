"""Derivatives of a step and of a run: docs/gradients.md."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _tumble
from ._arrays import numbers
from ._checks import whole
from ._names import unknown
from ._types import Floats, Integers

if TYPE_CHECKING:
    from ._scene import Scene


Smoothing = tuple[str, float] | None
"""Name and size of the smoothing."""


@dataclass(frozen=True)
class Derivatives:
    """Derivatives with their point of evaluation and diagnostics.

    A change of a state has twelve numbers: position (m, world), rotation vector (rad, body),
    velocity (m/s, world), spin (rad/s, body).
    """

    ends: Floats
    """States at the end, (N, 13)."""
    by: dict[str, Floats]
    """Derivatives by name: ``states``, ``wrenches`` (``controls`` of a run), and the requested constants."""
    margin: float
    """Distance to the nearest kink, m/s: a change of a contact's mode, or a new contact."""
    feature_margin: float
    """Distance to the nearest change of contact features, m/s. It matters for changes of poses and sizes."""
    at: tuple[int, int]
    """Steps of these margins in a run."""
    unsolved: int
    """Number of steps that failed or are wild. Derivatives through them are not meaningful."""
    unknown: int
    """Contacts of a step, or steps of a run, with unknown contact features under load.

    Such features do not follow known functions of the poses. They are treated as fixed in their bodies.
    """
    kept: int
    """Number of steps in which the distribution of hyperstatic forces follows the history."""
    limited: int
    """Number of steps that applied only part of their restitution, which is treated as constant."""
    untimed: int
    """Number of impacts whose time is left out: all of a run without ``impact_times``.

    With them, those in which several points of connected bodies meet in a step. These count as meeting at their mean time.
    """

    def __getitem__(self, name: str) -> Floats:
        if name not in self.by:
            raise unknown("derivative", name, self.by)
        return self.by[name]


@dataclass(frozen=True)
class RolloutDerivatives:
    """Derivatives of the losses of B rollouts, with diagnostics of each.

    The fields are those of Derivatives with one more leading dimension.
    """

    by: dict[str, Floats]
    """Derivatives by name: ``states`` (B, N, 12), ``controls`` (B, T, N, 6), and the constants, (B, ...).

    If the rollouts had them, also ``motors`` (B, T, M) and ``joint_forces`` (B, T, D).
    """
    margin: Floats
    """Distance to the nearest kink, m/s: (B,)."""
    feature_margin: Floats
    """Distance to the nearest change of contact features, m/s: (B,)."""
    at: Integers
    """Steps of both margins: (B, 2)."""
    unsolved: Integers
    """Numbers of steps, (B,), like the following fields."""
    unknown: Integers
    kept: Integers
    limited: Integers
    untimed: Integers

    def __getitem__(self, name: str) -> Floats:
        if name not in self.by:
            raise unknown("derivative", name, self.by)
        return self.by[name]


def jacobian(
    scene: Scene, states: Any, wrenches: Any, index: int | None, by: Iterable[str], smoothing: Smoothing
) -> Derivatives:
    """Derivative of one step: see Scene.jacobian."""
    names = constant_names(by)
    count = len(scene.bodies)
    pushes = None if wrenches is None else _of_bodies("wrenches", wrenches, (count, 6))
    found = _tumble.jacobian(scene._core, _states(scene, states), _index(index), pushes, names, smoothing)
    return _derivatives(found, ["states", "wrenches", *names])


def vjp(
    scene: Scene,
    run: tuple[Any, Any, Any],
    steps: int | None,
    index: int | None,
    by: Iterable[str],
    smoothing: Smoothing,
    impact_times: bool,
) -> Derivatives:
    """Derivatives of a scalar loss of a run: see Scene.vjp. ``run`` has cotangents, states and controls.

    ``steps`` is by default that of the controls, or 1.
    """
    cotangents, states, controls = run
    names = constant_names(by)
    count = len(scene.bodies)
    pushes = None
    if controls is not None:
        pushes = numbers("controls", controls, *_shapes(("T", count, 6)))
        if len(pushes) == 0 or (steps is not None and steps != len(pushes)):
            raise _tumble.TumbleError(f"controls have {len(pushes)} steps; {1 if steps is None else steps} are needed")
        pushes = pushes.reshape(len(pushes), count, 6)
    length = whole("steps", steps if steps is not None else 1 if pushes is None else len(pushes), 1, 9_999_999)
    duals = _of_bodies("cotangents", cotangents, (count, 12))
    start = _states(scene, states)
    found = _tumble.vjp(
        scene._core, start, _index(index), pushes, length, duals, names, smoothing, bool(impact_times)
    )
    return _derivatives(found, ["states", "controls", *names])


def _shapes(shape: Any) -> Any:
    """``shape``, and for one body also the shape without the body axis."""
    return (shape, (*shape[:-2], shape[-1])) if shape[-2] == 1 else (shape,)


def _of_bodies(name: str, value: Any, shape: tuple[int, int]) -> Floats:
    return numbers(name, value, *_shapes(shape)).reshape(shape)


def _states(scene: Scene, states: Any) -> Floats:
    count = len(scene.bodies)
    return scene.states if states is None else _of_bodies("states", states, (count, 13))


def _index(index: int | None) -> int | None:
    return None if index is None else whole("index", index, 0)


def smoothing_of(compliance: float | None, central_path: float | None) -> Smoothing:
    """Name and size of the smoothing."""
    given = [(name, by) for name, by in (("compliance", compliance), ("central_path", central_path)) if by is not None]
    if len(given) > 1:
        raise _tumble.TumbleError("compliance and central_path are both given; only one can be used")
    for name, by in given:
        return name, float(numbers(name, by, ()))
    return None


def constant_names(by: Iterable[str]) -> list[str]:
    """Names of constants as a list."""
    if isinstance(by, str):
        raise TypeError(f"by is the string {by!r}; a list of names is needed")
    return [str(name) for name in by]


def _derivatives(found: Any, names: Any) -> Derivatives:
    ends, arrays, (margin, feature_margin), counts, at = found
    return Derivatives(ends, dict(zip(names, arrays)), margin, feature_margin, tuple(at), *counts)
