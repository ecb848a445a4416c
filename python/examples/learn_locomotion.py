"""A hopper or a walker learns to move by random search for a linear policy; its learning curve is drawn.

python python/examples/learn_locomotion.py [--robot hopper] [--moves 30] [--workers 2] [--seed 0]
    [--out learning.svg] [--start FILE.json] [--policy FILE.json]

Augmented random search (Mania, Guy and Recht, 2018) moves a policy a = M (o - mean)/deviation
along random directions. The weight of a direction is the difference of the rewards along it and
against it. M has 33 numbers for the hopper and 102 for the walker. The search needs only numpy.
The model files come from gymnasium.

The walker learns to fall forward if it begins with M = 0. With --start policies/hopper.json it
begins with the hopper's policy on both legs. --policy writes the policy with the best test, which
audit_policies.py plays.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tumble.locomotion import EPISODE, Hopper, Walker2d

Floats = npt.NDArray[np.float64]

DIRECTIONS = 16
BEST = 8
NOISE = 0.05
STEP = 0.03
TESTS = 6
TESTED = 3
"""Number of moves between tests of the policy. The mean reward of the tests is on the curve."""
KNOWN = 20_000
"""Weight of the first policy's mean and deviation, as a number of observations."""
ROBOTS: dict[str, type[Hopper]] = {"hopper": Hopper, "walker2d": Walker2d}

_envs: dict[str, Hopper] = {}


class Policy(NamedTuple):
    """Linear policy of a robot."""

    robot: str
    matrix: Floats
    mean: Floats
    deviation: Floats

    def action(self, observed: Floats) -> Floats:
        """Controls, from -1 to 1."""
        return np.clip(self.matrix @ ((observed - self.mean) / self.deviation), -1.0, 1.0)

    def save(self, path: str | Path, **about: object) -> None:
        """Writes the policy to a JSON file, with entries that describe it."""
        numbers = {name: np.round(getattr(self, name), 6).tolist() for name in ("matrix", "mean", "deviation")}
        lines = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in (about | numbers).items()]
        lines.insert(0, f'"robot": {json.dumps(self.robot)}')
        Path(path).write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Policy:
        """Policy of a JSON file."""
        read = json.loads(Path(path).read_text(encoding="utf-8"))
        return cls(read["robot"], *(np.array(read[name]) for name in ("matrix", "mean", "deviation")))

    def on_two_legs(self) -> Policy:
        """Policy of the walker that gives each leg half the action of the hopper's leg."""
        trunk, rates = [0, 1], [8, 9, 10]
        legs = [[*trunk, 2, 3, 4, *rates, 11, 12, 13], [*trunk, 5, 6, 7, *rates, 14, 15, 16]]
        matrix, mean, deviation = np.zeros((6, 17)), np.zeros(17), np.ones(17)
        for number, observed in enumerate(legs):
            matrix[3 * number : 3 * number + 3, observed] = 0.5 * self.matrix
            mean[observed], deviation[observed] = self.mean, self.deviation
        return Policy("walker2d", matrix, mean, deviation)


def episode(task: tuple[Policy, int, float]) -> tuple[float, int, int, Floats, Floats]:
    """Sum of rewards of an episode, its length, its steps that did not converge, and two sums.

    The sums are those of the observations and of their squares. ``bonus`` is the value of a healthy
    step in the search.
    """
    policy, seed, bonus = task
    if policy.robot not in _envs:
        _envs[policy.robot] = ROBOTS[policy.robot]()
    env = _envs[policy.robot]
    observed, _ = env.reset(seed=seed)
    total, unsolved, count = 0.0, 0, 0
    sums, squares = np.zeros_like(policy.mean), np.zeros_like(policy.mean)
    for _ in range(EPISODE):
        sums += observed
        squares += observed**2
        count += 1
        observed, reward, over, _, info = env.step(policy.action(observed))
        total += reward - 1.0 + bonus
        unsolved += info["unsolved"]
        if over:
            break
    return total, count, unsolved, sums, squares


