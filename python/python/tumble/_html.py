"""Parts of pages that need no network: tables, curves and strips as HTML and SVG."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import numpy as np

from ._types import Floats

STYLE = """
:root { color-scheme: light dark; --page: #f4f6f8; --card: #fff; --ink: #1c2530; --faint: #5a6675; --line: #d5dce4; --grid: #e6eaef;
  --a: #c0392b; --b: #0b62a8; --right: #dff2e1; --yields: #fdf0cd; --wrong: #fadcdc;
  --s0: #e6edf3; --s1: #f7e3a1; --s2: #f0a35e; --s3: #d9534f; --s4: #7b1e3a; }
@media (prefers-color-scheme: dark) { :root { --page: #10151c; --card: #171e27; --ink: #dfe6ee; --faint: #9aa7b5;
  --line: #2e3947; --grid: #25303c; --a: #ff8a80; --b: #62b0f0; --right: #173a22; --yields: #40330f; --wrong: #4a1d20;
  --s0: #24303c; --s1: #6b5a1e; --s2: #a9682b; --s3: #dc5a55; --s4: #ffa3b8; } }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 0; color: var(--ink); background: var(--page); }
header, main { max-width: 82em; margin: 0 auto; padding: 12px 16px; }
h1 { font-size: 22px; margin: 0; } h2 { font-size: 17px; margin: 1.8em 0 .5em; }
h3 { font-size: 14px; margin: 1.2em 0 .2em; color: var(--faint); } a { color: var(--b); }
.wide, pre { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: 8px; width: fit-content; max-width: 100%; }
table { border-collapse: collapse; font-size: 13px; }
th, td { border-bottom: 1px solid var(--line); padding: .3em .6em; text-align: left; white-space: nowrap; }
tr:last-child td { border-bottom: 0; } th { color: var(--faint); } td:first-child { font-weight: 600; }
td.long { white-space: normal; min-width: 20em; }
.right { background: var(--right); } .yields { background: var(--yields); } .wrong { background: var(--wrong); }
details { margin: .6em 0; }
svg { display: block; font-size: 11px; min-width: 520px; max-width: 100%; height: auto; } svg text { fill: var(--faint); }
.grid { stroke: var(--grid); } .a, .b { fill: none; stroke-width: 1.4; } .a { stroke: var(--a); } .b { stroke: var(--b); }
p .a { color: var(--a); } p .b { color: var(--b); }
.s0 { fill: var(--s0); } .s1 { fill: var(--s1); } .s2 { fill: var(--s2); } .s3 { fill: var(--s3); } .s4 { fill: var(--s4); }
"""
_CLASSES = {"✓": "right", "~": "yields", "✗": "wrong"}
"""Class of a table's cell by its first letter."""
_CURVES = ("a", "b")
"""Classes of the curves of a chart."""
_TICKS = 4
"""Number of ticks of an axis, about."""
_LONG = 40
"""Length of a text that may be broken into lines."""
_WIDTH, _HEIGHT, _MARGIN = 720, 140, 70
"""Size of a chart and the width of its scale, px."""
_LEAST = 1e-16
"""Least value of a logarithmic scale."""
_COLUMNS = 240
"""Most columns of a strip."""
_ROW = 16
"""Height of a strip, px."""
_SHADES = 5
"""Number of the classes s0, s1 … of a strip's cells."""


def shown(line: str, gif: bytes) -> str:
    """A line of text and a picture below it, for notebooks."""
    data = b64encode(gif).decode()
    return f'<div>{escape(line)}</div><img alt="{escape(line, True)}" src="data:image/gif;base64,{data}">'


def document(title: str, body: Sequence[str]) -> str:
    """A page with the style of all reports, light or dark as the system is."""
    view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f'<meta charset="utf-8">{view}<title>{escape(title)}</title><style>{STYLE}</style>'
    top, joined = f"<header><h1>{escape(title)}</h1></header>", "\n".join(body)
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n{top}\n<main>\n{joined}\n</main></body></html>\n'
    )


def table(rows: Sequence[Sequence[str]]) -> str:
    """Table with a head. Cells that begin with ✓, ~ or ✗ are coloured."""
    head = "".join(f"<th scope='col'>{escape(value)}</th>" for value in rows[0])
    lines = ["<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows[1:]]
    return _wide(f"<table><tr>{head}</tr>\n" + "\n".join(lines) + "</table>", f"table of {rows[0][0]}")


def legend(*names: str) -> str:
    """Names of the curves of a chart in their colours."""
    words = [f"<span class='{curve}'>{escape(name)}</span>" for name, curve in zip(names, _CURVES)]
    return f"<p>{', '.join(words)}</p>"


def chart(title: str, times: Floats, values: Floats, logarithmic: bool = False) -> str:
    """Curves of the columns of ``values`` (K, C) over ``times`` (K,) in s, with a heading."""
    shown = np.log10(np.maximum(values, _LEAST)) if logarithmic else values
    title = f"{title}, log axis" if logarithmic else title
    finite = shown[np.isfinite(shown)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    if logarithmic:
        low, high = np.floor(low), np.ceil(high)
    span = max(high - low, 1e-300)
    across = _across(times)
    lines = []
    for value in _ticks(low, high, 1.0 if logarithmic else 0.0):
        height = 5 + _HEIGHT * (high - value) / span
        text = f"1e{value:.0f}" if logarithmic else f"{value:.4g}"
        lines.append(f"<path class='grid' d='M{_MARGIN} {height:.1f}h{_WIDTH}'/>")
        lines.append(f"<text x='{_MARGIN - 6}' y='{height + 4:.1f}' text-anchor='end'>{text}</text>")
    for column, curve in zip(shown.T, _CURVES):
        points = " ".join(
            f"{_MARGIN + _WIDTH * x:.1f},{5 + _HEIGHT * (high - value) / span:.1f}"
            for x, value in zip(across, column)
            if np.isfinite(value)
        )
        lines.append(f"<polyline class='{curve}' points='{points}'/>")
    return f"<h3>{escape(title)}</h3>{_svg(title, _HEIGHT + 26, [*lines, *_times(times, _HEIGHT + 20)])}"


def _ticks(low: float, high: float, least: float = 0.0) -> list[float]:
    """Round values from ``low`` to ``high``, with a distance of 1, 2 or 5 times a power of ten, at least ``least``."""
    if not high > low:
        return [low]
    rough = (high - low) / _TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = max(next((k * power for k in (1, 2, 5) if k * power >= rough), 10 * power), least)
    values = [float(step * k) for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]
    return values or [low, high]


def strips(names: Sequence[str], times: Floats, values: Floats, least: float, most: float) -> str:
    """A strip for each row of ``values`` (R, K) over ``times`` (K,), darker from ``least`` to ``most`` on a log scale."""
    count = max(1, min(_COLUMNS, len(times)))
    columns = np.minimum((np.arange(len(times)) * count) // max(len(times), 1), count - 1)
    parts, width = [], _WIDTH / count
    scale = np.log10(most / least)
    for place, (name, row) in enumerate(zip(names, values)):
        # A column of a strip shows its largest value.
        largest = np.full(count, -np.inf)
        np.maximum.at(largest, columns, np.where(np.isfinite(row), row, -np.inf))
        top = place * _ROW
        short = name if len(name) <= 28 else name[:27] + "…"
        parts.append(f"<text x='{_WIDTH + 6}' y='{top + 12}'>{escape(short)}<title>{escape(name)}</title></text>")
        for at in np.flatnonzero(np.isfinite(largest)):
            share = np.log10(max(largest[at], least) / least) / scale
            shade = 0 if largest[at] <= least else 1 + min(int(share * (_SHADES - 1)), _SHADES - 2)
            parts.append(
                f"<rect class='s{shade}' x='{at * width:.1f}' y='{top + 1}' width='{width + 0.3:.1f}' "
                f"height='{_ROW - 2}'/>"
            )
    height = len(names) * _ROW
    return _svg("strips over time", height + 18, [*parts, *_times(times, height + 14, 0)], _WIDTH + 220)


def _across(times: Floats) -> Floats:
    """Times as shares of their range."""
    length = max(float(times[-1] - times[0]), 1e-300) if len(times) else 1.0
    shares: Floats = (times - times[0]) / length if len(times) else np.zeros(0)
    return shares


def _times(times: Floats, height: int, left: int = _MARGIN) -> list[str]:
    """Labels of a time axis."""
    if not len(times):
        return []
    first, last = float(times[0]), float(times[-1])
    places = [(value, left + _WIDTH * (value - first) / max(last - first, 1e-300)) for value in _ticks(first, last)]
    return [f"<text x='{x:.1f}' y='{height}' text-anchor='middle'>{value:.4g} s</text>" for value, x in places]


def _wide(content: str, name: str) -> str:
    """Content that scrolls sideways where it does not fit, also by keys."""
    return f"<div class='wide' role='group' tabindex='0' aria-label='{escape(name, True)}'>{content}</div>"


def _svg(name: str, height: int, parts: Sequence[str], width: int = _WIDTH + _MARGIN + 30) -> str:
    size = f"viewBox='0 0 {width} {height}' width='{width}' height='{height}'"
    return _wide(f"<svg {size} role='img' aria-label='{escape(name, True)}'>{''.join(parts)}</svg>", f"chart: {name}")


def _cell(value: str) -> str:
    kind = _CLASSES.get(value[:1]) or ("long" if len(value) > _LONG else "")
    return f"<td class='{kind}'>{escape(value)}</td>" if kind else f"<td>{escape(value)}</td>"
