"""Writes data/robots/moving.json: robot trajectories of MuJoCo.

    python robots_moving.py

For each model of data/robots/moving the file contains random initial coordinates and rates, and
the coordinates 0.4 s later. MuJoCo uses the fourth-order Runge-Kutta method with steps of 0.1 ms
and no contacts. Requires mujoco 4.0.0 and numpy.
"""

import json
from pathlib import Path

import mujoco
import numpy as np
from robots import HERE, draw

DURATION = 0.4
STEP = 1e-4


def later(path):
    """Initial state of a model and its final coordinates."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = spec.compile()
    data = mujoco.MjData(model)
    q, v = draw(model, np.random.default_rng(1))
    data.qpos[:], data.qvel[:] = q, v
    if model.nu:
        data.ctrl[:] = model.key_ctrl[0]
    for _ in range(round(DURATION / STEP)):
        mujoco.mj_step(model, data)
    return {"q": q.tolist(), "v": v.tolist(), "duration": DURATION, "later": data.qpos.tolist()}


if __name__ == "__main__":
    models = sorted((HERE / "moving").glob("*.xml"))
    figures = {path.name: later(path) for path in models}
    Path(HERE / "moving.json").write_text(json.dumps(figures, indent=1) + "\n")
