"""Mass matrices and forces of MuJoCo's implicit steps.

The integrator "discrete" solves M̂ (v⁺ - v) = h (f - h K v + Jᵀ f_c) with the effective mass M̂ = M + h D + h² K. MuJoCo
builds D and K from joints, tendons, actuators, fluid drag and flexes, and keeps them in the arrays ``efm_*`` of MjData.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._tumble import TumbleError
from ._types import Floats, Integers

try:
    import mujoco as mujoco
except ImportError as error:
    raise ImportError("tumble.mujoco needs mujoco; install it with pip install mujoco") from error

DISCRETE = int(getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", -1))
"""Integrator of MuJoCo 3.13 and later that is implicit in velocities and positions."""
_EXPLICIT = (int(mujoco.mjtIntegrator.mjINT_EULER), int(mujoco.mjtIntegrator.mjINT_RK4))
"""Integrators whose derivatives are those of joint damping alone."""
_UNREAD = 1e-6
"""Relative residual of MuJoCo's smooth solve from which the read mass counts as incomplete."""


def is_discrete(model: Any) -> bool:
    """Whether the model has the integrator "discrete"."""
    return int(model.opt.integrator) == DISCRETE


def step_mass(model: Any, data: Any, bodies: Integers) -> Floats:
    """Mass matrix of the last step (nv, nv): with all terms that the integrator takes implicitly, symmetric.

    :param bodies: standalone free bodies, see ``free_bodies``.
    :raises TumbleError: if MuJoCo does not store the stiffness of a flex.
    """
    if is_discrete(model):
        return _effective_mass(model, data)
    mass = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, mass)
    except TypeError:
        mujoco.mj_fullM(model, mass, data.qM)
    if np.isnan(data.qH).any():
        return mass
    implicit = dense_of(model, data.qH)
    if int(model.opt.integrator) in _EXPLICIT or not len(bodies):
        return implicit
    # MuJoCo solves standalone free bodies apart, with derivatives that qH lacks.
    for at, block in zip(bodies, smooth_derivatives(model, data, bodies)):
        implicit[at : at + 6, at : at + 6] = mass[at : at + 6, at : at + 6] - 0.5 * model.opt.timestep * (
            block + block.T
        )
    return implicit


def dense_of(model: Any, factor: Any) -> Floats:
    """Lᵀ D L of a factor in the sparse form of MuJoCo."""
    L = _lower(model, factor)
    D = L.diagonal().copy()
    np.fill_diagonal(L, 1.0)
    product: Floats = L.T @ (D[:, None] * L)
    return product


def smooth_force(model: Any, data: Any) -> Floats:
    """Force of the last step without constraints (nv,). With "discrete" the springs are at the end of the step."""
    force: Floats = data.qfrc_smooth.copy()
    if is_discrete(model):
        for shift in (data.efm_c, data.efm_ca):
            force += shift if len(shift) else 0.0
    return force


def free_bodies(model: Any) -> Integers:
    """First degree of freedom of each free body without joints below it (B,)."""
    jointed = np.asarray(model.body_jntnum) > 0
    inside = np.bincount(model.body_rootid[jointed], minlength=model.nbody)
    roots = np.flatnonzero(
        jointed & (inside == 1) & (model.body_jntnum == 1) & (model.body_rootid == np.arange(model.nbody))
    )
    free = model.jnt_type[model.body_jntadr[roots]] == int(mujoco.mjtJoint.mjJNT_FREE)
    return np.asarray(model.body_dofadr[roots[free]], np.int64)


def uncoupled(model: Any, data: Any, bodies: Integers) -> Integers:
    """Free bodies that no tendon and no actuator couples in the effective mass."""
    terms = _couplings(model, data)[0] != 0.0
    touched = terms.any(axis=0)
    return np.array([at for at in bodies if not touched[at : at + 6].any()], np.int64)


def gyroscopic_derivatives(model: Any, data: Any, bodies: Integers, velocity: Floats) -> Floats:
    """Derivatives of the gyroscopic forces of free bodies by their velocities (B, 6, 6), at the kinematics of ``data``."""
    found = np.zeros((len(bodies), 6, 6))
    if not len(bodies):
        return found
    rows = bodies[:, None] + np.arange(6)
    saved, bias = data.qvel.copy(), np.zeros(model.nv)
    for axis in range(3, 6):
        # The force is quadratic in the angular velocity, so the central difference is exact.
        for sign in (1.0, -1.0):
            data.qvel[:] = velocity
            data.qvel[bodies + axis] += sign
            mujoco.mj_comVel(model, data)
            mujoco.mj_rne(model, data, 0, bias)
            found[:, :, axis] += 0.5 * sign * bias[rows]
    data.qvel[:] = velocity
    mujoco.mj_comVel(model, data)
    data.qvel[:] = saved
    return found


def smooth_derivatives(model: Any, data: Any, bodies: Integers) -> Floats:
    """Derivatives of drag, damping and actuators of free bodies by their velocities (B, 6, 6), from an implicit step."""
    derivative = np.zeros((model.nv, model.nv))
    derivative[np.repeat(np.arange(model.nv), model.D_rownnz), model.D_colind] = data.qDeriv
    blocks = [derivative[at : at + 6, at : at + 6] for at in bodies]
    return np.array(blocks).reshape(-1, 6, 6)


