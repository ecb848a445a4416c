"""Certificates for the steps of Newton's XPBD solver with free rigid bodies.

    >>> import tumble.referee_adapters.newton as referee
    >>> observables = solver.observables({solver.ObservableKind.CONTACT_F}, contacts=contacts)
    >>> certificate = referee.step(solver, state, end, control, contacts, h, observables)   # instead of solver.step
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._certificate import Certificate
from .._tumble import TumbleError
from ..referee import certify_bodies

try:
    import newton
    import warp
except ImportError as error:
    raise ImportError("tumble.referee_adapters.newton needs newton; install it with pip install newton") from error


def step(
    solver: Any, start: Any, end: Any, control: Any, contacts: Any, time_step: float, observables: Any
) -> Certificate:
    """Takes a step of ``solver`` and returns its certificate. Newton computes in single precision.

    :param start: state at the start, with the contacts that ``model.collide`` found for it.
    :param observables: container with ``CONTACT_F``, made for ``contacts``.
    :raises TumbleError: if the model has joints between bodies, or ``observables`` has no contact forces.
    """
    model = solver.model
    if observables.contact_f is None:
        raise TumbleError("observables has no contact forces; solver.observables({CONTACT_F}, ...) is needed")
    if any(kind != int(newton.JointType.FREE) for kind in model.joint_type.numpy()):
        raise TumbleError("the model has joints; referee.certify takes generalised coordinates")
    places = start.body_q.numpy().astype(float)
    attitudes = places[:, [6, 3, 4, 5]]
    attitudes /= np.linalg.norm(attitudes, axis=1, keepdims=True)
    before, loads = start.body_qd.numpy().astype(float), start.body_f.numpy().astype(float)
    distance, first, second = _kinematics(model, start, contacts)
    solver.step(start, end, control, contacts, time_step, observables=observables)
    after = end.body_qd.numpy().astype(float)

    count = int(contacts.rigid_contact_count.numpy()[0])
    shapes = np.stack([contacts.rigid_contact_shape0.numpy(), contacts.rigid_contact_shape1.numpy()], axis=1)[:count]
    normals = contacts.rigid_contact_normal.numpy()[:count].astype(float)
    pairs = model.shape_body.numpy()[shapes]
    used = (pairs >= 0).any(axis=1)
    # XPBD takes the mean of both coefficients.
    friction = model.shape_material_mu.numpy()[shapes].mean(axis=1)
    forces = observables.contact_f.numpy()[:count, :3].astype(float)
    return certify_bodies(
        masses=model.body_mass.numpy(),
        inertias=model.body_inertia.numpy(),
        positions=places[:, :3] + _turned(attitudes, model.body_com.numpy().astype(float)),
        attitudes=attitudes,
        velocities=before[:, :3],
        spins=before[:, 3:],
        velocities_after=after[:, :3],
        spins_after=after[:, 3:],
        points=(0.5 * (first + second))[:count][used],
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True))[used],
        pairs=pairs[used].astype(int),
        forces=forces[used],
        friction=friction[used],
        gaps=distance[:count][used],
        gravity=model.gravity.numpy()[0],
        wrenches=loads,
        time_step=time_step,
        names=[str(label) for label in model.body_label],
    )


def _kinematics(model: Any, state: Any, contacts: Any) -> Any:
    """Gaps and both points of all contacts."""
    size = contacts.rigid_contact_max
    gaps = warp.zeros(size, dtype=float, device=model.device)
    points = [warp.zeros(size, dtype=warp.vec3, device=model.device) for _ in range(2)]
    newton.eval_rigid_contact_kinematics(
        model, state, contacts, out_distance=gaps, out_point0_world=points[0], out_point1_world=points[1]
    )
    return tuple(array.numpy().astype(float) for array in (gaps, *points))


def _turned(attitudes: Any, vectors: Any) -> Any:
    """Vectors of the bodies' frames in the world's frame."""
    axes = attitudes[:, 1:]
    across = 2.0 * np.cross(axes, vectors)
    return vectors + attitudes[:, :1] * across + np.cross(axes, across)
