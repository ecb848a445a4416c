"""One engine on one case, in a process of its own: ``python -m tumble.bench._worker ENGINE CASE OUT``.

The result is JSON in the file OUT. A process without a result has crashed.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from ._case import Case, load_case
from ._differences import derivative
from .engines import Engine, Motion, Unsupported, engine


def result(name: str, path: Path) -> Dict[str, Any]:
    """Measured values, or the reason why there are none."""
    begin = time.perf_counter()
    try:
        found = engine(name)
    except ImportError as error:
        return {"status": "not installed", "reason": _line(error)}
    except StopIteration:
        return {"status": "not installed", "reason": "this build of the package does not have it"}
    case = load_case(path)
    facts = {"version": found.version(), "settings": found.settings, "compliant": found.compliant}
    try:
        measured = measure(found, case)
    except Unsupported as error:
        return {**facts, "status": "not modelled", "reason": _line(error)}
    except Exception as error:  # An engine may raise anything; the table tells what.
        return {**facts, "status": "error", "reason": f"{type(error).__name__}: {_line(error)}"}
    return {**facts, **measured, "process_seconds": time.perf_counter() - begin}


def measure(found: Engine, case: Case) -> Dict[str, Any]:
    """Runs a case and measures its answers and gradients."""
    scene = case.scene()
    values: List[float] = []
    motion = Motion(np.empty(0), 0.0)
    if case.answers:
        motion = found.run(scene)
        values = case.measure(scene, motion.states)
    methods = []
    for gradient in case.gradients:
        value, method = derivative(found, case, gradient)
        values.append(value)
        methods.append(method)
    return {
        "status": "measured",
        "values": [value if np.isfinite(value) else None for value in values],
        "methods": methods,
        "seconds": motion.seconds if case.answers else None,
        "steps": scene.steps,
        "note": motion.note,
    }


def _line(error: BaseException) -> str:
    """First line of an error's message, shortened."""
    text = (str(error).strip() or type(error).__name__).splitlines()[0]
    return text if len(text) <= 200 else text[:199] + "…"


if __name__ == "__main__":
    _, name, path, out = sys.argv
    Path(out).write_text(json.dumps(result(name, Path(path))))
