"""Common parts of the programs that solve local problems: reading, timing and output."""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Number of tries per problem, of which the fastest counts; fewer after LONG_SECONDS.
TRIES, LONG_SECONDS = 5, 0.5
ROUNDING = 1e-12


@dataclass(frozen=True)
class Problem:
    """Problem u = W p + q for n contacts, each with components (normal, tangents); SI units."""

    step: int
    seconds: float  # time of tumble's own step
    w: np.ndarray  # 3n×3n
    q: np.ndarray  # 3n
    mu: np.ndarray  # n
    start: np.ndarray  # 3n: impulses of the previous step

    @property
    def contacts(self) -> int:
        return len(self.mu)


def read(path: Path) -> list[Problem]:
    """Reads the problems in a file of local_problems or of problems.py."""
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
        # A matrix that is symmetric except for rounding becomes symmetric; other matrices stay as
        # they are.
        if np.abs(w - w.T).max() <= ROUNDING * np.abs(w).max():
            w = (w + w.T) / 2
        problems.append(Problem(step, float(seconds[0]), w, q, mu, start))
    return problems


def answer(name: str, solve, problems: list[Problem]) -> list[dict]:
    """Times and impulses of a solver on all problems, with cold and warm starts.

    `solve(problem, start)` returns `(work, impulses)`. The call `work()` is timed, and
    `impulses(value)` converts its value to the solution.
    """
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
    """Reads the file in the first argument and writes the solutions as JSON to standard output."""
    problems = read(Path(sys.argv[1]))
    answers = []
    for name, solve in solvers.items():
        answers += answer(name, solve, problems)
    json.dump(answers, sys.stdout)
