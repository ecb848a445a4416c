"""Certificate of a step: residuals of the contact laws, as a table and as a sentence."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ._types import Floats

if TYPE_CHECKING:
    from ._measured_step import MeasuredStep

PARTS = ("penetration", "normal_law", "cone", "friction_law", "constraint")
"""Residuals of a row. Of two equal ones, the first is named."""
EXACT = 1e-9
"""Residual up to which the laws count as met, m/s."""
_EQUAL = 0.999
"""An implied residual is named if it is this share of the largest."""


@dataclass(frozen=True)
class CertificateRow:
    """Residuals of one contact, limit or joint row in a step."""

    name: str
    """For example ``hand–capsule``."""
    kind: str
    """"contact", "moment", "limit", "locked", "box" or "free". A moment is in N m and rad/s instead of N and m/s."""
    gap: float
    """Gap at the start of the step, m; of a limit of a hinge rad."""
    force: float
    """Normal force of a contact or of a moment's contact, or force of the row, N."""
    friction_force: float
    """Length of the friction force or of the moment, N."""
    slip: float
    """Slip speed of a contact, or speed of the row, at the end of the step, m/s."""
    gap_speed: float
    """Gap at the end of the step divided by the time step, m/s."""
    ratio: float
    """Friction force divided by the largest one that the cone permits."""
    penetration: float
    normal_law: float
    friction_law: float
    cone: float
    constraint: float
    """Residual of a locked row or of a box."""
    power: float = 0.0
    """Mean power of the row's forces over the step, W; negative if they take energy."""

    @property
    def residual(self) -> float:
        """Largest residual of this row, m/s."""
        return max(self.penetration, self.normal_law, self.friction_law, self.cone, self.constraint)


@dataclass(frozen=True)
class Certificate:
    """Residuals of a step of any engine against Newton's law, hard contact and Coulomb's law.

    All residuals are speeds, m/s. ``str()`` describes the largest one in a sentence, ``table()`` lists all rows.
    """

    dynamics: float
    """Largest residual of Newton's law."""
    rows: tuple[CertificateRow, ...]
    time_step: float
    notes: tuple[str, ...] = ()
    """Parts of the model that the certificate does not cover."""
    energy: float = 0.0
    """Change of energy by contacts and by errors of Newton's law, J. Exact steps have none above zero."""
    _step: Any = field(default=None, repr=False, compare=False)
    """The measured step."""

    def measured(self) -> MeasuredStep:
        """Arrays of the step, as ``tumble.referee.audit`` takes them."""
        step: MeasuredStep = self._step
        return step

    @property
    def penetration(self) -> float:
        """Largest overlap at the end of the step, divided by the time step."""
        return max((row.penetration for row in self.rows), default=0.0)

    @property
    def normal_law(self) -> float:
        """Largest residual of "a contact pushes only where it is closed"."""
        return max((row.normal_law for row in self.rows), default=0.0)

    @property
    def friction_law(self) -> float:
        """Largest residual of Coulomb's law."""
        return max((row.friction_law for row in self.rows), default=0.0)

    @property
    def cone(self) -> float:
        """Largest excess of a friction force over its cone."""
        return max((row.cone for row in self.rows), default=0.0)

    @property
    def constraint(self) -> float:
        """Largest residual of joint rows that are not limits."""
        return max((row.constraint for row in self.rows), default=0.0)

    @property
    def residual(self) -> float:
        """Largest residual of all parts."""
        return max(self.dynamics, max((row.residual for row in self.rows), default=0.0))

    @property
    def worst(self) -> str:
        """Part and row of the largest residual, for example "friction law at contact hand–capsule"."""
        part, row = self._worst()
        return part.replace("_", " ") if row is None else f"{part.replace('_', ' ')} at {row.kind} {row.name}"

    def _worst(self) -> tuple[str, CertificateRow | None]:
        if not self.rows or self.dynamics >= max(row.residual for row in self.rows):
            return "dynamics", None
        row = max(self.rows, key=lambda each: each.residual)
        return next(part for part in PARTS if getattr(row, part) >= _EQUAL * row.residual), row

    def __str__(self) -> str:
        part, row = self._worst()
        if self.residual <= EXACT:
            return f"all laws hold to {self.residual:.1e} m/s"
        if row is None:
            return f"the velocities miss Newton's law by {_speed(self.dynamics)}"
        return f"{row.kind} {row.name} {_fault(part, row, self.time_step)}"

    def table(self, most: int = 20) -> str:
        """Text table of the parts and of the ``most`` rows with the largest residuals."""
        parts = [("dynamics", self.dynamics)] + [(part, getattr(self, part)) for part in PARTS]
        lines = [f"{part.replace('_', ' '):<14}{value:10.2e} m/s" for part, value in parts]
        if self.rows:
            width = max(len("row"), *(len(f"{row.kind} {row.name}") for row in self.rows))
            lines.append("")
            lines.append(f"{'row':<{width}}      gap, m  force, N  slip, m/s  ratio  residual, m/s")
        for row in sorted(self.rows, key=lambda each: -each.residual)[:most]:
            lines.append(
                f"{f'{row.kind} {row.name}':<{width}}  {row.gap:10.2e}  {row.force:8.3g}  {row.slip:9.2e}"
                f"  {row.ratio:5.3f}  {row.residual:13.2e}"
            )
        if len(self.rows) > most:
            lines.append(f"and {len(self.rows) - most} rows with smaller residuals")
        lines.extend(f"note: {note}" for note in self.notes)
        return "\n".join(lines)


