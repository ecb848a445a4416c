"""Certificates of MuJoCo's own steps."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ._certificate import Certificate
from ._measured_step import MeasuredStep, checked_step
from ._mujoco_metric import gyroscopic_derivatives, is_discrete, smooth_derivatives, smooth_force, step_mass, uncoupled
from ._mujoco_rows import ContactRows, JointRows, filled, groups_at, laws_of, mujoco, notes_of, raised_margins
from ._mujoco_step import HardStepper, single_stage
from ._types import Floats


def certify_step(stepper: HardStepper, data: Any) -> tuple[Certificate, Any]:
    """Certificate of MuJoCo's next step from ``data``, and a copy of ``data`` after that step."""
    step, after = measured_step(stepper, data)
    return step.certificate(), after


def measured_step(stepper: HardStepper, data: Any) -> tuple[MeasuredStep, Any]:
    """Arrays of MuJoCo's next step from ``data``, and a copy of ``data`` after that step."""
    model, collector = stepper.model, stepper.collector
    collector.check(data)
    after = copy.copy(data)
    integrator = model.opt.integrator
    model.opt.integrator = single_stage(integrator)
    try:
        after.qH[:] = np.nan
        mujoco.mj_step(model, after)
        ahead_contacts, ahead_joints = _rows_ahead(stepper, data)
    finally:
        model.opt.integrator = integrator
    contacts, joints = collector.contacts(after), collector.joints(after)
    open_contacts, open_joints = _untouched(contacts, ahead_contacts), _unlimited(joints, ahead_joints)
    time_step, size = model.opt.timestep, model.nv
    pushes, forces = _contact_forces(model, after, contacts), np.asarray(after.efc_force)[joints.index]
    J = np.concatenate([contacts.directions(), joints.J])
    carried = np.concatenate([pushes, forces])
    loads = smooth_force(model, after) + _unsymmetric_forces(stepper, data, after)
    if model.opt.enableflags & int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0)):
        awake = np.union1d(data.dof_awake_ind[: data.nv_awake], after.dof_awake_ind[: after.nv_awake])
        # Sleeping bodies do not move and have no rows.
        loads[np.setdiff1d(np.arange(size), awake)] = 0.0
    notes = notes_of(collector, contacts)
    if any("left out" in note for note in notes):
        # Newton's law includes the forces whose laws the certificate leaves out.
        loads += after.qfrc_constraint - J.T @ carried
    opened = ahead_contacts.kept(open_contacts)
    contact_w, open_w = (np.column_stack([of.gap / time_step, of.surface]).ravel() for of in (contacts, opened))
    none = np.zeros(int(open_joints.sum()))
    limits = [(int(joints.kind[at]), int(joints.id[at])) for at in groups_at(laws_of(joints, time_step))]
    limits += [(int(ahead_joints.kind[at]), int(ahead_joints.id[at])) for at in np.flatnonzero(open_joints)]
    step = checked_step(
        M=step_mass(model, after, collector.free_bodies),
        J=np.concatenate(
            [
                contacts.directions(),
                opened.J.reshape(3 * len(opened.gap), size),
                joints.J,
                ahead_joints.J[open_joints],
            ]
        ),
        velocity_before=data.qvel,
        velocity_after=after.qvel,
        force=loads,
        impulses=time_step * np.concatenate([pushes, np.zeros(3 * len(opened.gap)), forces, none]),
        laws=contacts.laws() + opened.friction.tolist() + laws_of(joints, time_step) + [["limit"]] * len(none),
        time_step=time_step,
        w=np.concatenate(
            [
                contact_w,
                np.zeros(3 * len(contacts.resisting)),
                open_w,
                joints.gap / time_step,
                ahead_joints.gap[open_joints] / time_step,
            ]
        ),
        names=collector.contact_names(contacts)
        + [collector.contact_name(pair) for pair in opened.geoms]
        + [collector.joint_name(*row) for row in limits],
        notes=notes,
    )
    stretch = np.concatenate([contacts.factors(), opened.factors()[: 3 * len(opened.gap)]])
    return replace(step, drifted=True, stretch=filled(stretch, len(step.impulses))), after


def _unsymmetric_forces(stepper: HardStepper, data: Any, after: Any) -> Floats:
    """Implicit forces of MuJoCo's step that its symmetric mass matrix lacks (nv,): of standalone free bodies."""
    model, collector = stepper.model, stepper.collector
    forces: Floats = np.zeros(model.nv)
    bodies = collector.free_bodies
    if not len(bodies) or single_stage(model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_EULER):
        return forces
    if is_discrete(model):
        # MuJoCo leaves these forces explicit for bodies with rows or couplings.
        bodies = uncoupled(model, after, collector.untouched(after))
    derivatives = -gyroscopic_derivatives(model, after, bodies, data.qvel.copy())
    if not is_discrete(model):
        smooth = smooth_derivatives(model, after, bodies)
        derivatives += 0.5 * (smooth - np.swapaxes(smooth, 1, 2))
    change = after.qvel - data.qvel
    for at, derivative in zip(bodies, derivatives):
        forces[at : at + 6] = derivative @ change[at : at + 6]
    return forces


def _rows_ahead(stepper: HardStepper, data: Any) -> tuple[ContactRows, JointRows]:
    """Contacts and joint limits that the step may reach, detected with raised margins."""
    model, scratch = stepper.model, copy.copy(data)
    ahead = stepper.reach(scratch)
    with raised_margins(model, ahead):
        mujoco.mj_fwdPosition(model, scratch)
    return stepper.collector.contacts(scratch, ahead), stepper.collector.joints(scratch, ahead)


def _untouched(contacts: ContactRows, ahead: ContactRows) -> Any:
    """Contacts ahead between geoms that have no contact in MuJoCo's step."""
    known = {tuple(pair) for pair in contacts.geoms.tolist()}
    return np.array([tuple(pair) not in known for pair in ahead.geoms.tolist()], dtype=bool)


def _unlimited(joints: JointRows, ahead: JointRows) -> Any:
    """Joint limits ahead that have no row in MuJoCo's step."""
    limits = (int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT), int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON))

    def keys(rows: JointRows) -> list[tuple[int, int, bool]]:
        # The sign tells the lower limit from the upper one.
        return [(int(kind), int(id_), bool(J.sum() > 0.0)) for kind, id_, J in zip(rows.kind, rows.id, rows.J)]

    known = set(keys(joints))
    return np.array([key[0] in limits and key not in known for key in keys(ahead)], dtype=bool)


def _contact_forces(model: Any, data: Any, contacts: ContactRows) -> Floats:
    """Forces of MuJoCo's contacts along the rows of contacts, N, and of moments, N m."""
    forces = np.zeros((len(contacts.index), 6))
    for place, index in enumerate(contacts.index):
        mujoco.mj_contactForce(model, data, int(index), forces[place])
    pushes, moments = forces[:, :3], forces[contacts.resisting][:, [4, 5, 3]]
    pushes[:, 1:] /= contacts.stretch
    moments[:, :2] /= contacts.turn_stretch
    carried: Floats = np.concatenate([pushes.ravel(), moments.ravel()])
    return carried
