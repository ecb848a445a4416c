"""One engine on several cases: ``python -m tumble.bench._worker ENGINE FOLDER LIMIT TOTAL CASE...``.

The engine is imported once. Each case then has a process of its own, forked from this one. LIMIT is its processor time, so
that other work on the machine fails no case; a case that waits is stopped after ten times as long.
TOTAL is the processor time of all cases; those that are left after it are not run. The result of a case
is a JSON file in FOLDER, named by the case; the name is printed when it is there. With ``--keep`` there is also a file
with the motion, CASE.npz. ``--adapter FILE --names`` prints the names of the engines of a file.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._types import Floats
from ._case import Case, load_case
from ._differences import derivative
from .engines import Engine, Motion, Unsupported, adapter_engines, engine

PATIENCE = 10.0
"""Largest duration of a case, in limits of its processor time."""
LOADED = "tumble.bench: the engine is loaded"
"""Line that is printed when the engine is imported."""


class Task(NamedTuple):
    """Engine, and the folder of its results."""

    name: str
    adapter: Path | None
    """File of an engine outside the package."""
    folder: Path
    keep: bool
    """True if motions are written too."""


def work(task: Task, limit: float, total: float, cases: Sequence[Path]) -> None:
    """Runs an engine on cases."""
    folder = task.folder
    try:
        engine(task.name, task.adapter)
    except (ImportError, StopIteration) as error:
        reason = _line(error) if isinstance(error, ImportError) else "this build of the package does not have it"
        for path in cases:
            _leave(folder, path, {"status": "not installed", "reason": reason})
        return
    print(LOADED, flush=True)
    fork = "fork" in multiprocessing.get_all_start_methods()
    multiprocessing.set_start_method("fork" if fork else "spawn")
    for path in cases:
        if sum(os.times()[:4]) > total:
            _leave(folder, path, {"status": "not run", "reason": f"the cases before it took {total:g} s"})
            continue
        child = multiprocessing.Process(target=_child, args=(task, path))
        child.start()
        if not _ended(child, limit):
            child.kill()
            child.join()
            _leave(folder, path, {"status": "time limit", "reason": f"stopped after {limit:g} s"})
        elif child.exitcode != 0:
            _leave(folder, path, {"status": "crash", "reason": f"exit code {child.exitcode}"})
        else:
            _announce(path)


def _ended(child: multiprocessing.Process, limit: float) -> bool:
    """Waits for a process, and tells whether it ended within ``limit`` s of processor time and ``PATIENCE`` times as long.

    Timers of processor time in the child itself would make its stopwatches coarse. Without /proc the limit is of wall time.
    """
    status = Path(f"/proc/{child.pid}/stat")
    last = time.monotonic() + limit * (PATIENCE if status.is_file() else 1.0)
    while time.monotonic() < last:
        child.join(min(0.05, limit))
        if not child.is_alive():
            return True
        with contextlib.suppress(OSError):
            # The name of the program may have spaces; after it, user and system time are the fields 11 and 12, in ticks.
            fields = status.read_text().rpartition(")")[2].split()
            if (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > limit:
                return False
    return False


def _child(task: Task, path: Path) -> None:
    arrays: dict[str, Floats] = {}
    found = result(engine(task.name, task.adapter), path, arrays)
    if task.keep and arrays:
        np.savez_compressed(task.folder / f"{path.stem}.npz", **arrays)  # type: ignore[arg-type]
    _leave(task.folder, path, found, announce=False)


def _leave(folder: Path, path: Path, found: dict[str, Any], announce: bool = True) -> None:
    (folder / f"{path.stem}.json").write_text(json.dumps(found))
    if announce:
        _announce(path)


def _announce(path: Path) -> None:
    # The line of an engine may have no end.
    print(f"\n{path.stem}", flush=True)


def result(found: Engine, path: Path, arrays: dict[str, Floats] | None = None) -> dict[str, Any]:
    """Measured values, or the reason why there are none. ``arrays`` gets the motions behind the values."""
    begin = time.perf_counter()
    case = load_case(path)
    facts = {"version": found.version(), "settings": found.settings, "compliant": found.compliant}
    try:
        measured = measure(found, case, arrays)
    except Unsupported as error:
        return {**facts, "status": "not modelled", "reason": _line(error)}
    except Exception as error:  # An engine may raise anything; the table tells what.
        return {**facts, "status": "error", "reason": f"{type(error).__name__}: {_line(error)}"}
    return {**facts, **measured, "process_seconds": time.perf_counter() - begin}


def measure(found: Engine, case: Case, arrays: dict[str, Floats] | None = None) -> dict[str, Any]:
    """Runs a case and measures its answers and gradients.

    ``arrays`` gets the motion as ``states``, and the end states of the differences of the n-th gradient as ``ends_n``.
    """
    scene = case.scene()
    values: list[float] = []
    arrays = {} if arrays is None else arrays
    motion = Motion(np.empty(0), 0.0)
    if case.answers:
        motion = found.run(scene)
        shape = (scene.steps + 1, len(scene.free), 13)
        if np.shape(motion.states) != shape:
            raise RuntimeError(f"the motion has states of the shape {np.shape(motion.states)}; {shape} is needed")
        arrays["states"] = motion.states
        values = case.measure(scene, motion.states)
    methods = []
    for place, gradient in enumerate(case.gradients):
        value, method, ends = derivative(found, case, gradient)
        if ends is not None:
            arrays[f"ends_{place}"] = ends
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


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(prog="python -m tumble.bench._worker")
    parser.add_argument("engine", nargs="?")
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("limit", nargs="?", type=float)
    parser.add_argument("total", nargs="?", type=float)
    parser.add_argument("cases", nargs="*", type=Path)
    parser.add_argument("--adapter", type=Path)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--names", action="store_true")
    given = parser.parse_args()
    if given.names:
        print("\n" + json.dumps([one.name for one in adapter_engines(given.adapter)]))
    else:
        work(Task(given.engine, given.adapter, given.folder, given.keep), given.limit, given.total, given.cases)


if __name__ == "__main__":
    main()
