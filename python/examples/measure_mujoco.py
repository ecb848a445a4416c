"""Steps MuJoCo models with random controls, hard and by MuJoCo, and prints a table.

OPENBLAS_NUM_THREADS=1 python python/examples/measure_mujoco.py MODEL.xml... [--seconds 2]

Needs mujoco. The time of a step is processor time, and the certificate is that of every tenth step.
"""

from __future__ import annotations

import argparse
import time
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


def run(model: Any, seconds: float, hard: bool) -> dict[str, float]:
    """Figures of a run from the model's start."""
    data, rng = starting(model), np.random.default_rng(0)
    limits = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-1.0, 1.0]).reshape(-1, 2)
    stepper = tumble.mujoco.HardStepper(model, unsolved="ignore")
    found = {"steps": 0, "unsolved": 0, "solver": 0.0, "residual": 0.0, "contacts": 0, "time": 0.0}
    while data.time < seconds - 0.5 * model.opt.timestep:
        step = int(found["steps"])
        if step % HOLD == 0 and model.nu == len(limits):
            data.ctrl[:] = rng.uniform(limits[:, 0], limits[:, 1])
        certificate = None
        if not hard and step % CERTIFIED == 0:
            certificate = tumble.mujoco.certify(model, data)
        begin = time.process_time()
        if hard:
            report = stepper.step(data)
        else:
            mujoco.mj_step(model, data)
        found["time"] += time.process_time() - begin
        if hard:
            found["unsolved"] += not report.solved
            found["solver"] = max(found["solver"], report.residual)
            found["contacts"] = max(found["contacts"], report.closed)
            if step % CERTIFIED == 0:
                certificate = report.certificate()
        if certificate is not None:
            found["residual"] = max(found["residual"], certificate.residual)
        found["steps"] += 1
    found["time"] /= max(1, found["steps"])
    return found


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("models", nargs="+", type=Path)
    arguments.add_argument("--seconds", type=float, default=2.0)
    given = arguments.parse_args()
    print("| model | nv | steps | contacts | not solved | solver, m/s | hard, m/s | mj_step, m/s | hard, µs | mj_step, µs | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for path in given.models:
        model = mujoco.MjModel.from_xml_path(str(path))
        soft, hard = run(model, given.seconds, False), run(model, given.seconds, True)
        print(
            f"| {path.stem} | {model.nv} | {hard['steps']:.0f} | {hard['contacts']:.0f} | {hard['unsolved']:.0f} |"
            f" {hard['solver']:.0e} | {hard['residual']:.0e} | {soft['residual']:.0e} |"
            f" {1e6 * hard['time']:.0f} | {1e6 * soft['time']:.0f} | {hard['time'] / soft['time']:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
