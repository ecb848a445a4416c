"""Pushes a box with a wrong model and side pushes, and counts the trials that end at the target.

    python bench/mpc.py
    python bench/mpc.py --trials 10

The planner of `python/examples/push_mpc.py` believes one coefficient of friction. Each trial draws
another one, and a side push: its direction and its step. A trial replays the first plan, or plans
again every five steps from the current state. The seed is fixed. Each search uses one thread.
"""

import argparse
import random
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tumble

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python" / "examples"))

import push_mpc as example

SEED = 20261126
FRICTION = 0.25
"""Largest relative error of the planner's coefficient of friction."""
SIDE = 0.1
"""Impulse of the side push, as a share of the impulse of the first plan."""
REST = 10
"""Steps without a push at the end, in which a box of 0.04 m/s comes to rest."""
ITERATIONS = 4
"""Iterations of a plan from the current state."""

Controls = list[dict[str, Any]]


@dataclass
class Trial:
    """Errors of the model in one run."""

    friction: float
    """Coefficient of friction of the real scene."""
    side: float
    """Force of the side push along y for one step, N."""
    step: int
    """Step of the side push."""


@dataclass
class Outcome:
    """Result of one run."""

    there: bool
    away: float
    """Distance to the target, m."""
    plans: int
    seconds: float
    """Processor time of the plans."""


def faces() -> Controls:
    """Pushes at all four sides of the box, each with the ranges of the example's push."""
    sides = {"-x": [-0.15, 0, -0.05], "+x": [0.15, 0, -0.05], "-y": [0, -0.15, -0.05], "+y": [0, 0.15, -0.05]}
    push = example.CONTROLS[0]
    return [{**push, "name": f"push{i}", "face": face, "at": at} for i, (face, at) in enumerate(sides.items())]


def plan_first(controls: Controls) -> tumble.Plan:
    planner = example.scene(example.BELIEVED)
    return tumble.plan(planner, example.STEPS, controls, example.TARGET, runs=4000, threads=1)


def plan_again(controls: Controls, plan: tumble.Plan, states: np.ndarray) -> tumble.Plan:
    """Plan from the current states, after one period of another plan.

    The search starts at the rest of the other plan, near its end with some extra time.
    """
    left = plan.controls.reshape(len(controls), -1, 3)[:, example.PERIOD :]
    more = max(0, example.SHORTEST - left.shape[1])
    # A zero push has no derivative by its offset.
    left = np.concatenate([left, np.tile([1.0, 0.0, 0.0], (len(controls), more, 1))], axis=1)
    return tumble.plan(
        example.scene(example.BELIEVED),
        left.shape[1],
        controls,
        example.TARGET,
        start=left.ravel(),
        states=states,
        stages=["shoot"],
        iterations=ITERATIONS,
        threads=1,
    )


class Follower:
    """Pushes of a plan, turned with the box from its planned attitude to its current one."""

    def __init__(self, plan: tumble.Plan):
        self.plan, self.states = plan, np.array(plan.run.states).reshape(-1, 13)

    def wrench(self, step: int, state: np.ndarray) -> np.ndarray:
        """Force in world axes, torque in body axes."""
        force, torque = np.split(self.plan.wrenches[step, 0], 2)
        turn = example.rotation(state[3:7]) @ example.rotation(self.states[step, 3:7]).T
        return np.concatenate([turn @ force, torque])


def run(controls: Controls, first: tumble.Plan, trial: Trial, again: bool) -> Outcome:
    """Run of the real box, with the first plan alone or with plans from its current states."""
    truth = example.scene(trial.friction).simulate()
    follower, since, plans, seconds = Follower(first), 0, 0, 0.0
    for step in range(example.LONGEST if again else first.steps):
        if again and step > 0 and step % example.PERIOD == 0:
            if step > trial.step and example.is_there(truth.states[0]):
                break
            clock = time.process_time()
            follower, since = Follower(plan_again(controls, follower.plan, truth.states)), step
            seconds += time.process_time() - clock
            plans += 1
        wrench = follower.wrench(step - since, truth.states[0])
        if step == trial.step:
            wrench[1] += trial.side
        truth.step(wrench)
    for _ in range(REST):
        truth.step()
    end = truth.states[0]
    return Outcome(example.is_there(end), example.miss(end)[0], plans, seconds)


def draw_trials(plan: tumble.Plan, count: int) -> list[Trial]:
    """Trials with both errors. The side push comes between steps 5 and 45 of the plan's 60."""
    draw = random.Random(SEED)
    side = SIDE * float(np.linalg.norm(plan.wrenches[:, 0, :3], axis=1).sum())
    return [
        Trial(
            friction=example.BELIEVED * (1 + draw.uniform(-FRICTION, FRICTION)),
            side=draw.choice([-side, side]),
            step=draw.randint(5, 45),
        )
        for _ in range(count)
    ]


def report(name: str, outcomes: list[Outcome]) -> None:
    there, plans = sum(outcome.there for outcome in outcomes), sum(outcome.plans for outcome in outcomes)
    seconds = sum(outcome.seconds for outcome in outcomes)
    line = f"{name}: {there} of {len(outcomes)} there, median {1e3 * np.median([o.away for o in outcomes]):.1f} mm"
    if plans:
        line += f", {plans} plans in {seconds:.1f} s, {plans / seconds:.1f} a second"
    print(line, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Plans pushes of a box with a wrong model.")
    parser.add_argument("--trials", type=int, default=50, help="number of trials, 50 by default")
    arguments = parser.parse_args()
    one, four = example.CONTROLS, faces()
    first = plan_first(one)
    both = draw_trials(first, arguments.trials)
    errors = {
        "friction": [replace(trial, side=0.0) for trial in both],
        "side push": [replace(trial, friction=example.BELIEVED) for trial in both],
        "both": both,
    }
    first_four = plan_first(four)
    for name, trials in errors.items():
        report(f"{name}, first plan", [run(one, first, trial, again=False) for trial in trials])
        report(f"{name}, one face", [run(one, first, trial, again=True) for trial in trials])
        report(f"{name}, four faces", [run(four, first_four, trial, again=True) for trial in trials])


if __name__ == "__main__":
    main()
