"""A step of an engine as arrays: its certificate, and the exact step from the same state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import numbers
from ._certificate import Certificate, rows_of
from ._checks import real, texts, whole
from ._problem import ContactProblem, Law, _groups, moments_of
from ._tumble import TumbleError
from ._types import Floats

EXACT_RESIDUAL = 1e-9
"""Residual to which exact steps are solved, m/s."""


@dataclass(frozen=True)
class ExactStep:
    """Step with hard contact and Coulomb's law from the state of a measured step."""

    velocity: Floats
    """Velocities at the end (n,)."""
    impulses: Floats
    """Impulse of every row (R,), N s."""
    speeds: Floats
    """Velocity of every row at the end (R,), m/s."""
    solved: bool
    residual: float


@dataclass(frozen=True)
class MeasuredStep:
    """Step of an engine in generalised coordinates. The fields are the arguments of ``tumble.referee.certify``."""

    mass: Floats
    directions: Floats
    before: Floats
    after: Floats
    force: Floats
    impulses: Floats
    laws: list[Law]
    time_step: float
    offsets: Floats
    lengths: Floats
    dimension: int
    labels: list[str]
    notes: tuple[str, ...]
    motion: Floats
    """Mean velocity of every row over the step (R,), m/s, without the gap of normal rows."""
    velocity_names: tuple[str, ...] = ()
    """Name of each velocity (n,), or none."""
    stretch: Floats | None = None
    """Factor of every row, where friction depends on the direction (R,): its velocity and impulse without the factor
    are u / s and s p."""
    drifted: bool = False
    """Whether offsets of locked rows are position errors of the start, which an exact step leaves."""
    bodies: Mapping[str, Any] | None = None
    """The step as rigid bodies and contacts, in the form of docs/reference/certificate-format.md; None without it."""

    def certificate(self) -> Certificate:
        """Residuals of the step."""
        p, J = self.impulses, self.directions
        found = np.linalg.solve(self.mass, np.column_stack([self.time_step * self.force + J.T @ p, J.T]))
        change = self.after - self.before
        missed = change - found[:, 0]
        return Certificate(
            dynamics=float(np.abs(missed * self.lengths).max(initial=0.0)),
            rows=rows_of(
                _groups(self.laws),
                self.dimension,
                p,
                J @ self.after + self.offsets,
                self.offsets,
                np.einsum("ij,ji->i", J, found[:, 1:]),
                self.time_step,
                self.labels,
                self.motion,
                np.ones(len(p)) if self.stretch is None else self.stretch,
            ),
            time_step=self.time_step,
            notes=self.notes,
            energy=float(p @ self.motion + self.after @ self.mass @ missed - 0.5 * change @ self.mass @ change),
            _step=self,
        )

    def exact(self) -> ExactStep:
        """Exact step from the same state. Overlaps of the start stay: they are the fault of earlier steps."""
        offsets, laws = self.offsets.copy(), list(self.laws)
        at, groups = 0, _groups(self.laws)
        resisting = set(moments_of(groups).values())
        for place, (friction, own) in enumerate(groups):
            size = len(own) if friction is None else self.dimension
            kinds = [law[0] for law in own] if friction is None else ["limit"]
            for row, kind in zip(range(at, at + size), kinds):
                if kind == "limit":
                    offsets[row] = max(offsets[row], 0.0)
                elif kind == "locked" and self.drifted:
                    offsets[row] = 0.0
            if friction == 0.0 and place not in resisting:
                laws[place] = ["limit", *["free"] * (self.dimension - 1)]
            at += size
        momentum = self.mass @ self.before + self.time_step * self.force
        if not at:
            return ExactStep(self._velocity(momentum), np.zeros(0), np.zeros(0), True, 0.0)
        problem = ContactProblem(
            M=self.mass, H=self.directions.T, f=momentum, w=offsets, laws=laws, dimension=self.dimension
        )
        solution = problem.to_local().solve(residual=EXACT_RESIDUAL)
        if not solution.solved:
            other = problem.solve(residual=EXACT_RESIDUAL)
            solution = min(solution, other, key=lambda each: each.residual)
        velocity = self._velocity(momentum + self.directions.T @ solution.impulses)
        return ExactStep(velocity, solution.impulses, solution.velocities, solution.solved, solution.residual)

    def _velocity(self, momentum: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self.mass, momentum), dtype=np.float64)


def checked_step(
    *,
    M: Any,
    J: Any,
    velocity_before: Any,
    velocity_after: Any,
    force: Any,
    impulses: Any,
    laws: Sequence[Law],
    time_step: float,
    w: Any = None,
    lengths: Any = None,
    dimension: int = 3,
    names: Sequence[str] | None = None,
    notes: Sequence[str] = (),
    motion: Any = None,
) -> MeasuredStep:
    """Step from the arguments of ``tumble.referee.certify``.

    :param motion: mean velocity of every row over the step (R,), m/s. By default that of the end of the step.
    :raises TumbleError: if an argument has a wrong shape or value.
    """
    time_step = positive("time_step", time_step)
    dimension = whole("dimension", dimension, 2, 3)
    groups = _groups(laws)
    count = sum(len(own) if friction is None else dimension for friction, own in groups)
    before = numbers("velocity_before", velocity_before, ("n",))
    size = len(before)
    after = numbers("velocity_after", velocity_after, (size,))
    loads = numbers("force", force, (size,))
    mass = numbers("M", M, (size, size))
    directions = numbers("J", J, (count, size))
    p = numbers("impulses", impulses, (count,))
    offsets = np.zeros(count) if w is None else numbers("w", w, (count,))
    scales = np.ones(size) if lengths is None else numbers("lengths", lengths, (size,))
    try:
        np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise TumbleError("M is not positive definite; a mass matrix of the step is needed") from None
    if motion is None:
        moved = directions @ after
        at = 0
        for friction, own in groups:
            tangents = slice(at + 1, at + dimension)
            if friction is not None:
                # The surfaces of a contact may move.
                moved[tangents] += offsets[tangents]
            at += len(own) if friction is None else dimension
    else:
        moved = numbers("motion", motion, (count,))
    # Copies: an engine goes on with its arrays, which a certificate may outlive.
    return MeasuredStep(
        mass=mass.copy(),
        directions=directions.copy(),
        before=before.copy(),
        after=after.copy(),
        force=loads.copy(),
        impulses=p.copy(),
        laws=list(laws),
        time_step=time_step,
        offsets=offsets.copy(),
        lengths=scales,
        dimension=dimension,
        labels=labels_of(names, len(groups)),
        notes=tuple(texts("notes", notes)),
        motion=moved,
    )


def positive(name: str, value: Any) -> float:
    """``value`` as a finite number above zero."""
    number = real(name, value)
    if not 0.0 < number < np.inf:
        raise TumbleError(f"{name} is {number:g}; a positive number is needed")
    return number


def labels_of(names: Sequence[str] | None, count: int) -> list[str]:
    """Names, or numbers without any."""
    if names is None:
        return [str(place) for place in range(count)]
    listed = texts("names", names)
    if len(listed) != count:
        raise TumbleError(f"names has {len(listed)} entries; {count} are needed")
    return listed
