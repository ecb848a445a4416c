"""Wild and failed steps of robots that move at random, by the time step.

python bench/wild.py [--actions 1000]

It needs the packages tumble, gymnasium and mujoco. Each environment takes the same random actions with its
time steps divided by 1, 2, 4 and 8. An episode lasts 200 actions, or until the robot falls.
"""

import argparse

import gymnasium
from tumble.bench._report import table

ENVIRONMENTS = ("Hopper", "Walker2d", "Ant", "HalfCheetah")
DIVISIONS = (1, 2, 4, 8)


def count(name: str, divisions: int, actions: int) -> tuple[float, int, int]:
    """Time step (s), number of steps that are wild or failed, and number of steps."""
    env = gymnasium.make(f"tumble/{name}-v0", substeps=divisions, max_episode_steps=200)
    env.reset(seed=1)
    env.action_space.seed(2)
    bare = env.unwrapped
    wild = 0
    for _ in range(actions):
        *_, terminated, truncated, info = env.step(env.action_space.sample())
        wild += info["unsolved"]
        if terminated or truncated:
            env.reset()
    return bare.dt / bare.frame_skip, wild, actions * bare.frame_skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Wild steps of robots by the time step.")
    parser.add_argument("--actions", type=int, default=1000)
    actions = parser.parse_args().actions
    rows = []
    for name in ENVIRONMENTS:
        for divisions in DIVISIONS:
            step, wild, steps = count(name, divisions, actions)
            rows.append([name, f"{step * 1e3:g}", f"{wild} of {steps}", f"{1e3 * wild / steps:.2f}"])
    print(table([["", "time step, ms", "wild or failed", "per thousand"], *rows]))


if __name__ == "__main__":
    main()
