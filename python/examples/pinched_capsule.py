"""Two fingers hold a capsule of 50 g in the air: how fast does it creep downwards?

python python/examples/pinched_capsule.py [SECONDS]

Each finger presses with 5 N and the friction coefficient is 1, so that the grip carries twenty times the capsule's
weight. MuJoCo's contacts creep at a speed that depends on ``impratio``; hard steps do not move. Needs mujoco.
"""

from __future__ import annotations

import sys

import mujoco
import numpy as np
import tumble.mujoco

MODEL = """
<mujoco>
  <option timestep="0.002" cone="elliptic" impratio="{impratio}"/>
  <worldbody>
    <body name="left" pos="-0.03 0 0.5">
      <joint name="left" type="slide" axis="1 0 0"/>
      <geom name="left finger" type="box" size="0.01 0.03 0.03" mass="0.1" contype="1" conaffinity="2"/>
    </body>
    <body name="right" pos="0.03 0 0.5">
      <joint name="right" type="slide" axis="1 0 0"/>
      <geom name="right finger" type="box" size="0.01 0.03 0.03" mass="0.1" contype="1" conaffinity="2"/>
    </body>
    <body name="capsule" pos="0 0 0.5">
      <freejoint/>
      <geom name="capsule" type="capsule" size="0.02 0.02" mass="0.05" friction="1 0.005 0.0001" contype="2" conaffinity="1"/>
    </body>
  </worldbody>
  <actuator>
    <motor joint="left" ctrlrange="-10 10"/>
    <motor joint="right" ctrlrange="-10 10"/>
  </actuator>
</mujoco>
"""
FORCE = 5.0
"""N, of each finger."""
SETTLED = 0.2
"""Time after which the creep is measured, s."""


def scene(impratio: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Model and data with both fingers pressing."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(impratio=impratio))
    data = mujoco.MjData(model)
    data.ctrl[:] = FORCE, -FORCE
    return model, data


def height(data: mujoco.MjData) -> float:
    """Height of the capsule, m."""
    return float(data.qpos[4])


def creep(impratio: float, seconds: float) -> float:
    """Mean downward speed of the capsule with MuJoCo's steps, m/s."""
    model, data = scene(impratio)
    while data.time < SETTLED:
        mujoco.mj_step(model, data)
    start, begin = height(data), data.time
    while data.time < SETTLED + seconds:
        mujoco.mj_step(model, data)
    return (start - height(data)) / float(data.time - begin)


def hard_drop(seconds: float) -> tuple[float, float]:
    """Distance that the capsule moves in hard steps, m, and the largest residual, m/s."""
    model, data = scene(1.0)
    start, residual = data.qpos.copy(), 0.0
    while data.time < seconds:
        report = tumble.mujoco.hard_step(model, data, unsolved="raise")
        residual = max(residual, report.residual)
    return float(np.linalg.norm(data.qpos[2:5] - start[2:5])), residual


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    for impratio in (1.0, 10.0, 100.0):
        model, data = scene(impratio)
        while data.time < SETTLED:
            mujoco.mj_step(model, data)
        print(
            f"mj_step, impratio {impratio:3.0f}: {1e6 * creep(impratio, 1.0):10.1f} µm/s; {tumble.mujoco.certify(model, data)}"
        )
    moved, residual = hard_drop(seconds)
    print(f"hard_step: moved {moved:.1e} m in {seconds:g} s, largest residual {residual:.1e} m/s")


if __name__ == "__main__":
    main()
