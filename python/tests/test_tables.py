"""Tables of a run in Python are those of the command line, byte for byte."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import tumble

PENDULUM = """
steps = 101
time_step = 0.01
accuracy = 1e-6
[ground]
none = true
friction = 0
[[bodies]]
name = "b"
box = [0.1, 0.1, 1.0]
mass = 1
position = [0.5, 0, 0]
attitude = { axis = [0, 1, 0], degrees = 90 }
[[joints]]
name = "h"
type = "revolute"
bodies = "b"
anchor = [0, 0, 0]
axis = [0, 1, 0]
"""


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("billiard", ["accuracy=1e-5"]),
        ("billiard", ["impacts=located"]),
        ("marbles", ["impacts=located"]),
        ("four-bar", ["accuracy=1e-4"]),
        ("slider-crank", []),
        ("plans/legs", []),
        ("pusher", []),
        ("turntable", ["accuracy=1e-4"]),
        ("marbles", []),
        ("quadruped", []),
    ],
)
def test_the_same_tables(name: str, fields: list[str], scenarios: Path, tmp_path: Path) -> None:
    """Divided steps, retries, restitution, joints, driven bodies and robots."""
    scene = scenarios / f"{name}.toml"
    flags = [flag for field in fields for flag in ("--set", field)]
    out = tmp_path / "cli"
    command = [os.environ["TUMBLE"], "run", str(scene), "--steps", "100", "--exact", *flags, "--out", str(out), "--quiet"]
    assert subprocess.run(command, check=False).returncode in (0, 3)
    values = dict(field.split("=") for field in fields)
    settings = {key: value if key == "impacts" else float(value) for key, value in values.items()}
    tumble.load(scene, **settings).run(99).to_csv(tmp_path / "python")
    tables = sorted(path.name for path in out.glob("*.csv"))
    assert tables == sorted(path.name for path in (tmp_path / "python").glob("*.csv"))
    for table in tables:
        assert (out / table).read_bytes() == (tmp_path / "python" / table).read_bytes(), table
    done = subprocess.run([os.environ["TUMBLE"], "verify", str(tmp_path / "python" / "states.csv")], check=False)
    assert done.returncode in (0, 3)


def test_energies_and_rates_of_divided_steps() -> None:
    """A pendulum without friction keeps its energy, and its axis turns as fast as its body."""
    run = tumble.Scene.from_text(PENDULUM).run(100)
    velocities, spins, heights = run.velocities[:, 0], run.spins[:, 0], run.positions[:, 0, 2]
    moments = np.array([1.01, 1.01, 0.02]) / 12
    true = 0.5 * (velocities**2).sum(1) + 0.5 * (moments * spins**2).sum(1) + 9.81 * heights
    assert np.abs(run.energy - true).max() < 1e-12
    assert np.ptp(run.energy) < 1e-5
    speed, spin = run.joints["h"]["speed"], spins[:, 1]
    # Rates are means over a step.
    assert np.abs(speed[:100] - 0.5 * (spin[:-1] + spin[1:])).max() < 2e-3
    assert len(run) == 101
