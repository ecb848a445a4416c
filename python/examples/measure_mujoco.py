"""Steps MuJoCo models with random controls, hard and by MuJoCo, and prints a table.

OPENBLAS_NUM_THREADS=1 python python/examples/measure_mujoco.py MODEL.xml... [--seconds 2]

Needs mujoco. The time of a step is processor time. Certificates are those of every tenth step, and their median is shown.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tumble.mujoco

HOLD = 10
"""Steps for which random controls are held."""
CERTIFIED = 10
"""Every this many steps a certificate is made."""


def starting(model: Any) -> Any:
    """Data at the first keyframe, if there is one."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


@dataclass
class Figures:
    """Figures of a run."""

    steps: int = 0
    unsolved: int = 0
    closed: int = 0
    """Largest number of contacts with a force."""
    residual: float = 0.0
    """Largest residual of the solver, m/s."""
    seconds: float = 0.0
    """Processor time of all steps."""
    certificates: list[float] = field(default_factory=list)
    """Residuals of certificates, m/s."""

    @property
    def cost(self) -> float:
        """Processor time of a step, µs."""
        return 1e6 * self.seconds / self.steps


def run(model: Any, seconds: float, hard: bool) -> Figures:
    """Figures of a run from the model's start."""
    data, rng = starting(model), np.random.default_rng(0)
    limits = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-1.0, 1.0]).reshape(-1, 2)
    stepper = tumble.mujoco.HardStepper(model, unsolved="ignore")
    found = Figures()
    while data.time < seconds - 0.5 * model.opt.timestep:
        if found.steps % HOLD == 0 and model.nu == len(limits):
            data.ctrl[:] = rng.uniform(limits[:, 0], limits[:, 1])
        certified = found.steps % CERTIFIED == 0
        if certified and not hard:
            found.certificates.append(tumble.mujoco.certify(model, data).residual)
        begin = time.process_time()
        report = stepper.step(data) if hard else mujoco.mj_step(model, data)
        found.seconds += time.process_time() - begin
        if hard:
            found.unsolved += not report.solved
            found.residual = max(found.residual, report.residual)
            found.closed = max(found.closed, report.closed)
            if certified:
                found.certificates.append(report.certificate().residual)
        found.steps += 1
    return found


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("models", nargs="+", type=Path)
    arguments.add_argument("--seconds", type=float, default=2.0)
    given = arguments.parse_args()
    print(
        "| model | nv | steps | contacts | not solved | solver, m/s | hard, m/s | mj_step, m/s | hard, µs | mj_step, µs | ratio |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for path in given.models:
        model = mujoco.MjModel.from_xml_path(str(path))
        soft, hard = run(model, given.seconds, False), run(model, given.seconds, True)
        medians = [f"{np.median(each.certificates):.0e}" for each in (hard, soft)]
        print(
            f"| {path.stem} | {model.nv} | {hard.steps} | {hard.closed} | {hard.unsolved} | {hard.residual:.0e} |"
            f" {medians[0]} | {medians[1]} | {hard.cost:.0f} | {soft.cost:.0f} | {hard.cost / soft.cost:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
