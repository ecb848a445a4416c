"""Motions of the work–precision diagram, and where their bodies are at the end.

The references of the eight smooth problems come from no engine: closed forms, or integrations of
the equations of motion with scipy's DOP853 to 1e-12. The bouncing ball has a closed form. The last
three problems have no reference.
"""

import math
import tomllib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import tumble
from accuracy import MOTIONS, shipped
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

GROUND = '[ground]\nfriction = 0.4\n[[bodies]]\nname = "body"\nmass = 1.0\n'
SMOOTH = ("slide", "oblique slide", "spin and slide", "slip to roll", "pendulum", "double pendulum", "four-bar", "top")
EVENTS = {
    "bounce": (GROUND.replace("0.4\n", "0.4\nrestitution = 1.0\n") + "sphere = 0.1\nposition = [0, 0, 0.6]\n", 1.2),
    "rocking block": (
        GROUND + "box = [0.2, 0.2, 0.6]\nattitude = { axis = [0, 1, 0], degrees = 10 }\n"
        f"position = [{0.3 * math.sin(math.radians(10)) - 0.1 * math.cos(math.radians(10))!r}, 0, "
        f"{0.3 * math.cos(math.radians(10)) + 0.1 * math.sin(math.radians(10))!r}]\n",
        0.8,
    ),
    "tumbling brick": (
        GROUND + "box = [0.4, 0.2, 0.1]\nposition = [0, 0, 0.4]\nvelocity = [1.5, 0.5, 0]\nspin = [3, 5, 2]\n",
        0.6,
    ),
    "dominoes": (shipped("dominoes"), 0.4),
}
"""Further motions, each with its duration in s."""
PROBLEMS = {name: MOTIONS[name] for name in SMOOTH} | EVENTS


class Tree(NamedTuple):
    """Joint that places a body, or closes a loop if ``child`` has a place already."""

    kind: str
    child: int
    parent: int
    """Body, or -1 for the world."""
    anchor: Any
    axis: Any
    closes: bool


