"""Tables of a report as text, Markdown, JSON and a page."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from datetime import date
from pathlib import Path
from statistics import median
from typing import Any

from .._files import written
from .._tumble import __version__
from ._case import Answer
from ._page import page
from ._runner import Report
from ._verdict import RIGHT, VERDICTS, WRONG, YIELDS, Outcome, counted

Rows = list[list[str]]
RAN = "the run took"
MISSING = "not installed"
FAILED = ("error", "crash", "time limit", "not run")
SIGNS = {RIGHT: "✓", YIELDS: "~", "not modelled": "–", "not run": "·", "error": "error", "crash": "crash", "time limit": "time"}


def summary(report: Report) -> str:
    """Verdicts of each engine as a text table, and the reasons why others are not installed."""
    rows = [row[:-1] for row in engine_rows(report) if row[1] != MISSING]
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
    missing = [f"{name}: {MISSING}: {about['missing']}" for name, about in report.engines.items() if "missing" in about]
    return "\n".join(lines + missing)


def engine_rows(report: Report) -> Rows:
    """Table of engines: version, numbers of verdicts, time of a step, settings."""
    rows = [["engine", "version", RIGHT, YIELDS, WRONG, "not modelled", "failed", "µs a step", "settings"]]
    for name, about in report.engines.items():
        if "missing" in about:
            rows.append([name, MISSING, *["–"] * 6, about["missing"]])
            continue
        outcomes = list(report.outcomes[name].values())
        numbers = counted(outcomes)
        failed = sum(numbers[verdict] for verdict in FAILED)
        counts = [str(numbers[verdict]) for verdict in (RIGHT, YIELDS, WRONG, "not modelled")]
        speed = step_microseconds(outcomes)
        timed = "–" if speed is None else f"{speed:.3g}"
        rows.append([name, about.get("version", "–"), *counts, str(failed), timed, about.get("settings", "–")])
    return rows


def step_microseconds(outcomes: Sequence[Outcome]) -> float | None:
    """Median over the cases of the mean time of a step, µs."""
    times = [1e6 * one.seconds / one.steps for one in outcomes if one.seconds is not None and one.steps]
    return median(times) if times else None


def installed(report: Report) -> list[str]:
    """Engines that ran."""
    return [name for name, about in report.engines.items() if "missing" not in about]


def case_rows(report: Report) -> Rows:
    """Table of cases: a sign for each engine, or the largest error in tolerances."""
    names = installed(report)
    rows = [["case", *names]]
    for case in report.cases:
        rows.append([case.name, *(cell(report.outcomes[name][case.name]) for name in names)])
    return rows


def cell(outcome: Outcome) -> str:
    """Sign of an outcome; of a wrong one the largest error in tolerances."""
    if outcome.verdict != WRONG:
        return SIGNS[outcome.verdict]
    worst = max(finding.error for finding in outcome.findings if finding.verdict == WRONG)
    return f"✗ {_ratio(worst)}"


def _ratio(error: float) -> str:
    if error == float("inf"):
        return "no value"
    return f"{error:.2g}" if error < 100 else f"{error:.0e}".replace("e+0", "e").replace("e+", "e")


def finding_rows(report: Report, allowed: bool = False) -> Rows:
    """Table of answers: expected value, tolerance, and the measured values; only those with an allowance if ``allowed``."""
    names = installed(report)
    rows = [["case", "answer", "unit", "expected", "tolerance", "allowance", *names]]
    for case in report.cases:
        for place, quantity in enumerate(case.quantities):
            allowance = quantity.compliant if isinstance(quantity, Answer) else None
            if allowed and allowance is None:
                continue
            values = []
            for name in names:
                outcome = report.outcomes[name][case.name]
                values.append(_measured(outcome, place))
            limits = [f"{quantity.tolerance:.2g}", "–" if allowance is None else f"{allowance:.2g}"]
            rows.append([case.name, quantity.name, quantity.unit, f"{quantity.value:.6g}", *limits, *values])
    return rows


def _measured(outcome: Outcome, place: int) -> str:
    if not outcome.findings:
        return SIGNS[outcome.verdict]
    finding = outcome.findings[place]
    value = "none" if finding.measured is None else f"{finding.measured:.4g}"
    mark = " (d)" if finding.method == "differences" else ""
    return value + mark


def failure_rows(report: Report) -> Rows:
    """Table of outcomes without values, and of remarks."""
    rows = [["engine", "case", "verdict", "reason"]]
    for name in installed(report):
        for outcome in report.outcomes[name].values():
            if outcome.reason:
                rows.append([name, outcome.case, outcome.verdict, outcome.reason])
    return rows


def machine() -> str:
    """Processor and system of this machine."""
    return f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"


def facts(seconds: float, what: str = RAN) -> dict[str, str]:
    """Date, machine and duration of what was done."""
    return {
        "date": date.today().isoformat(),
        "machine": machine(),
        "python": platform.python_version(),
        "tumble": __version__,
        "duration": f"{what} {seconds:.0f} s",
    }


LEGEND = [
    f"{SIGNS[RIGHT]}: {VERDICTS[RIGHT]}.",
    f"{SIGNS[YIELDS]}: {VERDICTS[YIELDS]}.",
    f"✗ n: {VERDICTS[WRONG]}; n is the largest error in tolerances.",
    f"–: {VERDICTS['not modelled']}.",
    "(d): a derivative from central differences of runs; the others are the engine's own.",
]


def markdown(report: Report, about: dict[str, str]) -> str:
    """The report in Markdown."""
    parts = [
        f"# Contact benchmark, {about['date']}",
        f"tumble {about['tumble']}, Python {about['python']}, {about['machine']}; {about['duration']}.",
        "## Engines",
        table(engine_rows(report)),
        "## Cases",
        "\n".join(f"- {line}" for line in LEGEND),
        table(case_rows(report)),
        "## Compliant contacts",
        "Measured values of the answers for which compliant contacts have an allowance.",
        table(finding_rows(report, allowed=True)),
        "## All answers",
        table(finding_rows(report)),
        "## Failures and remarks",
        table(failure_rows(report)),
    ]
    return "\n\n".join(parts) + "\n"


def table(rows: Rows) -> str:
    """Table in Markdown; the first row has the heads."""
    lines = ["| " + " | ".join(value.replace("|", "\\|") for value in row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def data(report: Report, about: dict[str, str]) -> dict[str, Any]:
    """The report as data. ``accuracy`` is the same in every run on a machine; ``times`` are not."""
    accuracy: dict[str, Any] = {}
    times: dict[str, Any] = {}
    for name, outcomes in report.outcomes.items():
        accuracy[name], times[name] = {}, {}
        for case, outcome in outcomes.items():
            fields = asdict(outcome)
            times[name][case] = {key: fields.pop(key) for key in ("seconds", "process_seconds")}
            accuracy[name][case] = {key: fields[key] for key in ("verdict", "reason", "steps", "findings")}
    cases = {
        case.name: {
            "description": case.description,
            "group": case.group,
            "sources": sorted({quantity.source for quantity in case.quantities}),
        }
        for case in report.cases
    }
    return {"about": about, "engines": report.engines, "cases": cases, "accuracy": accuracy, "times": times}


def write(report: Report, folder: Path, seconds: float, what: str = RAN) -> list[Path]:
    """Writes bench.md, bench.json and bench.html to a folder and returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    about = facts(seconds, what)
    sections = [
        ("Engines", engine_rows(report)),
        ("Cases", case_rows(report)),
        ("Compliant contacts", finding_rows(report, allowed=True)),
        ("All answers", finding_rows(report)),
        ("Failures and remarks", failure_rows(report)),
    ]
    contents = {
        "bench.md": markdown(report, about),
        "bench.json": json.dumps(data(report, about), indent=1, ensure_ascii=False) + "\n",
        "bench.html": page(about, LEGEND, sections, report.cases),
    }
    return [written(folder / name, text.encode()) for name, text in contents.items()]
