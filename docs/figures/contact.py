"""Figures of contact, certificate and forces."""

from __future__ import annotations

from typing import Any, Dict, List, Tuple

import matplotlib.pyplot as plt
import mujoco
import numpy as np
import tumble
import tumble.mujoco

TUMBLE, OTHER, GREY = "#0b6e99", "#d1662a", "#8a8a8a"
GRAVITY = 9.81
FLOOR = tumble.Scene(
    [
        {
            "name": "box",
            "box": [0.3, 0.2, 0.1],
            "mass": 1.0,
            "position": [0, 0, 0.5],
            "attitude": {"axis": [1, 2, 0.5], "degrees": 40},
            "velocity": [1.5, 0.3, 0],
            "spin": [2, -3, 4],
        }
    ],
    ground={"friction": 0.4},
    name="toss",
)
"""A tossed box."""
STEPS = 750


def mujoco_toss() -> Tuple[Any, Any]:
    """Model and data of the same toss with MuJoCo's default softness and elliptic cones."""
    state = FLOOR.states[0]
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option timestep="0.002" cone="elliptic" impratio="10"/><worldbody>
        <geom name="floor" type="plane" size="5 5 1" friction="0.4 0.005 0.0001"/>
        <body name="box"><freejoint/><geom name="box" type="box" size="0.15 0.1 0.05" mass="1"
        friction="0.4 0.005 0.0001"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[:] = state[:7]
    data.qvel[:] = state[7:]
    return model, data


def soft_rows() -> Tuple[List[float], List[Any]]:
    """Residual of each of MuJoCo's steps, and the contact rows of all certificates."""
    model, data = mujoco_toss()
    residuals, rows = [], []
    for _ in range(STEPS):
        found = tumble.mujoco.certify(model, data)
        residuals.append(found.residual)
        rows.extend(row for row in found.rows if row.gap is not None)
        mujoco.mj_step(model, data)
    return residuals, rows


def certificate() -> plt.Figure:
    """Residual of each step of one toss in two engines."""
    run = FLOOR.run(STEPS)
    residuals, _ = soft_rows()
    figure, axes = plt.subplots(figsize=(6.4, 3.0), layout="constrained")
    least = 1e-17
    axes.semilogy(run.time[:-1], np.maximum(residuals, least), ".", ms=2.5, color=OTHER, label="MuJoCo, elliptic cones")
    axes.semilogy(run.time[:-1], np.maximum(run.residuals, least), ".", ms=2.5, color=TUMBLE, label="tumble, native solver")
    axes.axhline(1e-9, color=GREY, lw=0.8, ls="--")
    axes.text(0.01, 1.6e-9, "accepted by tumble", color=GREY, va="bottom")
    axes.set(xlabel="time, s", ylabel="residual of the step, m/s", ylim=(3e-18, 1e2))
    axes.legend(loc="center right", markerscale=4)
    return figure
