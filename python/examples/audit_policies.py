"""A hopper and a walker move in MuJoCo and in tumble by the same policies; the referee audits both.

python python/examples/audit_policies.py [--actions 250] [--starts 1] [--out audits]

The policies are linear. learn_locomotion.py trained them in tumble and wrote policies/*.json. Both engines get the
same starts and the model files of gymnasium. MuJoCo takes its own steps with the contact settings of the file, but
with its integrator Euler instead of RK4: the referee audits Euler steps. robot_steps.py gives the steps of tumble to
the same referee. The script needs gymnasium and mujoco. It prints a table and writes a page for each run.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import mujoco
import numpy as np
import numpy.typing as npt
from learn_locomotion import ROBOTS, Policy
from robot_steps import RobotSteps
from tumble import referee

Floats = npt.NDArray[np.float64]

POLICIES = Path(__file__).parent / "policies"
MODELS = {"hopper": "Hopper-v5", "walker2d": "Walker2d-v5"}


def environment(robot: str) -> Any:
    """Environment of Gymnasium, with Euler steps."""
    env: Any = gymnasium.make(MODELS[robot]).unwrapped
    env.model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    return env


class Run(NamedTuple):
    """Run of a robot until its last action or its fall."""

    distance: float
    actions: int
    audit: referee.Audit


def in_mujoco(policy: Policy, start: tuple[Floats, Floats], actions: int, title: str) -> Run:
    """Run in Gymnasium's environment, with its model and its test of health."""
    env = environment(policy.robot)
    env.reset()
    env.set_state(*start)
    model, data, states, taken = env.model, env.data, [], 0
    while taken < actions and env.is_healthy:
        observed = np.concatenate([data.qpos[1:], np.clip(data.qvel, -10.0, 10.0)])
        data.ctrl[:] = policy.action(observed)
        for _ in range(env.frame_skip):
            states.append(copy.copy(data))
            mujoco.mj_step(model, data)
        taken += 1
    return Run(float(data.qpos[0] - start[0][0]), taken, referee.audit(states, model=model, title=title))


def in_tumble(policy: Policy, start: tuple[Floats, Floats], actions: int, title: str) -> Run:
    """Run in tumble's environment."""
    env = ROBOTS[policy.robot]()
    env.robot.set(*start)
    gears = environment(policy.robot).model.actuator_gear[:, 0]
    driven = env.robot.joints[-len(gears) :]
    steps, recording, taken = RobotSteps(env.simulation), [], 0
    torques = dict.fromkeys(driven, 0.0)
    while taken < actions and env.is_healthy():
        action = policy.action(env.observe())
        env.actions.apply(env.robot, action, env.dt)
        before, torques = torques, dict(zip(driven, (gears * action).tolist()))
        # A step has half of the torques before and half of those that begin with it.
        means = {joint: 0.5 * (before[joint] + torque) for joint, torque in torques.items()}
        recording += [steps.step(means if first else torques) for first in [True] + [False] * (env.frame_skip - 1)]
        taken += 1
    audited = [{**step, "time": (k + 1) * steps.h} for k, step in enumerate(recording) if step is not None]
    names = [f"{body} {axis}" for body in env.scene.bodies for axis in ("vx", "vy", "vz", "wx", "wy", "wz")]
    audit = referee.audit(audited, title=title, velocity_names=names)
    return Run(float(env.robot.q[0] - start[0][0]), taken, audit)


def row(robot: str, engine: str, runs: list[Run]) -> str:
    """Line of the table: largest values over all runs."""

    def column(name: str) -> Floats:
        return np.concatenate([run.audit.steps[name] for run in runs])

    broken = int((column("residual_m_s") > runs[0].audit.tolerance).sum())
    distance = " ".join(f"{run.distance:.2f}" for run in runs)
    largest = [max(0.0, float(column(name).max())) for name in ("overlap_m", "cone_slip_m_s", "creep_m_s", "energy_J")]
    numbers = "".join(f"{value:11.1e}" for value in (*largest, column("residual_m_s").max()))
    return f"{robot:<9} {engine:<7} {distance:>14} {numbers} {broken:6d} of {len(column('k'))}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--actions", type=int, default=250, help="actions of 8 ms, four steps each")
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("audits"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    print("                     distance,  inside by,  slip in     creep,     energy,  residual,  steps that")
    print("robot     engine            m           m  cone, m/s     m/s          J        m/s  break a law")
    for robot in MODELS:
        policy = Policy.load(POLICIES / f"{robot}.json")
        env = ROBOTS[robot]()
        starts = []
        for seed in range(args.starts):
            env.reset(seed=seed)
            starts.append((env.robot.q, env.robot.v))
        for engine, play in (("MuJoCo", in_mujoco), ("tumble", in_tumble)):
            runs = [play(policy, start, args.actions, f"{robot} in {engine}") for start in starts]
            for seed, run in enumerate(runs):
                run.audit.save(args.out / f"{robot}-{engine.lower()}-{seed}.html")
            print(row(robot, engine, runs), flush=True)


if __name__ == "__main__":
    main()
