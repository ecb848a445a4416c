"""Long runs of the drop scene in one process, with statistics of the steps and of the memory.

python bench/soak.py [NATIVE_STEPS [IPOPT_STEPS]]
python bench/soak.py seeds FIRST END

``scripts/soak`` runs it; ``docs/soak.md`` has its results.
"""

from __future__ import annotations

import gc
import sys
import time
from collections import Counter
from pathlib import Path

import tumble

THROW = 999
"""Steps of a throw: the scene has 1000 rows."""
ALLOWED = 4096
"""Allowed growth of memory after the warm-up, KiB; the allocators of C and Python vary by this much."""


class Throws:
    """Throws one after another: their numbers of steps by status, and the largest residual."""

    def __init__(self, solver: str) -> None:
        self.solver = solver
        self.statuses: Counter[str] = Counter()
        self.worst = (0.0, 0, 0)

    @property
    def steps(self) -> int:
        return sum(self.statuses.values())

    def throw(self, seed: int, steps: int = THROW) -> None:
        run = tumble.drop(seed, solver=self.solver).run(steps)
        self.statuses.update(tumble.Status(status).name.lower() for status in run.status[:steps])
        k = int(run.residuals[:steps].argmax())
        self.worst = max(self.worst, (float(run.residuals[k]), seed, k))

    def __str__(self) -> str:
        counts = ", ".join(f"{name} {count}" for name, count in sorted(self.statuses.items()))
        residual, seed, k = self.worst
        return f"{self.solver}, {self.steps} steps: {counts}; largest residual {residual:.1e} m/s (seed {seed}, k = {k})"


def resident() -> int:
    """Resident memory, KiB: VmRSS of Linux."""
    gc.collect()
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:"))


def soak(solver: str, most: int) -> int:
    """Throws with the seeds 0, 1, …, `most` steps in all. Returns the growth of the memory after the first two, KiB."""
    throws, begin = Throws(solver), time.perf_counter()
    memory, seed = [resident()], 0
    while throws.steps < most:
        throws.throw(seed, min(THROW, most - throws.steps))
        seed += 1
        memory.append(resident())
    tenths = [memory[len(memory) * k // 10] for k in range(10)]
    grown = memory[-1] - memory[min(2, len(memory) - 1)]
    print(f"{throws}\n{seed} throws in {time.perf_counter() - begin:.1f} s; memory, KiB, at each tenth: {tenths}, at the end {memory[-1]}")
    print(f"growth after two throws: {grown} KiB", flush=True)
    return grown


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["seeds"] and len(arguments) == 3:
        throws = Throws("native")
        for seed in range(int(arguments[1]), int(arguments[2])):
            throws.throw(seed)
        print(throws)
        return 0
    if len(arguments) > 2 or not all(argument.isdecimal() for argument in arguments):
        print("usage: soak [NATIVE_STEPS [IPOPT_STEPS]] | soak seeds FIRST END", file=sys.stderr)
        return 2
    native, ipopt = [*map(int, arguments), 100_000, 10_000][:2] if len(arguments) != 1 else (int(arguments[0]), 10_000)
    grown = [soak("native", native), soak("ipopt", ipopt)]
    if max(grown) > ALLOWED:
        print(f"soak: memory grew by more than {ALLOWED} KiB", file=sys.stderr)
    return int(max(grown) > ALLOWED)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
