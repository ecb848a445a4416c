"""Certificates for PyBullet's steps of rigid bodies.

    >>> import pybullet, tumble.referee_adapters.pybullet as referee
    >>> certificate = referee.step()      # instead of pybullet.stepSimulation()
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .._certificate import Certificate
from .._tumble import TumbleError
from ..referee import certify_bodies

try:
    import pybullet
except ImportError as error:
    raise ImportError("tumble.referee_adapters.pybullet needs pybullet; install it with pip install pybullet") from error

_MASS, _FRICTION, _INERTIA = 0, 1, 2


def step(client: int = 0, wrenches: Mapping[int, Any] | None = None) -> Certificate:
    """Takes a step of PyBullet and returns its certificate.

    Bullet damps velocities (0.04/s by default), which adds to the residual of dynamics. ``pybullet.changeDynamics``
    sets both dampings to zero.

    :param wrenches: forces and torques (6,) by body that were applied before, N and N m in the world's frame.
    :raises TumbleError: if a moving body has joints.
    """
    moving = _moving(client)
    places = {body: place for place, body in enumerate(moving)}
    before = [_state(body, client) for body in moving]
    pybullet.stepSimulation(physicsClientId=client)
    after = [pybullet.getBaseVelocity(body, physicsClientId=client) for body in moving]
    dynamics = {body: pybullet.getDynamicsInfo(body, -1, physicsClientId=client) for body in moving}
    found = pybullet.getContactPoints(physicsClientId=client) or ()
    contacts = [each for each in found if each[1] in places or each[2] in places]
    settings = pybullet.getPhysicsEngineParameters(physicsClientId=client)
    normals = np.array([each[7] for each in contacts]).reshape(-1, 3)
    return certify_bodies(
        masses=[dynamics[body][_MASS] for body in moving],
        inertias=np.array([np.diag(dynamics[body][_INERTIA]) for body in moving]).reshape(-1, 3, 3),
        positions=np.array([state[0] for state in before]).reshape(-1, 3),
        attitudes=np.array([state[1] for state in before]).reshape(-1, 4),
        velocities=np.array([state[2] for state in before]).reshape(-1, 3),
        spins=np.array([state[3] for state in before]).reshape(-1, 3),
        velocities_after=np.array([linear for linear, _ in after]).reshape(-1, 3),
        spins_after=np.array([angular for _, angular in after]).reshape(-1, 3),
        points=np.array([each[6] for each in contacts]).reshape(-1, 3),
        # Bullet's normal points from B to A.
        normals=-normals,
        pairs=np.array([[places.get(each[1], -1), places.get(each[2], -1)] for each in contacts], int).reshape(-1, 2),
        forces=np.array([_force(each) for each in contacts]).reshape(-1, 3),
        friction=np.array([_friction(each, client) for each in contacts]),
        gaps=np.array([each[8] for each in contacts]),
        gravity=[settings["gravityAccelerationX"], settings["gravityAccelerationY"], settings["gravityAccelerationZ"]],
        wrenches=np.array([(wrenches or {}).get(body, np.zeros(6)) for body in moving]).reshape(-1, 6),
        time_step=settings["fixedTimeStep"],
        names=[pybullet.getBodyInfo(body, physicsClientId=client)[1].decode() or f"body {body}" for body in moving],
    )


def _moving(client: int) -> list[int]:
    """Bodies with a mass."""
    moving = []
    for place in range(pybullet.getNumBodies(physicsClientId=client)):
        body = pybullet.getBodyUniqueId(place, physicsClientId=client)
        if pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[_MASS] <= 0.0:
            continue
        if pybullet.getNumJoints(body, physicsClientId=client):
            raise TumbleError(f"body {body} has joints; referee.certify takes generalised coordinates")
        moving.append(body)
    return moving


def _state(body: int, client: int) -> tuple[Any, Any, Any, Any]:
    position, (x, y, z, w) = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    linear, angular = pybullet.getBaseVelocity(body, physicsClientId=client)
    return position, (w, x, y, z), linear, angular


def _force(contact: Any) -> Any:
    """Force on A in the world's frame."""
    normal, first, second = (np.array(contact[place]) for place in (7, 11, 13))
    return contact[9] * normal + contact[10] * first + contact[12] * second


def _friction(contact: Any, client: int) -> float:
    """Coefficient of a pair: Bullet multiplies both."""
    pair: dict[int, float] = {
        body: pybullet.getDynamicsInfo(body, link, physicsClientId=client)[_FRICTION]
        for body, link in ((contact[1], contact[3]), (contact[2], contact[4]))
    }
    return float(np.prod(list(pair.values())))
