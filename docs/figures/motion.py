"""Figures of time steps, joints and reproducibility."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import mujoco
import numpy as np
import numpy.typing as npt
import tumble
from contact import GRAVITY, GREY, LEGS, OTHER, TUMBLE, dots
from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[2]
FREE: dict[str, Any] = {"none": True, "friction": 0.5}
BATON = {
    "name": "baton",
    "capsule": {"length": 0.5, "radius": 0.01},
    "mass": 0.2,
    "position": [0, 0, 0.6],
    "attitude": {"axis": [0, 1, 0], "degrees": 70},
    "velocity": [0, 0, -8],
    "spin": [0, 120, 0],
}


def flown(step: float) -> float:
    """Error of the height of a thrown ball after 0.4 s with the integrator euler, m."""
    ball = {"sphere": 0.1, "mass": 1.0, "position": [0, 0, 1], "velocity": [0, 0, 3]}
    run = tumble.Scene([ball], FREE, time_step=step, integrator="euler").run(round(0.4 / step))
    return abs(float(run.positions[-1, 0, 2]) - (1 + 3 * 0.4 - GRAVITY * 0.4**2 / 2))


def slid(step: float) -> float:
    """Error of the place of a sliding box after 0.4 s with the integrator euler, m."""
    box = {"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "velocity": [2, 0, 0]}
    run = tumble.Scene([box], {"friction": 0.3}, time_step=step, integrator="euler").run(round(0.4 / step))
    return abs(float(run.positions[-1, 0, 0]) - (2 * 0.4 - 0.3 * GRAVITY * 0.4**2 / 2))


def swung(step: float, integrator: str) -> float:
    """Angle of a pendulum after 0.4 s, rad."""
    rod = {"name": "rod", "box": [1.0, 0.02, 0.02], "mass": 1.0, "position": [0.5, 0, 2]}
    pin = {"name": "pin", "type": "revolute", "bodies": ["rod"], "anchor": [0, 0, 2], "axis": [0, 1, 0]}
    run = tumble.Scene([rod], FREE, joints=[pin], time_step=step, integrator=integrator).run(round(0.4 / step))
    return float(run.joints["pin"]["coordinate"][-1])


def turned(step: float, integrator: str) -> Floats:
    """Attitude of a free box after 0.4 s."""
    box = {"box": [0.4, 0.2, 0.1], "mass": 1.0, "position": [0, 0, 1], "spin": [1.0, 6.0, 0.5]}
    scene = tumble.Scene([box], FREE, gravity=0.0, time_step=step, integrator=integrator)
    return np.asarray(scene.run(round(0.4 / step)).attitudes[-1, 0])


def time_step() -> Figure:
    """Error over the time step for four motions."""
    steps = np.array([0.02, 0.01, 0.005, 0.002, 0.001, 0.0005])
    finest = 2e-5
    swing, attitude = swung(finest, "leapfrog"), turned(finest, "leapfrog")

    def swings(integrator: str) -> list[float]:
        return [abs(swung(h, integrator) - swing) for h in steps]

    def turns(integrator: str) -> list[float]:
        return [2 * float(np.linalg.norm(turned(h, integrator) - attitude)) for h in steps]

    curves = {
        "thrown ball, m": [flown(h) for h in steps],
        "sliding box, m": [slid(h) for h in steps],
        "pendulum, rad": swings("euler"),
        "free rotation, rad": turns("euler"),
        "pendulum, leapfrog": swings("leapfrog"),
        "free rotation, leapfrog": turns("leapfrog"),
    }
    figure, axes = plt.subplots(figsize=(6.8, 3.4), layout="constrained")
    for (name, errors), colour in zip(curves.items(), (*LEGS, GREY, "#303030")):
        axes.loglog(1e3 * steps, errors, "o-", ms=4, color=colour, label=name)
    axes.text(4, 2e-2, "order 1", color=GREY, ha="right")
    axes.text(2.2, 1.2e-4, "order 2", color=GREY, ha="right")
    axes.set(xlabel="time step, ms", ylabel="error after 0.4 s")
    figure.legend(loc="outside right center")
    return figure


BARS = """<mujoco>
  <option timestep="0.002"><flag contact="disable"/></option>
  <worldbody>
    <body pos="0 0 1">
      <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01" mass="0.5"/>
      <body pos="0 0 -0.3">
        <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.6 0 0" size="0.01" mass="1"/>
        <body name="last" pos="0.6 0 0">
          <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="0.5"/>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><connect body1="last" anchor="0 0 0.3"/></equality>
