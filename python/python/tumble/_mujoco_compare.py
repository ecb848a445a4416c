"""MuJoCo's steps beside hard steps, from the same state."""

from __future__ import annotations

import copy
import html
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ._certificate import Certificate
from ._checks import whole
from ._html import chart, document, legend
from ._mujoco_certify import certify_step
from ._mujoco_rows import mujoco
from ._mujoco_step import HardStepper
from ._types import Floats, Location

_STICKS = 0.99
"""Contacts whose friction is this share of the largest one or less should not slip."""


@dataclass(frozen=True)
class Comparison:
    """MuJoCo's steps and hard steps from the same state. Columns of arrays (K, 2) are MuJoCo and hard."""

    times: Floats
    """Time at the end of each step (K,), s."""
    distance: Floats
    """Largest distance between the two places of a body (K,), m."""
    energy: Floats
    """Energy at the start of each step (K, 2), J."""
    overlap: Floats
    """Deepest overlap at the start of each step (K, 2), m."""
    creep: Floats
    """Largest slip speed inside a friction cone (K, 2), m/s."""
    residual: Floats
    """Residual of the certificate of each step (K, 2), m/s."""
    unsolved: int
    """Hard steps that were not solved."""
    seconds: tuple[float, float]
    """Processor time of all steps, s."""
    worst: tuple[str, str]
    """Sentence about the step with the largest residual."""

    @property
    def cost_ratio(self) -> float:
        """Processor time of a hard step divided by that of MuJoCo's."""
        return self.seconds[1] / max(self.seconds[0], 1e-12)

    def _lines(self) -> list[tuple[str, str, str]]:
        steps = len(self.times)

        def largest(values: Floats) -> tuple[str, str]:
            return f"{values[:, 0].max():.2e}", f"{values[:, 1].max():.2e}"

        return [
            ("largest residual, m/s", *largest(self.residual)),
            ("deepest overlap, m", *largest(self.overlap)),
            ("fastest creep, m/s", *largest(self.creep)),
            ("energy at the end, J", f"{self.energy[-1, 0]:.6g}", f"{self.energy[-1, 1]:.6g}"),
            (
                "processor time, µs a step",
                f"{1e6 * self.seconds[0] / steps:.3g}",
                f"{1e6 * self.seconds[1] / steps:.3g}",
            ),
        ]

    def __str__(self) -> str:
        return self.table()

    def table(self) -> str:
        """Text table."""
        lines = [f"{'':<28}{'MuJoCo':>12}{'hard':>12}"]
        lines += [f"{name:<28}{soft:>12}{hard:>12}" for name, soft, hard in self._lines()]
        lines.append(f"places apart after {self.times[-1] - self.times[0]:.3g} s: {self.distance[-1]:.2e} m")
        lines.append(f"hard steps not solved: {self.unsolved} of {len(self.times)}")
        lines += [f"worst step of {name}: {text}" for name, text in zip(("MuJoCo", "hard"), self.worst)]
        return "\n".join(lines)

    def page(self, path: Location) -> None:
        """Writes a page with the table and curves, which needs no network."""
        charts = [
            chart("residual, m/s", self.times, self.residual, logarithmic=True),
            chart("overlap, m", self.times, self.overlap, logarithmic=True),
            chart("creep, m/s", self.times, self.creep, logarithmic=True),
            chart("energy, J", self.times, self.energy),
            chart("places apart, m", self.times, self.distance[:, None]),
        ]
        body = [legend("MuJoCo", "hard"), f"<pre tabindex='0'>{html.escape(self.table())}</pre>", *charts]
        Path(path).write_text(document("MuJoCo and hard steps", body), encoding="utf-8")


def compare(stepper: HardStepper, data: Any, steps: int, control: Callable[[Any], None] | None = None) -> Comparison:
    """Takes ``steps`` of both kinds on copies of ``data``."""
    model = stepper.model
    stepper.collector.check(data)
    steps = whole("steps", steps, 1)
    soft, hard = copy.copy(data), copy.copy(data)
    rows: list[list[float]] = []
    seconds = [0.0, 0.0]
    worst: list[tuple[float, str]] = [(-1.0, ""), (-1.0, "")]
    unsolved = 0
    flags = model.opt.enableflags
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    try:
        for _ in range(steps):
            if control is not None:
                control(soft)
                hard.ctrl[:] = soft.ctrl
            certificates = [certify_step(stepper, soft)[0]]
            begin = time.process_time()
            mujoco.mj_step(model, soft)
            middle = time.process_time()
            report = stepper.step(hard)
            seconds[1] += time.process_time() - middle
            seconds[0] += middle - begin
            certificates.append(report.certificate())
            unsolved += not report.solved
            for place, certificate in enumerate(certificates):
                if certificate.residual > worst[place][0]:
                    worst[place] = (certificate.residual, str(certificate))
            apart = float(np.linalg.norm(soft.xpos - hard.xpos, axis=1).max())
            row = [soft.time, apart, float(np.sum(soft.energy)), float(np.sum(hard.energy))]
            for measure in (_overlap, _creep, _residual):
                row += [measure(certificate) for certificate in certificates]
            rows.append(row)
    finally:
        model.opt.enableflags = flags
    table = np.array(rows)
    return Comparison(
        times=table[:, 0],
        distance=table[:, 1],
        energy=table[:, 2:4],
        overlap=table[:, 4:6],
        creep=table[:, 6:8],
        residual=table[:, 8:10],
        unsolved=unsolved,
        seconds=(seconds[0], seconds[1]),
        worst=(worst[0][1], worst[1][1]),
    )


def _overlap(certificate: Certificate) -> float:
    return max((max(0.0, -row.gap) for row in certificate.rows if row.kind == "contact"), default=0.0)


def _creep(certificate: Certificate) -> float:
    return max(
        (row.slip for row in certificate.rows if row.kind == "contact" and row.force > 0.0 and row.ratio < _STICKS),
        default=0.0,
    )


def _residual(certificate: Certificate) -> float:
    return certificate.residual
