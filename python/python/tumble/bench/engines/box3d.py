"""Box3D in single precision, by the library in the Python package robox3d."""

from __future__ import annotations

from typing import Any

import numpy as np
from robox3d._ffi import ffi, lib

from .._scene import Body, Scene
from ._base import Engine, Motion, Stopwatch, rows, world_spin

GROUND = (100.0, 100.0, 10.0)
"""Half sides of the box that is the ground, m. Its end is farther than any case reaches."""


class Box3d(Engine):
    """Box3D with a number of substeps, and with contacts of a frequency (Hz) or its default one."""

    compliant = True

    def __init__(self, name: str, substeps: int, frequency: float | None, settings: str) -> None:
        self.name, self.substeps, self.frequency, self.settings = name, substeps, frequency, settings

    def version(self) -> str:
        found = lib.b3GetVersion()
        return f"{found.major}.{found.minor}.{found.revision}"

    def run(self, scene: Scene) -> Motion:
        world = self._world(scene)
        bodies = [_added(world, body, scene) for body in scene.bodies][: len(scene.free)]
        states = np.empty((scene.steps + 1, len(bodies), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                for body, wrench in zip(bodies, scene.wrenches(step, states[step]).tolist(), strict=True):
                    lib.b3Body_ApplyForceToCenter(body, wrench[:3], True)
                    lib.b3Body_ApplyTorque(body, wrench[3:], True)
            with stopwatch:
                lib.b3World_Step(world, scene.time_step, self.substeps)
            states[step + 1] = _read(bodies)
        lib.b3DestroyWorld(world)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)

    def _world(self, scene: Scene) -> Any:
        definition = lib.b3DefaultWorldDef()
        definition.gravity = scene.gravity.tolist()
        definition.enableSleep = False
        # Slower approaches do not bounce; tumble's threshold is 2 g h.
        definition.restitutionThreshold = 2.0 * float(np.linalg.norm(scene.gravity)) * scene.time_step
        definition.maximumLinearSpeed = 1e4
        if self.frequency is not None:
            definition.contactHertz = self.frequency
        world = lib.b3CreateWorld(ffi.new("b3WorldDef*", definition))
        if scene.ground:
            definition = lib.b3DefaultBodyDef()
            definition.position = [0.0, 0.0, -GROUND[2]]
            _shaped(lib.b3CreateBody(world, ffi.new("b3BodyDef*", definition)), "box", GROUND, None, scene)
        return world


def _added(world: Any, body: Body, scene: Scene) -> Any:
    w, x, y, z = body.attitude.tolist()
    definition = lib.b3DefaultBodyDef()
    definition.position, definition.rotation = body.position.tolist(), [[x, y, z], w]
    if not body.fixed:
        definition.type = lib.b3_dynamicBody
        definition.linearVelocity = body.velocity.tolist()
        definition.angularVelocity = world_spin(body.state[None])[0].tolist()
        # Otherwise spins above a quarter of a turn a step are cut.
        definition.allowFastRotation = True
        # Contacts of every step come from the state of that step.
        definition.enableContactRecycling = False
    made = lib.b3CreateBody(world, ffi.new("b3BodyDef*", definition))
    _shaped(made, body.kind, body.size, body.points, scene)
    if not body.fixed:
        lib.b3Body_SetMassData(made, [body.mass, [0.0, 0.0, 0.0], np.diag(body.inertia).tolist()])
    return made


def _shaped(made: Any, kind: str, size: Any, points: Any, scene: Scene) -> None:
    """Gives a body its shape. Contacts have the geometric mean of frictions and the larger restitution, which are equal."""
    definition = lib.b3DefaultShapeDef()
    definition.baseMaterial.friction, definition.baseMaterial.restitution = scene.friction, scene.restitution
    settings = ffi.new("b3ShapeDef*", definition)
    if kind == "sphere":
        lib.b3CreateSphereShape(made, settings, ffi.new("b3Sphere*", [[0.0, 0.0, 0.0], size[0]]))
    elif kind == "capsule":
        ends = [[0.0, 0.0, size[1]], [0.0, 0.0, -size[1]]]
        lib.b3CreateCapsuleShape(made, settings, ffi.new("b3Capsule*", [*ends, size[0]]))
    elif kind == "box":
        hull = ffi.new("b3BoxHull*", lib.b3MakeBoxHull(*size))
        lib.b3CreateHullShape(made, settings, ffi.addressof(hull, "base"))
    else:
        hull = lib.b3CreateHull(ffi.new("b3Vec3[]", points.tolist()), len(points), len(points))
        if hull == ffi.NULL:
            raise RuntimeError(f"Box3D does not make a hull of {len(points)} points")
        lib.b3CreateHullShape(made, settings, hull)
        lib.b3DestroyHull(hull)


def _read(bodies: list[Any]) -> Any:
    poses = [lib.b3Body_GetTransform(body) for body in bodies]
    speeds = [(lib.b3Body_GetLinearVelocity(body), lib.b3Body_GetAngularVelocity(body)) for body in bodies]
    return rows(
        np.array([_vector(pose.p) for pose in poses]),
        np.array([[pose.q.s, *_vector(pose.q.v)] for pose in poses]),
        *(np.array([_vector(pair[place]) for pair in speeds]) for place in (0, 1)),
    )


def _vector(found: Any) -> list[float]:
    return [found.x, found.y, found.z]


ENGINES: list[Engine] = [
    Box3d("box3d", 4, 240.0, "single precision, 4 substeps, contacts of 240 Hz, no recycling of contacts"),
    Box3d("box3d-default", 4, None, "single precision, 4 substeps, contacts of 30 Hz, no recycling of contacts"),
]
