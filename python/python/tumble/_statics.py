"""Answers of statics."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ._tumble import TumbleError


def vector(name: str, values: Iterable[float]) -> list[float]:
    """Three finite numbers."""
    numbers = [float(value) for value in values]
    if len(numbers) != 3 or not all(abs(number) < float("inf") for number in numbers):
        raise TumbleError(f"{name}: three finite numbers are needed")
    return numbers


class Statics:
    """Whether a scene can stand, by how much, and where it is weak: the answer of Scene.stands.

    ``report`` is the whole answer, the object that ``tumble stands --json`` prints (docs/statics.md).
    """

    __slots__ = ("report",)

    report: dict[str, Any]
    """The answer as a dictionary: certificates, forces, velocities, slopes."""

    def __init__(self, report: dict[str, Any]) -> None:
        self.report = report

    @property
    def verdict(self) -> str:
        """"equilibrium", "none" or "undecided"."""
        return str(self.report["verdict"])

    @property
    def stands(self) -> bool:
        """True if forces in the friction cones balance all bodies."""
        return bool(self.report["stands"])

    @property
    def factor(self) -> float | None:
        """Largest factor on the load; None without both certificates."""
        limit = self.report["limit"]
        return None if limit is None else limit["factor"]

    @property
    def least_friction(self) -> float | None:
        """Smallest factor on all coefficients of friction; None without both certificates."""
        least = self.report["least_friction"]
        return None if least is None else least["factor"]

    def __repr__(self) -> str:
        return f"Statics({self.report['name']!r}, {self.verdict}, factor={self.factor})"
