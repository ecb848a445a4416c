"""Verdicts: what a measured value says about an engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ._case import Answer, Case, Gradient

RIGHT, YIELDS, WRONG = "right", "yields", "wrong"
"""Verdicts on a measured value: right, wrong, or wrong by no more than compliant contacts are allowed."""
VERDICTS = {
    RIGHT: "every answer is within its tolerance",
    YIELDS: "an answer is beyond its tolerance, but within the allowance of compliant contacts",
    WRONG: "an answer is beyond its tolerance",
    "not modelled": "the engine does not have a law or a shape of the case",
    "error": "the engine raised an error",
    "crash": "the process ended without a result",
    "time limit": "the process was stopped at the time limit",
    "not installed": "the engine is not installed",
    "not run": "the time of the engine was over, or a submitted result does not have the case",
}
"""Verdicts on a case and their meaning."""
UNMEASURED = ("not modelled", "error", "crash", "time limit")
"""Verdicts without values that an engine may have in a case."""


@dataclass(frozen=True)
class Finding:
    """Measured value of an answer or a gradient."""

    name: str
    unit: str
    expected: float
    tolerance: float
    allowance: float | None
    """Largest error of compliant contacts; None where they have no allowance."""
    measured: float | None
    """None for a value that is not finite."""
    method: str
    """``run``, or of a gradient ``own`` (the engine's derivative) or ``differences``."""
    verdict: str

    @property
    def error(self) -> float:
        """Error in tolerances; infinite without a value."""
        return float("inf") if self.measured is None else abs(self.measured - self.expected) / self.tolerance


@dataclass(frozen=True)
class Outcome:
    """One engine on one case."""

    engine: str
    case: str
    verdict: str
    reason: str = ""
    findings: list[Finding] = field(default_factory=list)
    seconds: float | None = None
    """Time of the steps, s."""
    steps: int | None = None
    process_seconds: float | None = None
    """Time of the process, with imports and compilation, s."""


def judged(engine: str, case: Case, result: Mapping[str, Any]) -> Outcome:
    """Outcome of a worker's result."""
    if result["status"] != "measured":
        return Outcome(engine, case.name, result["status"], result["reason"])
    methods = ["run"] * len(case.answers) + list(result["methods"])
    findings = [
        _finding(quantity, value, method, result["compliant"])
        for quantity, value, method in zip(case.quantities, result["values"], methods)
    ]
    verdicts = {finding.verdict for finding in findings}
    verdict = next(one for one in (WRONG, YIELDS, RIGHT) if one in verdicts)
    return Outcome(
        engine=engine,
        case=case.name,
        verdict=verdict,
        reason=result["note"],
        findings=findings,
        seconds=result["seconds"],
        steps=result["steps"],
        process_seconds=result["process_seconds"],
    )


def _finding(quantity: Answer | Gradient, value: float | None, method: str, compliant: bool) -> Finding:
    allowance = quantity.compliant if isinstance(quantity, Answer) else None
    error = float("inf") if value is None else abs(value - quantity.value)
    if error <= quantity.tolerance:
        verdict = RIGHT
    elif compliant and allowance is not None and error <= allowance:
        verdict = YIELDS
    else:
        verdict = WRONG
    return Finding(
        quantity.name, quantity.unit, quantity.value, quantity.tolerance, allowance, value, method, verdict
    )


def counted(outcomes: list[Outcome]) -> dict[str, int]:
    """Number of outcomes of each verdict."""
    return {name: sum(outcome.verdict == name for outcome in outcomes) for name in VERDICTS}
