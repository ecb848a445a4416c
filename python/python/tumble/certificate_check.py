"""Reference checker of step certificates. It needs NumPy alone and shares no code with tumble.

    $ python certificate_check.py [--tolerance 1e-6] steps.jsonl

The format and all formulas are in docs/reference/certificate-format.md, whose numbers (C1) to (C8) stand below.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

FORMAT = "step-certificate 1"
PARTS = ("dynamics", "penetration", "normal_law", "friction_law", "cone", "constraint")
AGREEMENT = 1e-9
"""Largest difference of a stated residual and the computed one, m/s, or relative above 1 m/s."""


class Refused(Exception):
    """Reason why a file or a step is refused."""


def fields(what: str, table: Any, needed: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Any]:
    """The table, if it has all needed fields and no unknown ones."""
    if not isinstance(table, dict):
        raise Refused(f"{what} is not an object")
    missing, unknown = set(needed) - set(table), set(table) - set(needed) - set(optional)
    if missing or unknown:
        raise Refused(f"{what} has no {min(missing)}" if missing else f"{what} has the unknown field {min(unknown)}")
    return table


def array(what: str, value: Any, *shape: int) -> Any:
    """Finite numbers of a shape."""
    try:
        found = np.array(value, dtype=object)
        if not all(type(entry) in (int, float) for entry in found.ravel()):
            raise TypeError
        numbers = found.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise Refused(f"{what} is not numbers of the shape {shape}") from None
    if numbers.size == 0 and 0 in shape:
        return np.zeros(shape)
    if numbers.shape != shape:
        raise Refused(f"{what} has the shape {numbers.shape} instead of {shape}")
    if not np.isfinite(numbers).all():
        raise Refused(f"{what} is not finite")
    return numbers


def number(what: str, value: Any, least: float = -np.inf, above: float = -np.inf) -> float:
    """Number from ``least`` and above ``above``."""
    if (found := float(array(what, value))) < least or found <= above:
        raise Refused(f"{what} is {found:g}, which is too small")
    return found


def unit(what: str, value: Any, size: int) -> Any:
    """Vector of length 1."""
    found, length = array(what, value, size), np.linalg.norm(array(what, value, size))
    if abs(length - 1.0) > 1e-6:
        raise Refused(f"{what} has the length {length:g} instead of 1")
    return found / length


def whole(what: str, value: Any, least: int, below: int) -> int:
    """Whole number in a range."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value < below:
        raise Refused(f"{what} is {value!r}; a whole number from {least} to {below - 1} is needed")
    return value


