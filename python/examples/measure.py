"""Benchmark for the numbers of docs/python.md: interleaved runs, the fastest of some rounds.

python python/examples/measure.py
"""

from __future__ import annotations

import copy
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from operator import itemgetter
from pathlib import Path

import numpy as np
import tumble

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
ROUNDS = 7
ROLLOUTS, STEPS = 400, 500
READ = 200
"""Number of steps whose contacts are read."""
READ_ALL = itemgetter("body", "partner", "point", "normal", "force", "slip")


def seconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def stepped(simulation: tumble.Simulation, read: Callable[[], object]) -> None:
    for _ in range(READ):
        simulation.step()
        read()


def memory() -> int:
    """Peak memory so far, KiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main() -> None:
    scene = tumble.drop()
    starts = np.concatenate([tumble.drop(seed).states for seed in range(ROLLOUTS)])
    starts[:, 2] = 1.8

    def batch() -> None:
        tumble.rollout(scene, starts, steps=STEPS, threads=1)

    def runs() -> None:
        for start in starts:
            scene.simulate(start).run(STEPS, contacts=False)

    def steps() -> None:
        for start in starts[:40]:
            simulation = scene.simulate(start)
            for _ in range(STEPS):
                simulation.step()

    count = ROLLOUTS * STEPS
    cases = [("rollout, 1 thread", batch, count), ("run", runs, count), ("step", steps, count // 10)]
    fastest = {name: float("inf") for name, *_ in cases}
    for _ in range(ROUNDS):
        for name, work, _ in cases:
            fastest[name] = min(fastest[name], seconds(work))
    for name, _, number in cases:
        print(f"{name:<18}{fastest[name] / number * 1e6:7.3f} µs a step")

    # Time to read contacts in the loop, relative to the step itself.
    sliding = {"box": [0.3, 0.3, 0.2], "mass": 1.0, "position": [0, 0, 0.1], "velocity": [900, 0, 0]}
    scenes = {"sliding box": tumble.Scene([sliding], {"friction": 0.05})}
    scenes.update((name, tumble.load(SCENARIOS / f"{name}.toml")) for name in ("stack", "pile"))
    for name, of in scenes.items():
        begun = of.simulate()
        begun.run(300, contacts=False)
        simulation = begun
        reads: list[Callable[[], object]] = [
            lambda: None,
            lambda: simulation.contacts["force"],
            lambda: READ_ALL(simulation.contacts),
        ]
        loops = [float("inf")] * len(reads)
        for _ in range(ROUNDS):
            for place, read in enumerate(reads):
                simulation = copy.copy(begun)
                loops[place] = min(loops[place], seconds(lambda: stepped(simulation, read)))
        step, one, some = loops
        print(
            f"{name}, {len(simulation.contacts['body'])} contacts: {step / READ * 1e6:.0f} µs a step; with "
            f"their forces {one / step:.3f}, with pairs, places, normals and slips too {some / step:.3f} times as long"
        )

    code = "import time; t = time.perf_counter(); import tumble; print(time.perf_counter() - t)"
    imports = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(ROUNDS)]
    print(f"import tumble     {min(imports) * 1e3:7.1f} ms")

    simulation = scene.simulate()
    for _ in range(10_000):
        simulation.step()
    before = memory()
    for _ in range(1_000_000):
        simulation.step()
    print(f"memory after 10⁶ more steps: {memory() - before:+d} KiB")


if __name__ == "__main__":
    main()
