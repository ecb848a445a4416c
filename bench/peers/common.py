"""What the programs that solve local problems share: reading them, timing, writing answers."""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# A solver gets so many tries at a problem, the fastest counts, or fewer if they take long.
TRIES, LONG_SECONDS = 5, 0.5
ROUNDING = 1e-12


@dataclass(frozen=True)
class Problem:
    """u = W p + q for n contacts, each with components (normal, tangents); SI units."""

    step: int
    seconds: float  # of tumble's own step
    w: np.ndarray  # 3n×3n
    q: np.ndarray  # 3n
    mu: np.ndarray  # n
    start: np.ndarray  # 3n: impulses of the step before

    @property
    def contacts(self) -> int:
        return len(self.mu)


def read(path: Path) -> list[Problem]:
    """The problems of a file that examples/local_problems.rs or examples/bare_problems.rs wrote."""
    data, at, problems = path.read_bytes(), 0, []
    while at < len(data):
        n, step = (int(value) for value in np.frombuffer(data, "<u8", 2, at))
        count = 1 + 9 * n * n + 3 * n + n + 3 * n
        numbers = np.frombuffer(data, "<f8", count, at + 16)
        at += 16 + 8 * count
        seconds, w, q, mu, start = np.split(
            numbers, np.cumsum([1, 9 * n * n, 3 * n, n])
        )
        w = w.reshape(3 * n, 3 * n)
        # What is symmetric but for rounding is made so; matrices of other programs stay as they are.
        if np.abs(w - w.T).max() <= ROUNDING * np.abs(w).max():
            w = (w + w.T) / 2
        problems.append(Problem(step, float(seconds[0]), w, q, mu, start))
    return problems


def answer(name: str, solve, problems: list[Problem]) -> list[dict]:
    """The times and impulses of `solve(problem, start) → (work, impulses)`, cold and warm, where
    `work()` is what is timed and `impulses(its value)` the answer."""
    answers = []
    for index, problem in enumerate(problems):
        for start_name, start in (("cold", np.zeros_like(problem.q)), ("warm", problem.start)):
            seconds, spent, solution = float("inf"), 0.0, None
            for _ in range(TRIES):
                work, impulses = solve(problem, start)
                clock = time.process_time()
                value = work()
                taken = time.process_time() - clock
                solution = impulses(value)
                seconds, spent = min(seconds, taken), spent + taken
                if spent > LONG_SECONDS:
                    break
            answers.append(
                {
                    "solver": name,
                    "problem": index,
                    "start": start_name,
                    "seconds": seconds,
                    "impulses": np.asarray(solution).tolist(),
                }
            )
    return answers


def main(solvers: dict) -> None:
    """Reads the file that is the argument, writes the answers as JSON to standard output."""
    problems = read(Path(sys.argv[1]))
    answers = []
    for name, solve in solvers.items():
        answers += answer(name, solve, problems)
    json.dump(answers, sys.stdout)
