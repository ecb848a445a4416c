"""SuperDex in double precision: compliant contacts of surface samples with distance fields, solved implicitly."""

from __future__ import annotations

import os
from importlib.metadata import version
from typing import Any

import numpy as np

os.environ.setdefault("SUPERDEX_PRECISION", "fp64")
from superdex import physics  # noqa: E402

from .._scene import Body, Scene  # noqa: E402
from .._solids import prism_triangles  # noqa: E402
from ._base import Engine, Motion, Stopwatch, Unsupported, no_restitution, rows, world_spin  # noqa: E402

COLLIDERS = {"box": physics.ColliderType.BOX, "sphere": physics.ColliderType.SPHERE, "hull": physics.ColliderType.SDF}
PRECISE_NEWTON = {"max_iter": 50, "abs_tol": 1e-9, "rel_tol": 1e-10}
PRECISE_CONTACT = {
    "friction_falloff_vel": 1e-4,
    "penalty_smoothing_half_distance": 1e-4,
    "penalty_threshold_default": 0.0,
}
"""Slip of full friction, m/s, half the depth in which the stiffness begins, and the gap at which it begins, m."""
DIVISIONS = 8
"""Squares along an edge of a cube, whose triangles are the samples of a box or, projected, of a ball."""


class Superdex(Engine):
    """SuperDex with its defaults, or with steps and contacts that are more precise."""

    compliant = True

    def __init__(self, name: str, precise: bool, settings: str) -> None:
        self.name, self.precise, self.settings = name, precise, settings

    def version(self) -> str:
        return version("superdex-physics")

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene)
        if not physics.is_initialized():
            physics.initialize(0)
        world = physics.create_scene("bench")
        world.set_gravity(scene.gravity.tolist())
        if self.precise:
            solver = world.get_solver_params()
            for name, value in PRECISE_NEWTON.items():
                setattr(solver.non_linear_solver, name, value)
            world.set_solver_params(solver)
        if scene.ground:
            plane = physics.create_plane_shape(normal=[0.0, 0.0, 1.0], distance=0.0)
            world.create_rigid_actor(name="ground", shape=plane, is_static=True, contact=self._contact(scene))
        actors = [self._added(world, body, scene) for body in scene.bodies][: len(scene.free)]
        states = np.empty((scene.steps + 1, len(actors), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                for actor, wrench in zip(actors, scene.wrenches(step, states[step]), strict=True):
                    actor.set_external_forces_on_dofs(np.arange(6, dtype=np.int32), wrench)
            with stopwatch:
                world.step(scene.time_step)
            states[step + 1] = _read(actors)
        physics.destroy_scene(world)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)

    def _contact(self, scene: Scene) -> Any:
        contact = physics.ContactParams()
        contact.coulomb_friction_coefficient = scene.friction
        for name, value in PRECISE_CONTACT.items() if self.precise else ():
            setattr(contact, name, value)
        return contact

    def _added(self, world: Any, body: Body, scene: Scene) -> Any:
        w, x, y, z = body.attitude.tolist()
        place = physics.TransformRT(physics.Quaternion(x, y, z, w), body.position.tolist())
        moving: dict[str, Any] = {}
        if not body.fixed:
            ix, iy, iz = body.inertia.tolist()
            moving = {
                "mass": body.mass,
                "center_of_mass": [0.0, 0.0, 0.0],
                "moment_of_inertia": [ix, 0.0, 0.0, iy, 0.0, iz],
                "linear_velocity": body.velocity.tolist(),
                "angular_velocity": world_spin(body.state[None])[0].tolist(),
            }
        made = world.create_rigid_actor(
            name=body.name,
            shape=physics.create_tri_mesh_shape(*_mesh(body)),
            is_static=body.fixed,
            world_from_local=place,
            contact=self._contact(scene),
            collider_type=COLLIDERS[body.kind],
            **moving,
        )
        if self.precise and not body.fixed:
            physics.experimental.enable_newton_euler_inertia(made, True)
        return made


def _mesh(body: Body) -> tuple[Any, Any]:
    """Corners and outward triangles of the surface that meets other bodies."""
    if body.kind == "capsule":
        raise Unsupported("the adapter has no capsules")
    if body.kind == "hull":
        return body.points.ravel(), prism_triangles(len(body.points)).ravel()
    ticks = np.linspace(-1.0, 1.0, DIVISIONS + 1)
    flat = np.stack([*np.meshgrid(ticks, ticks, indexing="ij"), np.ones((DIVISIONS + 1,) * 2)], axis=-1).reshape(-1, 3)
    first = (np.arange(DIVISIONS)[:, None] * (DIVISIONS + 1) + np.arange(DIVISIONS)).reshape(-1, 1)
    across = DIVISIONS + 1
    square = np.concatenate([first + [0, across, across + 1], first + [0, across + 1, 1]])
    points = np.concatenate(
        [sign * np.roll(flat * [1.0, sign, 1.0], axis, axis=1) for axis in range(3) for sign in (1, -1)]
    )
    triangles = np.concatenate([square + side * len(flat) for side in range(6)])
    unique, place = np.unique(points.round(12), axis=0, return_inverse=True)
    if body.kind == "sphere":
        angles = np.tan(0.25 * np.pi * unique)
        unique = body.size[0] * angles / np.linalg.norm(angles, axis=1, keepdims=True)
    else:
        unique = unique * body.size
    return unique.ravel(), place.ravel()[triangles].ravel().astype(np.int32)


def _read(actors: list[Any]) -> Any:
    poses = [actor.get_center_of_mass_transform() for actor in actors]
    turns = np.array([pose.rotation.tolist() for pose in poses])[:, [3, 0, 1, 2]]
    places = np.array([list(pose.translation) for pose in poses])
    speeds = (
        np.array([list(get()) for get in found])
        for found in ([actor.get_linear_velocity for actor in actors], [actor.get_angular_velocity for actor in actors])
    )
    return rows(places, turns, *speeds)


ENGINES: list[Engine] = [
    Superdex(
        "superdex",
        True,
        "double precision, Newton to 1e-9, Newton–Euler inertia, friction velocity 1e-4 m/s, contact from 0 mm, smoothed by 0.1 mm",
    ),
    Superdex("superdex-default", False, "double precision, defaults: backward Euler, 4 iterations of Newton"),
]
