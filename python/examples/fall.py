"""Every robot of a folder falls for 10 s: python fall.py FOLDER [--motors] [--leave-out NAME …].

The start has random coordinates within the limits, 0.3 to 0.4 m higher than in the file. The
robot has no controls, or motors with new targets every 0.1 s. The output has the number of steps
certified at 1e-9 m/s, whole or in shorter steps, the number of wild steps, and the largest joint
error. Contacts of condim 4 and 6 have sliding friction only.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import tumble


def start(robot: tumble.Robot, rng: np.random.Generator) -> Any:
    """Random coordinates near those of the file."""
    q = np.array(robot.start)
    for name, kind in zip(robot.joints, robot.joint_types):
        if kind == "free":
            # It is the first joint.
            q[2] += 0.4
            q[3:7] = np.array([0.98, 0.1, 0.15, 0.0]) / np.linalg.norm([0.98, 0.1, 0.15])
        elif kind in ("slide", "hinge"):
            at, limits = robot[name].place, robot[name].range
            if name in ("rootz", "root_z"):
                q[at] += 0.3
            elif limits is None:
                q[at] += rng.uniform(-0.15, 0.15)
            else:
                low, high = limits
                q[at] = np.clip(q[at] + rng.uniform(-0.15, 0.15) * (high - low), low, high)
    return q


def off(simulation: tumble.Simulation) -> float:
    """Largest error of joint positions and hinge axes, m and rad."""
    worst = 0.0
    for joint, axes in zip(simulation.joints.values(), simulation.scene.joint_axes):
        worst = max([worst] + [abs(joint["place"][k]) for k in range(3) if k not in axes])
        if 5 in axes and 3 not in axes:
            worst = max([worst] + [abs(joint["angles"][k]) for k in range(3) if k + 3 not in axes])
    return worst


def drive(robot: tumble.Robot, rng: np.random.Generator) -> None:
    """Sets new controls of the actuators, or new joint targets if there are none."""
    if robot.actuators:
        ranges = [bounds or (-1.0, 1.0) for bounds in robot.control_ranges]
        robot.controls = [rng.uniform(low, high) for low, high in ranges]
        return
    for joint in robot.slides_and_hinges:
        joint.stiffness, joint.damping = 80.0, 2.0
        joint.max_force = joint.max_force or 25.0
        joint.target = rng.uniform(*(joint.range or (-1.0, 1.0)))


def fall(path: Path, rng: np.random.Generator, motors: bool, leave_out: list[str]) -> str:
    """Report line about the robot of a file."""
    mujoco = path.suffix == ".xml"
    scene = tumble.load(path, leave_out=leave_out, point_contacts=True if mujoco else None)
    simulation = scene.simulate()
    simulation.robot.set(start(simulation.robot, rng))
    steps, every = (round(seconds / scene.time_step) for seconds in (10, 0.1))
    certified = shorter = wild = 0
    worst = far = 0.0
    for k in range(steps):
        if motors and k % every == 0:
            drive(simulation.robot, rng)
        step = simulation.step()
        wild += step.status is tumble.Status.WILD
        if step.status is tumble.Status.SUBSTEPPED:
            shorter += 1
        else:
            certified += step.residual <= 1e-9
            worst = max(worst, step.residual)
        if k % 20 == 0:
            far = max(far, off(simulation))
    return (
        f"{steps} steps of {1000 * simulation.scene.time_step:g} ms, "
        f"{100 * (certified + shorter) / steps:g} % certified, {shorter} in shorter steps, {wild} wild, "
        f"residual up to {worst:.1e} m/s, joints off by {far:.1e}"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description="Every robot of a folder falls for 10 s.")
    arguments.add_argument("folder", type=Path, metavar="FOLDER")
    arguments.add_argument("--motors", action="store_true", help="with motors at targets that change")
    arguments.add_argument("--leave-out", action="append", default=[], metavar="NAME", help="as in tumble.load")
    given = arguments.parse_args()
    folder = given.folder
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.urdf")]):
        try:
            line = fall(path, np.random.default_rng(3), given.motors, given.leave_out)
            print(f"{path.relative_to(folder)}: {line}", flush=True)
        except tumble.TumbleError as error:
            print(f"{path.relative_to(folder)}: {error}")


if __name__ == "__main__":
    main()