def rows_of(
    laws: list[tuple[float | None, list[tuple[str, float, float]]]],
    dimension: int,
    impulses: Floats,
    speeds: Floats,
    offsets: Floats,
    response: Floats,
    time_step: float,
    names: list[str],
    motion: Floats,
    stretch: Floats,
) -> tuple[CertificateRow, ...]:
    """Residuals of every group, from impulses p, row velocities u, the diagonal of W and the mean motion of rows.

    Slips and friction forces are those without the factors ``stretch`` of the rows.
    """
    rows: list[CertificateRow] = []
    at = 0
    starts: list[int] = []
    for (friction, own), name in zip(laws, names):
        starts.append(at)
        size = len(own) if friction is None else dimension
        span = slice(at, at + size)
        if friction is not None:
            gap = offsets[at] * time_step
            power = float(impulses[span] @ motion[span]) / time_step
            row = _contact(name, friction, impulses[span], speeds[span], response[span], stretch[span], gap, time_step)
            rows.append(replace(row, power=power))
        elif own[0][0] == "rolling":
            power = float(impulses[span] @ motion[span]) / time_step
            (_, contact, rolling), _, (_, _, torsional) = own
            load, limits = float(impulses[starts[int(contact)]]), (rolling, torsional)
            numbers = impulses[span], speeds[span], response[span], stretch[span]
            rows.append(replace(_moment(name, limits, load, *numbers, time_step), power=power))
        else:
            for place, law in zip(range(at, at + size), own):
                power = float(impulses[place] * motion[place]) / time_step
                row = _single(name, law, impulses[place], speeds[place], response[place], offsets[place], time_step)
                rows.append(replace(row, power=power))
        at += size
    return tuple(rows)


def _contact(
    name: str, friction: float, p: Floats, u: Floats, response: Floats, stretch: Floats, gap: float, time_step: float
) -> CertificateRow:
    import numpy as np

    normal, tangent = float(response[0]), float(np.mean(response[1:]))
    along = tangent * p[1:]
    radius = friction * tangent * max(float(p[0]), 0.0)
    target = along - u[1:]
    length = float(np.linalg.norm(target))
    projected = target if length <= radius else target * (radius / length)
    pull = float(np.linalg.norm(p[1:]))
    largest = friction * float(p[0])
    return CertificateRow(
        name=name,
        kind="contact",
        gap=float(gap),
        force=float(p[0]) / time_step,
        friction_force=float(np.linalg.norm(p[1:] * stretch[1:])) / time_step,
        slip=float(np.linalg.norm(u[1:] / stretch[1:])),
        gap_speed=float(u[0]),
        ratio=_ratio(pull, largest),
        penetration=max(0.0, -float(u[0])),
        normal_law=abs(min(normal * float(p[0]), float(u[0]))),
        friction_law=float(np.linalg.norm(along - projected)),
        cone=max(0.0, tangent * (pull - largest)),
        constraint=0.0,
    )


