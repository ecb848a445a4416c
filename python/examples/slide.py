"""Sliding distances of a block for many friction coefficients.

python python/examples/slide.py
"""

from __future__ import annotations

import numpy as np
import tumble

SPEED = 2.0
"""Initial speed, m/s."""
GRAVITY = 9.81


def main() -> None:
    block = {"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "velocity": [SPEED, 0, 0]}
    scene = tumble.Scene([block], {"friction": 0.3})
    frictions = np.linspace(0.1, 1.0, 10)
    runs = tumble.rollout(scene, steps=1200, parameters={"friction": frictions})
    distances = runs.states[:, -1, 0, 0]
    print("friction  distance, m  v²/(2 μ g), m")
    for friction, distance in zip(frictions, distances):
        print(f"{friction:8.2f}  {distance:11.5f}  {SPEED**2 / (2 * friction * GRAVITY):13.5f}")
    print(f"largest residual {runs.residuals.max():.1e} m/s, not solved {len(runs.unsolved)}")


if __name__ == "__main__":
    main()