class Search:
    """Policy of a robot and statistics of its observations."""

    def __init__(self, robot: str, seed: int) -> None:
        self.robot = robot
        self.rng = np.random.default_rng(seed)
        env = ROBOTS[robot]()
        acted, seen = env.action_space.shape, env.observation_space.shape
        assert acted is not None and seen is not None
        self.shape = (acted[0], seen[0])
        self.matrix = np.zeros(self.shape)
        self.count, self.sums, self.squares = 0, np.zeros(self.shape[1]), np.zeros(self.shape[1])
        self.steps = self.unsolved = 0

    def begin_with(self, policy: Policy) -> None:
        """Continues from a policy. Its mean and deviation count as those of ``KNOWN`` observations."""
        self.matrix, self.count = policy.matrix, KNOWN
        self.sums = KNOWN * policy.mean
        self.squares = KNOWN * (policy.deviation**2 + policy.mean**2)

    def scaling(self) -> tuple[Floats, Floats]:
        """Mean and deviation of the observations."""
        if self.count == 0:
            return np.zeros(self.shape[1]), np.ones(self.shape[1])
        mean = self.sums / self.count
        return mean, np.sqrt(np.maximum(self.squares / self.count - mean**2, 1e-6))

    @property
    def policy(self) -> Policy:
        """Current policy."""
        return Policy(self.robot, self.matrix, *self.scaling())

    def run(self, pool: ProcessPoolExecutor, matrices: list[Floats], bonus: float) -> Floats:
        """Sum of rewards of an episode with each matrix."""
        scaling = self.scaling()
        seeds = self.rng.integers(2**31, size=len(matrices))
        policies = [Policy(self.robot, matrix, *scaling) for matrix in matrices]
        tasks = [(policy, int(seed), bonus) for policy, seed in zip(policies, seeds)]
        totals = []
        for total, count, unsolved, sums, squares in pool.map(episode, tasks):
            totals.append(total)
            self.count += count
            self.steps += count
            self.unsolved += unsolved
            self.sums += sums
            self.squares += squares
        return np.array(totals)

    def move(self, pool: ProcessPoolExecutor) -> None:
        """One step of the search.

        Healthy steps have no value in it, so that standing still is not an optimum.
        """
        directions = self.rng.standard_normal((DIRECTIONS, *self.shape))
        matrices = [self.matrix + sign * NOISE * one for one in directions for sign in (1, -1)]
        totals = self.run(pool, matrices, 0.0).reshape(DIRECTIONS, 2)
        best = np.argsort(-totals.max(axis=1))[:BEST]
        spread = totals[best].std() + 1e-9
        slope = np.tensordot(totals[best, 0] - totals[best, 1], directions[best], axes=1)
        self.matrix = self.matrix + STEP / (BEST * spread) * slope


def spacing(range_of: float) -> float:
    """Round distance of at most seven marks: 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(range_of / 7.0))
    return float(next(power * digit for digit in (1.0, 2.0, 5.0, 10.0) if power * digit >= range_of / 7.0))


def svg(curve: list[tuple[int, float, float, float]]) -> str:
    """Learning curve over steps: mean, minimum and maximum of the tests."""
    width, height, left, bottom = 640, 320, 60, 40
    steps = max(point[0] for point in curve)
    best = max(1.0, *(point[3] for point in curve))
    between, apart = spacing(best), spacing(steps)
    most = between * np.ceil(best / between)

    def at(step: float, reward: float) -> str:
        x = left + (width - left - 20) * step / steps
        y = height - bottom - (height - bottom - 20) * max(reward, 0.0) / most
        return f"{x:.1f},{y:.1f}"

    line = " ".join(at(point[0], point[1]) for point in curve)
    band = [at(point[0], point[3]) for point in curve]
    band += [at(point[0], point[2]) for point in reversed(curve)]
    marks = []
    for reward in np.arange(0.0, most + 0.5 * between, between):
        y = float(at(0.0, reward).split(",")[1])
        marks.append(f'<path d="M{left} {y}H{width - 20}" stroke="#ddd"/>')
        marks.append(f'<text x="{left - 8}" y="{y + 4}" text-anchor="end">{reward:.0f}</text>')
    for step in np.arange(0.0, steps, apart):
        x = at(float(step), 0.0).split(",")[0]
        marks.append(f'<text x="{x}" y="{height - bottom + 18}" text-anchor="middle">{step:.0f}</text>')
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            'font-family="sans-serif" font-size="12">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
            *marks,
            f'<polygon points="{" ".join(band)}" fill="#9ecae1" opacity="0.6"/>',
            f'<polyline points="{line}" fill="none" stroke="#08519c" stroke-width="2"/>',
            f'<text x="{width / 2}" y="{height - 6}" text-anchor="middle">steps of the environment</text>',
            f'<text x="14" y="{height / 2}" text-anchor="middle" '
            f'transform="rotate(-90 14 {height / 2})">reward of an episode</text>',
            "</svg>\n",
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", choices=list(ROBOTS), default="hopper")
    parser.add_argument("--moves", type=int, default=30)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="learning.svg")
    parser.add_argument("--start", help="JSON file of the first policy; a hopper's serves both legs of a walker")
    parser.add_argument("--policy", help="JSON file of the policy with the best test")
    args = parser.parse_args()
    search = Search(args.robot, args.seed)
    if args.start:
        start = Policy.load(args.start)
        search.begin_with(start.on_two_legs() if (start.robot, args.robot) == ("hopper", "walker2d") else start)
    curve: list[tuple[int, float, float, float]] = []
    began, moves = time.monotonic(), 0
    with ProcessPoolExecutor(args.workers) as pool:
        while moves <= args.moves:
            if moves % TESTED == 0:
                policy = search.policy
                totals = search.run(pool, [policy.matrix] * TESTS, 1.0)
                if args.policy and totals.mean() > max((point[1] for point in curve), default=-np.inf):
                    rewards = [round(total, 1) for total in totals.tolist()]
                    policy.save(args.policy, seed=args.seed, moves=moves, steps=search.steps, rewards=rewards)
                minutes = (time.monotonic() - began) / 60.0
                curve.append((search.steps, totals.mean(), totals.min(), totals.max()))
                print(
                    f"{minutes:5.2f} min, {moves:4} moves, {search.steps:8} steps, {search.unsolved} without an "
                    f"answer: reward {totals.mean():7.1f} ({totals.min():.1f} to {totals.max():.1f})",
                    flush=True,
                )
            search.move(pool)
            moves += 1
    with open(args.out, "w", encoding="utf-8") as file:
        file.write(svg(curve))


if __name__ == "__main__":
    main()