def rotation(q: Any) -> Any:
    """Matrix of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew


def inertia(what: str, value: Any) -> Any:
    """Inertia tensor of a body that can exist."""
    flat = isinstance(value, list) and len(value) == 3 and not isinstance(value[0], list)
    tensor = np.diag(array(what, value, 3)) if flat else array(what, value, 3, 3)
    moments = np.linalg.eigvalsh(0.5 * (tensor + tensor.T))
    if np.abs(tensor - tensor.T).max() > 1e-9 * moments[2] or moments[0] <= 0.0:
        raise Refused(f"{what} is not symmetric with positive moments")
    if moments[2] > (1.0 + 1e-9) * (moments[0] + moments[1]):
        raise Refused(f"{what} has a moment above the sum of the two others")
    return tensor


BODIES = ("kind", "time_step", "residuals", "gravity", "bodies", "contacts")
BODY = ("mass", "inertia", "position", "attitude", "velocity", "spin", "velocity_after", "spin_after")
CONTACT = ("bodies", "point", "normal", "friction", "gap", "impulse")
MATRICES = (*BODIES[:3], "mass", "rows", "velocity", "velocity_after", "force", "impulses", "laws")
LAWS = {"contact": ("friction",), "moment": ("contact", "rolling", "torsional")} | dict.fromkeys(("limit", "locked", "free", "box"), ())
"""Fields of each law. A box may have bounds too, ``least`` and ``most``."""


class Step:
    """Step in generalised coordinates: M, J, v, v\u207a, f, p, the velocities of rows, lengths, and groups of rows."""

    def __init__(self, step: Any) -> None:
        if not isinstance(step, dict) or (kind := step.get("kind")) not in ("bodies", "matrices"):
            raise Refused("the step has no kind bodies or matrices")
        self.h = number("time_step", step.get("time_step"), above=0.0)
        self.groups: list[tuple[dict[str, Any], slice]] = []
        if kind == "bodies":
            self._bodies(fields("the step", step, BODIES, ("names", "notes", "time")))
        else:
            self._matrices(fields("the step", step, MATRICES, ("offsets", "lengths", "dimension", "names", "notes", "time")))

    def _bodies(self, step: dict[str, Any]) -> None:
        """Matrices of rigid bodies, (C3) and (C4)."""
        bodies, contacts = listed("bodies", step["bodies"]), listed("contacts", step["contacts"])
        count, rows = 6 * len(bodies), 3 * len(contacts)
        gravity = array("gravity", step["gravity"], 3)
        self.M, self.J = np.zeros((count, count)), np.zeros((rows, count))
        self.before, self.after, self.force, self.lengths = np.zeros((4, count))
        self.p, offsets = np.zeros(rows), np.zeros(rows)
        centres = []
        for place, entry in enumerate(bodies):
            what = f"bodies[{place}]"
            fields(what, entry, BODY, ("wrench", "attitude_after"))
            mass, tensor = number(f"{what}.mass", entry["mass"], above=0.0), inertia(f"{what}.inertia", entry["inertia"])
            turn = rotation(unit(f"{what}.attitude", entry["attitude"], 4))
            turned = turn @ tensor @ turn.T
            centres.append(array(f"{what}.position", entry["position"], 3))
            v, w, v_after, w_after = (array(f"{what}.{name}", entry[name], 3) for name in BODY[4:])
            wrench = array(f"{what}.wrench", entry.get("wrench", [0.0] * 6), 6)
            gyroscopic = np.cross(w, turned @ w)
            if "attitude_after" in entry:
                end = rotation(unit(f"{what}.attitude_after", entry["attitude_after"], 4))
                gyroscopic = (end @ tensor @ end.T - turned) @ w_after / self.h
            own = slice(6 * place, 6 * place + 6)
            self.M[own, own] = np.block([[mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), turned]])
            self.before[own], self.after[own] = np.concatenate([v, w]), np.concatenate([v_after, w_after])
            self.force[own] = wrench + np.concatenate([mass * gravity, -gyroscopic])
            self.lengths[own] = [1.0] * 3 + [np.sqrt(np.trace(tensor) / (2.0 * mass))] * 3
        for place, entry in enumerate(contacts):
            what, own = f"contacts[{place}]", slice(3 * place, 3 * place + 3)
            fields(what, entry, CONTACT, ("gap_after", "slip"))
            pair = [whole(f"{what}.bodies", body, -1, len(bodies)) for body in listed(f"{what}.bodies", entry["bodies"])]
            if len(pair) != 2 or pair[0] == pair[1]:
                raise Refused(f"{what}.bodies is {pair}; two different bodies are needed")
            frame = axes(unit(f"{what}.normal", entry["normal"], 3))
            point = array(f"{what}.point", entry["point"], 3)
            for body, sign in zip(pair, (-1.0, 1.0)):
                if body >= 0:
                    arm = np.cross(point - centres[body], frame)
                    self.J[own, 6 * body : 6 * body + 6] += sign * np.hstack([frame, arm])
            self.p[own] = frame @ array(f"{what}.impulse", entry["impulse"], 3)
            moved = self.J[own] @ self.after
            offsets[own.start] = number(f"{what}.gap", entry["gap"]) / self.h
            if "gap_after" in entry:
                offsets[own.start] = number(f"{what}.gap_after", entry["gap_after"]) / self.h - moved[0]
            if "slip" in entry:
                offsets[own.start + 1 : own.stop] = (frame @ array(f"{what}.slip", entry["slip"], 3) - moved)[1:]
            self.groups.append(({"law": "contact", "friction": number(f"{what}.friction", entry["friction"], 0.0)}, own))
        self.u = self.J @ self.after + offsets

    def _matrices(self, step: dict[str, Any]) -> None:
        """Matrices as they are."""
        size = len(listed("velocity", step["velocity"]))
        dimension = whole("dimension", step.get("dimension", 3), 2, 4)
        at = 0
        for place, entry in enumerate(listed("laws", step["laws"])):
            what = f"laws[{place}]"
            if not isinstance(entry, dict) or (law := str(entry.get("law"))) not in LAWS:
                raise Refused(f"{what} has no law of {', '.join(LAWS)}")
            fields(what, entry, ("law", *LAWS[law]), ("least", "most") if law == "box" else ())
            for name in entry.keys() - {"law", "contact"}:
                number(f"{what}.{name}", entry[name], -np.inf if law == "box" else 0.0)
            if law == "moment" and self.groups[whole(f"{what}.contact", entry["contact"], 0, place)][0]["law"] != "contact":
                raise Refused(f"{what}.contact is not a contact")
            rows = {"contact": dimension, "moment": 3}.get(law, 1)
            self.groups.append((entry, slice(at, at + rows)))
            at += rows
        self.M, self.J = array("mass", step["mass"], size, size), array("rows", step["rows"], at, size)
        if np.abs(self.M - self.M.T).max(initial=0.0) > 1e-9 * np.abs(self.M).max(initial=0.0):
            raise Refused("mass is not symmetric")
        self.before, self.after, self.force = (array(name, step[name], size) for name in MATRICES[5:8])
        self.p = array("impulses", step["impulses"], at)
        self.lengths = array("lengths", step.get("lengths", [1.0] * size), size)
        self.u = self.J @ self.after + array("offsets", step.get("offsets", [0.0] * at), at)

    def residuals(self) -> dict[str, float]:
        """Largest residual of each part, m/s."""
        if np.linalg.eigvalsh(self.M).min(initial=np.inf) <= 0.0:
            raise Refused("the mass matrix is not positive definite")
        moved = np.linalg.solve(self.M, np.column_stack([self.h * self.force + self.J.T @ self.p, self.J.T]))
        found = dict.fromkeys(PARTS, 0.0)
        # (C2)
        found["dynamics"] = np.abs(self.lengths * (self.after - self.before - moved[:, 0])).max(initial=0.0)
        response = np.sum(self.J * moved[:, 1:].T, axis=1)
        for entry, rows in self.groups:
            for part, value in self._violations(entry, self.p[rows], self.u[rows], response[rows]):
                found[part] = max(found[part], value)
        return {part: float(value) for part, value in found.items()}

    def _violations(self, entry: dict[str, Any], p: Any, u: Any, w: Any) -> Iterator[tuple[str, float]]:
        """Residuals of a law, from impulses, velocities and the diagonal of the response."""
        law = entry["law"]
        if law in ("contact", "limit"):
            # (C5)
            yield "penetration", max(0.0, -u[0])
            yield "normal_law", abs(min(w[0] * p[0], u[0]))
        if law == "contact":
            # (C6), (C7)
            yield from disc(p[1:], u[1:], w[1:].mean(), entry["friction"] * p[0])
        elif law == "moment":
            load = max(0.0, self.p[self.groups[entry["contact"]][1].start])
            yield from disc(p[:2], u[:2], w[:2].mean(), entry["rolling"] * load)
            yield from disc(p[2:], u[2:], w[2], entry["torsional"] * load)
        elif law == "locked":
            # (C8)
            yield "constraint", abs(u[0])
        elif law == "free":
            yield "constraint", abs(w[0] * p[0])
        elif law == "box":
            least, most = w[0] * entry.get("least", -np.inf), w[0] * entry.get("most", np.inf)
            yield "constraint", abs(w[0] * p[0] - min(max(w[0] * p[0] - u[0], least), most))


def disc(p: Any, u: Any, w: float, limit: float) -> Iterator[tuple[str, float]]:
    """Residuals of the largest dissipation within a disc, (C6) and (C7)."""
    radius, target = w * max(limit, 0.0), w * p - u
    nearest = target * min(1.0, radius / max(float(np.linalg.norm(target)), 1e-300))
    yield "friction_law", float(np.linalg.norm(w * p - nearest))
    yield "cone", max(0.0, w * (float(np.linalg.norm(p)) - limit))


def listed(what: str, value: Any) -> list[Any]:
    """The value, if it is a list."""
    if not isinstance(value, list):
        raise Refused(f"{what} is not a list")
    return value


def axes(normal: Any) -> Any:
    """Normal and two tangents as rows. The residuals do not depend on the choice of the tangents."""
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    return np.array([normal, first, np.cross(normal, first)]) / np.array([[1.0]] + [[np.linalg.norm(first)]] * 2)


def check(text: str, tolerance: float = np.inf) -> Iterator[tuple[int, dict[str, float] | None, str]]:
    """Line, computed residuals and reason of refusal, or no reason, of each step of a file."""
    first, *lines = text.removesuffix("\n").split("\n")  # Texts of JSON may have other separators of lines.
    head = fields("the first line", json.loads(first), ("format", "engine"), ("about",))
    if head["format"] != FORMAT:
        raise Refused(f"the format is {head['format']!r}; {FORMAT!r} is needed")
    for place, line in enumerate(lines, start=2):
        found = None
        try:
            step = json.loads(line)
            found = Step(step).residuals()
            stated = fields("residuals", step["residuals"], PARTS)
            for part, value in found.items():
                claim = number(f"residuals.{part}", stated[part], 0.0)
                if not abs(claim - value) <= AGREEMENT * max(1.0, value):
                    raise Refused(f"{part} is {value:.12g} m/s, not {claim:.12g} as stated")
                if value > tolerance:
                    raise Refused(f"{part} is {value:.3g} m/s, more than {tolerance:g}")
            yield place, found, ""
        except (Refused, ValueError, RecursionError) as refusal:  # of JSON and of linear algebra too
            yield place, found, str(refusal)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    parser = argparse.ArgumentParser(description="Checks step certificates. The exit code is 1 if a step is refused.")
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--tolerance", type=float, default=np.inf, metavar="V", help="refuse larger residuals, m/s")
    options = parser.parse_args(arguments)
    bad = 0
    for path in options.files:
        try:
            with open(path, encoding="utf-8") as file:
                results = list(check(file.read(), options.tolerance))
        except (OSError, ValueError, Refused) as error:
            print(f"{path}: {error}", file=sys.stderr)
            return 2
        for line, _, reason in results:
            if reason:
                print(f"{path}:{line}: {reason}")
        refused = sum(bool(reason) for _, _, reason in results)
        print(f"{path}: {len(results)} steps, {refused} refused; largest residuals, m/s:")
        for part in PARTS:
            print(f"  {part:14}{max((found[part] for _, found, _ in results if found), default=0.0):10.2e}")
        bad += refused
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
