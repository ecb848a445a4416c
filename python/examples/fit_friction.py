"""Friction coefficient of a measured slide, by least squares over rollouts.

python python/examples/fit_friction.py
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import tumble
from scipy.optimize import minimize_scalar

TRUE_FRICTION = 0.37
NOISE = 1e-3
"""Standard deviation of a measured position, m."""
STEPS = 400

Floats = npt.NDArray[np.float64]


def scene() -> tumble.Scene:
    block = {"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "velocity": [2, 0.5, 0]}
    return tumble.Scene([block], {"friction": 0.5})


def slides(frictions: Floats) -> Floats:
    """Position of the block after each step, m: (B, T, 3)."""
    runs = tumble.rollout(scene(), steps=STEPS, parameters={"friction": frictions})
    assert not runs.unsolved
    return runs.states[:, :, 0, 0:3]


def measured() -> Floats:
    """Slide with simulated measurement noise: (T, 3)."""
    noise = np.random.default_rng(0).normal(scale=NOISE, size=(STEPS, 3))
    places: Floats = slides(np.array([TRUE_FRICTION]))[0] + noise
    return places


def fit(places: Floats) -> float:
    """Friction of the slide nearest to ``places``: a grid of 64, then a local search."""

    def errors(frictions: Floats) -> Floats:
        squares: Floats = np.mean((slides(frictions) - places) ** 2, axis=(1, 2))
        return squares

    grid = np.linspace(0.02, 1.28, 64)
    best = float(grid[np.argmin(errors(grid))])
    near = (max(best - 0.02, 0.0), best + 0.02)
    found = minimize_scalar(lambda mu: errors(np.array([mu]))[0], bounds=near, method="bounded")
    return float(found.x)


def main() -> None:
    friction = fit(measured())
    print(f"friction {friction:.4f}, in truth {TRUE_FRICTION}")


if __name__ == "__main__":
    main()
