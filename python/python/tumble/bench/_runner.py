"""Processes of the benchmark: a worker for each engine, which forks one for each case."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from .._tumble import TumbleError
from ._case import Case
from ._verdict import Outcome, judged
from ._worker import LOADED

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
LOADING = 600.0
"""Longest time that an engine may take to be imported, s."""


@dataclass(frozen=True)
class Report:
    """Outcomes of all engines and cases."""

    engines: dict[str, dict[str, Any]]
    """Version, settings and kind of contacts of each engine, or the reason why it is not installed."""
    cases: list[Case]
    outcomes: dict[str, dict[str, Outcome]]
    """By engine, then by case."""


def run(
    engines: Sequence[str],
    cases: Sequence[Case],
    *,
    pythons: Mapping[str, str],
    limit: float,
    total: float,
    jobs: int,
    progress: Callable[[Outcome], None] = lambda outcome: None,
    finished: Callable[[Report, str], None] = lambda report, name: None,
    adapters: Mapping[str, Path] = MappingProxyType({}),
    keep: Path | None = None,
) -> Report:
    """Runs every engine on every case.

    :param pythons: interpreter of an engine, by default this one.
    :param limit: time limit of a case, s.
    :param total: time limit of all cases of an engine, s.
    :param jobs: number of engines at a time.
    :param finished: called with the report when an engine of this name has run all cases.
    :param adapters: file of an engine outside the package.
    :param keep: folder for the motions, ENGINE/CASE.npz.
    """
    outcomes: dict[str, dict[str, Outcome]] = {name: {} for name in engines}
    about: dict[str, dict[str, Any]] = {name: {} for name in engines}
    report = Report(about, list(cases), outcomes)

    def one(name: str) -> None:
        python, folder = pythons.get(name, sys.executable), None if keep is None else keep / name
        for case, result in _results(name, cases, python, (limit, total), adapters.get(name), folder):
            if "version" in result:
                about[name] = {key: result[key] for key in ("version", "settings", "compliant")}
            elif result["status"] == "not installed":
                about[name] = {"missing": result["reason"]}
            outcomes[name][case.name] = judged(name, case, result)
            progress(outcomes[name][case.name])
        if "version" in about[name]:
            finished(report, name)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(one, engines))
    return report


def _results(
    name: str,
    cases: Sequence[Case],
    python: str,
    limits: tuple[float, float],
    adapter: Path | None,
    keep: Path | None,
) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Results of the cases of an engine, each as soon as it is there."""
    with tempfile.TemporaryDirectory() as folder:
        options = [] if adapter is None else ["--adapter", str(adapter)]
        if keep is not None:
            options.append("--keep")
            keep.mkdir(parents=True)
        paths = [case.path for case in cases]
        command = [python, "-m", f"{__package__}._worker", *options, name, folder, *map(str, limits), *paths]
        # One thread a process: the order of additions, and with it the last digits, stay the same.
        environment = {**os.environ, **{variable: "1" for variable in ONE_THREAD}}
        waiting = {case.name: case for case in cases}

        def taken(case: Case) -> tuple[Case, dict[str, Any]]:
            motion = Path(folder) / f"{case.name}.npz"
            if keep is not None and motion.is_file():
                shutil.move(motion, keep / motion.name)
            return case, json.loads((Path(folder) / f"{case.name}.json").read_text())

        with open(Path(folder) / "errors.txt", "w+", encoding="utf-8", errors="replace") as errors:
            try:
                worker = subprocess.Popen(
                    command, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True, errors="replace"
                )
            except OSError as error:
                for case in cases:
                    yield case, {"status": "not installed", "reason": f"{python} does not start: {error.strerror}"}
                return
            hung = threading.Event()

            def stop() -> None:
                hung.set()
                worker.kill()

            loading = threading.Timer(LOADING, stop)
            loading.start()
            with worker:
                # Engines print too.
                for line in map(str.strip, worker.stdout or ()):
                    if line == LOADED:
                        loading.cancel()
                    elif line in waiting:
                        yield taken(waiting.pop(line))
                    if not waiting:
                        break
            loading.cancel()
            errors.seek(0)
            said = errors.read().strip().splitlines()
        failure = {"status": "crash", "reason": f"exit code {worker.returncode}" + (f": {said[-1][:200]}" if said else "")}
        if hung.is_set():
            failure = {"status": "time limit", "reason": f"it did not load in {LOADING:g} s"}
        for case in waiting.values():
            yield case, failure


def adapter_names(path: Path, python: str) -> list[str]:
    """Names of the engines of an adapter outside the package, read by a process of its own.

    :raises TumbleError: if the file does not load.
    """
    command = [python, "-m", f"{__package__}._worker", "--adapter", str(path), "--names"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, timeout=LOADING)
    except subprocess.TimeoutExpired:
        raise TumbleError(f"--adapter {path} does not load in {LOADING:g} s") from None
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise TumbleError(f"--adapter {path} does not load: {said[-1].removeprefix('tumble._tumble.TumbleError: ')}")
    names: list[str] = json.loads(done.stdout.strip().splitlines()[-1])
    return names
