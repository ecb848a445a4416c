"""Command line of the contact benchmark."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from .._tumble import TumbleError
from ._case import Case, all_cases, chosen
from ._report import facts, summary, write
from ._runner import Report, adapter_names, run
from ._submission import submitted
from ._verdict import RIGHT, VERDICTS, WRONG, Outcome
from .engines import MODULES

DESCRIPTION = """Runs cases of rigid contact with known answers on all engines that are installed.

Each engine and case has a process of its own with a limit of processor time, so a crash or an endless loop ends one case.
An engine that is not installed is a line with the reason. A verdict is one of:
"""
EPILOG = """examples:
  python -m tumble.bench --out results
  python -m tumble.bench --engines tumble,mujoco --cases 'incline-*'
  python -m tumble.bench --python drake-sap=/venv/bin/python --engines drake-sap
  python -m tumble.bench --folder my-cases --engines tumble
  python -m tumble.bench --template > my_engine.py
  python -m tumble.bench --adapter my_engine.py --engines my-engine --submit results

The exit code is 0 if the benchmark ran, whatever the verdicts are, 1 with --strict if a case is not right, and 2 for
bad input. docs/benchmark.md describes cases and tables, docs/howto/bench-adapter.md adapters.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        if options.template:
            print(files(__package__).joinpath("template.py").read_text(encoding="utf-8"), end="")
            return 0
        if not min(options.limit, options.total, options.jobs) > 0:
            raise TumbleError("--limit, --total and --jobs need positive numbers")
        cases = all_cases(options.folder)
        names = chosen([case.name for case in cases], _listed(options.cases), "case")
        adapters = _adapters(options.adapter)
        engines = chosen([*MODULES, *adapters], _listed(options.engines), "engine")
        if options.list:
            _print_lists(cases, engines, names)
            return 0
        pythons = _pythons(options.python, engines)
        for target in filter(None, (options.out, options.submit)):
            target.mkdir(parents=True, exist_ok=True)
        selected = [case for case in cases if case.name in names]
        total, done = len(selected) * len(engines), 0

        def progress(outcome: Outcome) -> None:
            nonlocal done
            done += 1
            if not options.quiet:
                print(f"{done:4d}/{total} {outcome.engine:14} {outcome.case:24} {_said(outcome)}", file=sys.stderr)

        def finished(report: Report, name: str) -> None:
            if options.submit is not None:
                about = facts(time.perf_counter() - begin)
                print(f"wrote {submitted(report, name, Path(folder), options.submit, adapters.get(name), about)}")

        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            report = run(
                engines,
                selected,
                pythons=pythons,
                limit=options.limit,
                total=options.total,
                jobs=options.jobs,
                progress=progress,
                finished=finished,
                adapters=adapters,
                keep=None if options.submit is None else Path(folder),
            )
        print(summary(report))
        for path in [] if options.out is None else write(report, options.out, time.perf_counter() - begin):
            print(f"wrote {path}")
    except (TumbleError, OSError) as error:
        print(f"tumble.bench: {error}", file=sys.stderr)
        return 2
    wrong = any(one.verdict != RIGHT for row in report.outcomes.values() for one in row.values())
    return 1 if options.strict and wrong else 0


def _parser() -> argparse.ArgumentParser:
    meanings = "".join(f"  {name:14} {meaning}\n" for name, meaning in VERDICTS.items())
    parser = argparse.ArgumentParser(
        prog="python -m tumble.bench",
        description=DESCRIPTION + meanings,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--engines", default="*", metavar="NAMES", help="names or patterns with *, separated by commas (default: all)")
    add("--cases", default="*", metavar="NAMES", help="names or patterns with *, separated by commas (default: all)")
    add("--folder", type=Path, metavar="DIR", help="folder with more case files")
    add("--list", action="store_true", help="print engines and cases, and run nothing")
    add("--out", type=Path, metavar="DIR", help="write bench.md, bench.json and bench.html to this folder")
    add("--adapter", action="append", default=[], type=Path, metavar="FILE", help="file of an engine of one's own (repeatable)")
    add("--template", action="store_true", help="print an adapter to begin with, and run nothing")
    add("--submit", type=Path, metavar="DIR", help="write a result file with all motions for each engine, DIR/ENGINE.zip")
    add("--limit", type=float, default=120.0, metavar="S", help="processor time of a case, s (default: 120)")
    add("--total", type=float, default=3600.0, metavar="S", help="processor time of all cases of an engine, s (default: 3600)")
    add("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="engines at a time (default: all cores)")
    add(
        "--python",
        action="append",
        default=[],
        metavar="ENGINE=PATH",
        help="interpreter for an engine whose packages are elsewhere; it needs tumble too (repeatable)",
    )
    add("--strict", action="store_true", help="exit with 1 if a case is not right")
    add("--quiet", action="store_true", help="print no line for each case")
    return parser


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _adapters(paths: Sequence[Path]) -> dict[str, Path]:
    """File of each engine outside the package."""
    found: dict[str, Path] = {}
    for path in map(Path.absolute, paths):
        for name in adapter_names(path, sys.executable):
            if name in MODULES or name in found:
                raise TumbleError(f"--adapter {path}: there is already an engine {name}; change its name")
            found[name] = path
    return found


def _pythons(given: Sequence[str], engines: Sequence[str]) -> dict[str, str]:
    found = {}
    for entry in given:
        names, equals, path = entry.partition("=")
        if not equals or not path:
            raise TumbleError(f"--python {entry}: ENGINE=PATH is needed")
        for name in chosen([*MODULES, *engines], [names], "engine"):
            found[name] = path
    return found


def _print_lists(cases: Sequence[Case], engines: Sequence[str], names: Sequence[str]) -> None:
    print("engines: " + ", ".join(engines))
    for case in cases:
        if case.name in names:
            print(f"{case.group:13} {case.name:24} {case.description}")


def _said(outcome: Outcome) -> str:
    if outcome.verdict == WRONG:
        wrong = [finding for finding in outcome.findings if finding.verdict == WRONG]
        worst = max(wrong, key=lambda finding: finding.error)
        return f"wrong: {worst.name} is {worst.measured!r} instead of {worst.expected:.6g} {worst.unit}"
    return f"{outcome.verdict}{': ' + outcome.reason if outcome.reason else ''}"


if __name__ == "__main__":
    sys.exit(main())
