"""Command line of the contact benchmark."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from .._tumble import TumbleError
from ._case import Case, all_cases, chosen
from ._report import summary, write
from ._runner import run
from ._verdict import RIGHT, VERDICTS, WRONG, Outcome
from .engines import MODULES

DESCRIPTION = """Runs cases of rigid contact with known answers on all engines that are installed.

Each engine and case has a process of its own with a time limit. A verdict is one of:
"""
EPILOG = """examples:
  python -m tumble.bench --out results
  python -m tumble.bench --engines tumble,mujoco --cases 'incline-*'
  python -m tumble.bench --python drake-sap=/venv/bin/python --engines drake-sap
  python -m tumble.bench --folder my-cases --engines tumble

The exit code is 0 if the benchmark ran, whatever the verdicts are, 1 with --strict if a case is not right, and 2 for
bad input. docs/benchmark.md describes cases and tables.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        cases = all_cases(options.folder)
        names = chosen([case.name for case in cases], _listed(options.cases), "case")
        engines = chosen(list(MODULES), _listed(options.engines), "engine")
        if options.list:
            _print_lists(cases, engines, names)
            return 0
        pythons = _pythons(options.python)
        if not options.limit > 0.0 or options.jobs < 1:
            raise TumbleError("--limit and --jobs need positive numbers")
        selected = [case for case in cases if case.name in names]
        total, done = len(selected) * len(engines), 0

        def progress(outcome: Outcome) -> None:
            nonlocal done
            done += 1
            if not options.quiet:
                print(f"{done:4d}/{total} {outcome.engine:14} {outcome.case:24} {_said(outcome)}", file=sys.stderr)

        begin = time.perf_counter()
        report = run(
            engines, selected, pythons=pythons, limit=options.limit, jobs=options.jobs, progress=progress
        )
        print(summary(report))
        if options.out is not None:
            for path in write(report, options.out, time.perf_counter() - begin):
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
    add("--limit", type=float, default=120.0, metavar="S", help="time limit of a case, s (default: 120)")
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


def _pythons(given: Sequence[str]) -> dict[str, str]:
    found = {}
    for entry in given:
        names, equals, path = entry.partition("=")
        if not equals or not path:
            raise TumbleError(f"--python {entry}: ENGINE=PATH is needed")
        for name in chosen(list(MODULES), [names], "engine"):
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
