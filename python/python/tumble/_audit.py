"""Audit of a run of any engine: the certificates of its steps, and the exact step from each state."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ._certificate import Certificate, CertificateRow
from ._measured_step import ExactStep, MeasuredStep
from ._tumble import TumbleError
from ._types import Floats, Location

if TYPE_CHECKING:
    import pandas as pd

STICKS = 0.99
"""Contacts with at most this share of the largest friction force should not slip."""
KINDS = {
    "dynamics": "m/s",
    "penetration": "m",
    "normal law": "m/s",
    "slip inside the cone": "m/s",
    "creep": "m/s",
    "friction law": "m/s",
    "beyond the cone": "m/s",
    "joint law": "m/s",
    "energy": "J",
}
"""Kinds of findings and the units of their values."""
_STEP_COLUMNS = (
    "k",
    "time_s",
    "residual_m_s",
    "dynamics_m_s",
    "overlap_m",
    "cone_slip_m_s",
    "creep_m_s",
    "energy_J",
    "apart_m_s",
    "exact_residual_m_s",
)
_CONTACT_COLUMNS = (
    "k",
    "time_s",
    "gap_m",
    "force_N",
    "friction_force_N",
    "slip_m_s",
    "ratio",
    "penetration_m_s",
    "normal_law_m_s",
    "friction_law_m_s",
    "cone_m_s",
    "residual_m_s",
    "power_W",
    "exact_force_N",
    "exact_slip_m_s",
)


@dataclass(frozen=True)
class Recorded:
    """A step of a recording."""

    k: int
    time: float
    """Time at the end of the step, s."""
    step: MeasuredStep
    replay: float = 0.0
    """Largest difference of the recorded velocities, and of the recorded positions over the time step, from those of
    the step, m/s or rad/s."""


@dataclass(frozen=True)
class Finding:
    """A law that the steps of a run do not meet at one contact or joint row."""

    kind: str
    """For example "creep", see docs/referee.md."""
    row: str
    """Name of the contact or joint row; empty for the kinds "dynamics" and "energy"."""
    steps: int
    """Number of steps with this finding."""
    first: int
    """Index k of the first one."""
    worst: int
    """Index k of the step with the largest value."""
    value: float
    """Largest value."""
    unit: str
    """"m", "m/s" or "J"."""
    sentence: str
    """Description of the worst step."""


@dataclass(frozen=True)
class Audit:
    """Certificates of the steps of a run, with the exact step from the same state beside each.

    ``str()`` and ``table()`` summarise, ``save()`` writes a page.
    """

    steps: dict[str, Any]
    """One entry per step (K,): k, time_s, residual_m_s, dynamics_m_s, overlap_m, cone_slip_m_s, creep_m_s, energy_J,
    apart_m_s, exact_residual_m_s. ``apart_m_s`` is the distance of the engine's velocity from the exact one."""
    contacts: dict[str, Any]
    """One entry per step and contact: k, time_s, contact (its name), the columns of ``CertificateRow`` with units, and
    exact_force_N and exact_slip_m_s of the exact step."""
    findings: tuple[Finding, ...]
    """Laws that are not met, those of most steps first; one for each kind and row."""
    velocities: tuple[Floats, ...]
    """Velocities of the engine at the end of each step (n,)."""
    exact_velocities: tuple[Floats, ...]
    """Velocities of the exact step from the same state (n,)."""
    velocity_names: tuple[str, ...]
    """Name of each velocity (n,)."""
    tolerance: float
    """Residual up to which a law counts as met, m/s."""
    title: str
    notes: tuple[str, ...] = ()
    """Parts of the run that the audit does not cover."""

    @property
    def is_clean(self) -> bool:
        """True without findings."""
        return not self.findings

    @property
    def look_at(self) -> tuple[int, ...]:
        """Indices k of the worst step of each finding, without repetitions."""
        return tuple(dict.fromkeys(finding.worst for finding in self.findings))

    def steps_to_pandas(self) -> pd.DataFrame:
        """One row per step, with the columns of ``steps``."""
        import pandas

        return pandas.DataFrame(self.steps)

    def contacts_to_pandas(self) -> pd.DataFrame:
        """One row per step and contact, with the columns of ``contacts``."""
        import pandas

        return pandas.DataFrame(self.contacts)

    def beside(self, k: int, most: int | None = None) -> str:
        """Text table of the velocities of the engine and of the exact step at step ``k``.

        :param most: only this many velocities, those farthest apart.
        :raises KeyError: if the audit has no step ``k``.
        """
        place = self.place(k)
        engine, exact = self.velocities[place], self.exact_velocities[place]
        apart = np.abs(engine - exact)
        shown = np.arange(len(apart)) if most is None else np.sort(np.argsort(-apart, kind="stable")[:most])
        width = max(len("velocity"), *(len(name) for name in self.velocity_names), 0)
        lines = [f"{'velocity':<{width}}  {'engine':>13}  {'exact':>13}  {'apart':>9}"]
        for at in shown.tolist():
            name = self.velocity_names[at]
            lines.append(f"{name:<{width}}  {engine[at]:13.6g}  {exact[at]:13.6g}  {apart[at]:9.2e}")
        if len(shown) < len(apart):
            lines.append(f"and {len(apart) - len(shown)} velocities that are less far apart")
        return "\n".join(lines)

    def place(self, k: int) -> int:
        """Place of step ``k`` in the arrays."""
        found = np.flatnonzero(self.steps["k"] == k)
        if not len(found):
            raise KeyError(f"the audit has no step {k}")
        return int(found[0])

    def __str__(self) -> str:
        count = len(self.steps["k"])
        if self.is_clean:
            return f"{count} steps: all laws hold to {self.steps['residual_m_s'].max(initial=0.0):.1e} m/s"
        first = self.findings[0]
        return f"{count} steps, {len(self.findings)} findings; the first: {first.kind}, {first.sentence}"

    def table(self, most: int = 20) -> str:
        """Text table of the largest values and of the first ``most`` findings."""
        lines = [self.title, str(self), ""]
        lines += [f"{name:<38}{value:>10}  {where}" for name, value, where in self.largest()]
        if self.findings:
            lines += ["", f"{'finding':<22}{'steps':>6}{'first':>7}{'worst':>7}{'value':>11}"]
        for finding in self.findings[:most]:
            lines.append(
                f"{finding.kind:<22}{finding.steps:6d}{finding.first:7d}{finding.worst:7d}{finding.value:11.2e} "
                f"{finding.unit:<4} {finding.row}"
            )
        if len(self.findings) > most:
            lines.append(f"and {len(self.findings) - most} findings more")
        lines += [f"note: {note}" for note in self.notes]
        return "\n".join(lines)

    def largest(self) -> list[tuple[str, str, str]]:
        """Name, largest value and step of each measure."""
        measures = (
            ("deepest overlap, m", "overlap_m"),
            ("fastest slip inside the cone, m/s", "cone_slip_m_s"),
            ("fastest creep, m/s", "creep_m_s"),
            ("largest gain of energy, J", "energy_J"),
            ("largest residual, m/s", "residual_m_s"),
            ("farthest from the exact step, m/s", "apart_m_s"),
            ("largest residual of exact steps, m/s", "exact_residual_m_s"),
        )
        rows = []
        for name, column in measures:
            values = self.steps[column]
            if len(values):
                at = int(np.argmax(values))
                largest = max(float(values[at]), 0.0)
                rows.append((name, f"{largest:.2e}", f"step {int(self.steps['k'][at])}" if largest else ""))
        return rows

    def save(self, path: Location) -> None:
        """Writes a page with tables and charts, which needs no network.

        :raises TumbleError: if ``path`` is a file that tumble did not write.
        """
        from ._audit_page import write_page

        write_page(self, path)


