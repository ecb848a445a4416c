"""Processes of the benchmark: one for each engine and case, with a time limit."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Sequence

from ._case import Case
from ._verdict import Outcome, judged

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Report:
    """Outcomes of all engines and cases."""

    engines: Dict[str, Dict[str, str]]
    """Version and settings of each engine, or the reason why it is not installed."""
    cases: List[Case]
    outcomes: Dict[str, Dict[str, Outcome]]
    """By engine, then by case."""


def run(
    engines: Sequence[str],
    cases: Sequence[Case],
    *,
    pythons: Mapping[str, str],
    limit: float,
    jobs: int,
    progress: Callable[[Outcome], None] = lambda outcome: None,
) -> Report:
    """Runs every engine on every case.

    :param pythons: interpreter of an engine, by default this one.
    :param limit: time limit of a process, s.
    :param jobs: number of processes at a time.
    """
    about: Dict[str, Dict[str, str]] = {}
    outcomes: Dict[str, Dict[str, Outcome]] = {name: {} for name in engines}

    def one(name: str, case: Case) -> Outcome:
        result = _result(name, case, pythons.get(name, sys.executable), limit)
        if "version" in result:
            about[name] = {"version": result["version"], "settings": result["settings"]}
        outcome = judged(name, case, result)
        outcomes[name][case.name] = outcome
        progress(outcome)
        return outcome

    # The first case tells whether the engine is installed.
    with ThreadPoolExecutor(jobs) as pool:
        first = dict(zip(engines, pool.map(lambda name: one(name, cases[0]), engines)))
    missing = [name for name, outcome in first.items() if outcome.verdict == "not installed"]
    for name in missing:
        about[name] = {"missing": first[name].reason}
        for case in cases[1:]:
            outcomes[name][case.name] = Outcome(name, case.name, "not installed", first[name].reason)
    tasks = [(name, case) for case in cases[1:] for name in engines if name not in missing]
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(lambda task: one(*task), tasks))
    ordered = {name: {case.name: outcomes[name][case.name] for case in cases} for name in engines}
    return Report({name: about.get(name, {}) for name in engines}, list(cases), ordered)


def _result(name: str, case: Case, python: str, limit: float) -> Dict[str, Any]:
    """Result of a worker, or the way its process ended."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result.json"
        command = [python, "-m", f"{__package__}._worker", name, case.path, str(out)]
        # One thread a process: the order of additions, and with it the last digits, stay the same.
        environment = {**os.environ, **{variable: "1" for variable in ONE_THREAD}}
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=limit, check=False, cwd=folder
            )
        except subprocess.TimeoutExpired:
            return {"status": "time limit", "reason": f"stopped after {limit:g} s"}
        except OSError as error:
            return {"status": "not installed", "reason": f"{python} does not start: {error.strerror}"}
        if out.is_file():
            result: Dict[str, Any] = json.loads(out.read_text())
            return result
        said = done.stderr.strip().splitlines()
        reason = f"exit code {done.returncode}" + (f": {said[-1][:200]}" if said else "")
        return {"status": "crash", "reason": reason}
