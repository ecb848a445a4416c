"""Model predictive control of a pushed box, with a wrong friction coefficient in the model.

The controller plans again from the current pose after every five steps.

python python/examples/push_mpc.py
"""

from __future__ import annotations

import time

import numpy as np
import tumble

BELIEVED = 0.4
STEPS, PERIOD, SHORTEST, LONGEST = 60, 5, 15, 150
AT = np.array([-0.15, 0.0, -0.05])
CONTROLS = [{"kind": "push", "face": "-x", "at": AT, "normal": [0, 20], "tangential": [-6, 6], "offset": [-0.15, 0.15]}]
HALF = np.pi / 8
TARGET = {
    "position": [0.4, 0.15],
    "attitude": [np.cos(HALF), 0, 0, np.sin(HALF)],
    "speed": 0,
    "tolerance": {"position": 0.01, "attitude": 2, "speed": 0.02},
}


def scene(friction: float) -> tumble.Scene:
    box = {"box": [0.3, 0.3, 0.2], "mass": 1.0, "position": [0, 0, 0.1]}
    return tumble.Scene(bodies=[box], ground={"friction": friction}, time_step=0.02, integrator="euler")


def rotation(q: np.ndarray) -> np.ndarray:
    """Rotation matrix from body to world."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix: np.ndarray = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return matrix


def wrench(plan: tumble.Plan, step: int, state: np.ndarray) -> np.ndarray:
    """Planned push at the current pose: force in world axes, torque in body axes."""
    normal, tangential, _, offset, _ = (column[step] for column in plan.columns.values())
    force = np.array([normal, tangential, 0.0])
    torque = np.cross(AT + [0, offset, 0], force)
    return np.concatenate([rotation(state[3:7]) @ force, torque])


def miss(state: np.ndarray) -> tuple[float, float, float]:
    """Distance (m), angle (degrees) and speed (m/s) to the target."""
    away = float(np.linalg.norm(state[:2] - TARGET["position"]))
    turn = 2 * np.arccos(min(1.0, abs(float(state[3:7] @ TARGET["attitude"]))))
    return away, float(np.degrees(turn)), float(np.linalg.norm(state[7:10]))


def is_there(state: np.ndarray) -> bool:
    """True within twice the tolerances of the planner."""
    away, turn, speed = miss(state)
    return away < 0.02 and turn < 4 and speed < 0.04


def pushed(friction: float) -> tuple[bool, int, float, tuple[float, float, float]]:
    """Runs the controller. Returns success, number of plans, plans per second and the last miss."""
    planner, truth = scene(BELIEVED), scene(friction).simulate()
    plan = tumble.plan(planner, STEPS, CONTROLS, TARGET, runs=4000)
    taken, plans, seconds = 0, 0, 0.0
    while True:
        for step in range(PERIOD):
            truth.step(wrench(plan, step, truth.states[0]))
        taken += PERIOD
        state = truth.states[0]
        if is_there(state) or taken >= LONGEST:
            break
        # Warm start: the rest of the plan from the current pose, near the end with some extra time.
        left = plan.controls.reshape(-1, 3)[PERIOD:]
        more = max(0, SHORTEST - len(left))
        left = np.vstack([left, np.tile([1.0, 0.0, 0.0], (more, 1))])
        clock = time.perf_counter()
        plan = tumble.plan(
            planner,
            len(left),
            CONTROLS,
            TARGET,
            start=left.ravel(),
            states=truth.states,
            stages=["shoot"],
            iterations=8,
        )
        seconds += time.perf_counter() - clock
        plans += 1
    return is_there(state), plans, plans / max(seconds, 1e-9), miss(state)


def main() -> None:
    arrived = 0
    frictions = [0.3, 0.35, 0.4, 0.45, 0.5]
    for friction in frictions:
        there, plans, rate, (away, turn, _) = pushed(friction)
        arrived += there
        word = "there" if there else "not there"
        print(
            f"friction {friction}, believed {BELIEVED}: {word} after {plans} plans, {rate:.0f} a second, "
            f"{1e3 * away:.1f} mm and {turn:.2f} degrees off"
        )
    print(f"{arrived} of {len(frictions)} arrived")


if __name__ == "__main__":
    main()