def audit_steps(recorded: Iterable[Recorded], tolerance: float, title: str, names: tuple[str, ...] | None) -> Audit:
    """Audit of recorded steps. ``names`` are those of the velocities; numbers by default."""
    steps: list[tuple[float, ...]] = []
    contacts: list[tuple[float, ...]] = []
    contact_names: list[str] = []
    own: list[Floats] = []
    exact: list[Floats] = []
    groups = _Groups()
    notes: dict[str, None] = {}
    replay, unsolved = 0.0, 0
    for each in recorded:
        names = names or each.step.velocity_names or None
        if names is not None and len(names) != len(each.step.after):
            count = len(each.step.after)
            raise TumbleError(f"velocity_names has {len(names)} entries; step {each.k} has {count} velocities")
        step, certificate = each.step, each.step.certificate()
        try:
            right = step.exact()
        except TumbleError as error:
            raise TumbleError(f"step {each.k} of the recording: {error}") from None
        own.append(step.after)
        exact.append(right.velocity)
        notes.update(dict.fromkeys(certificate.notes))
        replay, unsolved = max(replay, each.replay), unsolved + (not right.solved)
        exact_rows = _exact_certificate(step, right)
        pairs = list(zip(certificate.rows, exact_rows.rows))
        for row, beside in pairs:
            if row.kind == "contact":
                contact_names.append(row.name)
                contacts.append((each.k, each.time, *_contact_values(row), beside.force, beside.slip))
        found = list(_faults(step, certificate, pairs, tolerance))
        for kind, name, value, sentence in found:
            groups.add(each.k, kind, name, value, f"step {each.k}: {sentence}")
        steps.append(
            (
                each.k,
                each.time,
                certificate.residual,
                certificate.dynamics,
                max((row.penetration for row in certificate.rows if row.kind == "contact"), default=0.0)
                * step.time_step,
                _largest(found, "slip inside the cone"),
                _largest(found, "creep"),
                certificate.energy,
                float(np.abs((step.after - right.velocity) * step.lengths).max(initial=0.0)),
                exact_rows.residual,
            )
        )
    if replay > tolerance:
        said = f"recorded states differ from those of mj_step by up to {replay:.1e} m/s or rad/s"
        notes[f"{said}; mj_step's are audited"] = None
    if unsolved:
        notes[f"{unsolved} exact steps are not solved"] = None
    size = max((len(velocity) for velocity in own), default=0)
    return Audit(
        steps=_columns(_STEP_COLUMNS, steps),
        contacts=_with_names(_columns(_CONTACT_COLUMNS, contacts), contact_names),
        findings=tuple(sorted(groups.findings.values(), key=lambda each: -each.steps)),
        velocities=tuple(own),
        exact_velocities=tuple(exact),
        velocity_names=names or tuple(str(place) for place in range(size)),
        tolerance=tolerance,
        title=title,
        notes=tuple(notes),
    )


