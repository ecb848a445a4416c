"""Writes data/numpy_draws.json: random start attitudes of NumPy's legacy generator."""

import json
from pathlib import Path

import numpy as np

OUTPUT = Path(__file__).resolve().parents[1] / "numpy_draws.json"

# Small seeds, and seeds next to powers of two where an integer type could overflow.
SEEDS = [*range(31), 42, 397, 624, 65535, 65536, 123456789]
SEEDS += [2**31 - 1, 2**31, 2**31 + 1, 3141592653, 2**32 - 2, 2**32 - 1]


def draw(seed: int) -> dict:
    """Draws of rand(4) after seed(`seed`), and the quaternion d / ‖d‖."""
    draws = np.random.RandomState(seed).rand(4)
    return {"seed": seed, "draws": draws.tolist(), "quaternion": (draws / np.linalg.norm(draws)).tolist()}


def main() -> None:
    lines = ",\n".join(json.dumps(draw(seed)) for seed in SEEDS)
    OUTPUT.write_text(f"[\n{lines}\n]\n")
    print(f"{OUTPUT.name}: {len(SEEDS)} seeds")


if __name__ == "__main__":
    main()