class Problem:
    """Scene of tumble, and what the other engines need of it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.text, self.duration = PROBLEMS[name]
        self.scene = self.at(0.001)
        document = tomllib.loads(self.text)
        self.ground = document["ground"]
        self.bodies = [
            body for body in document["bodies"] for _ in range(math.prod(body.get("copies", {}).get("count", [1])))
        ]
        self.length = 2.0 * float(self.scene.extents.max())
        self.place = self.scene.states[:, :3]
        self.turn = Rotation.from_quat(self.scene.states[:, 3:7], scalar_first=True)
        self.joints = self._tree(document.get("joints", []))

    def at(self, step: float, **settings: Any) -> tumble.Scene:
        """Scene with a time step and settings."""
        text = f'name = "motion"\nsteps = 1\ntime_step = {step!r}\nintegrator = "leapfrog"\n{self.text}'
        return tumble.Scene.from_text(text, **settings)

    def slope(self) -> Rotation:
        """Attitude of the ground."""
        return Rotation.from_rotvec([0.0, math.radians(self.ground.get("slope", 0.0)), 0.0])

    def relative(self, body: int, point: Any) -> Any:
        """Point of the world in the frame of a body, or of the world for -1."""
        return np.asarray(point) if body < 0 else self.turn[body].inv().apply(point - self.place[body])

    def _tree(self, tables: list[dict[str, Any]]) -> list[Tree]:
        joints, placed = [], {-1}
        for table in tables:
            names = table["bodies"] if isinstance(table["bodies"], list) else [table["bodies"]]
            pair = [self.scene.bodies.index(name) for name in names] + [-1] * (2 - len(names))
            child, parent = pair if pair[0] not in placed else reversed(pair)
            axis = np.array(table.get("axis", [0, 0, 1]), float)
            joints.append(Tree(table["type"], child, parent, np.array(table["anchor"], float), axis, child in placed))
            placed.add(child)
        # A loop ends at the body that has a place; the world comes last.
        return [j._replace(child=j.parent, parent=j.child) if j.closes and j.child < 0 else j for j in joints]


def plate(problem: Problem) -> Any:
    """Box that slides on its four lower corners, which carry it like four equal springs."""
    half, friction, slope = problem.scene.extents[0], problem.scene.friction, problem.slope()
    down, inertia = slope.inv().apply(np.array(problem.scene.gravity)), problem.scene.inertias[0][2, 2]
    corners = np.array([[x, y] for x in (-half[0], half[0]) for y in (-half[1], half[1])])

    def rates(_: float, state: Any) -> Any:
        c, s = math.cos(state[2]), math.sin(state[2])
        arms = corners @ np.array([[c, s], [-s, c]])
        slips = state[3:5] + state[5] * np.stack([-arms[:, 1], arms[:, 0]], axis=1)
        directions = slips / np.linalg.norm(slips, axis=1)[:, None]
        # Forces of the springs are affine in the place. They balance weight and moments per unit mass.
        basis = np.column_stack([np.ones(4), arms])
        balance = np.column_stack([np.ones(4), arms - half[2] * friction * directions]).T
        normal = basis @ np.linalg.solve(balance @ basis, [-down[2], 0.0, 0.0])
        forces = -friction * normal[:, None] * directions
        torque = float(np.sum(arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]))
        return np.concatenate([state[3:], forces.sum(axis=0) + down[:2], [torque / inertia * problem.scene.masses[0]]])

    velocity = slope.inv().apply(np.array(problem.scene.states[0, 7:10]))
    start = [0.0, 0.0, 0.0, *velocity[:2], problem.scene.states[0, 12]]
    end = solve_ivp(rates, (0.0, problem.duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return problem.place + slope.apply([end[0], end[1], 0.0])


def rolling(problem: Problem) -> Any:
    """Ball whose slip has a constant direction until it rolls."""
    radius, brake = problem.bodies[0]["sphere"], problem.scene.friction * -problem.scene.gravity[2]
    velocity, spin = problem.scene.states[0, 7:10], problem.scene.states[0, 10:13]
    slip = velocity + np.cross(spin, [0.0, 0.0, -radius])
    size, t = float(np.linalg.norm(slip)), problem.duration
    until = size / (3.5 * brake)
    return problem.place + velocity * t - slip / size * brake * until * (t - 0.5 * until)


def bouncing(problem: Problem) -> Any:
    """Ball that falls and rises without loss."""
    gravity, fall = -problem.scene.gravity[2], problem.place[0, 2] - problem.bodies[0]["sphere"]
    half = math.sqrt(2.0 * fall / gravity)
    since = (problem.duration + half) % (2.0 * half) - half
    return problem.place - [0.0, 0.0, 0.5 * gravity * since**2]


def jointed(problem: Problem) -> Any:
    """Bodies on joints, by the equations of motion with multipliers. A state has places, frames, velocities, spins."""
    scene, count = problem.scene, len(problem.bodies)
    arms = [[problem.relative(body, joint.anchor) for body in (joint.child, joint.parent)] for joint in problem.joints]
    normals = [
        problem.turn[joint.child].inv().apply(np.linalg.svd(joint.axis[None])[2][1:])
        if joint.kind == "revolute"
        else []
        for joint in problem.joints
    ]

    def rates(_: float, state: Any) -> Any:
        # The rows of a transposed frame are the body's axes.
        axes, velocities = state[3 * count : 12 * count].reshape(-1, 3, 3), state[12 * count :].reshape(count, 6)
        frames, spins = axes.transpose(0, 2, 1), velocities[:, 3:]
        inertias = frames @ scene.inertias @ axes
        inverse = np.zeros((count, 6, count, 6))
        for b in range(count):
            inverse[b, :3, b, :3], inverse[b, 3:, b, 3:] = np.eye(3) / scene.masses[b], np.linalg.inv(inertias[b])
        inverse = inverse.reshape(6 * count, 6 * count)
        weights, torques = (
            scene.masses[:, None] * scene.gravity,
            -np.cross(spins, (inertias @ spins[:, :, None])[:, :, 0]),
        )
        forces = np.concatenate([weights, torques], axis=1).ravel()
        rows, sides = [], []
        for joint, pair, own in zip(problem.joints, arms, normals):
            row, side = np.zeros((3 + len(own), count, 6)), np.zeros(3 + len(own))
            directions = np.reshape([frames[joint.child] @ normal for normal in own], (-1, 3))
            for body, arm, sign in zip((joint.child, joint.parent), pair, (1.0, -1.0)):
                if body >= 0:
                    arm, spin = frames[body] @ arm, spins[body]
                    row[:3, body, :3], row[:3, body, 3:] = sign * np.eye(3), sign * np.cross(np.eye(3), arm).T
                    row[3:, body, 3:] = sign * directions
                    side[:3] -= sign * np.cross(spin, np.cross(spin, arm))
                    side[3:] -= sign * np.cross(spins[joint.child], directions) @ spin
            rows.append(row.reshape(-1, 6 * count))
            sides.append(side)
        matrix, side = np.concatenate(rows), np.concatenate(sides)
        # The joints of a planar loop are redundant.
        multipliers = np.linalg.lstsq(matrix @ inverse @ matrix.T, side - matrix @ inverse @ forces, rcond=1e-9)[0]
        turning = np.cross(spins[:, None], axes)
        return np.concatenate([velocities[:, :3].ravel(), turning.ravel(), inverse @ (forces + matrix.T @ multipliers)])

    axes = problem.turn.as_matrix().transpose(0, 2, 1)
    velocities = np.concatenate([scene.states[:, 7:10], problem.turn.apply(np.array(scene.states[:, 10:]))], axis=1)
    start = np.concatenate([problem.place.ravel(), axes.ravel(), velocities.ravel()])
    end = solve_ivp(rates, (0.0, problem.duration), start, "DOP853", rtol=1e-12, atol=1e-12)
    return end.y[: 3 * count, -1].reshape(count, 3)


REFERENCES: dict[str, Callable[[Problem], Any]] = {name: jointed for name in SMOOTH[4:]} | {
    "slide": plate,
    "oblique slide": plate,
    "spin and slide": plate,
    "slip to roll": rolling,
    "bounce": bouncing,
}
