"""Runs in the Rerun viewer. It needs the package ``rerun-sdk``."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

from ._trajectory import Trajectory

_TIME = "time"
_FORCES = (0xE0, 0x6C, 0x3C)


def log(run: Trajectory, path: str = "tumble", *, recording: Any | None = None) -> None:
    """Logs a run below the entity ``path`` of a recording, by default the active one.

    The timeline "time" is that of the scene, in s. Entities are

    - ``bodies/NAME``: pose, and its surface as meshes;
    - ``fixed/NAME``: fixed objects;
    - ``contacts``: forces of the step from a state on, as arrows. The weight of all bodies is as
      long as the largest body;
    - ``residual`` (m/s) and ``energy`` (J).

    For example::

        rr.init("tumble", spawn=True)
        tumble.rerun.log(scene.run(500))
    """
    bodies, fixed, fixed_names = run._recording.surfaces()
    names = [*(f"bodies/{rr.escape_entity_path_part(name)}" for name in run.scene.bodies)]
    names += [f"fixed/{index}-{rr.escape_entity_path_part(name)}" for index, name in enumerate(fixed_names)]
    rr.log(path, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True, recording=recording)
    for name, meshes in zip(names, [*bodies, *fixed]):
        for index, (vertices, triangles, colour) in enumerate(meshes):
            colours = np.tile(np.array(colour, dtype=np.uint8), (len(vertices), 1))
            mesh = rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, vertex_colors=colours)
            rr.log(f"{path}/{name}/{index}", mesh, static=True, recording=recording)
    times = [rr.TimeColumn(_TIME, duration=run.time)]
    # Rerun has quaternions x, y, z, w.
    attitudes = run.attitudes[..., [1, 2, 3, 0]]
    for body, name in enumerate(names[: len(bodies)]):
        poses = rr.Transform3D.columns(translation=run.positions[:, body], quaternion=attitudes[:, body])
        rr.send_columns(f"{path}/{name}", times, poses, recording=recording)
    steps = [rr.TimeColumn(_TIME, duration=run.time[:-1])]
    residuals = rr.Scalars.columns(scalars=run.residuals)
    rr.send_columns(f"{path}/residual", steps, residuals, recording=recording)
    rr.send_columns(f"{path}/energy", times, rr.Scalars.columns(scalars=run.energy), recording=recording)
    _log_forces(run, f"{path}/contacts", steps, recording)


def _log_forces(run: Trajectory, path: str, steps: Any, recording: Any | None) -> None:
    """Logs contact forces as arrows."""
    if not run._recording.has_contacts:
        return
    contacts = run.contacts
    loaded = np.any(contacts["force"] != 0.0, axis=1)
    place = contacts["k"][loaded] - run.scene.start_index
    weight = float(run.scene.masses.sum() * np.linalg.norm(run.scene.gravity))
    scale = 2.0 * float(run.scene.extents.max()) / (weight if weight > 0.0 else 1.0)
    counts = np.bincount(place, minlength=len(run.residuals))
    arrows = rr.Arrows3D.columns(
        vectors=scale * contacts["force"][loaded],
        origins=contacts["point"][loaded],
        colors=np.tile(np.array(_FORCES, dtype=np.uint8), (int(loaded.sum()), 1)),
    )
    rr.send_columns(path, steps, arrows.partition(counts), recording=recording)
