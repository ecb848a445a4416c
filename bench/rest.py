"""Time of a step in which one ball rolls beside many boxes at rest.

python bench/rest.py [--boxes 100,1000,5000] [--steps 200]

It needs the package tumble. The ball never comes near the boxes. Times are processor times.
"""

import argparse
import math
import time

import tumble


def scene(boxes: int, rolls: bool) -> str:
    """Scene text: a grid of boxes at rest, and a ball beside it that rolls or lies."""
    width = math.isqrt(boxes)
    text = ["time_step = 0.002", "steps = 1000000", "[ground]", "friction = 0.5"]
    for box in range(boxes):
        at = f"[{0.5 * (box % width)}, {0.5 * (box // width)}, 0.1]"
        text.append(f"[[bodies]]\nbox = 0.2\nmass = 1.0\nposition = {at}")
    motion = "velocity = [0.0, 0.5, 0.0]\nspin = [-5.0, 0.0, 0.0]" if rolls else ""
    text.append(f"[[bodies]]\nsphere = 0.1\nmass = 1.0\nposition = [-3.0, 0.0, 0.1]\n{motion}")
    return "\n".join(text)


def step_time(boxes: int, rolls: bool, steps: int) -> float:
    """Processor time of a step (s), once the boxes have come to rest."""
    simulation = tumble.Scene.from_text(scene(boxes, rolls), "rest.toml").simulate()
    for _ in range(30):
        simulation.step()
    clock = time.process_time()
    for _ in range(steps):
        simulation.step()
    return (time.process_time() - clock) / steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--boxes", default="100,1000,5000", help="numbers of boxes")
    parser.add_argument("--steps", type=int, default=200)
    args = parser.parse_args()
    print("| boxes | all at rest, us a step | beside a rolling ball, us a step |")
    print("|---|---|---|")
    for boxes in map(int, args.boxes.split(",")):
        times = [1e6 * step_time(boxes, rolls, args.steps) for rolls in (False, True)]
        print(f"| {boxes} | {times[0]:.1f} | {times[1]:.1f} |", flush=True)


if __name__ == "__main__":
    main()
