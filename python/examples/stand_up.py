"""A robot on four legs stands up from a crouch. Exact gradients of the run find its motors' targets.

python python/examples/stand_up.py go1.urdf [--iterations 200] [--out targets.csv] [--picture rise.png]

The robot is Unitree's Go1 or a similar one, with hip, thigh and calf on each leg. Its motors follow
targets that are linear between knots. Adam (Kingma and Ba, 2015) moves the knots against the gradient
of a loss: distance from the place of rest, tilt and speed of the trunk over the last 0.1 s. The first
targets are those of the crouch, and the last ones those of the standing pose. The result is compared
with two plans by hand: the standing pose as the target from the first step, and a ramp to it.
"""

from __future__ import annotations

import argparse
import time
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import tumble

Floats = npt.NDArray[np.float64]

CROUCH = np.array([0.0, 1.2, -2.5] * 4)
STAND = np.array([0.0, 0.8, -1.6] * 4)
STIFFNESS, DAMPING = 60.0, 2.0
TIME_STEP, STEPS, KNOTS = 0.005, 100, 10
FREE = slice(1, 9)
"""Knots that are found: the first is the crouch, and the last two are the standing pose."""
TAIL = 20
"""Number of steps at the end in which the robot should stand."""
WEIGHTS = {"place": 10.0, "height": 100.0, "tilt": 10.0, "speed": 0.3, "spin": 0.01}
SMOOTH = 0.03
"""Weight of the squared differences of neighbouring knots."""
RATE = 0.03


def scene_of(file: str) -> tuple[tumble.Scene, float]:
    """The robot in a crouch on the ground with motors, and the height of its trunk at rest as it stands."""
    with warnings.catch_warnings():
        # The file has elements of Gazebo, and meshes for pictures.
        warnings.simplefilter("ignore")
        robot = tumble.load(file).simulate().robot
        names = [joint.name for joint in robot.slides_and_hinges]
        scenes = []
        for joints in (CROUCH, STAND):
            q = np.concatenate([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], joints])
            lowest = robot.lowest(q)
            table = {"file": file, "position": [0.0, 0.0, 1.0 - lowest], "coordinates": dict(zip(names, joints))}
            scene = tumble.Scene([], {"friction": 1.0}, robots=[table], time_step=TIME_STEP, integrator="euler")
            scenes.append(scene.with_motors(stiffness=STIFFNESS, damping=DAMPING))
    standing = tumble.rollout(scenes[1], motors=np.tile(STAND, (1, 400, 1)))
    return scenes[0], float(standing.states[0, -1, 0, 2])


def weights_of_knots() -> Floats:
    """Weights (T, K + 1) of linear interpolation. The first knot is the crouch at the start."""
    times = np.arange(1, STEPS + 1) * KNOTS / STEPS
    return np.maximum(0.0, 1.0 - np.abs(times[:, None] - np.arange(KNOTS + 1)))


class Loss:
    """Loss of states (1, T, N, 13), and its derivative by them in twelve numbers of each body."""

    def __init__(self, height: float) -> None:
        self.height, self.value = height, 0.0

    def __call__(self, states: Floats) -> Floats:
        """Derivative. The value is kept."""
        trunk = states[:, -TAIL:, 0]
        place, w, axis = trunk[..., :3] - [0.0, 0.0, self.height], trunk[..., 3:4], trunk[..., 4:7]
        of_place = np.array([WEIGHTS["place"], WEIGHTS["place"], WEIGHTS["height"]])
        duals = np.zeros((*states.shape[:3], 12))
        # The squared vector part of an attitude changes by w times itself with a rotation of the body.
        parts = [2.0 * of_place * place, WEIGHTS["tilt"] * w * axis]
        parts += [2.0 * WEIGHTS["speed"] * trunk[..., 7:10], 2.0 * WEIGHTS["spin"] * trunk[..., 10:13]]
        duals[:, -TAIL:, 0] = np.concatenate(parts, axis=-1) / TAIL
        squares = [of_place * place**2, WEIGHTS["tilt"] * axis**2]
        squares += [WEIGHTS["speed"] * trunk[..., 7:10] ** 2, WEIGHTS["spin"] * trunk[..., 10:13] ** 2]
        self.value = sum(float(part.sum()) for part in squares) / TAIL
        return duals


