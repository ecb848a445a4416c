"""PyBullet: projected Gauss–Seidel on impulses."""

from __future__ import annotations

import time
from importlib.metadata import version
from typing import Any

import numpy as np
import pybullet

from .._scene import Body, Scene
from ._base import Engine, Motion, Stopwatch, Unsupported, rows, world_spin

ITERATIONS = 1000


class Pybullet(Engine):
    """PyBullet with many iterations and a friction cone."""

    name = "pybullet"
    settings = f"{ITERATIONS} iterations, residual threshold 0, friction cone, no damping"
    compliant = True
    """Overlaps of up to 10 µm stay, and larger ones are pushed out over several steps."""

    def version(self) -> str:
        return version("pybullet")

    def run(self, scene: Scene) -> Motion:
        bodies, own = _begun(scene, scene.time_step, 0)
        states = np.empty((scene.steps + 1, len(bodies), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                for place, wrench in enumerate(scene.wrenches(step, states[step])):
                    at = states[step, place, :3]
                    pybullet.applyExternalForce(bodies[place], -1, wrench[:3], at, pybullet.WORLD_FRAME, **own)
                    pybullet.applyExternalTorque(bodies[place], -1, wrench[3:], pybullet.WORLD_FRAME, **own)
            with stopwatch:
                pybullet.stepSimulation(**own)
            poses = [pybullet.getBasePositionAndOrientation(body, **own) for body in bodies]
            speeds = [pybullet.getBaseVelocity(body, **own) for body in bodies]
            attitudes = np.array([pose[1] for pose in poses])[:, [3, 0, 1, 2]]
            places = np.array([pose[0] for pose in poses])
            states[step + 1] = rows(places, attitudes, *(np.array([speed[i] for speed in speeds]) for i in (0, 1)))
        pybullet.disconnect(**own)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)

    def time(self, scene: Scene, before: int) -> float:
        if before > 0 or len(scene.free) > 1:
            raise Unsupported("it is timed with one body, whose steps are substeps of one call")
        _, own = _begun(scene, scene.steps * scene.time_step, scene.steps)
        begin = time.process_time()
        pybullet.stepSimulation(**own)
        seconds = time.process_time() - begin
        pybullet.disconnect(**own)
        return seconds


def _begun(scene: Scene, step: float, substeps: int) -> tuple[list[Any], Any]:
    """Free bodies and client of a scene at its start."""
    own = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
    pybullet.setGravity(*scene.gravity, **own)
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=step,
        numSubSteps=substeps,
        numSolverIterations=ITERATIONS,
        solverResidualThreshold=0.0,
        enableConeFriction=1,
        # Slower approaches do not bounce; tumble's threshold is 2 g h.
        restitutionVelocityThreshold=2.0 * float(np.linalg.norm(scene.gravity)) * scene.time_step,
        **own,
    )
    if scene.ground:
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, planeNormal=(0, 0, 1), **own)
        _material(pybullet.createMultiBody(0, plane, **own), scene, own)
    return [_added(body, scene, own) for body in scene.bodies][: len(scene.free)], own


def _added(body: Body, scene: Scene, own: Any) -> Any:
    w, x, y, z = body.attitude
    mass = 0.0 if body.fixed else body.mass
    made = pybullet.createMultiBody(mass, _shape(body, own), -1, body.position, (x, y, z, w), **own)
    _material(made, scene, own)
    if not body.fixed:
        pybullet.changeDynamics(made, -1, localInertiaDiagonal=body.inertia, **own)
        spin = world_spin(body.state[None])[0]
        pybullet.resetBaseVelocity(made, body.velocity, spin, **own)
    return made


def _shape(body: Body, own: Any) -> Any:
    if body.kind == "box":
        return pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=body.size, **own)
    if body.kind == "sphere":
        return pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=body.size[0], **own)
    if body.kind == "capsule":
        radius, half = body.size
        return pybullet.createCollisionShape(pybullet.GEOM_CAPSULE, radius=radius, height=2.0 * half, **own)
    return pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=body.points.tolist(), **own)


def _material(body: Any, scene: Scene, own: Any) -> None:
    """Coefficients: a contact has the product of both bodies' coefficients."""
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=float(np.sqrt(scene.friction)),
        restitution=float(np.sqrt(scene.restitution)),
        rollingFriction=0.0,
        spinningFriction=0.0,
        linearDamping=0.0,
        angularDamping=0.0,
        maxJointVelocity=1e4,
        **own,
    )


ENGINES: list[Engine] = [Pybullet()]
