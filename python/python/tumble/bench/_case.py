"""Cases: one TOML file each, with a scene and the answers that are known for it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .._tumble import TumbleError
from .._types import Floats
from ._formula import evaluate
from ._measures import Measures
from ._scene import Scene, known, scene_of

COMPONENTS = ("x", "y", "z", "vx", "vy", "vz")
"""Components of an end state that have derivatives."""


@dataclass(frozen=True)
class Answer:
    """Quantity with a known value."""

    name: str
    unit: str
    measured: str
    """Formula over the motion."""
    value: float
    tolerance: float
    """Largest error of a right answer."""
    reason: str
    """Reason for the tolerance."""
    source: str
    compliant: float | None
    """Largest error that compliant contacts may have by design; None if they have no allowance."""


@dataclass(frozen=True)
class Gradient:
    """Derivative of a component of an end state by a parameter."""

    name: str
    unit: str
    body: int
    component: str
    by: str
    step: float
    """Change of the parameter in central differences."""
    value: float
    tolerance: float
    reason: str
    source: str


@dataclass(frozen=True)
class Case:
    """Scene with known answers."""

    name: str
    path: str
    description: str
    group: str
    fast: bool
    """True if the case belongs to the short selection of the tests."""
    parameters: dict[str, float]
    table: Mapping[str, Any]
    answers: list[Answer]
    gradients: list[Gradient]

    @property
    def quantities(self) -> list[Answer | Gradient]:
        """Answers, then gradients."""
        return [*self.answers, *self.gradients]

    def scene(self, **changed: float) -> Scene:
        """Scene with the parameters of the case, some of them changed."""
        return scene_of(self.table, {**self.parameters, **changed})

    def measure(self, scene: Scene, states: Floats) -> list[float]:
        """Measured values of the answers."""
        names = {**self.parameters, **Measures(scene, states).names()}
        return [_number(evaluate(answer.measured, names)) for answer in self.answers]


_CASE = {"description", "group", "fast", "parameters", "scene", "answers", "gradients"}
_ANSWER = {"name", "unit", "measured", "value", "tolerance", "reason", "source", "compliant"}
_GRADIENT = {"name", "unit", "body", "component", "by", "step", "value", "tolerance", "reason", "source"}
GROUPS = ("friction", "rolling", "impacts", "statics", "conservation", "gradients")
_LARGEST_FILE = 1 << 20


def load_case(path: Path) -> Case:
    """Reads a case file.

    :raises OSError: for an unreadable file.
    :raises TumbleError: for an invalid case.
    """
    content = path.read_bytes()
    try:
        if len(content) > _LARGEST_FILE:
            raise TumbleError(f"the file is longer than {_LARGEST_FILE} bytes")
        return _case(path, tomllib.loads(content.decode()))
    except (TumbleError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise TumbleError(f"{path}: {error}") from None


def _case(path: Path, table: Mapping[str, Any]) -> Case:
    known("the case", table, _CASE, ("description", "group", "scene"))
    if table["group"] not in GROUPS:
        raise TumbleError(f"group is {table['group']!r}; known are {', '.join(GROUPS)}")
    parameters: dict[str, float] = {}
    for name, value in table.get("parameters", {}).items():
        parameters[name] = _number(evaluate(value, parameters))
    scene = scene_of(table["scene"], parameters)
    constants = {**parameters, "h": scene.time_step, "T": scene.steps * scene.time_step}
    answers = [_answer(entry, constants) for entry in table.get("answers", [])]
    gradients = [_gradient(entry, constants, scene) for entry in table.get("gradients", [])]
    if not answers and not gradients:
        raise TumbleError("the case has no answers; add [[answers]] or [[gradients]]")
    case = Case(
        name=path.stem,
        path=str(path),
        description=str(table["description"]),
        group=str(table["group"]),
        fast=bool(table.get("fast", True)),
        parameters=parameters,
        table=table["scene"],
        answers=answers,
        gradients=gradients,
    )
    # A motion without motion: a formula with an unknown name is refused when the file is read.
    case.measure(scene, np.repeat(scene.states[None], scene.steps + 1, axis=0))
    return case


def _answer(entry: Mapping[str, Any], constants: Mapping[str, float]) -> Answer:
    known("an answer", entry, _ANSWER, sorted(_ANSWER - {"compliant"}))
    compliant = _number(evaluate(entry["compliant"], constants)) if "compliant" in entry else None
    return Answer(measured=str(entry["measured"]), compliant=compliant, **_expected(entry, constants))


def _gradient(entry: Mapping[str, Any], constants: Mapping[str, float], scene: Scene) -> Gradient:
    known("a gradient", entry, _GRADIENT, sorted(_GRADIENT))
    names = [body.name for body in scene.free]
    if entry["body"] not in names or entry["component"] not in COMPONENTS:
        raise TumbleError(
            f"a gradient is of {entry['component']!r} of {entry['body']!r}; components are {', '.join(COMPONENTS)}, "
            f"bodies {', '.join(names)}"
        )
    if entry["by"] not in constants or entry["by"] in ("h", "T"):
        raise TumbleError(f"a gradient is by {entry['by']!r}, which is not in [parameters]")
    return Gradient(
        body=names.index(entry["body"]),
        component=entry["component"],
        by=entry["by"],
        step=_number(evaluate(entry["step"], constants)),
        **_expected(entry, constants),
    )


def _expected(entry: Mapping[str, Any], constants: Mapping[str, float]) -> dict[str, Any]:
    tolerance = _number(evaluate(entry["tolerance"], constants))
    if not 0.0 < tolerance < math.inf:
        raise TumbleError(f"{entry['name']} has the tolerance {tolerance:g}; a positive number is needed")
    texts = {name: str(entry[name]) for name in ("name", "unit", "reason", "source")}
    return {**texts, "value": _number(evaluate(entry["value"], constants)), "tolerance": tolerance}


def _number(value: Any) -> float:
    if isinstance(value, (int, float, np.floating)):
        return float(value)
    raise TumbleError(f"a number is needed, but a formula gives {type(value).__name__}")


def all_cases(folder: Path | None = None) -> list[Case]:
    """Cases of the package, and those of a folder, by group and name."""
    paths = sorted(Path(str(files(__package__) / "cases")).glob("*.toml"))
    if folder is not None:
        if not folder.is_dir():
            raise TumbleError(f"{folder} is not a folder; give one with case files")
        paths += sorted(folder.glob("*.toml"))
    found: dict[str, Case] = {}
    for path in paths:
        if path.stem in found:
            raise TumbleError(f"{path}: there is already a case {path.stem}; rename the file")
        found[path.stem] = load_case(path)
    return sorted(found.values(), key=lambda case: (GROUPS.index(case.group), case.name))


def chosen(names: Sequence[str], patterns: Sequence[str], what: str) -> list[str]:
    """Names that match any of the patterns, in their order.

    :raises TumbleError: if a pattern matches nothing.
    """
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise TumbleError(f"there is no {what} {pattern!r}; --list prints all of them")
    return [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