def _exact_certificate(step: MeasuredStep, right: ExactStep) -> Certificate:
    """Certificate of the exact step, with the offsets that it was solved with."""
    J = step.directions
    return replace(
        step,
        after=right.velocity,
        impulses=right.impulses,
        offsets=right.speeds - J @ right.velocity,
        motion=right.speeds,
    ).certificate()


def _faults(
    step: MeasuredStep, certificate: Certificate, pairs: list[tuple[CertificateRow, CertificateRow]], tolerance: float
) -> Iterator[tuple[str, str, float, str]]:
    """Kind, row, value and sentence of each law that a step does not meet."""
    if certificate.dynamics > tolerance:
        yield "dynamics", "", certificate.dynamics, "the velocities miss Newton's law"
    for row, exact in pairs:
        name = f"{row.kind} {row.name}"
        if row.penetration > tolerance:
            depth = row.penetration * step.time_step
            yield "penetration", name, depth, f"{name} ends {depth:.2e} m inside"
        if row.normal_law > tolerance and row.force < 0.0:
            yield "normal law", name, row.normal_law, f"{name} pulls with {-row.force:.3g} N"
        elif row.normal_law > tolerance and row.gap_speed > tolerance:
            apart = row.gap_speed * step.time_step
            yield (
                "normal law",
                name,
                row.normal_law,
                f"{name} pushes with {row.force:.3g} N and ends {apart:.2e} m apart",
            )
        if row.constraint > tolerance:
            yield "joint law", name, row.constraint, f"{name} misses its law by {row.constraint:.2e} m/s"
        if row.kind != "contact":
            continue
        if row.cone > tolerance:
            yield "beyond the cone", name, row.cone, f"{name} has {row.ratio:.3g} of the largest friction force"
        slips = row.force > 0.0 and row.slip > tolerance and row.friction_law > tolerance
        if slips and row.ratio < STICKS:
            said = f"{name} slips {row.slip:.2e} m/s with {row.ratio:.2g} of the largest friction force"
            yield "slip inside the cone", name, row.slip, said
        elif slips:
            yield "friction law", name, row.friction_law, f"the friction force of {name} does not oppose its slip"
        if slips and exact.force > 0.0 and exact.slip <= tolerance:
            yield "creep", name, row.slip, f"{name} slips {row.slip:.2e} m/s; in the exact step it sticks"
    moved = float(np.abs(step.impulses).sum() + np.abs(step.mass @ step.after).sum())
    if certificate.energy > tolerance * moved:
        yield "energy", "", certificate.energy, f"contacts and errors add {certificate.energy:.2e} J"


class _Groups:
    """Findings of the same kind and row."""

    def __init__(self) -> None:
        self.findings: dict[tuple[str, str], Finding] = {}
        self._last: dict[tuple[str, str], int] = {}

    def add(self, k: int, kind: str, row: str, value: float, sentence: str) -> None:
        """Adds a fault of step ``k``. Contacts of the same bodies count once a step."""
        key = kind, row
        before = self.findings.get(key, Finding(kind, row, 0, k, k, -1.0, KINDS[kind], sentence))
        count = before.steps + (self._last.get(key) != k)
        self._last[key] = k
        if value > before.value:
            before = replace(before, worst=k, value=value, sentence=sentence)
        self.findings[key] = replace(before, steps=count)


def _contact_values(row: CertificateRow) -> tuple[float, ...]:
    return (
        row.gap,
        row.force,
        row.friction_force,
        row.slip,
        row.ratio,
        row.penetration,
        row.normal_law,
        row.friction_law,
        row.cone,
        row.residual,
        row.power,
    )


def _largest(found: list[tuple[str, str, float, str]], kind: str) -> float:
    return max((value for each, _, value, _ in found if each == kind), default=0.0)


def _columns(names: tuple[str, ...], rows: list[tuple[float, ...]]) -> dict[str, Any]:
    table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    columns: dict[str, Any] = {name: table[:, place].copy() for place, name in enumerate(names)}
    columns["k"] = columns["k"].astype(np.int64)
    return columns


def _with_names(columns: dict[str, Any], names: list[str]) -> dict[str, Any]:
    """Columns with the names of the contacts after the time."""
    head = {name: columns[name] for name in ("k", "time_s")}
    return {**head, "contact": np.array(names, dtype=object), **{n: c for n, c in columns.items() if n not in head}}
