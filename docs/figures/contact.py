"""Figures of contact, certificate and forces."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import mujoco
import numpy as np
import numpy.typing as npt
import tumble
import tumble.mujoco
from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]
TUMBLE, OTHER, GREY = "#0b6e99", "#d1662a", "#8a8a8a"
LEGS = ("#0b6e99", "#d1662a", "#7a5195", "#2f8f5b")
GRAVITY = 9.81
FRICTION = 0.4
STEPS = 750
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
    ground={"friction": FRICTION},
    name="toss",
)
"""A tossed box."""
MODEL = """<mujoco>
  <option timestep="0.002" cone="elliptic" impratio="10"/>
  <default><geom friction="0.4 0.005 0.0001"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body name="box"><freejoint/><geom name="box" type="box" size="0.15 0.1 0.05" mass="1"/></body>
  </worldbody>
</mujoco>"""
"""The same box with MuJoCo's default softness."""


def dots(axes: Any, x: Any, y: Any, **style: Any) -> None:
    """Draws points within the axes, without those that another one covers."""
    limits = np.array([axes.get_xlim(), axes.get_ylim()])
    points = np.column_stack([x, y])
    points = points[np.all((points >= limits[:, 0]) & (points <= limits[:, 1]), axis=1)]
    shown = points.copy()
    if axes.get_yscale() == "log":
        shown[:, 1], limits[1] = np.log(points[:, 1]), np.log(limits[1])
    cells = np.round(250 * (shown - limits[:, 0]) / (limits[:, 1] - limits[:, 0]))
    _, first = np.unique(cells, axis=0, return_index=True)
    axes.plot(*points[np.sort(first)].T, ".", mew=0, **style)


def turned(attitude: Floats, vector: Floats) -> Floats:
    """A body's vector in the world."""
    w, axis = attitude[0], attitude[1:]
    once = np.cross(axis, vector)
    return np.asarray(vector + 2 * (w * once + np.cross(axis, once)))


def hard_rows() -> tuple[Floats, dict[str, Floats]]:
    """Residual of each step of the toss, and its contacts at the ends of the steps."""
    run = FLOOR.run(STEPS)
    found = run.contacts
    gaps = []
    for k, point in zip(found["k"], found["point"]):
        start, end = run.states[k, 0], run.states[k + 1, 0]
        corner = turned(start[3:7] * [1, -1, -1, -1], point - start[:3])
        gaps.append((end[:3] + turned(end[3:7], corner))[2])
    normal = np.asarray(found["normal_force"])
    friction = np.linalg.norm(np.asarray(found["force"])[:, :2], axis=1)
    slip = np.linalg.norm(np.asarray(found["slip"]), axis=1)
    rows = {"gap": np.array(gaps), "force": normal, "friction": friction, "slip": slip}
    return run.residuals, rows


def soft_rows() -> tuple[Floats, dict[str, Floats]]:
    """Residuals and contacts of the same toss in MuJoCo."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    state = FLOOR.states[0]
    data.qpos[:] = state[:7]
    # A free joint has the velocity in the world and the spin in the body, like a state.
    data.qvel[:] = state[7:]
    residuals: list[float] = []
    found: list[Any] = []
    for _ in range(STEPS):
        certificate = tumble.mujoco.certify(model, data)
        residuals.append(certificate.residual)
        found.extend(certificate.rows)
        mujoco.mj_step(model, data)
    rows = {
        "gap": np.array([row.gap_speed * model.opt.timestep for row in found]),
        "force": np.array([row.force for row in found]),
        "friction": np.array([row.friction_force for row in found]),
        "slip": np.array([row.slip for row in found]),
    }
    return np.array(residuals), rows


def hard_contact() -> Figure:
    """Gap and normal force, slip and friction of all contacts of one toss in two engines."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(6.8, 3.0), layout="constrained")
    left.set(xlabel="gap at the end of the step, mm", ylabel="normal force, N", xlim=(-0.8, 1.6), ylim=(-0.8, 25))
    right.set(xlabel="slip speed, m/s", ylabel="friction / (μ · normal force)", xlim=(-0.05, 1.5), ylim=(-0.04, 1.1))
    for (_, rows), colour, label in ((soft_rows(), OTHER, "MuJoCo"), (hard_rows(), TUMBLE, "tumble")):
        style = {"ms": 5, "color": colour, "alpha": 0.7}
        dots(left, 1e3 * rows["gap"], rows["force"], label=label, **style)
        pressed = rows["force"] > 1e-3
        share = rows["friction"][pressed] / (FRICTION * rows["force"][pressed])
        dots(right, rows["slip"][pressed], share, **style)
    left.legend(loc="upper right", markerscale=2)
    return figure


def certificate() -> Figure:
    """Residual of each step of one toss in two engines."""
    figure, axes = plt.subplots(figsize=(6.8, 2.8), layout="constrained")
    time = FLOOR.time_step * np.arange(STEPS)
    least = 1e-17  # an exact zero is drawn here
    axes.set(xlabel="time, s", ylabel="residual of the step, m/s", yscale="log", xlim=(-0.03, 1.53), ylim=(3e-18, 1e3))
    for (residuals, _), colour, label in ((soft_rows(), OTHER, "MuJoCo"), (hard_rows(), TUMBLE, "tumble")):
        dots(axes, time, np.maximum(residuals, least), ms=4, color=colour, label=label)
    axes.axhline(1e-9, color=GREY, lw=0.8, ls="--")
    axes.text(0.0, 2e-9, "tumble accepts a step below this line", color=GREY)
    axes.legend(loc="center right", markerscale=4)
    return figure


