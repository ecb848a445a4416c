"""Steps of a robot in tumble as arguments of ``tumble.referee.certify``.

audit_policies.py uses it. The referee gets bodies, joints and contacts, and computes the laws from these with numpy:

- The velocities are those of the bodies: each has a velocity and a spin, in the world's frame.
- Contacts with the ground have their force, their mean slip, and the gaps at both ends of the step.
- Locked axes of joints have their force and their error at the end of the step.
- Stops have the part of the torque that motor, damping and armature do not explain.

Planar robots of capsules on level ground are supported, with planar and revolute joints and the integrator "leapfrog".
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import tumble
from tumble import referee

Floats = npt.NDArray[np.float64]

LOCKED = {"planar": ((2,), (0, 1)), "revolute": ((0, 1, 2), (0, 1))}
"""Locked positions and rotations of the types of joints, in the joint's frame."""


def matrix(quaternion: Any) -> Floats:
    """Rotation matrix of w, x, y, z."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class RobotSteps:
    """Takes steps of a simulation and returns the arguments of ``certify`` for each."""

    def __init__(self, simulation: tumble.Simulation) -> None:
        self.simulation = simulation
        scene = simulation.scene
        self.h, self.gravity = scene.time_step, scene.gravity
        self.names, self.masses, self.inertias = scene.bodies, scene.masses, scene.inertias
        with tempfile.TemporaryDirectory() as folder:
            scene.run(0).to_csv(folder)
            model = json.loads((Path(folder) / "run.json").read_text(encoding="utf-8"))["model"]
        self.joints: list[dict[str, Any]] = model["joints"]
        number = {body["name"]: index for index, body in enumerate(model["bodies"])}
        for joint in self.joints:
            joint["body"], joint["other"] = [*(number[name] for name in joint["bodies"]), None][:2]
        shapes = {body["name"]: body["pieces"] for body in model["bodies"] if "pieces" in body}
        forms = [shapes[body.get("shape", body["name"])] for body in model["bodies"]]
        self.radii = [pieces[0]["capsule"]["radius"] for pieces in forms]
        self.friction = {
            number[each["between"][0]]: each["coefficient"]
            for each in model["friction"]
            if each["between"][1] == "ground"
        }
        unsupported = {joint["type"] for joint in self.joints} - set(LOCKED)
        if unsupported or any(len(pieces) != 1 for pieces in forms):
            raise ValueError(f"joints {sorted(unsupported)} or several pieces in a body are not supported")
        self.first = simulation.index
        self.rates: dict[str, Any] = {}
        """Rates of the joints over the last step."""

    def step(self, forces: dict[str, float]) -> dict[str, Any] | None:
        """Takes a step. ``forces`` are the torques of the motors by joint.

        Returns None for the first step, whose velocities of the middle are not known at its start, and for a step
        that tumble takes in shorter ones.
        """
        simulation = self.simulation
        start, first = simulation.step_states, simulation.index == self.first
        status = simulation.step().status
        if first or status == tumble.Status.SUBSTEPPED:
            self.rates = {joint["name"]: simulation.joints[joint["name"]]["speed"] for joint in self.joints}
            return None
        rows = _Rows(self, start, simulation.step_states)
        rows.add_contacts(simulation.contacts)
        for joint in self.joints:
            rows.add_joint(joint, simulation.joints[joint["name"]], forces.get(joint["name"], 0.0))
        return rows.arguments()


class _Rows:
    """Rows of a step from the states ``start`` to ``end``."""

    def __init__(self, run: RobotSteps, start: Floats, end: Floats) -> None:
        self.run, self.h = run, run.h
        self.places, self.places_after = start[:, :3], end[:, :3]
        self.turns = [matrix(state[3:7]) for state in start]
        self.turns_after = [matrix(state[3:7]) for state in end]
        count = len(start)
        self.before, self.after = np.zeros((count, 6)), np.zeros((count, 6))
        self.mass = np.zeros((6 * count, 6 * count))
        self.force = np.zeros((count, 6))
        self.force[:, :3] = run.masses[:, None] * run.gravity
        for body, (turn, own) in enumerate(zip(self.turns, run.inertias)):
            at = 6 * body
            self.mass[at : at + 3, at : at + 3] = run.masses[body] * np.eye(3)
            self.mass[at + 3 : at + 6, at + 3 : at + 6] = turn @ own @ turn.T
            self.before[body] = [*start[body, 7:10], *turn @ self.momentum(own, start[body, 10:], -1.0)]
            self.after[body] = [*end[body, 7:10], *turn @ self.momentum(own, end[body, 10:], 1.0)]
        self.directions: list[Floats] = []
        self.impulses: list[float] = []
        self.ends: list[float] = []
        """Velocity of each row for its law, for example the gap at the end over h."""
        self.motion: list[float] = []
        self.laws: list[Any] = []
        self.names: list[str] = []

    def momentum(self, inertia: Floats, spin: Floats, sign: float) -> Floats:
        """Spin of a rigid body with the angular momentum of (34) in docs/formulation.md."""
        return np.asarray(np.linalg.solve(inertia, referee.step_momentum(inertia, spin, sign * self.h)))

    def row(self, body: int, other: int | None, along: Floats, point: Floats | None) -> Floats:
        """Direction of a row: along an axis at a point, or about the axis without a point."""
        found = np.zeros_like(self.before)
        for index, sign in ((body, 1.0), (other, -1.0)):
            if index is not None and point is None:
                found[index, 3:] += sign * along
            elif index is not None and point is not None:
                found[index] += sign * np.hstack([along, np.cross(point - self.places[index], along)])
        return found.ravel()

    def add(self, direction: Floats, impulse: float, end: float, motion: float) -> None:
        """Adds a row."""
        self.directions.append(direction)
        self.impulses.append(impulse)
        self.ends.append(end)
        self.motion.append(motion)

    def add_contacts(self, contacts: Any) -> None:
        """Adds the contacts. The gap at the end is that of the centre of the capsule's end."""
        for index, (body, partner) in enumerate(zip(contacts["body"], contacts["partner"])):
            if partner != "ground":
                raise ValueError(f"a contact with {partner} is not supported")
            normal, gap = contacts["normal"][index], float(contacts["gap"][index])
            centre = contacts["point"][index] + self.run.radii[body] * normal
            arm = self.turns_after[body] @ self.turns[body].T @ (centre - self.places[body])
            moved = float((self.places_after[body] + arm - centre) @ normal)
            across = np.linalg.svd(normal[None])[2][1:]
            for number, axis in enumerate((normal, *across)):
                impulse = self.h * float(contacts["force"][index] @ axis)
                speed = float(contacts["slip"][index] @ axis) if number else moved / self.h
                end = speed if number else (gap + moved) / self.h
                self.add(self.row(body, None, axis, contacts["point"][index]), impulse, end, speed)
            self.laws.append(float(self.run.friction[body]))
            self.names.append(f"{self.run.names[body]}–ground")

    def add_joint(self, joint: dict[str, Any], record: dict[str, Any], motor: float) -> None:
        """Adds the locked axes and the stops of a joint, and the torque of its drive."""
        body, other, name = joint["body"], joint["other"], joint["name"]
        axes = matrix(joint["frames"][1]["attitude"])
        if other is not None:
            axes = self.turns[other] @ axes
        anchor = self.places[body] + self.turns[body] @ joint["frames"][0]["position"]
        locked = LOCKED[joint["type"]]
        for axis in locked[0]:
            row = self.row(body, other, axes[:, axis], anchor)
            self.add_locked(f"{name} {'xyz'[axis]}", row, record, ("force", "place", "velocity"), axis)
        for axis in locked[1]:
            row = self.row(body, other, axes[:, axis], None)
            self.add_locked(f"{name} about {'xyz'[axis]}", row, record, ("torque", "angles", "spin"), axis)
        if joint["type"] != "revolute":
            return
        direction = self.row(body, other, axes[:, 2], None)
        rate, place = float(record["speed"]), float(record["coordinate"])
        last = float(self.run.rates[name])
        self.run.rates[name] = rate
        # The damping is that of the mean rate: the integrator is "leapfrog".
        damping = 0.5 * joint.get("damping", 0.0) * (last + rate)
        explained = motor - damping - joint.get("armature", 0.0) * (rate - last) / self.h
        stop = float(record["torque"][2]) - explained
        self.force += (explained * direction).reshape(self.force.shape)
        limits = joint.get("limits", ())
        for word, limit, sign in zip(("lower", "upper"), limits, (1.0, -1.0)):
            pushes = stop if sign * (place - sum(limits) / 2.0) < 0.0 else 0.0
            self.add(sign * direction, self.h * sign * pushes, sign * (place - limit) / self.h, sign * rate)
            self.laws.append(["limit"])
            self.names.append(f"{name} {word} stop")

    def add_locked(self, name: str, row: Floats, record: dict[str, Any], of: tuple[str, str, str], axis: int) -> None:
        """Adds a locked axis of a joint. ``of`` are the names of its force, its place and its rate."""
        force, place, rate = (float(record[column][axis]) for column in of)
        self.add(row, self.h * force, place / self.h, rate)
        self.laws.append(["locked"])
        self.names.append(name)

    def arguments(self) -> dict[str, Any]:
        """Arguments of ``certify``."""
        J = np.array(self.directions)
        return {
            "M": self.mass,
            "J": J,
            "velocity_before": self.before.ravel(),
            "velocity_after": self.after.ravel(),
            "force": self.force.ravel(),
            "impulses": self.impulses,
            "laws": self.laws,
            "time_step": self.h,
            "w": self.ends - J @ self.after.ravel(),
            "motion": self.motion,
            "names": self.names,
        }
