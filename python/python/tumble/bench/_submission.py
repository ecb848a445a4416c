"""Result files: what an engine answered in the cases, with the motions from which anybody can judge it again.

A result file is a zip archive of ``result.json``, the motions ``CASE.npz``, and the adapter if it is not one of the package.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._files import written
from .._tumble import TumbleError
from .._types import Floats
from ._case import Case
from ._differences import difference
from ._runner import Report
from ._verdict import UNMEASURED, Outcome, judged

FORMAT = "tumble-bench-result 1"
LARGEST = 1 << 32
"""Largest size of a motion file, bytes."""
AGREEMENT = 1e-9
"""Largest difference of a stated value and that of its motion, as a share of the answer or of its tolerance."""
_NUMBER = (int, float, type(None))
_ENGINE: dict[str, Any] = {"name": str, "version": str, "settings": str, "compliant": bool}
_CASE: dict[str, Any] = {
    **dict.fromkeys(("case_sha256", "verdict", "reason"), str),
    **dict.fromkeys(("values", "methods"), list),
    **dict.fromkeys(("steps", "seconds", "process_seconds"), _NUMBER),
    "motion_sha256": dict,
}
"""Types of the fields of an engine and of a case."""
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, KeyError, TypeError, ValueError)
"""Errors of damaged archives and arrays."""


def submitted(
    report: Report, name: str, motions: Path, folder: Path, adapter: Path | None, about: Mapping[str, str]
) -> Path:
    """Writes the result file of an engine that ran, and returns its path."""
    found: dict[str, Any] = {"format": FORMAT, "engine": {"name": name, **report.engines[name]}, "about": dict(about), "cases": {}}
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_STORED) as archive:
        for case in report.cases:
            if report.outcomes[name][case.name].verdict == "not run":
                continue
            motion = motions / name / f"{case.name}.npz"
            arrays = _arrays(motion.read_bytes()) if motion.is_file() else {}
            found["cases"][case.name] = _stated(case, report.outcomes[name][case.name], arrays)
            if arrays:
                archive.write(motion, motion.name)
        if adapter is not None:
            text = adapter.read_bytes()
            found["engine"]["adapter_sha256"] = hashlib.sha256(text).hexdigest()
            archive.writestr("adapter.py", text)
        archive.writestr("result.json", json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    return written(folder / f"{name}.zip", memory.getvalue())


def _stated(case: Case, outcome: Outcome, arrays: Mapping[str, Floats]) -> dict[str, Any]:
    return {
        "case_sha256": digest(Path(case.path).read_bytes()),
        "verdict": outcome.verdict,
        "reason": outcome.reason,
        "values": [finding.measured for finding in outcome.findings],
        "methods": [finding.method for finding in outcome.findings[len(case.answers) :]],
        "steps": outcome.steps,
        "seconds": outcome.seconds,
        "process_seconds": outcome.process_seconds,
        "motion_sha256": {name: _hash(array) for name, array in sorted(arrays.items())},
    }


def digest(content: bytes) -> str:
    """SHA-256 of bytes."""
    return hashlib.sha256(content).hexdigest()


def _hash(array: Floats) -> str:
    """SHA-256 of the shape and the numbers, which does not depend on the compression."""
    numbers = np.ascontiguousarray(array, dtype="<f8")
    return digest(repr(numbers.shape).encode() + numbers.tobytes())


def _arrays(content: bytes) -> dict[str, Floats]:
    with zipfile.ZipFile(io.BytesIO(content)) as inner:
        if sum(entry.file_size for entry in inner.infolist()) > LARGEST:
            raise TumbleError(f"a motion file has more than {LARGEST} bytes")
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return {name: np.asarray(arrays[name], dtype=np.float64) for name in arrays.files}


def _typed(what: str, table: Any, types: Mapping[str, Any]) -> dict[str, Any]:
    """The table, if it has all fields with their types."""
    for field, kind in types.items():
        if not isinstance(table, dict) or not isinstance(table.get(field, ...), kind):
            raise TumbleError(f"{what} has no field {field} of the right type")
    return dict(table)


class Result:
    """Result file of an engine."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._archive = zipfile.ZipFile(path)
            self._data = json.loads(self._archive.read("result.json"))
            if self._data["format"] != FORMAT:
                raise TumbleError(f"the format is {self._data['format']!r}; {FORMAT!r} is needed")
            self.engine: dict[str, Any] = _typed("engine", self._data["engine"], _ENGINE)
            self.name, self.compliant = self.engine["name"], self.engine["compliant"]
            self.cases: dict[str, Any] = _typed("result.json", self._data, {"cases": dict})["cases"]
        except UNREADABLE as error:
            raise TumbleError(f"{path} is not a result of tumble.bench: {error}") from None

    def judged(self, case: Case) -> tuple[Outcome, list[str]]:
        """Verdict from the motion, and what in the file does not agree with it."""
        if case.name not in self.cases:
            return Outcome(self.name, case.name, "not run", "the result does not have the case"), []
        try:
            return self._again(case, _typed("the case", self.cases[case.name], _CASE))
        except (*UNREADABLE, OSError) as error:
            reason = f"the file has no readable result: {error}"
            return Outcome(self.name, case.name, "error", reason), [reason]

    def _again(self, case: Case, stated: Mapping[str, Any]) -> tuple[Outcome, list[str]]:
        if stated["case_sha256"] != digest(Path(case.path).read_bytes()):
            reason = "its case file is another one than here"
            return Outcome(self.name, case.name, "not run", reason), [reason]
        if not stated["values"] and stated["verdict"] in UNMEASURED:
            return Outcome(self.name, case.name, stated["verdict"], stated["reason"]), []
        if len(stated["values"]) != len(case.quantities):
            raise TumbleError(f"{len(stated['values'])} values instead of {len(case.quantities)}")
        arrays = _arrays(self._archive.read(f"{case.name}.npz")) if stated["motion_sha256"] else {}
        faults = [
            f"{name} of its motion have another hash than stated"
            for name in sorted({*arrays, *stated["motion_sha256"]})
            if name not in arrays or _hash(arrays[name]) != stated["motion_sha256"].get(name)
        ]
        values = _values(case, arrays, stated, faults)
        result = {**stated, "status": "measured", "values": values, "compliant": self.compliant, "note": stated["reason"]}
        result["steps"] = case.scene().steps
        outcome = judged(self.name, case, result)
        for quantity, value, claim in zip(case.quantities, values, stated["values"]):
            unit = max(quantity.tolerance, abs(quantity.value))
            if (value is None) != (claim is None) or (value is not None and not abs(value - claim) <= AGREEMENT * unit):
                faults.append(f"{quantity.name} is {value} {quantity.unit}, not {claim} as stated")
        if outcome.verdict != stated["verdict"]:
            faults.append(f"it is {outcome.verdict}, not {stated['verdict']} as stated")
        return outcome, faults


def _values(case: Case, arrays: Mapping[str, Floats], stated: Mapping[str, Any], faults: list[str]) -> list[float | None]:
    """Values of the answers and gradients from the motion. An engine's own derivatives stay as they are stated."""
    scene, values = case.scene(), list[float]()
    if case.answers:
        states = arrays["states"]
        if states.shape != (scene.steps + 1, len(scene.free), 13):
            raise TumbleError(f"its motion has the shape {states.shape}")
        # Single precision has seven digits.
        if not np.allclose(states[0], scene.states, rtol=1e-5, atol=1e-5):
            faults.append("its motion does not begin at the start of the case")
        values = case.measure(scene, states)
    for place, (gradient, method) in enumerate(zip(case.gradients, stated["methods"], strict=True)):
        own = method == "own"
        values.append(stated["values"][len(case.answers) + place] if own else difference(arrays[f"ends_{place}"], gradient))
    return [value if value is not None and np.isfinite(value) else None for value in values]
