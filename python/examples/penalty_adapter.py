"""Adapter of a small penalty engine for the contact benchmark: points of bodies on springs of the ground.

    python -m tumble.bench --adapter penalty_adapter.py --engines penalty

It was made from ``python -m tumble.bench --template``. A point below the ground is pushed out by a spring with a damper.
Friction brakes its slip, up to the cone. Bodies do not touch each other.
"""

from typing import Any

import numpy as np
from tumble.bench.engines import Engine, Motion, Scene, Stopwatch, Unsupported, rows, world_spin

SUBSTEPS = 10
PERIOD = 0.02
"""Period of a body on its spring, s."""


class Penalty(Engine):
    """One body on springs."""

    name = "penalty"
    settings = f"{SUBSTEPS} substeps, springs with a period of {PERIOD:g} s, critical damping"
    compliant = True

    def version(self) -> str:
        return "1"

    def run(self, scene: Scene) -> Motion:
        if scene.restitution > 0.0 or len(scene.bodies) > 1:
            raise Unsupported("one body on the ground, without restitution")
        (body,) = scene.bodies
        h = scene.time_step / SUBSTEPS
        place, turn, speed, spin = body.position, body.attitude, body.velocity, world_spin(scene.states)[0]
        states = np.empty((scene.steps + 1, 1, 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            (wrench,) = scene.wrenches(step, states[step])
            with stopwatch:
                for _ in range(SUBSTEPS):
                    axes = matrix(turn)
                    tensor = axes * body.inertia @ axes.T
                    force = wrench[:3] + body.mass * scene.gravity
                    torque = wrench[3:] - np.cross(spin, tensor @ spin)
                    arms = body.points @ axes.T - [0.0, 0.0, body.radius]
                    for arm in arms[arms[:, 2] + place[2] < (0.0 if scene.ground else -np.inf)]:
                        push = contact(place[2] + arm[2], speed + np.cross(spin, arm), body.mass, scene.friction)
                        force, torque = force + push, torque + np.cross(arm, push)
                    speed = speed + h * force / body.mass
                    spin = spin + h * np.linalg.solve(tensor, torque)
                    place, turn = place + h * speed, turned(turn, h * spin)
            states[step + 1] = rows(place[None], turn[None], speed[None], spin[None])
        return Motion(states, stopwatch.seconds)


def contact(gap: float, velocity: Any, mass: float, friction: float) -> Any:
    """Force on a point at the height ``gap``, below zero."""
    rate = 2.0 * np.pi / PERIOD
    normal = max(0.0, -mass * rate * (rate * gap + 2.0 * velocity[2]))
    slip = np.array([velocity[0], velocity[1], 0.0])
    brake = min(friction * normal, mass * rate * np.linalg.norm(slip))
    return np.array([0.0, 0.0, normal]) - brake * slip / max(np.linalg.norm(slip), 1e-12)


def matrix(q: Any) -> Any:
    """Rotation matrix of a unit quaternion w, x, y, z."""
    w, v = q[0], q[1:]
    cross = np.cross(v, np.eye(3))
    return np.eye(3) - 2.0 * w * cross + 2.0 * cross @ cross


def turned(q: Any, angle: Any) -> Any:
    """Quaternion after a small rotation, in the world's frame."""
    change = np.concatenate([[-0.5 * q[1:] @ angle], 0.5 * (q[0] * angle + np.cross(angle, q[1:]))])
    return (q + change) / np.linalg.norm(q + change)


ENGINES = [Penalty()]