def free_acceleration(model: Any, data: Any, mass: Floats, bodies: Integers) -> Floats:
    """(v⁺ - v) / h of a discrete step without constraints (nv,). ``bodies`` are the standalone free bodies."""
    acceleration = np.asarray(np.linalg.solve(mass, smooth_force(model, data)), dtype=np.float64)
    time_step, own = model.opt.timestep, uncoupled(model, data, bodies)
    for at, derivative in zip(own, gyroscopic_derivatives(model, data, own, data.qvel.copy())):
        span = slice(at, at + 6)
        block = mass[span, span]
        acceleration[span] = np.linalg.solve(block + time_step * derivative, block @ acceleration[span])
    return acceleration


def advance(model: Any, data: Any) -> None:
    """Integrates velocities by ``data.qacc``, positions, activations and time, without implicit damping."""
    flags = model.opt.disableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    try:
        mujoco.mj_Euler(model, data)
    finally:
        model.opt.disableflags = flags


def _effective_mass(model: Any, data: Any) -> Floats:
    """M̂ = M + h D + h² K of the last step."""
    size = model.nv
    mass = _symmetric(model, data.M)
    if len(data.efm_diag):
        mass[np.arange(size), np.arange(size)] += data.efm_diag
    if len(data.efm_fluid):
        mass += _symmetric(model, data.efm_fluid)
    terms, scales = _couplings(model, data)
    mass += terms.T @ (scales[:, None] * terms)
    if data.nefmK:
        rows = np.repeat(np.arange(size), data.efm_K_rownnz)
        entries = _entries(data.efm_K_rowadr, data.efm_K_rownnz)
        np.add.at(mass, (rows, data.efm_K_colind[entries]), data.efm_K_val[entries])
    if model.nflex:
        _check_flexes(model, data, mass)
    return mass


def _couplings(model: Any, data: Any) -> tuple[Floats, Floats]:
    """Directions (T, nv) and factors (T,) of the terms of tendons, actuators and passive contacts of flexes."""
    directions: list[Floats] = []
    scales: list[float] = []

    def add(columns: Any, values: Any, scale: float) -> None:
        if scale:
            row = np.zeros(model.nv)
            row[columns] = values
            directions.append(row)
            scales.append(scale)

    lengths = np.asarray(data.ten_J).ravel()
    for place in range(data.nefmT):
        tendon = int(data.efm_tid[place])
        span = slice(model.ten_J_rowadr[tendon], model.ten_J_rowadr[tendon] + model.ten_J_rownnz[tendon])
        add(model.ten_J_colind[span], lengths[span], float(data.efm_ts[place]))
    moments = np.asarray(data.actuator_moment).ravel()
    for place in range(data.nefmA):
        actuator = int(data.efm_aid[place])
        first = int(model.actuator_outadr[actuator])
        for row in range(first, first + int(model.actuator_outnum[actuator])):
            span = slice(data.moment_rowadr[row], data.moment_rowadr[row] + data.moment_rownnz[row])
            add(data.moment_colind[span], moments[span], float(data.efm_as[place]))
    at = 0
    while at < data.nefmcon:
        # A packed row: count, contact, columns; scale, force, values.
        span = slice(at + 2, at + 2 + int(data.efm_con_ind[at]))
        add(data.efm_con_ind[span], data.efm_con_val[span], float(data.efm_con_val[at]))
        at = span.stop
    return np.array(directions).reshape(-1, model.nv), np.array(scales)


def _check_flexes(model: Any, data: Any, mass: Floats) -> None:
    """Raises TumbleError if MuJoCo's smooth acceleration does not fit the mass that was read."""
    force = smooth_force(model, data)
    missed = np.abs(mass @ data.qacc_smooth - force).max(initial=0.0)
    if missed > max(_UNREAD, 100.0 * model.opt.tolerance) * np.abs(force).max(initial=0.0):
        raise TumbleError(
            'the integrator "discrete" does not store the stiffness of these flexes; use <option solver="Newton"/>, '
            "or flexes without elasticity"
        )


def _lower(model: Any, values: Any) -> Floats:
    """Lower triangle in the sparsity of MuJoCo's mass matrix, dense."""
    lower = np.zeros((model.nv, model.nv))
    lower[np.repeat(np.arange(model.nv), model.M_rownnz), model.M_colind] = values
    return lower


def _symmetric(model: Any, values: Any) -> Floats:
    lower = _lower(model, values)
    whole: Floats = lower + np.tril(lower, -1).T
    return whole


def _entries(starts: Any, counts: Any) -> Integers:
    """Places of the entries of sparse rows, row by row."""
    counts = np.asarray(counts, np.int64)
    skipped = np.asarray(starts, np.int64) - np.concatenate([[0], np.cumsum(counts)[:-1]])
    return np.asarray(np.repeat(skipped, counts) + np.arange(counts.sum()), np.int64)
