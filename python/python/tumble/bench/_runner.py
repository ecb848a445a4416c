"""Processes of the benchmark: a worker for each engine, which forks one for each case."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ._case import Case
from ._verdict import Outcome, judged

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Report:
    """Outcomes of all engines and cases."""

    engines: dict[str, dict[str, str]]
    """Version and settings of each engine, or the reason why it is not installed."""
    cases: list[Case]
    outcomes: dict[str, dict[str, Outcome]]
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
    :param limit: time limit of a case, s.
    :param jobs: number of engines at a time.
    """
    outcomes: dict[str, dict[str, Outcome]] = {name: {} for name in engines}
    about: dict[str, dict[str, str]] = {name: {} for name in engines}

    def one(name: str) -> None:
        for case, result in _results(name, cases, pythons.get(name, sys.executable), limit):
            if "version" in result:
                about[name] = {"version": result["version"], "settings": result["settings"]}
            elif result["status"] == "not installed":
                about[name] = {"missing": result["reason"]}
            outcomes[name][case.name] = judged(name, case, result)
            progress(outcomes[name][case.name])

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(one, engines))
    return Report(about, list(cases), outcomes)


def _results(name: str, cases: Sequence[Case], python: str, limit: float) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Results of the cases of an engine, each as soon as it is there."""
    with tempfile.TemporaryDirectory() as folder:
        command = [python, "-m", f"{__package__}._worker", name, folder, str(limit), *(case.path for case in cases)]
        # One thread a process: the order of additions, and with it the last digits, stay the same.
        environment = {**os.environ, **{variable: "1" for variable in ONE_THREAD}}
        waiting = {case.name: case for case in cases}
        reason = ""
        with open(Path(folder) / "errors.txt", "w+", encoding="utf-8", errors="replace") as errors:
            try:
                worker = subprocess.Popen(
                    command, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True
                )
            except OSError as error:
                for case in cases:
                    yield case, {"status": "not installed", "reason": f"{python} does not start: {error.strerror}"}
                return
            with worker:
                for line in worker.stdout or ():
                    # Engines print too.
                    case_done = waiting.pop(line.strip(), None)
                    if case_done is not None:
                        yield case_done, json.loads((Path(folder) / f"{case_done.name}.json").read_text())
            errors.seek(0)
            said = errors.read().strip().splitlines()
            reason = f"exit code {worker.returncode}" + (f": {said[-1][:200]}" if said else "")
        for case in waiting.values():
            yield case, {"status": "crash", "reason": reason}
