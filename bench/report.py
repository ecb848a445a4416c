"""Results: storage, tables and files."""

import datetime
import json
import os
import platform
import shlex
import statistics
import sys
from argparse import Namespace
from pathlib import Path

import bare
import heaps
import local
import several_report
from engines.base import Engine
from scene import Scene
from tables import NOTHING, length, table

# Reference engines of the ratios: the first for slow engines, the second for the others.
TUTORIAL, MUJOCO = "tutorial (CasADi, Ipopt)", "MuJoCo elliptic"
COMMON_HEADS = ["not converged", "certificate: contact law, m/s", "certificate: whole, m/s"]


class Results:
    """Times and figures of all engines."""

    def __init__(self, chosen: Namespace, left_out: dict[str, str]) -> None:
        self.left_out = left_out
        self.about = {
            "date": datetime.date.today().isoformat(),
            "command": shlex.join(["scripts/bench", *sys.argv[1:]]),
            "rounds": chosen.rounds,
            "machine": machine(),
            "load_at_start": os.getloadavg()[0],
        }
        self.times: dict[str, dict[str, list[float]]] = {}
        self.measured: dict[str, dict[str, dict]] = {}
        # One entry per round.
        self.heaps: list[list[dict]] = []
        self.bare: list[list[dict]] = []
        self.begun = False

    def seconds(self, engine: Engine, scene: Scene) -> list[float]:
        """Times of an engine on a scene, one per round."""
        return self.times.setdefault(engine.name, {}).setdefault(scene.name, [])

    def figures(self, engine: Engine) -> dict[str, dict]:
        """Figures of an engine by scene."""
        return self.measured.setdefault(engine.name, {})

    def finish(
        self,
        engines: list[Engine],
        drops: list[Scene],
        piles: list[Scene],
        counted: tuple[list[Scene], list[Scene]],
        problems: dict | None,
    ) -> None:
        """Stores the engines that finished, the timed scenes and the local problems' result."""
        self.engines = [engine for engine in engines if engine.name in self.measured]
        self.drops = drops
        self.piles, (self.growth, self.firsts), self.problems = piles, counted, problems
        self.about["load_at_end"] = os.getloadavg()[0]

    def keep(self, out: Path, line: dict) -> None:
        """Appends a line to OUT/rounds.jsonl, so that an interrupted comparison keeps its results.

        The first line of a comparison overwrites the file.
        """
        out.mkdir(parents=True, exist_ok=True)
        with (out / "rounds.jsonl").open("a" if self.begun else "w") as file:
            if not self.begun:
                file.write(json.dumps(self.about) + "\n")
            file.write(json.dumps(line) + "\n")
        self.begun = True

    def keep_round(self, out: Path, number: int) -> None:
        """Appends all times of a round."""
        seconds = {
            engine: {scene: times[-1] for scene, times in scenes.items() if len(times) == number}
            for engine, scenes in self.times.items()
        }
        self.keep(out, {"round": number, "seconds": seconds, "bare": self.bare[-1:]})

    def save(self, out: Path) -> None:
        """Writes OUT/results.json and OUT/results.md, each completely or not at all."""
        out.mkdir(parents=True, exist_ok=True)
        data = {
            **self.about,
            "settings": {engine.name: engine.settings for engine in self.engines},
            "left_out": self.left_out,
            "seconds": {engine.name: self.times.get(engine.name) for engine in self.engines},
            "figures": {engine.name: self.measured[engine.name] for engine in self.engines},
            "heaps": self.heaps,
            "local_problems": self.problems,
            "bare_problems": self.bare,
        }
        text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
        for name, content in (("results.json", text), ("results.md", self.markdown())):
            part = out / f"{name}.part"
            part.write_text(content)
            part.replace(out / name)
            print(f"wrote {out / name}")

    def markdown(self) -> str:
        """All tables."""
        machine = self.about["machine"]
        parts = [
            f"{self.about['date']}, `{self.about['command']}`, {machine['cpu']}, "
            f"{machine['cores']} cores, {machine['system']}; {self.about['rounds']} rounds; load "
            f"{self.about['load_at_start']:.2f} before, {self.about['load_at_end']:.2f} after.",
        ]
        for drop in self.drops:
            title = f"**drop, seed {drop.seed}** ({drop.steps} steps)"
            parts += [title, self.drop_table(drop)]
        if self.drops:
            parts += ["**rest, slide, incline**", self.others_table()]
        for pile in self.piles:
            parts += [several_report.title(pile), several_report.table_of(self, pile)]
            parts += [several_report.remarks(self, pile)]
        if self.growth:
            parts += ["**growth**: stacks of ten at rest", several_report.growth(self)]
        if self.firsts:
            parts += ["**first steps** of structures from no forces", several_report.firsts(self)]
        if self.heaps:
            parts += [f"**heaps** of {self.heaps[0][0]['count']} boxes, {heaps.STEPS} steps of 2 ms", heaps.tables(self.heaps)]
        if self.bare:
            parts += ["**bare problems**", bare.tables(self.bare)]
        if self.problems:
            parts += ["**local problems**", local.tables(self.problems)]
        lines = [f"- {engine.name}: {engine.settings}." for engine in self.engines]
        lines += [f"- left out: {name} ({why})." for name, why in self.left_out.items()]
        return "\n\n".join([*parts, "\n".join(lines)]) + "\n"

    def drop_table(self, drop: Scene) -> str:
        """Speed, penetration and certificates on the drop scene."""
        heads = ["µs a step", "× real time", "to the tutorial's", "to MuJoCo elliptic"]
        heads += ["deepest penetration", *COMMON_HEADS]
        rows = []
        for engine in self.engines:
            seconds = self.times.get(engine.name, {}).get(drop.name)
            if seconds is None:
                continue
            figures = self.measured[engine.name][drop.name]
            median = statistics.median(seconds)
            row = [f"{1e6 * median / drop.steps:.2f}", f"{drop.seconds / median:.2f}"]
            row += [self.ratio(seconds, TUTORIAL, drop) if engine.slow else NOTHING]
            row += [self.ratio(seconds, MUJOCO, drop) if not engine.slow else NOTHING]
            row += [length(figures["penetration_m"]), unsolved(figures), *certificates([figures])]
            rows.append([engine.name, *row])
        return table(heads, rows)

    def ratio(self, seconds: list[float], base: str, scene: Scene) -> str:
        """Median over the rounds of the ratio to an engine `base`."""
        bases = self.times.get(base, {}).get(scene.name, [])
        if len(bases) != len(seconds):
            return NOTHING
        return f"{statistics.median(a / b for a, b in zip(seconds, bases)):.3g}"

    def others_table(self) -> str:
        """Figures of the engines on the three quiet scenes."""
        heads = ["rest: drift", "rest: sink", "rest: energy, J", "slide: lift-off"]
        heads += ["slide: distance error", "incline: creep", "of it after 30 s"]
        heads += COMMON_HEADS
        rows = []
        for engine in self.engines:
            figures = self.measured[engine.name]
            if "rest" not in figures:
                continue
            rest, slide, incline = (figures[name] for name in ("rest", "slide", "incline"))
            row = [length(rest["drift_m"]), length(rest["sink_m"])]
            row += [f"{rest['kinetic_energy_J']:.1g}", length(slide["lift_off_m"])]
            row += [length(slide["distance_error_m"]), length(incline["creep_m"])]
            row += [length(incline["late_creep_m"]), unsolved(rest, slide, incline)]
            rows.append([engine.name, *row, *certificates([rest, slide, incline])])
        return table(heads, rows)


def certificates(figures: list[dict]) -> list[str]:
    """Worst certificates of some scenes: of the contact law, and of all of eq. 18."""
    if any(one["certificate_m_s"] is None for one in figures):
        return ["no forces", "no forces"]
    names = ("certificate_contact_m_s", "certificate_m_s")
    return [f"{max(one[name] for one in figures):.2g}" for name in names]


def unsolved(*figures: dict) -> str:
    """Total number of unsolved steps of some scenes."""
    counts = [one["unsolved"] for one in figures]
    return "not reported" if None in counts else str(sum(counts))


def machine() -> dict[str, str | int | None]:
    """Description of this machine."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), "")
    return {
        "cpu": model or platform.machine(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
    }
