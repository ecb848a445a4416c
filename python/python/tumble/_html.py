"""Parts of pages that need no network: tables, curves and strips as HTML and SVG."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import numpy as np

from ._types import Floats

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 80em; padding: 0 1em; color: #222; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; } h3 { font-size: 1em; margin: 1.2em 0 .2em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; }
th, td { border-bottom: 1px solid #ddd; padding: .25em .6em; text-align: left; white-space: nowrap; }
th { background: #f4f4f4; }
td:first-child { font-weight: 600; }
.right { background: #e3f3e3; } .yields { background: #fdf3d3; } .wrong { background: #f9dcdc; }
details { margin: .4em 0; } pre { background: #f6f6f6; padding: 1em; overflow-x: auto; }
td:last-child { white-space: normal; }
svg { display: block; font-size: 11px; max-width: 100%; } svg text { fill: #555; }
"""
_CLASSES = {"✓": "right", "~": "yields", "✗": "wrong"}
"""Class of a table's cell by its first letter."""
_COLOURS = ("#c0392b", "#2471a3")
_WIDTH, _HEIGHT, _MARGIN = 720, 140, 70
"""Size of a chart and the width of its scale, px."""
_LEAST = 1e-16
"""Least value of a logarithmic scale."""
_COLUMNS = 240
"""Most columns of a strip."""
_ROW = 16
"""Height of a strip, px."""
_SHADES = ("#eef3f7", "#f7e3a1", "#f0a35e", "#d9534f", "#7b1e3a")


def shown(line: str, gif: bytes) -> str:
    """A line of text and a picture below it, for notebooks."""
    data = b64encode(gif).decode()
    return f'<div>{escape(line)}</div><img alt="{escape(line, True)}" src="data:image/gif;base64,{data}">'


def document(title: str, body: Sequence[str]) -> str:
    """A page with the style of all reports."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    joined = "\n".join(body)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n{joined}\n</body></html>\n'


def table(rows: Sequence[Sequence[str]]) -> str:
    """Table with a head. Cells that begin with ✓, ~ or ✗ are coloured."""
    head = "".join(f"<th>{escape(value)}</th>" for value in rows[0])
    lines = ["<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows[1:]]
    return f'<div class="wide"><table><tr>{head}</tr>\n' + "\n".join(lines) + "</table></div>"


def legend(*names: str) -> str:
    """Names of the curves of a chart in their colours."""
    words = [f"<span style='color:{colour}'>{escape(name)}</span>" for name, colour in zip(names, _COLOURS)]
    return f"<p>{', '.join(words)}</p>"


def chart(title: str, times: Floats, values: Floats, logarithmic: bool = False) -> str:
    """Curves of the columns of ``values`` (K, C) over ``times`` (K,) in s, with a heading."""
    shown = np.log10(np.maximum(values, _LEAST)) if logarithmic else values
    title = f"{title}, log axis" if logarithmic else title
    finite = shown[np.isfinite(shown)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    span = max(high - low, 1e-300)
    across = _across(times)
    lines = []
    for column, colour in zip(shown.T, _COLOURS):
        points = " ".join(
            f"{_MARGIN + _WIDTH * x:.1f},{5 + _HEIGHT * (high - value) / span:.1f}"
            for x, value in zip(across, column)
            if np.isfinite(value)
        )
        lines.append(f"<polyline fill='none' stroke='{colour}' points='{points}'/>")
    for value, height in ((high, 12), (low, _HEIGHT + 4)):
        text = f"{10**value:.1e}" if logarithmic else f"{value:.4g}"
        lines.append(f"<text x='{_MARGIN - 6}' y='{height}' text-anchor='end'>{text}</text>")
    frame = f"<rect x='{_MARGIN}' y='5' width='{_WIDTH}' height='{_HEIGHT}' fill='none' stroke='#ccc'/>"
    return f"<h3>{escape(title)}</h3>{_svg(_HEIGHT + 26, [frame, *lines, *_ends(times, _HEIGHT + 20)])}"


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
            shade = 0 if largest[at] <= least else 1 + min(int(share * (len(_SHADES) - 1)), len(_SHADES) - 2)
            parts.append(
                f"<rect x='{at * width:.1f}' y='{top + 1}' width='{width + 0.3:.1f}' height='{_ROW - 2}' "
                f"fill='{_SHADES[shade]}'/>"
            )
    height = len(names) * _ROW
    return _svg(height + 18, [*parts, *_ends(times, height + 14, 0)], _WIDTH + 220)


def _across(times: Floats) -> Floats:
    """Times as shares of their range."""
    length = max(float(times[-1] - times[0]), 1e-300) if len(times) else 1.0
    shares: Floats = (times - times[0]) / length if len(times) else np.zeros(0)
    return shares


def _ends(times: Floats, height: int, left: int = _MARGIN) -> list[str]:
    """Labels of the first and the last time."""
    if not len(times):
        return []
    return [
        f"<text x='{left}' y='{height}'>{times[0]:.4g} s</text>",
        f"<text x='{left + _WIDTH}' y='{height}' text-anchor='end'>{times[-1]:.4g} s</text>",
    ]


def _svg(height: int, parts: Sequence[str], width: int = _WIDTH + _MARGIN + 10) -> str:
    return f"<svg viewBox='0 0 {width} {height}' width='{width}' height='{height}'>{''.join(parts)}</svg>"


def _cell(value: str) -> str:
    kind = _CLASSES.get(value[:1])
    return f'<td class="{kind}">{escape(value)}</td>' if kind else f"<td>{escape(value)}</td>"
