"""Contact problem of a MuJoCo step: rows that may close, offsets and warm starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._mujoco_rows import ContactRows, JointRows, mujoco
from ._problem import ContactProblem, ContactSolution, Law
from ._types import Floats

RECOVERY = 0.2
"""Speed at which overlaps and position errors of the start are removed, m/s or rad/s."""
RECOVERY_TIME = 0.05
"""Large overlaps are removed faster, within about this time, s."""
_NEAR = 0.05
"""Contacts take part from the start if their gap speed without impulses is smaller than this, m/s."""

_FRICTIONLESS: Law = ["limit", "free", "free"]
"""Law of a contact without friction, whose tangents are kept."""


@dataclass
class StepSolution:
    """Impulses and velocities of a step."""

    impulses: Floats
    """Impulses of the contacts (C, 3), N s."""
    moments: Floats
    """Impulses of the moments of contacts (T, 3), N m s."""
    tail: Floats
    """Impulses of the joint rows, N s."""
    after: Floats
    """Velocities at the end of the step."""
    residual: float
    iterations: int


@dataclass
class StepProblem:
    """Contact problem of a step. Contacts that stay open take no part."""

    mass: Floats
    free: Floats
    contacts: ContactRows
    joints: JointRows
    laws: list[Law]
    start: tuple[Floats, Floats, Floats] | None
    residual: float

    def solve(self, offsets: Floats, fixed: Floats, thorough: bool) -> StepSolution:
        """Solution for offsets of the contacts (C, 3) and of the joint rows. ``thorough`` tries all forms."""
        normals = self.contacts.J[:, 0]
        near = offsets[:, 0] + np.minimum(normals @ self.free, 0.0) < _NEAR
        nothing = np.zeros((len(near), 3)), np.zeros((len(self.contacts.resisting), 3)), np.zeros(len(fixed))
        found = StepSolution(*nothing, self.free, 0.0, 0)
        while near.any() or len(fixed):
            self._solve_near(near, offsets, fixed, found, thorough)
            missed = ~near & (normals @ found.after + offsets[:, 0] < -0.1 * self.residual)
            if not missed.any():
                break
            near |= missed
        return found

    def _solve_near(self, near: Any, offsets: Floats, fixed: Floats, found: StepSolution, thorough: bool) -> None:
        contacts = self.contacts.kept(near)
        rows = np.concatenate([contacts.directions(), self.joints.J])
        w = np.concatenate([offsets[near].ravel(), np.zeros(3 * len(contacts.resisting)), fixed])
        resisting = set(contacts.resisting.tolist())
        laws = [
            _FRICTIONLESS if law == 0.0 and place not in resisting else law
            for place, law in enumerate(contacts.laws())
        ]
        resist = near[self.contacts.resisting]
        guess = None
        if self.start is not None:
            pushes, moments, tail = self.start
            guess = np.concatenate([pushes[near].ravel(), moments[resist].ravel(), tail])
        solution, found.after = self._best(rows, w, laws + self.laws, guess, thorough)
        found.iterations += solution.iterations
        found.residual = solution.residual
        ends = 3 * np.cumsum([len(contacts.gap), len(contacts.resisting)])
        pushes, moments, found.tail = np.split(solution.impulses, ends)
        found.impulses[near] = pushes.reshape(-1, 3)
        found.moments[:] = 0.0
        found.moments[resist] = moments.reshape(-1, 3)

    def _best(
        self, rows: Floats, w: Floats, laws: list[Law], guess: Floats | None, thorough: bool
    ) -> tuple[ContactSolution, Floats]:
        """Solution and velocities. The best one of all forms and starts, if the first is not solved."""
        pull = np.linalg.solve(self.mass, rows.T)
        W = rows @ pull
        problem = ContactProblem(W=0.5 * (W + W.T), q=rows @ self.free + w, laws=laws)
        solution = problem.solve(residual=self.residual, start=guess)
        if thorough and not solution.solved:
            others = [ContactProblem(M=self.mass, H=rows.T, f=self.mass @ self.free, w=w, laws=laws)]
            others += [problem] if guess is not None else []
            found = [solution, *(each.solve(residual=self.residual) for each in others)]
            solution = min(found, key=lambda each: each.residual)
            if not solution.solved:
                again = problem.solve(residual=self.residual, start=solution.impulses)
                solution = min(solution, again, key=lambda each: each.residual)
        return solution, self.free + pull @ solution.impulses


def exact_offsets(contacts: ContactRows, joints: JointRows, time_step: float) -> tuple[Floats, Floats]:
    """Offsets of contacts (C, 3) and joint rows: gap / h, and surface velocities."""
    offsets = np.zeros((len(contacts.gap), 3))
    offsets[:, 0] = contacts.gap / time_step
    offsets[:, 1:] = contacts.surface
    return offsets, joints.gap / time_step


def recovered(gaps: Floats, fixed: Floats, joints: JointRows, bound: float, time_step: float) -> tuple[Floats, Floats]:
    """Normal offsets and offsets of joint rows with which overlaps are removed at about the speed ``bound``."""
    share = min(1.0, time_step / RECOVERY_TIME) if bound > 0.0 else 0.0
    normals: Floats = np.maximum(gaps, np.minimum(-bound, share * gaps))
    least = np.maximum(fixed, np.minimum(-bound, share * fixed))
    locked = joints.kind == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    rows: Floats = np.where(locked, np.minimum(least, np.maximum(bound, share * fixed)), least)
    return normals, rows


def contact_keys(contacts: ContactRows) -> list[tuple[int, int, int]]:
    """Geoms of each contact and its number among those of the same geoms."""
    seen: dict[tuple[int, int], int] = {}
    keys = []
    for first, second in contacts.geoms.tolist():
        number = seen.get((first, second), 0)
        seen[first, second] = number + 1
        keys.append((first, second, number))
    return keys


def joint_keys(joints: JointRows) -> list[tuple[int, int, int]]:
    """Kind and id of each row and its number among those of the same id."""
    seen: dict[tuple[int, int], int] = {}
    keys = []
    for pair in zip(joints.kind.tolist(), joints.id.tolist()):
        number = seen.get(pair, 0)
        seen[pair] = number + 1
        keys.append((*pair, number))
    return keys


def by_key(
    contacts: ContactRows, joints: JointRows, found: StepSolution
) -> tuple[dict[Any, Floats], dict[Any, Floats], dict[Any, Floats]]:
    """Impulses of contacts, moments and joints by the keys of their rows."""
    keys = contact_keys(contacts)
    moments = dict(zip([keys[place] for place in contacts.resisting], found.moments))
    return dict(zip(keys, found.impulses)), moments, dict(zip(joint_keys(joints), found.tail))
