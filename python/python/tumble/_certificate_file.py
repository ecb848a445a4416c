"""Files of step certificates: docs/reference/certificate-format.md."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ._certificate import PARTS, Certificate
from ._files import written
from ._measured_step import MeasuredStep
from ._problem import _groups
from ._tumble import TumbleError
from ._types import Location

FORMAT = "step-certificate 1"


def exported(path: Location, certificates: Iterable[Certificate], engine: str, about: str) -> Path:
    """Writes a header, and a line for each certificate."""
    lines = [json.dumps({"format": FORMAT, "engine": str(engine), "about": str(about)}, ensure_ascii=False)]
    for place, certificate in enumerate(certificates):
        if not isinstance(certificate, Certificate):
            raise TumbleError(f"certificates[{place}] is {type(certificate).__name__}; a Certificate is needed")
        lines.append(json.dumps(_line(certificate), ensure_ascii=False, allow_nan=False))
    return written(Path(os.fspath(path)), ("\n".join(lines) + "\n").encode())


def _line(certificate: Certificate) -> dict[str, Any]:
    step = certificate.measured()
    content = _matrices(step) if step.bodies is None else {"kind": "bodies", **step.bodies}
    return {
        **content,
        "time_step": step.time_step,
        "residuals": {part: getattr(certificate, part) for part in ("dynamics", *PARTS)},
        "notes": list(step.notes),
    }


def _matrices(step: MeasuredStep) -> dict[str, Any]:
    laws, names = _laws(step)
    return {
        "kind": "matrices",
        "mass": step.mass.tolist(),
        "rows": step.directions.tolist(),
        "velocity": step.before.tolist(),
        "velocity_after": step.after.tolist(),
        "force": step.force.tolist(),
        "impulses": step.impulses.tolist(),
        "offsets": step.offsets.tolist(),
        "lengths": step.lengths.tolist(),
        "dimension": step.dimension,
        "laws": laws,
        "names": names,
    }


def _laws(step: MeasuredStep) -> tuple[list[dict[str, Any]], list[str]]:
    """Laws and names. A group of row laws becomes one entry for each row."""
    laws: list[dict[str, Any]] = []
    names: list[str] = []
    first: list[int] = []
    for (friction, own), name in zip(_groups(step.laws), step.labels):
        first.append(len(laws))
        if friction is not None:
            laws.append({"law": "contact", "friction": friction})
        elif own[0][0] == "rolling":
            (_, contact, rolling), _, (_, _, torsional) = own
            laws.append({"law": "moment", "contact": first[int(contact)], "rolling": rolling, "torsional": torsional})
        else:
            for law, least, most in own:
                bounds = {"least": least, "most": most} if law == "box" else {}
                laws.append({"law": law, **{side: bound for side, bound in bounds.items() if np.isfinite(bound)}})
        names += [name] * (len(laws) - first[-1])
    return laws, names
