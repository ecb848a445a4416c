"""A page of a report that needs no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from .._html import document, table
from ._case import Case


def page(
    about: dict[str, str], legend: Sequence[str], sections: Sequence[tuple[str, list[list[str]]]], cases: Sequence[Case]
) -> str:
    """HTML of a report: its tables, then the files of the cases."""
    title = f"Contact benchmark, {about['date']}"
    facts = f"tumble {about['tumble']}, Python {about['python']}, {about['machine']}; {about['duration']}."
    body = [f"<p>{escape(facts)}</p>"]
    body += ["<ul>", *(f"<li>{escape(line)}</li>" for line in legend), "</ul>"]
    for heading, rows in sections:
        body += [f"<h2>{escape(heading)}</h2>", table(rows)]
    body.append("<h2>Case files</h2>")
    for case in cases:
        summary = f"<summary><b>{escape(case.name)}</b>: {escape(case.description)}</summary>"
        text = escape(Path(case.path).read_text(encoding="utf-8"))
        body.append(f"<details>{summary}<pre tabindex='0'>{text}</pre></details>")
    return document(title, body)
