"""Genesis on the processor: compliant contacts, in double precision."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import genesis as gs
import numpy as np

from .._scene import Scene
from ._base import Engine, Motion, Stopwatch, Unsupported, no_restitution, rows, world_spin
from ._mjcf import mjcf_of

PRECISE = {
    "friction_cone": gs.friction_cone.elliptic,
    "constraint_timeconst": None,
    "iterations": 100,
    "tolerance": 1e-12,
    "contact_pruning_tolerance": None,
    "use_gjk_collision": True,
}
"""The cone that its documents advise against creep, with Signorini's law and impratio 100, and contacts of 2 h, the stiffest."""
LEAST_FRICTION, MOST_FRICTION = 0.01, 5.0


class Genesis(Engine):
    """Genesis with options of its rigid solver."""

    compliant = True

    def __init__(self, name: str, options: dict[str, Any], settings: str) -> None:
        self.name, self.options, self.settings = name, options, settings

    def version(self) -> str:
        return str(gs.__version__)

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene)
        if not LEAST_FRICTION <= scene.friction <= MOST_FRICTION:
            raise Unsupported(f"friction is from {LEAST_FRICTION} to {MOST_FRICTION:g} ({scene.friction:g} is needed)")
        if not gs._initialized:
            gs.init(backend=gs.cpu, precision="64", logging_level="error")
        world = gs.Scene(
            show_viewer=False,
            sim_options=gs.options.SimOptions(dt=scene.time_step, gravity=tuple(scene.gravity)),
            rigid_options=gs.options.RigidOptions(**self.options),
        )
        if scene.ground:
            world.add_entity(gs.morphs.Plane(), material=gs.materials.Rigid(friction=scene.friction))
        added = []
        for body in scene.bodies:
            model = mjcf_of(replace(scene, bodies=[body], forces=[], ground=False), "")
            added.append(world.add_entity(gs.morphs.MJCF(file=model), material=gs.materials.Rigid(friction=scene.friction)))
        world.build()
        bodies = added[: len(scene.free)]
        solver, links = world.rigid_solver, [body.links[-1].idx for body in bodies]
        # The velocities of a free joint are in the world's frame.
        solver.set_dofs_velocity(
            np.concatenate([scene.states[:, 7:10], world_spin(scene.states)], axis=1).ravel(),
            [dof for body in bodies for dof in range(body.dof_start, body.dof_end)],
        )
        states = np.empty((scene.steps + 1, len(bodies), 13))
        states[0] = scene.states
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                wrenches = scene.wrenches(step, states[step])
                centre = gs.link_ref_frame.link_COM
                solver.apply_links_external_wrench(wrenches[:, :3], wrenches[:, 3:], links, ref=centre)
            with stopwatch:
                world.step(update_visualizer=False, refresh_visualizer=False)
            read = (solver.get_links_pos, solver.get_links_quat, solver.get_links_vel, solver.get_links_ang)
            states[step + 1] = rows(*(np.asarray(get(links)) for get in read))
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


ENGINES: list[Engine] = [
    Genesis("genesis", PRECISE, "double precision; elliptic cone, Signorini's law, 100 iterations, contacts of 2 h, GJK"),
    Genesis("genesis-default", {}, "double precision, defaults: pyramid, 25 iterations, contacts of 10 ms"),
]