</mujoco>"""
"""Four bars: two cranks of 0.3 m on the world, and a rod of 0.6 m between them."""


def four_bars() -> tumble.Scene:
    """The same bars as a scene."""
    crank = {"capsule": {"length": 0.3, "radius": 0.01}, "mass": 0.5}
    across = {"axis": [0, 1, 0], "degrees": 90}
    bodies = [
        {"name": "left", "position": [0, 0, 0.85], **crank},
        {"name": "rod", "position": [0.3, 0, 0.7], "capsule": {"length": 0.6, "radius": 0.01}, "mass": 1.0, "attitude": across},
        {"name": "right", "position": [0.6, 0, 0.85], **crank},
    ]
    places = {"a": [0, 0, 1], "b": [0, 0, 0.7], "c": [0.6, 0, 0.7], "d": [0.6, 0, 1]}
    pairs = {"a": ["left"], "b": ["rod", "left"], "c": ["right", "rod"], "d": ["right"]}
    joints = [
        {"name": name, "type": "revolute", "bodies": pairs[name], "anchor": place, "axis": [0, 1, 0]}
        for name, place in places.items()
    ]
    return tumble.Scene(bodies, FREE, joints=joints, name="four bars")


def joints_as_rows() -> Figure:
    """Gap of a closed loop of four bars in two engines."""
    count, spin = 1000, 6.0
    scene = four_bars()
    states = scene.states.copy()
    # Both cranks turn and carry the rod.
    states[[0, 2], 11] = spin
    states[0, 7] = states[2, 7] = -spin * 0.15
    states[1, 7] = -spin * 0.3
    run = scene.simulate(states).run(count)
    ours = np.max([np.linalg.norm(run.joints[name]["place"], axis=1) for name in "abcd"], axis=0)
    model = mujoco.MjModel.from_xml_string(BARS)
    data = mujoco.MjData(model)
    data.qvel[:] = [spin, -spin, spin]
    theirs: list[float] = []
    for _ in range(count + 1):
        mujoco.mj_forward(model, data)
        tip = data.xpos[3] + data.xmat[3].reshape(3, 3) @ [0, 0, 0.3]
        theirs.append(float(np.linalg.norm(tip - [0.6, 0, 1])))
        mujoco.mj_step(model, data)
    figure, axes = plt.subplots(figsize=(6.8, 2.8), layout="constrained")
    time = run.time
    axes.set(xlabel="time, s", ylabel="gap between joined points, m", yscale="log", xlim=(-0.04, 2.04), ylim=(1e-18, 1))
    axes.plot(time, np.maximum(theirs, 1e-18), color=OTHER, label="MuJoCo, equality with default softness")
    dots(axes, time, np.maximum(ours, 1e-18), ms=4, color=TUMBLE, label="tumble, largest of four joints")
    axes.legend(loc="center right", markerscale=3)
    return figure


def unphysical_steps() -> Figure:
    """Height and spin of a baton that meets the ground, for four time steps."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(6.8, 2.9), layout="constrained")
    wild = tumble.Status.WILD
    for step, colour in zip((0.02, 0.01, 0.005, 0.0005), (OTHER, *LEGS[2:], TUMBLE)):
        run = tumble.Scene([BATON], {"friction": 0.6}, time_step=step).run(round(0.5 / step))
        marked = np.flatnonzero(run.status == wild)
        for axes, values in ((left, run.positions[:, 0, 2]), (right, np.linalg.norm(run.spins[:, 0], axis=1))):
            axes.plot(run.time, values, color=colour, label=f"{1e3 * step:g} ms")
            axes.plot(run.time[marked], values[marked], "x", color=colour, ms=6)
    left.set(xlabel="time, s", ylabel="height of the centre, m", ylim=(0, None))
    right.set(xlabel="time, s", ylabel="spin, rad/s", ylim=(0, 190))
    right.legend(title="time step (×: wild)", ncols=2, loc="upper right")
    return figure


def determinism() -> Figure:
    """Distance between two runs of balls among pegs whose starts differ by a tiny amount."""
    scene = tumble.load(ROOT / "scenarios" / "galton.toml")
    count = 1500
    run = scene.run(count)
    same = scene.simulate(threads=2).run(count)
    figure, axes = plt.subplots(figsize=(6.8, 2.9), layout="constrained")
    for shift, colour in zip((1e-6, 1e-9, 1e-12, 1e-15), LEGS):
        states = scene.states.copy()
        states[0, 0] += shift
        other = scene.simulate(states).run(count)
        distance = np.linalg.norm(other.positions - run.positions, axis=2).max(axis=1)
        axes.semilogy(run.time, np.maximum(distance, 1e-18), color=colour, label=f"moved by $10^{{{round(np.log10(shift))}}}$ m")
    apart = np.abs(same.states - run.states).max()
    axes.text(0.02, 0.03, f"same start, two threads: {apart:g} apart in every number", transform=axes.transAxes, color=GREY)
    axes.set(xlabel="time, s", ylabel="largest distance of a ball, m", ylim=(1e-18, 10))
    figure.legend(loc="outside right center")
    return figure
