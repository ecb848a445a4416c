"""Functions that formulas of case files apply to a recorded motion.

Functions of a body's name return a curve: one value per state. The name may have ``*``. Then ``moved``, ``speed``,
``turn``, ``depth`` and ``overlap`` return the largest value over the bodies, and the others refuse it. Reductions turn
a curve into a number.
"""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from .._tumble import TumbleError
from .._types import Floats
from ._scene import Body, Scene
from ._solids import matrix_of


class Measures:
    """Curves of a motion: ``states`` (T + 1, N, 13) of the free bodies of ``scene``."""

    def __init__(self, scene: Scene, states: Floats) -> None:
        self.scene, self.states = scene, states
        self.times = scene.time_step * np.arange(len(states))
        self.turns = matrix_of(states[:, :, 3:7])
        self.spins = np.einsum("tnij,tnj->tni", self.turns, states[:, :, 10:13])

    def names(self) -> dict[str, Any]:
        """Names for ``evaluate``."""
        functions: dict[str, Callable[..., Any]] = {
            "energy": self.energy,
            "momentum": self.momentum,
            "angular_momentum": self.angular_momentum,
            "moved": self.moved,
            "speed": self.speed,
            "turn": self.turn,
            "depth": self.depth,
            "overlap": self.overlap,
            "at": self.at,
            "rate": self.rate,
            "mean": self.mean,
            "peak": self.peak,
            "first": lambda curve: float(curve[0]),
            "last": lambda curve: float(curve[-1]),
            "change": lambda curve: float(curve[-1] - curve[0]),
            "largest": lambda curve: float(np.max(curve)),
            "smallest": lambda curve: float(np.min(curve)),
            "rise": lambda curve: float(np.max(curve - np.minimum.accumulate(curve))),
            "spread": lambda curve: float(np.max(np.abs(curve - curve[0]))),
            "hypot": np.hypot,
        }
        for place, axis in enumerate("xyz"):
            functions[axis] = self._component(self.states[:, :, place])
            functions[f"v{axis}"] = self._component(self.states[:, :, 7 + place])
            functions[f"w{axis}"] = self._component(self.spins[:, :, place])
        return {**functions, "t": self.times}

    def _component(self, values: Floats) -> Callable[[str], Floats]:
        def curve(name: str) -> Floats:
            found: Floats = values[:, self._one(name)]
            return found

        return curve

    def _some(self, pattern: str) -> list[int]:
        found = [place for place, body in enumerate(self.scene.free) if fnmatchcase(body.name, str(pattern))]
        if not found:
            names = ", ".join(body.name for body in self.scene.free)
            raise TumbleError(f"there is no body {pattern!r} that moves; there are {names}")
        return found

    def _one(self, pattern: str) -> int:
        found = self._some(pattern)
        if len(found) > 1:
            raise TumbleError(f"{pattern!r} names {len(found)} bodies; one is needed")
        return found[0]

    def moved(self, pattern: str) -> Floats:
        """Distance from the initial position, m."""
        places = self.states[:, self._some(pattern), :3]
        distances: Floats = np.linalg.norm(places - places[0], axis=2).max(axis=1)
        return distances

    def speed(self, pattern: str) -> Floats:
        """Speed of the centre of mass, m/s."""
        speeds: Floats = np.linalg.norm(self.states[:, self._some(pattern), 7:10], axis=2).max(axis=1)
        return speeds

    def turn(self, pattern: str) -> Floats:
        """Angle of the rotation from the initial attitude, rad."""
        turns = self.turns[:, self._some(pattern)]
        # |R − 1|² = 8 sin²(½ angle) is accurate for small angles.
        chords = np.linalg.norm(turns - turns[0], axis=(2, 3)) / np.sqrt(8.0)
        angles: Floats = 2.0 * np.arcsin(np.minimum(chords, 1.0)).max(axis=1)
        return angles

    def energy(self) -> Floats:
        """Kinetic and potential energy of all bodies, J."""
        total = np.zeros(len(self.states))
        for place, body in enumerate(self.scene.free):
            state = self.states[:, place]
            total += 0.5 * body.mass * (state[:, 7:10] ** 2).sum(axis=1)
            total += 0.5 * (body.inertia * state[:, 10:13] ** 2).sum(axis=1)
            total -= body.mass * state[:, :3] @ self.scene.gravity
        return total

    def momentum(self, axis: str) -> Floats:
        """Component of the momentum of all bodies, N s."""
        masses = np.array([body.mass for body in self.scene.free])
        total: Floats = self.states[:, :, 7 + "xyz".index(axis)] @ masses
        return total

    def angular_momentum(self, axis: str) -> Floats:
        """Component of the angular momentum of all bodies about the origin, N m s."""
        total = np.zeros((len(self.states), 3))
        for place, body in enumerate(self.scene.free):
            state = self.states[:, place]
            own = np.einsum("tij,tj->ti", self.turns[:, place], body.inertia * state[:, 10:13])
            total += body.mass * np.cross(state[:, :3], state[:, 7:10]) + own
        component: Floats = total[:, "xyz".index(axis)]
        return component

    def depth(self, pattern: str) -> Floats:
        """Largest depth of the bodies below the ground, m, zero if none is below."""
        deepest = np.zeros(len(self.states))
        for place in self._some(pattern):
            body = self.scene.free[place]
            heights = self.states[:, place, 2:3] + self.turns[:, place, 2, :] @ body.points.T
            deepest = np.maximum(deepest, body.radius - heights.min(axis=1))
        return deepest

    def overlap(self, first: str, second: str) -> Floats:
        """Largest overlap of pairs of balls, m, zero if none overlap."""
        deepest = np.zeros(len(self.states))
        for a in self._some(first):
            for b in self._some(second):
                if a == b:
                    continue
                radii = _ball(self.scene.free[a]) + _ball(self.scene.free[b])
                distances = np.linalg.norm(self.states[:, a, :3] - self.states[:, b, :3], axis=1)
                deepest = np.maximum(deepest, radii - distances)
        return deepest

    def at(self, curve: Floats, time: float) -> float:
        """Value of a curve at a time, linear between states."""
        return float(np.interp(time, self.times, curve))

    def rate(self, curve: Floats, start: float, end: float) -> float:
        """Mean rate of change between two times, per second."""
        return (self.at(curve, end) - self.at(curve, start)) / (end - start)

    def mean(self, curve: Floats, start: float, end: float) -> float:
        """Mean value between two times."""
        within = (self.times >= start) & (self.times <= end)
        return float(np.mean(curve[within]))

    def peak(self, curve: Floats, number: float) -> float:
        """Value of the given local maximum of a curve after its start, the first one being 1; NaN without it."""
        inner = curve[1:-1]
        tops = inner[(inner > curve[:-2]) & (inner >= curve[2:])]
        return float(tops[int(number) - 1]) if len(tops) >= number else float("nan")


def _ball(body: Body) -> float:
    if body.kind != "sphere":
        raise TumbleError(f"overlap needs balls; {body.name} is a {body.kind}")
    return body.radius
