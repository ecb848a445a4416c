"""The environment PushCube under a simple rule, 64 cubes in parallel.

python python/examples/push_cube.py
"""

from __future__ import annotations

import numpy as np
import tumble.gym


def rule(observations: np.ndarray) -> np.ndarray:
    """Force towards the target: speed control with friction compensation."""
    way, velocity = observations[:, 13:15], observations[:, 7:9]
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    speed = np.minimum(0.5, 2.0 * distance)
    return np.asarray((0.2 + 0.5 * speed) * way / distance - 0.5 * velocity)


def main() -> None:
    envs = tumble.gym.PushCubeVector(64, threads=2)
    observations, _ = envs.reset(seed=0)
    reached = ended = 0
    for _ in range(200):
        observations, _, terminated, truncated, info = envs.step(rule(observations))
        reached += int(info["is_success"].sum())
        ended += int((terminated | truncated).sum())
    print(f"{ended} episodes ended, {reached} of them at the target")


if __name__ == "__main__":
    main()
