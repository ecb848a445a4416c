"""Certificates for the steps of Drake's discrete MultibodyPlant with point contact.

    >>> import tumble.referee_adapters.drake as referee
    >>> certificate = referee.step(simulator, plant, scene_graph)   # instead of simulator.AdvanceTo(time + h)
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._certificate import Certificate
from .._tumble import TumbleError
from ..referee import _frames, certify

try:
    from pydrake.multibody.plant import CalcContactFrictionFromSurfaceProperties
    from pydrake.multibody.tree import JacobianWrtVariable
except ImportError as error:
    raise ImportError("tumble.referee_adapters.drake needs drake; install it with pip install drake") from error


def step(simulator: Any, plant: Any, scene_graph: Any) -> Certificate:
    """Takes a discrete step of ``plant`` and returns its certificate.

    :raises TumbleError: if the plant is continuous or has hydroelastic contacts.
    """
    time_step = plant.time_step()
    if time_step <= 0.0:
        raise TumbleError("the plant is continuous; MultibodyPlant(time_step=...) is needed")
    context = plant.GetMyContextFromRoot(simulator.get_context())
    start = plant.CreateDefaultContext()
    start.SetTimeStateAndParametersFrom(context)
    before = plant.GetVelocities(context).copy()
    torques = np.zeros(0)
    if plant.num_actuators():
        torques = plant.get_net_actuation_output_port().Eval(context)
    simulator.AdvanceTo(simulator.get_context().get_time() + time_step)
    # Ports are sampled: these are the contacts of the step that was taken.
    results = plant.get_contact_results_output_port().Eval(context)
    if results.num_hydroelastic_contacts():
        raise TumbleError("the plant has hydroelastic contacts; ContactModel.kPoint is needed")
    contacts = [results.point_pair_contact_info(place) for place in range(results.num_point_pair_contacts())]
    damping = _damping(plant, start)
    forces = plant.CalcGravityGeneralizedForces(start) - plant.CalcBiasTerm(start) - damping * before
    if len(torques):
        forces = forces + plant.MakeActuationMatrix() @ torques
    inspector = scene_graph.model_inspector()
    J: list[Any] = [np.zeros((0, plant.num_velocities()))]
    impulses, offsets = np.zeros((len(contacts), 3)), np.zeros((len(contacts), 3))
    friction: list[float] = []
    names: list[str] = []
    for place, contact in enumerate(contacts):
        pair = contact.point_pair()
        # Drake's normal points from B to A and its force acts on B.
        frame = _frames(-np.array(pair.nhat_BA_W).reshape(1, 3))[0]
        bodies = [plant.get_body(index) for index in (contact.bodyA_index(), contact.bodyB_index())]
        of_a, of_b = (_jacobian(plant, start, body, contact.contact_point()) for body in bodies)
        J.append(frame @ (of_b - of_a))
        impulses[place] = time_step * frame @ contact.contact_force()
        offsets[place, 0] = -pair.depth / time_step
        surfaces = [
            inspector.GetProximityProperties(geometry).GetProperty("material", "coulomb_friction")
            for geometry in (pair.id_A, pair.id_B)
        ]
        friction.append(CalcContactFrictionFromSurfaceProperties(*surfaces).dynamic_friction())
        names.append("–".join(body.name() for body in bodies))
    return certify(
        M=plant.CalcMassMatrix(start) + time_step * np.diag(damping),
        J=np.concatenate(J),
        velocity_before=before,
        velocity_after=plant.GetVelocities(context),
        force=forces,
        impulses=impulses.ravel(),
        laws=[float(value) for value in friction],
        time_step=time_step,
        w=offsets.ravel(),
        names=names,
        notes=["joint limits and constraints are left out"] if plant.num_constraints() or plant.num_joints() > 1 else [],
    )


def _damping(plant: Any, context: Any) -> Any:
    """Damping of every velocity, which Drake takes implicitly."""
    damping = np.zeros(plant.num_velocities())
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if joint.num_velocities():
            damping[joint.velocity_start() :][: joint.num_velocities()] = joint.GetDampingVector(context)
    return damping


def _jacobian(plant: Any, context: Any, body: Any, point: Any) -> Any:
    """Velocity of a point of a body by the generalised velocities (3, nv)."""
    world = plant.world_frame()
    local = plant.CalcPointsPositions(context, world, np.asarray(point).reshape(3, 1), body.body_frame())
    kind = JacobianWrtVariable.kV
    return plant.CalcJacobianTranslationalVelocity(context, kind, body.body_frame(), local, world, world)
