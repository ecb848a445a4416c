"""Makes the figures of the concept pages from measured runs.

python docs/figures/make.py [NAME...]      writes docs/figures/NAME.svg, by default all of them
python docs/figures/make.py --check        makes all and names those that differ from the files

Needs the Python package, mujoco and matplotlib. The same versions write the same bytes. The check allows
differences of one point, because another processor may round differently.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path
from typing import Any, Callable, Dict, List

import contact
import matplotlib
import matplotlib.pyplot as plt
import motion
from matplotlib.figure import Figure

FOLDER = Path(__file__).resolve().parent
FIGURES: Dict[str, Callable[[], Figure]] = {
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
NUMBER = re.compile(r"(?<![\w#.])-?\d+(?:\.\d+)?(?!\w)")


def write(name: str, folder: Path) -> Path:
    """Writes a figure as SVG without a date."""
    path = folder / f"{name}.svg"
    with matplotlib.rc_context(STYLE):
        figure = FIGURES[name]()
        figure.savefig(path, metadata={"Date": None, "Creator": None})
        plt.close(figure)
    return path


def same(one: str, other: str) -> bool:
    """True if two pictures have the same text and numbers that differ by at most one point."""
    if NUMBER.sub("", one) != NUMBER.sub("", other):
        return False
    numbers = zip(NUMBER.findall(one), NUMBER.findall(other))
    return all(abs(float(a) - float(b)) <= 1.0 for a, b in numbers)


def changed() -> List[str]:
    """Names of the figures whose files differ from what is made now."""
    with tempfile.TemporaryDirectory() as folder:
        texts = {name: write(name, Path(folder)).read_text() for name in FIGURES}
    return [name for name, text in texts.items() if not same((FOLDER / f"{name}.svg").read_text(), text)]


def main() -> int:
    matplotlib.use("svg")
    names = sys.argv[1:]
    if names == ["--check"]:
        out = changed()
        print(f"out of date: {', '.join(out)}; run docs/figures/make.py" if out else f"{len(FIGURES)} figures are up to date")
        return 1 if out else 0
    if unknown := [name for name in names if name not in FIGURES]:
        print(f"no figure is called {', '.join(unknown)}; there are {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    for name in names or FIGURES:
        print(write(name, FOLDER))
    return 0


if __name__ == "__main__":
    sys.exit(main())
