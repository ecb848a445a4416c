"""Judges result files of the contact benchmark again: ``python -m tumble.bench.check RESULT...``."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from .._tumble import TumbleError
from ._case import all_cases
from ._report import summary, write
from ._runner import Report
from ._submission import Result
from ._verdict import Outcome

DESCRIPTION = """Judges result files of python -m tumble.bench --submit again, from their motions and the cases of this package.

Every answer is computed anew and compared with the stated one. Own derivatives of an engine have no motion and stay as stated.
"""
EPILOG = """examples:
  python -m tumble.bench.check my-engine.zip
  python -m tumble.bench.check rows/*.zip --out page

The exit code is 0 if all files agree with their motions, 1 if one does not, and 2 for bad input.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    options = _parser().parse_args(arguments)
    begin = time.perf_counter()
    try:
        cases = all_cases(options.folder)
        results = _named([Result(path) for path in options.results])
        outcomes: dict[str, dict[str, Outcome]] = {name: {} for name in results}
        count = 0
        for name, result in results.items():
            for case in cases:
                outcomes[name][case.name], faults = result.judged(case)
                count += len(faults)
                for fault in faults:
                    print(f"{result.path}: {case.name}: {fault}")
            for unknown in sorted(result.cases.keys() - {case.name for case in cases}):
                count += 1
                print(f"{result.path}: {unknown}: there is no such case here; give its folder by --folder")
        report = Report({name: result.engine for name, result in results.items()}, cases, outcomes)
        print(summary(report))
        if options.out is not None:
            for path in write(report, options.out, time.perf_counter() - begin, "judged again in"):
                print(f"wrote {path}")
    except (TumbleError, OSError) as error:
        print(f"tumble.bench.check: {error}", file=sys.stderr)
        return 2
    print(f"{count} statements do not agree with their motions" if count else "all statements agree with their motions")
    return 1 if count else 0


def _named(results: Sequence[Result]) -> dict[str, Result]:
    """Results by engine, and by engine and version where one engine has several."""
    counts = Counter(result.name for result in results)
    named = {result.name if counts[result.name] == 1 else f"{result.name} {result.engine['version']}": result for result in results}
    if len(named) < len(results):
        raise TumbleError("two results have the same engine and version; rename one in its adapter")
    return named


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tumble.bench.check",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULT", help="result file of --submit")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="folder with more case files")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write a page with all rows to this folder, as tumble.bench does")
    return parser


if __name__ == "__main__":
    sys.exit(main())
