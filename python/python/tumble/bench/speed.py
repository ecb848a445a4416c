"""Section on speed of the contact benchmark: ``python -m tumble.bench.speed``.

Every round runs every engine on every scene in turn, so that other work on the machine disturbs all alike. The tables have
medians over the rounds, and ratios are computed within each round. Overlaps and energies are those of one more run.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np

from .._files import written
from .._tumble import TumbleError
from .._types import Floats
from . import _timed
from ._case import chosen
from ._measures import Measures
from ._report import Rows, machine, table
from ._scene import Scene
from ._solids import matrix_of
from ._timed import Timed
from .engines import MODULES, Engine, Unsupported, engine

BASE = "mujoco-default"
"""Reference of the ratios."""
USUAL = f"tumble,tumble-1e-6,tumble-ipopt,{BASE},drake-sap,rapier,rapier-default,pybullet,dart,dart-exact,tutorial"
# The scheduler disturbs runs of a few milliseconds: a round uses the fastest of several short runs.
REPEATS, REPEAT_SECONDS = 25, 0.3
SAMPLES = 100
"""Number of states in which overlaps of bodies are computed."""
GROUPS: dict[str, Callable[[argparse.Namespace], list[Timed]]] = {
    "one": lambda options: [_timed.drop(seed) for seed in options.seeds],
    "several": lambda _: [_timed.stack(), _timed.pyramid(), _timed.wall(), _timed.pile()],
    "growth": lambda _: [_timed.stacks(count) for count in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)],
    "first": lambda _: _timed.first_steps(),
    "heaps": lambda options: _timed.heaps(options.heap_seeds, options.heap_boxes),
}
WEIGHED = ("growth", "first")
"""Groups whose memory is measured."""

Key = tuple[str, str]
"""Names of a scene and an engine."""


class Comparison:
    """Times and figures of engines on scenes."""

    def __init__(self, engines: Sequence[Engine], out: Path) -> None:
        self.engines, self.out = list(engines), out
        self.times: dict[Key, list[float]] = {}
        self.figures: dict[Key, dict[str, float]] = {}
        self.left_out: dict[str, str] = {}

    def each(self, scenes: Sequence[Timed], work: Callable[[Engine, Timed], None]) -> None:
        """Calls ``work`` for all engines and scenes. An engine that fails is left out."""
        for timed in scenes:
            for found in list(self.engines):
                if found.most_bodies is not None and len(timed.scene.free) > found.most_bodies:
                    continue
                try:
                    work(found, timed)
                except Unsupported:
                    continue
                except Exception as error:  # An engine may raise anything; the others go on.
                    self.engines.remove(found)
                    self.left_out[found.name] = f"{timed.name}: {error}"

    def time(self, found: Engine, timed: Timed) -> None:
        """Adds the time of a round, s, which is kept also if the comparison is interrupted."""
        seconds = [found.time(timed.scene, timed.before)]
        while len(seconds) < REPEATS and sum(seconds) < REPEAT_SECONDS:
            seconds.append(found.time(timed.scene, timed.before))
        self.times.setdefault((timed.name, found.name), []).append(min(seconds))
        with (self.out / "rounds.jsonl").open("a") as file:
            file.write(json.dumps({"scene": timed.name, "engine": found.name, "seconds": min(seconds)}) + "\n")

    def record(self, found: Engine, timed: Timed) -> None:
        """Measures the motion of an engine."""
        motion = found.run(timed.scene)
        self.figures[timed.name, found.name] = {
            "slowest step, ms": 1e3 * motion.slowest,
            **figures(timed.scene, motion.states),
            **motion.facts,
        }

    def weigh(self, found: Engine, timed: Timed) -> None:
        """Measures the memory of an engine."""
        self.figures[timed.name, found.name] = {"memory, MiB": found.memory(timed.scene, timed.before) / 1024}

    def ratios(self, timed: Timed, name: str) -> list[float]:
        """Times of an engine by those of the reference in the same round."""
        base = self.times.get((timed.name, BASE), [])
        return [own / other for own, other in zip(self.times[timed.name, name], base)]

    def rows(self, scenes: Sequence[Timed]) -> Rows:
        """Table of a group: a row for each scene and engine."""
        keys = [(timed, found.name) for timed in scenes for found in self.engines if (timed.name, found.name) in self.times]
        heads = dict.fromkeys(head for timed, name in keys for head in self.figures.get((timed.name, name), {}))
        rows = [["scene", "engine", "µs a step", f"to {BASE}", *heads]]
        for timed, name in keys:
            own = self.figures.get((timed.name, name), {})
            steps = timed.scene.steps - timed.before
            numbers = [1e6 * median(self.times[timed.name, name]) / steps]
            numbers += [median(self.ratios(timed, name) or [np.nan]), *(own.get(head, np.nan) for head in heads)]
            rows.append([timed.name, name, *("–" if np.isnan(number) else f"{number:.3g}" for number in numbers)])
        return rows

    def spreads(self, scenes: Sequence[Timed]) -> list[str]:
        """Lines with the range of the ratios of each engine over the scenes of a group."""
        lines = []
        for found in self.engines:
            values = [median(ratios) for timed in scenes if (timed.name, found.name) in self.times and (ratios := self.ratios(timed, found.name))]
            if values and found.name != BASE:
                lines.append(f"- {found.name}: {min(values):.3g} to {max(values):.3g} of the time of {BASE}, {mean(values):.3g} on average.")
        return lines


def figures(scene: Scene, states: Floats) -> dict[str, float]:
    """Overlaps (m), the longest way of a body (m), the kinetic energy at the end and the largest rise of the energy (J)."""
    if not np.isfinite(states).all():
        raise RuntimeError("the motion is not finite")
    measures = Measures(scene, states)
    samples = np.unique(np.linspace(0, len(states) - 1, SAMPLES).round().astype(int))
    below = measures.depth("*") if scene.ground else np.zeros(len(states))
    overlaps = [max(0.0, float(below[sample]), deepest_overlap(scene, states[sample])) for sample in samples]
    energy = measures.energy()
    masses, moments = (np.array([getattr(body, name) for body in scene.free]) for name in ("mass", "inertia"))
    kinetic = 0.5 * (masses @ (states[-1, :, 7:10] ** 2).sum(axis=1) + (moments * states[-1, :, 10:] ** 2).sum())
    return {
        "deepest overlap, m": max(max(overlaps), float(below.max())),
        "overlap at the end, m": overlaps[-1],
        "moved, m": float(np.linalg.norm(states[-1, :, :3] - states[0, :, :3], axis=1).max()),
        "kinetic energy at the end, J": float(kinetic),
        "energy rise, J": float((energy - np.minimum.accumulate(energy)).max()),
    }


def deepest_overlap(scene: Scene, states: Floats) -> float:
    """Largest overlap of two boxes, m, by separating axes: 3 + 3 face normals and 9 products of edges.

    Along a unit axis the overlap is the sum of both half widths Σ |a·e_i| s_i minus the distance of the centres. The depth is
    the minimum over the axes.
    """
    fixed = [body.state for body in scene.bodies if body.fixed]
    places = np.concatenate([states, np.array(fixed).reshape(-1, 13)])
    halves, turns, centres = np.array([body.size for body in scene.bodies]), matrix_of(places[:, 3:7]), places[:, :3]
    reach = np.linalg.norm(halves, axis=1)
    first, second = np.triu_indices(len(places), k=1)
    near = np.linalg.norm(centres[second] - centres[first], axis=1) < reach[first] + reach[second]
    near &= first < len(states)
    first, second = first[near], second[near]
    if len(first) == 0:
        return 0.0
    a, b = turns[first], turns[second]
    # The columns are the axes of a box. Products of parallel edges are not valid axes.
    edges = np.cross(a[:, :, :, None], b[:, :, None, :], axis=1).reshape(len(first), 3, 9)
    axes = np.concatenate((a, b, edges), axis=2)
    lengths = np.linalg.norm(axes, axis=1)
    usable = lengths > 1e-6
    axes = axes / np.where(usable, lengths, 1.0)[:, None, :]
    widths = sum(
        np.einsum("pij,pi->pj", np.abs(np.einsum("pki,pkj->pij", turn, axes)), half)
        for turn, half in ((a, halves[first]), (b, halves[second]))
    )
    apart = np.abs(np.einsum("pi,pij->pj", centres[second] - centres[first], axes))
    return float(np.where(usable, widths - apart, np.inf).min(axis=1).max())


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        groups = chosen(list(GROUPS), options.scenes.split(","), "group of scenes")
        names = chosen(list(MODULES), options.engines.split(","), "engine")
        if options.list:
            print("\n".join(names))
            return 0
        if min(options.rounds, options.heap_boxes) < 1:
            raise TumbleError("--rounds and --heap-boxes need positive numbers")
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "rounds.jsonl").write_text("")
        comparison = Comparison([], options.out)
        for name in names:
            try:
                comparison.engines.append(engine(name))
            except (ImportError, StopIteration) as error:
                comparison.left_out[name] = str(error) or "this build of the package does not have it"
        scenes = {group: GROUPS[group](options) for group in groups}
        load = os.getloadavg()[0]
        for number in range(options.rounds):
            print(f"round {number + 1} of {options.rounds}", file=sys.stderr, flush=True)
            comparison.each([timed for own in scenes.values() for timed in own], comparison.time)
        for group, own in scenes.items():
            comparison.each(own, comparison.weigh if group in WEIGHED else comparison.record)
        head = f"{date.today()}, {machine()}; {options.rounds} rounds; load {load:.2f} before, {os.getloadavg()[0]:.2f} after."
        text = _markdown(comparison, scenes, head)
        print(text)
        data = {"about": head, "left_out": comparison.left_out, "seconds": _nested(comparison.times), "figures": _nested(comparison.figures)}
        for name, content in (("speed.md", text), ("speed.json", json.dumps(data, indent=1, ensure_ascii=False))):
            print(f"wrote {written(options.out / name, (content + chr(10)).encode())}")
    except (TumbleError, OSError) as error:
        print(f"tumble.bench.speed: {error}", file=sys.stderr)
        return 2
    return 0


def _markdown(comparison: Comparison, scenes: dict[str, list[Timed]], head: str) -> str:
    parts = [head]
    for group, own in scenes.items():
        parts += [f"**{group}**", table(comparison.rows(own))]
        spreads = comparison.spreads(own)
        parts += ["\n".join(spreads)] if spreads else []
    lines = [f"- {found.name} {found.version()}: {found.settings}." for found in comparison.engines]
    lines += [f"- left out: {name} ({why})." for name, why in comparison.left_out.items()]
    return "\n\n".join([*parts, "\n".join(lines)])


def _nested(values: dict[Key, Any]) -> dict[str, dict[str, Any]]:
    """Values by scene, then by engine."""
    found: dict[str, dict[str, Any]] = {}
    for (scene, name), value in values.items():
        found.setdefault(scene, {})[name] = value
    return found


def _numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tumble.bench.speed", description="Times engines on the same scenes.")
    add = parser.add_argument
    add("--scenes", default="*", metavar="NAMES", help=f"of {', '.join(GROUPS)}, separated by commas (default: all)")
    add("--engines", default=USUAL, metavar="NAMES", help=f"names or patterns with *, separated by commas (default: {USUAL})")
    add("--seeds", type=_numbers, default=[42, 0], metavar="LIST", help="of the thrown cube (default: 42,0)")
    add("--heap-seeds", type=_numbers, default=[1, 2, 3], metavar="LIST", help="of the heaps (default: 1,2,3)")
    add("--heap-boxes", type=int, default=100, metavar="N", help="boxes of a heap (default: 100)")
    add("--rounds", type=int, default=3, metavar="N", help="rounds of timing (default: 3)")
    add("--list", action="store_true", help="print the chosen engines, and run nothing")
    add("--out", type=Path, default=Path("target/bench"), metavar="DIR", help="folder of speed.md, speed.json and rounds.jsonl")
    return parser


if __name__ == "__main__":
    sys.exit(main())
