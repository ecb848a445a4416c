"""Newton on the processor with two of its solvers, in single precision. Steps are replayed from recorded graphs."""

from __future__ import annotations

from typing import Any

import newton
import numpy as np
import warp

from .._scene import Body, Scene
from .._solids import prism_triangles
from ._base import Engine, Motion, Stopwatch, rows, world_spin

ITERATIONS = 50
"""Iterations of XPBD, whose default is 2."""
CONTACTS_PER_BODY = 32
"""Room for contacts. Kamino's time grows with the room, not with the contacts; Newton's own room is 1000."""


class Newton(Engine):
    """Newton with one of its solvers for rigid bodies."""

    def __init__(self, name: str, compliant: bool, settings: str) -> None:
        self.name, self.compliant, self.settings = name, compliant, settings

    def version(self) -> str:
        return str(newton.__version__)

    def run(self, scene: Scene) -> Motion:
        warp.config.quiet = True
        with warp.ScopedDevice("cpu"):
            return self._run(scene)

    def _run(self, scene: Scene) -> Motion:
        model = _model(scene)
        room = CONTACTS_PER_BODY * len(scene.bodies)
        pipeline = newton.CollisionPipeline(model, deterministic=True, rigid_contact_max=room)
        contacts, control = pipeline.contacts(), model.control()
        now, then = model.state(), model.state()

        def step(solver: Any, before: Any, after: Any) -> None:
            pipeline.collide(before, contacts)
            solver.step(before, after, control, contacts, scene.time_step)

        # The first step compiles kernels; the motion starts again with another solver.
        _start(now, scene)
        step(self._solver(model, scene), now, then)
        solver = self._solver(model, scene)
        _start(now, scene)
        with warp.ScopedCapture() as there:
            step(solver, now, then)
        with warp.ScopedCapture() as back:
            step(solver, then, now)
        count = len(scene.free)
        states = np.empty((scene.steps + 1, count, 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for index in range(scene.steps):
            before, after, recorded = (now, then, there) if index % 2 == 0 else (then, now, back)
            if scene.forces:
                before.body_f.assign(scene.wrenches(index, states[index]).astype(np.float32))
            with stopwatch:
                warp.capture_launch(recorded.graph)
            found = int(contacts.rigid_contact_count.numpy()[0])
            if found > room:
                raise RuntimeError(f"{found} contacts in step {index}; the adapter has room for {room}")
            places, speeds = after.body_q.numpy().astype(float), after.body_qd.numpy().astype(float)
            attitudes = places[:, [6, 3, 4, 5]]
            states[index + 1] = rows(places[:, :3], attitudes, speeds[:, :3], speeds[:, 3:])[:count]
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)

    def _solver(self, model: Any, scene: Scene) -> Any:
        if self.name == "newton-kamino":
            return newton.solvers.SolverKamino(model)
        return newton.solvers.SolverXPBD(
            model, iterations=ITERATIONS, enable_restitution=scene.restitution > 0.0
        )


def _model(scene: Scene) -> Any:
    builder = newton.ModelBuilder()
    newton.solvers.SolverKamino.register_custom_attributes(builder)
    material = newton.ModelBuilder.ShapeConfig(
        density=0.0, mu=scene.friction, restitution=scene.restitution, mu_torsional=0.0, mu_rolling=0.0
    )
    for body in scene.bodies:
        place = warp.transform(body.position.tolist(), warp.quat(*np.roll(body.attitude, -1).tolist()))
        if body.fixed:
            _shape(builder, -1, body, place, material)
            continue
        inertia = warp.mat33(*np.diag(body.inertia).ravel().tolist())
        made = builder.add_body(xform=place, mass=body.mass, inertia=inertia, lock_inertia=True, label=body.name)
        _shape(builder, made, body, warp.transform_identity(), material)
    if scene.ground:
        builder.add_ground_plane(cfg=material)
    model = builder.finalize()
    model.set_gravity(scene.gravity.tolist())
    return model


def _shape(builder: Any, made: int, body: Body, place: Any, material: Any) -> None:
    given = {"body": made, "xform": place, "cfg": material}
    if body.kind == "box":
        builder.add_shape_box(hx=body.size[0], hy=body.size[1], hz=body.size[2], **given)
    elif body.kind == "sphere":
        builder.add_shape_sphere(radius=body.size[0], **given)
    elif body.kind == "capsule":
        builder.add_shape_capsule(radius=body.size[0], half_height=body.size[1], **given)
    else:
        mesh = newton.Mesh(body.points.astype(np.float32), prism_triangles(len(body.points)).ravel())
        builder.add_shape_convex_hull(mesh=mesh, **given)


def _start(state: Any, scene: Scene) -> None:
    """Sets the initial states: poses with quaternions x, y, z, w, velocities and world spins."""
    starts = scene.states
    state.body_q.assign(np.concatenate([starts[:, :3], starts[:, [4, 5, 6, 3]]], axis=1).astype(np.float32))
    state.body_qd.assign(np.concatenate([starts[:, 7:10], world_spin(starts)], axis=1).astype(np.float32))


ENGINES: list[Engine] = [
    Newton("newton-kamino", True, "Kamino, defaults (PADMM, 200 iterations), single precision, on the processor"),
    Newton("newton-xpbd", True, f"XPBD, {ITERATIONS} iterations, single precision, on the processor"),
]