def legs(points: list[list[float]], force: float, at: list[float]) -> Floats:
    """Forces that the ground exerts on a body's points if a load presses it at a place, N."""
    body = {
        "points": points,
        "mass": 1.0,
        "inertia": [0.3, 0.3, 0.5],
        "position": [0, 0, 0.5],
        "load": {"force": [0, 0, -force], "at": at},
    }
    run = tumble.Scene([body], {"friction": 0.5, "rebound_speed": 0.0}, gravity=0.0).run(1)
    found = np.zeros(len(points))
    for place, pressure in zip(run.contacts["point"], run.contacts["normal_force"]):
        found[int(np.argmin(np.linalg.norm(np.array(points)[:, :2] - place[:2], axis=1)))] = pressure
    return found


CORNERS = [[1, 1, -0.5], [1, -1, -0.5], [-1, 1, -0.5], [-1, -1, -0.5]]


def hyperstatic_forces() -> Figure:
    """Forces on four legs under a load on the diagonal: what statics allows, and tumble's choice."""
    figure, axes = plt.subplots(1, 2, figsize=(6.8, 2.9), layout="constrained", sharey=True)
    load = 100.0
    places = np.linspace(0.0, 0.95, 20)
    found = np.array([legs(CORNERS, load, [s, s, 0.0]) for s in places])
    # The forces W/4 (1 + 2s), W/4, W/4, W/4 (1 - 2s) plus t (1, -1, -1, 1) balance the load for every t.
    low = -0.25 * load * (1 - 2 * places)
    free = {0: 0.25 * load * (1 + 2 * places), 3: 0.25 * load * (1 - 2 * places)}
    high = np.full_like(places, 0.25 * load)
    for axis, (leg, name) in zip(axes, ((0, "leg below the load"), (3, "opposite leg"))):
        axis.fill_between(places, free[leg] + low, free[leg] + high, color=LEGS[leg], alpha=0.18, lw=0, label="balances the load")
        axis.plot(places, found[:, leg], "o", ms=3.5, color=LEGS[leg], label="tumble")
        axis.set(xlabel="place of the load on the diagonal / half diagonal", title=name)
        axis.legend(loc="upper left" if leg == 0 else "upper right")
    axes[0].set(ylabel="force on the leg, N")
    return figure


def table_problem(compliance: float) -> tumble.ContactProblem:
    """One step of a table with four legs, a load off its centre, and equally compliant legs."""
    mass, inertia, step, load, at = 1.0, np.diag([0.3, 0.3, 0.5]), 0.01, 100.0, np.array([0.5, 0.2, 0.0])
    rows = []
    for corner in np.array(CORNERS, float):
        arm = np.array([[0, -corner[2], corner[1]], [corner[2], 0, -corner[0]], [-corner[1], corner[0], 0]])
        # Normal first, then the tangents.
        rows.append(np.hstack([np.eye(3), -arm])[[2, 0, 1]])
    J = np.vstack(rows)
    inverse = np.zeros((6, 6))
    inverse[:3, :3], inverse[3:, 3:] = np.eye(3) / mass, np.linalg.inv(inertia)
    force = np.array([0.0, 0.0, -load])
    velocity = step * inverse @ np.concatenate([force, np.cross(at, force)])
    W = J @ inverse @ J.T
    return tumble.ContactProblem(W=W + compliance * np.eye(12), q=J @ velocity, mu=[0.5] * 4)


def selection_rule() -> Figure:
    """Leg forces under vanishing compliance, and the pressure under a long foot."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(6.8, 3.0), layout="constrained")
    compliances = np.logspace(1.5, -7, 35)
    forces = np.array([table_problem(c).solve(residual=1e-10).impulses[::3] / 0.01 for c in compliances])
    exact = legs(CORNERS, 100.0, [0.5, 0.2, 0.0])
    for leg, colour in enumerate(LEGS):
        left.semilogx(compliances, forces[:, leg], color=colour)
        left.plot(3e-8, exact[leg], "o", ms=5, color=colour, clip_on=False)
    left.set(xlabel="compliance of each leg, 1/kg", ylabel="force on the leg, N", xlim=(40, 3e-8), ylim=(-2, 60))
    left.text(3e-8, 51, "dots: a step of tumble", color=GREY, ha="right")
    xs = np.linspace(-1.0, 1.0, 21)
    foot = [[float(x), y, -0.5] for x in xs for y in (-0.2, 0.2)]
    for place, colour in zip((0.0, 0.2, 0.6), LEGS):
        found = legs(foot, 100.0, [place, 0.0, 0.0]).reshape(-1, 2).sum(axis=1)
        right.plot(xs, found, "o-", ms=3, color=colour, label=f"load at {place:g} m")
    right.set(xlabel="place under the foot, m", ylabel="force on a pair of points, N")
    right.legend(loc="upper left")
    return figure