def _moment(
    name: str,
    limits: tuple[float, float],
    pressed: float,
    p: Floats,
    u: Floats,
    response: Floats,
    stretch: Floats,
    time_step: float,
) -> CertificateRow:
    """Residuals of a moment, whose rolling and torsional parts have limits of their own."""
    import numpy as np

    across, along = float(np.mean(response[:2])), float(response[2])
    rolling, torsional = (limit * max(pressed, 0.0) for limit in limits)
    target = across * p[:2] - u[:2]
    size = float(np.linalg.norm(target))
    rolls = across * p[:2] - target * min(1.0, across * rolling / size if size > 0.0 else 1.0)
    spins = along * p[2] - np.clip(along * p[2] - u[2], -along * torsional, along * torsional)
    sizes = float(np.linalg.norm(p[:2])), abs(float(p[2]))
    ratio = max(_ratio(sizes[0], rolling), _ratio(sizes[1], torsional))
    return CertificateRow(
        name=name,
        kind="moment",
        gap=0.0,
        force=pressed / time_step,
        friction_force=float(np.linalg.norm(p * stretch)) / time_step,
        slip=float(np.linalg.norm(u / stretch)),
        gap_speed=0.0,
        ratio=ratio,
        penetration=0.0,
        normal_law=0.0,
        friction_law=max(float(np.linalg.norm(rolls)), abs(float(spins))),
        cone=max(0.0, across * (sizes[0] - rolling), along * (sizes[1] - torsional)),
        constraint=0.0,
    )


def _ratio(size: float, largest: float) -> float:
    if largest > 0.0:
        return size / largest
    return float("inf") if size > 0.0 else 0.0


def _single(
    name: str, law: tuple[str, float, float], p: float, u: float, response: float, offset: float, time_step: float
) -> CertificateRow:
    kind, least, most = law
    p, u, response = float(p), float(u), float(response)
    limit = kind == "limit"
    if kind == "locked":
        constraint = abs(u)
    elif kind == "box":
        constraint = abs(response * p - min(max(response * p - u, response * least), response * most))
    else:
        constraint = 0.0 if limit else abs(response * p)
    return CertificateRow(
        name=name,
        kind=kind,
        gap=float(offset) * time_step,
        force=p / time_step,
        friction_force=0.0,
        slip=abs(u),
        gap_speed=u,
        ratio=0.0,
        penetration=max(0.0, -u) if limit else 0.0,
        normal_law=abs(min(response * p, u)) if limit else 0.0,
        friction_law=0.0,
        cone=0.0,
        constraint=constraint,
    )


def _speed(value: float) -> str:
    """A speed with a unit in which it is easily read."""
    for unit, size in (("m/s", 1.0), ("mm/s", 1e-3), ("µm/s", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value:.1e} m/s"


def _length(value: float) -> str:
    return _speed(value).removesuffix("/s")


def _fault(part: str, row: CertificateRow, time_step: float) -> str:
    """Predicate of the sentence about a row."""
    if row.kind == "moment" and part == "cone":
        return f"has a moment beyond its limit (ratio {row.ratio:.3g})"
    if row.kind == "moment":
        return f"turns at {row.slip:.3g} rad/s with a moment of {row.friction_force:.3g} N m (ratio {row.ratio:.2g})"
    if part == "penetration" and row.kind == "limit":
        return f"ends the step {row.penetration * time_step:.3g} beyond (m or rad)"
    if part == "penetration":
        return f"ends the step {_length(row.penetration * time_step)} inside"
    if part == "normal_law":
        if row.force < 0.0:
            return f"pulls with {-row.force:.3g} N"
        return f"pushes with {row.force:.3g} N and ends the step {_length(row.gap_speed * time_step)} apart"
    if part == "cone":
        return f"has a friction force beyond its cone (ratio {row.ratio:.3g})"
    if part == "friction_law":
        if row.ratio < 1.0:
            return f"slips {_speed(row.slip)} inside its cone (ratio {row.ratio:.2g})"
        return f"slips {_speed(row.slip)} against a friction force that does not oppose it"
    return f"misses its law by {_speed(row.constraint)}"
