"""A page of a report that needs no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from ._case import Case

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 80em; padding: 0 1em; color: #222; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; }
th, td { border-bottom: 1px solid #ddd; padding: .25em .6em; text-align: left; white-space: nowrap; }
th { background: #f4f4f4; }
td:first-child { font-weight: 600; }
.right { background: #e3f3e3; } .yields { background: #fdf3d3; } .wrong { background: #f9dcdc; }
details { margin: .4em 0; } pre { background: #f6f6f6; padding: 1em; overflow-x: auto; }
td:last-child { white-space: normal; }
"""
CLASSES = {"✓": "right", "~": "yields", "✗": "wrong"}


def page(
    about: dict[str, str], legend: Sequence[str], sections: Sequence[tuple[str, list[list[str]]]], cases: Sequence[Case]
) -> str:
    """HTML of a report: its tables, then the files of the cases."""
    title = f"Contact benchmark, {about['date']}"
    facts = f"tumble {about['tumble']}, Python {about['python']}, {about['machine']}; the run took {about['duration']}."
    body = [f"<h1>{escape(title)}</h1>", f"<p>{escape(facts)}</p>"]
    body += ["<ul>", *(f"<li>{escape(line)}</li>" for line in legend), "</ul>"]
    for heading, rows in sections:
        body += [f"<h2>{escape(heading)}</h2>", _table(rows)]
    body.append("<h2>Case files</h2>")
    for case in cases:
        summary = f"<summary><b>{escape(case.name)}</b>: {escape(case.description)}</summary>"
        text = escape(Path(case.path).read_text(encoding="utf-8"))
        body.append(f"<details>{summary}<pre>{text}</pre></details>")
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    joined = "\n".join(body)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n{joined}\n</body></html>\n'


def _table(rows: list[list[str]]) -> str:
    head = "".join(f"<th>{escape(value)}</th>" for value in rows[0])
    lines = []
    for row in rows[1:]:
        lines.append("<tr>" + "".join(_cell(value) for value in row) + "</tr>")
    return f'<div class="wide"><table><tr>{head}</tr>\n' + "\n".join(lines) + "</table></div>"


def _cell(value: str) -> str:
    kind = CLASSES.get(value[:1])
    return f'<td class="{kind}">{escape(value)}</td>' if kind else f"<td>{escape(value)}</td>"
