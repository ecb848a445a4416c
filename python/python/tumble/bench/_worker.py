"""One engine on several cases: ``python -m tumble.bench._worker ENGINE FOLDER LIMIT CASE...``.

The engine is imported once. Each case then has a process of its own, forked from this one, with a time limit. Its result
is a JSON file in FOLDER, named by the case; the name is printed when it is there.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._case import Case, load_case
from ._differences import derivative
from .engines import Engine, Motion, Unsupported, engine


def work(name: str, folder: Path, limit: float, cases: Sequence[Path]) -> None:
    """Runs an engine on cases."""
    try:
        engine(name)
    except (ImportError, StopIteration) as error:
        reason = _line(error) if isinstance(error, ImportError) else "this build of the package does not have it"
        for path in cases:
            _leave(folder, path, {"status": "not installed", "reason": reason})
        return
    fork = "fork" in multiprocessing.get_all_start_methods()
    multiprocessing.set_start_method("fork" if fork else "spawn")
    for path in cases:
        child = multiprocessing.Process(target=_child, args=(name, folder, path))
        child.start()
        child.join(limit)
        if child.is_alive():
            child.kill()
            child.join()
            _leave(folder, path, {"status": "time limit", "reason": f"stopped after {limit:g} s"})
        elif child.exitcode != 0:
            _leave(folder, path, {"status": "crash", "reason": f"exit code {child.exitcode}"})
        else:
            print(path.stem, flush=True)


def _child(name: str, folder: Path, path: Path) -> None:
    _leave(folder, path, result(engine(name), path), announce=False)


def _leave(folder: Path, path: Path, found: dict[str, Any], announce: bool = True) -> None:
    (folder / f"{path.stem}.json").write_text(json.dumps(found))
    if announce:
        print(path.stem, flush=True)


def result(found: Engine, path: Path) -> dict[str, Any]:
    """Measured values, or the reason why there are none."""
    begin = time.perf_counter()
    case = load_case(path)
    facts = {"version": found.version(), "settings": found.settings, "compliant": found.compliant}
    try:
        measured = measure(found, case)
    except Unsupported as error:
        return {**facts, "status": "not modelled", "reason": _line(error)}
    except Exception as error:  # An engine may raise anything; the table tells what.
        return {**facts, "status": "error", "reason": f"{type(error).__name__}: {_line(error)}"}
    return {**facts, **measured, "process_seconds": time.perf_counter() - begin}


def measure(found: Engine, case: Case) -> dict[str, Any]:
    """Runs a case and measures its answers and gradients."""
    scene = case.scene()
    values: list[float] = []
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
    work(sys.argv[1], Path(sys.argv[2]), float(sys.argv[3]), [Path(path) for path in sys.argv[4:]])