def stand_up(scene: tumble.Scene, height: float, iterations: int) -> Floats:
    """Targets (T, 12) of the best iterate, found by Adam from those of the crouch."""
    loss, weights = Loss(height), weights_of_knots()
    knots = np.tile(CROUCH, (KNOTS + 1, 1))
    knots[FREE.stop :] = STAND
    first, second = np.zeros_like(knots[FREE]), np.zeros_like(knots[FREE])
    best: Floats = weights @ knots
    lowest = np.inf
    began = time.process_time()
    for count in range(1, iterations + 1):
        aimed = weights @ knots
        runs = tumble.rollout(scene, motors=aimed[None], gradients=loss)
        assert runs.gradients is not None
        steps = np.diff(knots, axis=0)
        value = loss.value + SMOOTH * float(np.square(steps).sum())
        if value < lowest:
            best, lowest = aimed, value
        slope = weights.T @ runs.gradients["motors"][0]
        slope[1:] += 2.0 * SMOOTH * steps
        slope[:-1] -= 2.0 * SMOOTH * steps
        slope = slope[FREE]
        first = 0.9 * first + 0.1 * slope
        second = 0.999 * second + 0.001 * slope**2
        scaled = first / (1.0 - 0.9**count) / (np.sqrt(second / (1.0 - 0.999**count)) + 1e-8)
        knots[FREE] -= RATE * (1.0 - (count - 1) / iterations) * scaled
        if count == 1 or count % 10 == 0:
            spent = time.process_time() - began
            print(f"{count:4} gradients, {spent:5.1f} s: loss {value:.5f}, least {lowest:.5f}", flush=True)
    return best


def report(name: str, scene: tumble.Scene, height: float, aimed: Floats) -> float:
    """Prints how a plan ends, and how far its trunk moves in a further second. Returns its loss."""
    loss = Loss(height)
    held = np.concatenate([aimed, np.tile(aimed[-1], (200, 1))])
    runs = tumble.rollout(scene, motors=held[None])
    loss(runs.states[:, :STEPS])
    trunk = runs.states[0, :, 0]
    end = trunk[STEPS - 1]
    print(
        f"{name}: loss {loss.value:.4f}; {1e3 * np.hypot(*end[:2]):.0f} mm aside, {1e3 * (end[2] - height):.0f} mm "
        f"from the height of rest, {2.0 * np.degrees(np.arcsin(np.linalg.norm(end[4:7]))):.1f}° turned, "
        f"{np.linalg.norm(end[7:10]):.3f} m/s; {1e3 * np.linalg.norm(trunk[-1, :3] - end[:3]):.0f} mm in a further "
        f"second; {len(runs.unsolved)} steps not solved"
    )
    return loss.value


def strip(scene: tumble.Scene, aimed: Floats, path: str) -> None:
    """Draws the crouch, and five states of the run at equal intervals."""
    from PIL import Image

    states = tumble.rollout(scene, motors=aimed[None]).states[0]
    shown = [scene.states, *states[STEPS // 5 - 1 :: STEPS // 5]]
    pictures = [scene.simulate(one).picture(240, (-70.0, 8.0)) for one in shown]
    Image.fromarray(np.concatenate(pictures, axis=1)[40:200]).save(path)


def cost(scene: tumble.Scene, aimed: Floats) -> tuple[float, float]:
    """Processor times of a run, and of a run with its gradient, s: medians of 25."""

    def duals(states: Floats) -> Any:
        return np.ones((*states.shape[:3], 12))

    spent: tuple[list[float], list[float]] = ([], [])
    for _ in range(25):
        for times, gradients in zip(spent, (None, duals)):
            began = time.process_time()
            tumble.rollout(scene, motors=aimed[None], gradients=gradients, threads=1)
            times.append(time.process_time() - began)
    return float(np.median(spent[0])), float(np.median(spent[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot")
    parser.add_argument("--iterations", type=int, default=200)
    parser.add_argument("--out", help="CSV file of the targets, one row per step")
    parser.add_argument("--picture", help="PNG file with six pictures of the robot")
    args = parser.parse_args()
    scene, height = scene_of(args.robot)
    ramp = CROUCH + (STAND - CROUCH) * np.minimum(1.0, np.arange(1, STEPS + 1) / (STEPS - TAIL))[:, None]
    report("standing pose at once", scene, height, np.tile(STAND, (STEPS, 1)))
    report("ramp", scene, height, ramp)
    found = stand_up(scene, height, args.iterations)
    report("found", scene, height, found)
    plans = {"standing pose at once": np.tile(STAND, (STEPS, 1)), "found": found, "crouch": np.tile(CROUCH, (STEPS, 1))}
    for name, aimed in plans.items():
        run, both = cost(scene, aimed)
        reverse = f"its reverse pass {1e3 * (both - run):.1f} ms: {both / run - 1.0:.2f} runs"
        print(f"{name}: a run takes {1e3 * run:.1f} ms, {reverse}")
    if args.picture:
        strip(scene, found, args.picture)
    if args.out:
        names = ",".join(name for name, _ in scene.motor_axes)
        np.savetxt(args.out, found, delimiter=",", header=names, comments="")


if __name__ == "__main__":
    main()
