"""tumble and other engines on the same scenes: timed in rounds, measured, printed and saved.

Every round runs every engine on every timed scene in turn and is saved at its end. The tables
show medians over the rounds, and ratios are computed within each round. The motion of each engine
is recorded in a separate run without timing.
"""

import sys

import arguments
import bare
import engines
import heaps
import local
import report
import scene
from engines.base import Engine, Unavailable
from metrics import measure
from several import measure_several

# The scheduler disturbs runs of a few milliseconds, so a round uses the fastest of several short
# runs.
REPEATS, REPEAT_SECONDS = 25, 0.3
SEVERAL = ("stack", "pyramid", "wall", "pile")
# Numbers of boxes and of steps; fewer steps for more boxes.
GROWTH = [(n, max(60, min(500, 20_000 // n))) for n in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)]


# Structures whose first step is timed.
FIRST = [scene.wall(15, 20), scene.wall(25, 40), scene.pyramid(15), scene.pyramid(24)]


class Field:
    """Participating engines, and the engines left out or failed with the reason."""

    def __init__(self, names: list[str]) -> None:
        self.engines: list[Engine] = []
        self.left_out: dict[str, str] = {}
        self.failed = False
        for name in names:
            try:
                self.engines += engines.load(name)
            except Unavailable as reason:
                self.leave_out(name, str(reason))

    def leave_out(self, name: str, reason: str) -> None:
        self.left_out[name] = reason
        print(f"left out: {name} ({reason})", flush=True)

    def each(self, work, scenes: list[scene.Scene], what: str) -> None:
        """Calls `work(engine, scene)` for all; an engine that fails is removed."""
        for place in scenes:
            for engine in list(self.engines):
                if not engine.runs(place):
                    continue
                try:
                    work(engine, place)
                # A foreign library may raise any exception; the other engines continue.
                except Exception as error:
                    self.engines.remove(engine)
                    self.failed = True
                    self.leave_out(engine.name, f"{what} {place.name}: {error}")


def main() -> int:
    chosen = arguments.parse()
    drops = [scene.drop(seed) for seed in chosen.seeds] if "one" in chosen.scenes else []
    quiet = ("rest", "slide", "incline") if "one" in chosen.scenes else ()
    others = [scene.load(name) for name in quiet]
    piles = [scene.several(name) for name in SEVERAL] if "several" in chosen.scenes else []
    growth = [scene.stacks(*size) for size in GROWTH] if "growth" in chosen.scenes else []
    firsts = FIRST if "first" in chosen.scenes else []
    field = Field(chosen.engines)
    results = report.Results(chosen, field.left_out)

    def time(engine: Engine, place: scene.Scene) -> None:
        results.seconds(engine, place).append(fastest(engine, place))

    def record(engine: Engine, place: scene.Scene) -> None:
        look = measure if place.kind == "one" else measure_several
        results.figures(engine)[place.name] = look(place, engine.record(place))

    def weigh(engine: Engine, place: scene.Scene) -> None:
        results.figures(engine)[place.name] = {"memory_kib": engine.memory(place)}

    if not field.engines:
        print("bench: no engine can be run", file=sys.stderr)
        return 1
    for number in range(chosen.rounds):
        print(f"round {number + 1} of {chosen.rounds}", flush=True)
        field.each(time, drops + piles + growth + firsts, "timing")
        if "heaps" in chosen.scenes:
            asked = (chosen.heap_seeds, chosen.heap_boxes, chosen.engines)
            results.heaps.append(heaps.run(*asked, lambda one: results.keep(chosen.out, one)))
        if chosen.problems:
            results.bare.append(bare.run(chosen.problems, field.left_out))
        results.keep_round(chosen.out, number + 1)
    print("recording", flush=True)
    field.each(record, drops + others + piles, "recording")
    field.each(weigh, growth + firsts, "weighing")
    problems = local.compare() if "local" in chosen.scenes else None

    results.finish(field.engines, drops, piles, (growth, firsts), problems)
    print(results.markdown())
    results.save(chosen.out)
    return int(field.failed)


def fastest(engine: Engine, place: scene.Scene) -> float:
    """Time of one run (s), or the fastest of several runs if one is very short."""
    seconds = [engine.time(place)]
    while len(seconds) < REPEATS and sum(seconds) < REPEAT_SECONDS:
        seconds.append(engine.time(place))
    return min(seconds)


if __name__ == "__main__":
    sys.exit(main())
