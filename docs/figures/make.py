"""Makes the figures of the concept pages from measured runs.

python docs/figures/make.py [NAME...]           writes docs/figures/NAME.svg, by default all of them
python docs/figures/make.py --check [NAME...]   makes them and names those that differ from the files

Needs the Python package, mujoco and matplotlib. Each file has the data of its curves as description, and the check
compares these data. The bytes of a file are no measure: layout and names within it depend on the last digit of a
coordinate, and another processor may round it differently.
"""

from __future__ import annotations

import json
import pathlib
import sys
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import contact
import matplotlib
import matplotlib.pyplot as plt
import motion
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path

FOLDER = pathlib.Path(__file__).resolve().parent
FIGURES: dict[str, Callable[[], Figure]] = {
    "hard-contact": contact.hard_contact,
    "certificate": contact.certificate,
    "selection-rule": contact.selection_rule,
    "hyperstatic-forces": contact.hyperstatic_forces,
    "time-step": motion.time_step,
    "joints-as-rows": motion.joints_as_rows,
    "unphysical-steps": motion.unphysical_steps,
    "determinism": motion.determinism,
}
STYLE: Any = {
    "svg.hashsalt": "tumble",
    "svg.fonttype": "path",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "savefig.facecolor": "white",
    "axes.formatter.use_mathtext": True,
}
ALLOWED = 0.002
"""Allowed difference of a coordinate, as a part of the axes: less than a point in the largest figure."""


def curves_of(axes: Axes) -> Any:
    """Text, limits and curves of axes. Points are in parts of the axes, and limits in units of the scale."""
    legend = axes.get_legend()
    texts = [*axes.texts, *(legend.get_texts() if legend else [])]
    limits = axes.transScale.transform(np.transpose([axes.get_xlim(), axes.get_ylim()]))
    curves = []
    for item in (*axes.lines, *axes.collections):
        if isinstance(item, Line2D):
            colour, path = item.get_color(), item.get_path()
        elif isinstance(item, PolyCollection):
            colour, path = item.get_facecolor()[0], Path.make_compound_path(*item.get_paths())
        else:
            raise TypeError(f"{type(item).__name__}: the check knows lines and filled areas")
        shape = item.get_transform() - axes.transAxes
        points = np.clip(shape.transform(path.vertices), -1.0, 2.0).round(4)
        curves.append({"colour": to_hex(colour), "points": points.tolist()})
    return {
        "text": [axes.get_title(), axes.get_xlabel(), axes.get_ylabel(), *(text.get_text() for text in texts)],
        "scale": [axes.get_xscale(), axes.get_yscale()],
        "limits": limits.tolist(),
        "curves": curves,
    }


def data_of(figure: Figure) -> Any:
    """Data of all axes of a figure, as in its file."""
    legends = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    return {"text": legends, "axes": [curves_of(axes) for axes in figure.axes]}


def made(name: str, path: pathlib.Path | None = None) -> Any:
    """Makes a figure and returns its data. With a path, it is written as SVG without a date."""
    with matplotlib.rc_context(STYLE):
        figure = FIGURES[name]()
        data = data_of(figure)
        if path:
            description = json.dumps(data, separators=(",", ":"))
            figure.savefig(path, metadata={"Date": None, "Creator": None, "Description": description})
        plt.close(figure)
    return data


def recorded(name: str) -> Any:
    """Data of the figure in the file."""
    description = ElementTree.parse(FOLDER / f"{name}.svg").find(".//{http://purl.org/dc/elements/1.1/}description")
    return None if description is None else json.loads(description.text or "null")


def near(one: Any, other: Any, size: Any = 1.0) -> bool:
    """True if two arrays differ by at most the allowed part of ``size``."""
    one, other = np.array(one), np.array(other)
    return one.shape == other.shape and bool(np.all(np.abs(one - other) <= ALLOWED * size))


def same_axes(one: Any, other: Any) -> bool:
    """True if two axes have the same text, and limits and curves at the same places."""
    low, high = np.array(one["limits"])
    return (
        [one["text"], one["scale"]] == [other["text"], other["scale"]]
        and near(one["limits"], other["limits"], np.abs(high - low))
        and [curve["colour"] for curve in one["curves"]] == [curve["colour"] for curve in other["curves"]]
        and all(near(a["points"], b["points"]) for a, b in zip(one["curves"], other["curves"]))
    )


def is_current(name: str) -> bool:
    """True if a figure's file has the curves that are made now."""
    file, now = recorded(name), made(name)
    return (
        file is not None
        and file["text"] == now["text"]
        and len(file["axes"]) == len(now["axes"])
        and all(same_axes(one, other) for one, other in zip(file["axes"], now["axes"]))
    )


def main() -> int:
    matplotlib.use("svg")
    is_check = sys.argv[1:2] == ["--check"]
    names = sys.argv[2:] if is_check else sys.argv[1:]
    if unknown := [name for name in names if name not in FIGURES]:
        print(f"no figure is called {', '.join(unknown)}; there are {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    names = names or list(FIGURES)
    if is_check:
        out = [name for name in names if not is_current(name)]
        print(f"out of date: {', '.join(out)}; run docs/figures/make.py" if out else f"up to date: {', '.join(names)}")
        return 1 if out else 0
    for name in names:
        path = FOLDER / f"{name}.svg"
        made(name, path)
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
