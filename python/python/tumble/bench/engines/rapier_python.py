"""Rapier in single precision, by its own Python package: all shapes, forces and restitution."""

from __future__ import annotations

from typing import Any

import numpy as np
import rapier3d

from .._scene import Body, Scene
from ._base import Engine, Motion, Stopwatch, rows, world_spin

ITERATIONS = 8
"""Substeps; by default 4."""
SOFTNESS = {"contact_softness": 120.0, "static_contact_softness": 240.0}
"""Natural frequencies of contacts, Hz: four times the defaults."""


class RapierPython(Engine):
    """Rapier with its defaults, or with more iterations and stiffer contacts."""

    compliant = True

    def __init__(self, name: str, stiff: bool, settings: str) -> None:
        self.name, self.stiff, self.settings = name, stiff, settings

    def version(self) -> str:
        return str(rapier3d.__version__)

    def run(self, scene: Scene) -> Motion:
        world = rapier3d.PhysicsWorld(gravity=scene.gravity.tolist())
        # One thread, as in the other adapters.
        world.set_num_threads(1)
        parameters = world.integration_parameters
        parameters.dt = scene.time_step
        if self.stiff:
            parameters.num_solver_iterations = ITERATIONS
            for name, frequency in SOFTNESS.items():
                setattr(parameters, name, rapier3d.SpringCoefficients(frequency, 10.0))
            # Contacts of every step come from the state of that step.
            parameters.contact_recycling = parameters.contact_clustering = False
        handles = [world.add_body(_builder(body), [_collider(body, scene)]) for body in scene.bodies]
        if scene.ground:
            world.add_collider(_material(rapier3d.Collider.halfspace((0.0, 0.0, 1.0)), scene))
        bodies = [world.rigid_bodies[handle] for handle in handles[: len(scene.free)]]
        states = np.empty((scene.steps + 1, len(bodies), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                for body, wrench in zip(bodies, scene.wrenches(step, states[step]), strict=True):
                    body.reset_forces()
                    body.reset_torques()
                    body.add_force(wrench[:3].tolist())
                    body.add_torque(wrench[3:].tolist())
            with stopwatch:
                world.step()
            states[step + 1] = _read(bodies)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


def _read(bodies: list[Any]) -> Any:
    places = np.array([[body.translation.x, body.translation.y, body.translation.z] for body in bodies])
    # The quaternion is x, y, z, w.
    attitudes = np.array([[body.rotation.w, body.rotation.i, body.rotation.j, body.rotation.k] for body in bodies])
    velocities = np.array([[body.linvel.x, body.linvel.y, body.linvel.z] for body in bodies])
    spins = np.array([[body.angvel.x, body.angvel.y, body.angvel.z] for body in bodies])
    return rows(places, attitudes, velocities, spins)


def _builder(body: Body) -> Any:
    place = rapier3d.Isometry3(body.position.tolist(), rapier3d.Rotation3.from_quaternion(*body.attitude.tolist()))
    if body.fixed:
        return rapier3d.RigidBody.fixed().position(place)
    mass = rapier3d.MassProperties((0.0, 0.0, 0.0), body.mass, body.inertia.tolist())
    return (
        rapier3d.RigidBody.dynamic()
        .position(place)
        .linvel(body.velocity.tolist())
        .angvel(world_spin(body.state[None])[0].tolist())
        .additional_mass_properties(mass)
        .can_sleep(False)
        # Otherwise spins above a quarter of a turn a step are cut.
        .allow_fast_rotation(True)
    )


def _collider(body: Body, scene: Scene) -> Any:
    if body.kind == "box":
        made = rapier3d.Collider.cuboid(*body.size)
    elif body.kind == "sphere":
        made = rapier3d.Collider.ball(body.size[0])
    elif body.kind == "capsule":
        made = rapier3d.Collider.capsule_z(body.size[1], body.size[0])
    else:
        made = rapier3d.Collider.convex_hull(body.points)
    return _material(made, scene)


def _material(builder: Any, scene: Scene) -> Any:
    """Contacts have the mean of both coefficients, which are equal."""
    return builder.density(0.0).friction(scene.friction).restitution(scene.restitution)


ENGINES: list[Engine] = [
    RapierPython(
        "rapier-python",
        True,
        f"{ITERATIONS} iterations, contact softness 120 Hz, 240 Hz with fixed bodies, no recycling or clustering of contacts, "
        "single precision",
    ),
    RapierPython("rapier-python-default", False, "defaults: 4 iterations, friction per manifold, single precision"),
]
