"""Steps of MuJoCo models with hard contact and Coulomb's exact law."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ._certificate import Certificate
from ._measured_step import MeasuredStep, checked_step
from ._mujoco_metric import DISCRETE, advance, free_acceleration, is_discrete, step_mass
from ._mujoco_problem import (
    RECOVERY,
    StepProblem,
    StepSolution,
    by_key,
    contact_keys,
    exact_offsets,
    joint_keys,
    recovered,
)
from ._mujoco_rows import (
    LIMITS,
    ContactRows,
    JointRows,
    Reach,
    RowCollector,
    filled,
    groups_at,
    laws_of,
    mujoco,
    notes_of,
    raised_margins,
)
from ._problem import ContactProblem
from ._tumble import TumbleError
from ._types import Floats

RESIDUAL = 1e-9
"""Residual to which a step is solved, m/s."""
_REACH = 2.0
"""Contacts are detected this many times the distance ahead that the fastest body travels in a step."""
_LEAST_REACH = 1e-4
"""Least distance of that kind, m."""
_LEAST_TURN = 1e-2
"""Least distance ahead of limits, rad or m."""
_WILD = 3.0
"""Overlaps are kept if their removal makes velocities this many times as large."""
_LEAST_WILD = 20.0
"""Speed that is not too large for this, m/s or rad/s."""
_RETRY = 20
"""Overlaps that are kept are tried again after this many steps."""
_LEAST_BEYOND = 1e-6
"""Excess of a limit that a note names, rad or m."""
_LARGEST = 1e10
"""Acceleration from which MuJoCo resets a state, mjMAXVAL."""
_BOUNCE = 2.0
"""Contacts bounce if they approach faster than this many steps of gravity."""
_INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_EULER): mujoco.mjtIntegrator.mjINT_EULER,
    int(mujoco.mjtIntegrator.mjINT_RK4): mujoco.mjtIntegrator.mjINT_EULER,
    DISCRETE: DISCRETE,
}
"""Integrator that takes the place of a model's own; IMPLICITFAST for all others."""


class UnsolvedStep(UserWarning):
    """Warning about a step that was not solved to the residual."""


def single_stage(integrator: int) -> int:
    """Integrator with one stage and a symmetric matrix."""
    return int(_INTEGRATORS.get(int(integrator), mujoco.mjtIntegrator.mjINT_IMPLICITFAST))


@dataclass
class HardStep:
    """Report of a hard step."""

    solved: bool
    """Whether the residual is at most ``residual`` of the stepper."""
    residual: float
    """Largest residual of the contact laws, m/s."""
    iterations: int
    contacts: int
    """Contacts that were detected."""
    closed: int
    """Contacts that carry a force."""
    overlap: float
    """Deepest overlap at the start of the step, m."""
    notes: tuple[str, ...] = ()
    """Parts of the model that have no hard counterpart."""
    _parts: dict[str, Any] = field(default_factory=dict, repr=False)

    def problem(self) -> ContactProblem:
        """Contact problem of this step in the form M, H, f, w."""
        step = self._parts["step"]
        momentum = step["M"] @ step["velocity_before"] + step["time_step"] * step["force"]
        return ContactProblem(M=step["M"], H=step["J"].T, f=momentum, w=step["w"], laws=step["laws"])

    def certificate(self) -> Certificate:
        """Certificate of this step, computed by ``tumble.referee`` from matrices, velocities and impulses alone."""
        return self.measured().certificate()

    def measured(self) -> MeasuredStep:
        """Arrays of this step, as the referee takes them."""
        collector: RowCollector = self._parts["collector"]
        contacts: ContactRows = self._parts["contacts"]
        joints: JointRows = self._parts["joints"]
        names = collector.contact_names(contacts)
        names += [
            collector.joint_name(int(joints.kind[at]), int(joints.id[at])) for at in groups_at(laws_of(joints, 1.0))
        ]
        step = checked_step(names=names, notes=self.notes, **self._parts["step"])
        return replace(step, drifted=True, stretch=filled(contacts.factors(), len(step.impulses)))


class HardStepper:
    """Steps of a MuJoCo model by tumble's solver: MuJoCo's forces, collision detection and integration, hard contacts.

    The model is changed during a step (margins and integrator) and restored at its end. Threads need their own models.

    :param restitution: Newton's coefficient of all contacts.
    :param recovery: speed at which overlaps of the start are removed, m/s.
    :param residual: residual to which a step is solved, m/s.
    :param unsolved: "warn", "raise" or "ignore", for steps that are not solved.
    """

    def __init__(
        self,
        model: Any,
        *,
        restitution: float = 0.0,
        recovery: float = RECOVERY,
        residual: float = RESIDUAL,
        unsolved: str = "warn",
    ) -> None:
        if not recovery > 0.0:
            raise TumbleError(f"recovery is {recovery}; a positive number is needed")
        self.model = model
        self.recovery = float(recovery)
        self.residual = float(residual)
        self.configure(restitution=restitution, unsolved=unsolved)
        self.collector = RowCollector(model)
        self._radius = _body_radii(model)
        self._last: tuple[dict[Any, Floats], dict[Any, Floats], dict[Any, Floats]] | None = None
        self._last_time = np.nan
        self._kept = 0
        """Steps since overlaps could last be removed."""

    def configure(self, *, restitution: float, unsolved: str) -> None:
        """Sets what the constructor was given."""
        if unsolved not in ("warn", "raise", "ignore"):
            raise TumbleError(f'unsolved is {unsolved!r}; "warn", "raise" or "ignore" is needed')
        if not 0.0 <= restitution <= 1.0:
            raise TumbleError(f"restitution is {restitution}; a number from 0 to 1 is needed")
        self.restitution = float(restitution)
        self.unsolved = unsolved

    def step(self, data: Any) -> HardStep:
        """Advances ``data`` by one time step."""
        self.collector.check(data)
        model, options = self.model, self.model.opt
        integrator, time_step = options.integrator, options.timestep
        began = data.time
        if began != self._last_time:
            self._last, self._kept = None, 0
        options.integrator = single_stage(integrator)
        try:
            ahead = self._forces(data)
            if not np.abs(data.qacc_smooth).max(initial=0.0) < _LARGEST:
                # MuJoCo's own warning and reset.
                data.qacc[:] = data.qacc_smooth
                mujoco.mj_checkAcc(model, data)
                ahead = self._forces(data)
            contacts = self.collector.contacts(data, ahead)
            joints = self.collector.joints(data, ahead)
            position, before = data.qpos.copy(), data.qvel.copy()
            # The integrator without constraint forces: free velocities, activations, time and the implicit mass.
            data.qfrc_constraint[:] = 0.0
            mass = self._integrate(data)
        finally:
            options.integrator = integrator
        free = data.qvel.copy()
        report, after = self._solve(data, mass, before, free, contacts, joints)
        if data.time <= began:
            report.notes += (f"MuJoCo has reset the state at {began:.6g} s: it was too fast",)
        self._write_forces(data, report, contacts, joints, before)
        data.qpos[:] = position
        mujoco.mj_integratePos(model, data.qpos, after, time_step)
        data.qvel[:] = after
        self._last_time = data.time
        return report

    def _forces(self, data: Any) -> Reach:
        """Computes positions, contacts ahead and all forces but those of the rows."""
        ahead = self.reach(data)
        if is_discrete(self.model):
            mujoco.mj_checkPos(self.model, data)
            mujoco.mj_checkVel(self.model, data)
            # Actuators join the effective mass in no other function than mj_forward.
            with raised_margins(self.model, ahead):
                mujoco.mj_forward(self.model, data)
            return ahead
        with raised_margins(self.model, ahead):
            mujoco.mj_step1(self.model, data)
        mujoco.mj_fwdActuation(self.model, data)
        mujoco.mj_fwdAcceleration(self.model, data)
        return ahead

    def _integrate(self, data: Any) -> Floats:
        """Integrates without constraint forces and returns the mass matrix of the step."""
        model, bodies = self.model, self.collector.free_bodies
        if is_discrete(model):
            mass = step_mass(model, data, bodies)
            data.qacc[:] = free_acceleration(model, data, mass, bodies)
            advance(model, data)
            return mass
        data.qacc[:] = data.qacc_smooth
        data.qH[:] = np.nan
        if model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_EULER):
            mujoco.mj_Euler(model, data)
        else:
            mujoco.mj_implicit(model, data)
        return step_mass(model, data, bodies)

    def reach(self, data: Any) -> Reach:
        """Distances up to which contacts and limits are detected ahead."""
        model = self.model
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        levers = data.xpos - data.subtree_com[model.body_rootid]
        squares = np.stack([data.cvel[:, :3], data.cvel[:, 3:], levers])
        spins, speeds, distances = np.sqrt((squares * squares).sum(axis=2))
        # |v + ω × r| is at most |v| + |ω| |r|.
        speeds += spins * (distances + self._radius)
        time_step = model.opt.timestep
        bodies = _REACH * time_step * (speeds + time_step * _length(model.opt.gravity)) + _LEAST_REACH
        rates = np.zeros(model.njnt)
        np.maximum.at(rates, model.dof_jntid, np.abs(data.qvel))
        turned = 3.0 * _REACH * time_step
        return Reach(
            travel=float(bodies.max()),
            bodies=bodies,
            joints=turned * rates + _LEAST_TURN,
            tendons=turned * np.abs(data.ten_velocity) + _LEAST_TURN,
        )

    def _solve(
        self, data: Any, mass: Floats, before: Floats, free: Floats, contacts: ContactRows, joints: JointRows
    ) -> tuple[HardStep, Floats]:
        time_step = self.model.opt.timestep
        offsets, fixed = exact_offsets(contacts, joints, time_step)
        rebound = self._rebound(contacts, before)
        laws = laws_of(joints, time_step)
        problem = StepProblem(mass, free, contacts, joints, laws, self._start(contacts, joints), self.residual)

        def attempt(bound: float, thorough: bool) -> StepSolution:
            normals, rows = recovered(offsets[:, 0], fixed, joints, bound, time_step)
            return problem.solve(np.column_stack([np.minimum(normals, rebound), offsets[:, 1:]]), rows, thorough)

        notes = notes_of(self.collector, contacts)
        overlaps = bool(offsets[:, 0].min(initial=0.0) < 0.0 or fixed.any())
        # Overlaps that cannot be removed, as of a body between two walls, stay as they are.
        keeps = overlaps and self._kept % _RETRY != 0
        found = attempt(0.0 if keeps else self.recovery, thorough=not overlaps)
        fast = _LEAST_WILD + _WILD * max(np.abs(free).max(initial=0.0), np.abs(before).max(initial=0.0))
        if overlaps and (found.residual > self.residual or np.abs(found.after).max(initial=0.0) > fast):
            kept = attempt(0.0, thorough=True)
            kept.iterations += found.iterations
            if kept.residual <= self.residual:
                found, keeps = kept, True
        self._kept = self._kept + 1 if keeps else 0
        if keeps:
            notes = (*notes, "overlaps that cannot be removed are kept")
        notes += self._beyond(joints)
        offsets[:, 0] = np.minimum(offsets[:, 0], rebound)
        self._last = by_key(contacts, joints, found)
        solved = found.residual <= self.residual and bool(np.isfinite(found.after).all())
        step = dict(
            M=mass,
            J=np.concatenate([contacts.directions(), joints.J]),
            velocity_before=before,
            velocity_after=found.after,
            force=mass @ (free - before) / time_step,
            impulses=np.concatenate([found.impulses.ravel(), found.moments.ravel(), found.tail]),
            laws=contacts.laws() + laws,
            time_step=time_step,
            w=np.concatenate([offsets.ravel(), np.zeros(found.moments.size), fixed]),
        )
        if self.restitution > 0.0 and not contacts.surface.any():
            work = 0.5 * float(step["impulses"] @ (step["J"] @ (before + found.after)))
            if work > 1e-6 * float(before @ mass @ before):
                notes += (f"the impacts make {work:.2g} J, as Newton's restitution with friction can",)
        report = HardStep(
            solved=solved,
            residual=found.residual,
            iterations=found.iterations,
            contacts=len(contacts.gap),
            closed=int((found.impulses[:, 0] > 0.0).sum()),
            overlap=float(max(0.0, -contacts.gap.min(initial=0.0))),
            notes=notes,
            _parts={"collector": self.collector, "contacts": contacts, "joints": joints, "step": step},
        )
        if not solved:
            self._complain(f"the step to {data.time:.6g} s is not solved: residual {found.residual:.1e} m/s")
        return report, found.after

    def _beyond(self, joints: JointRows) -> tuple[str, ...]:
        """Note on the limit that is exceeded most at the start of the step."""
        gaps = np.where(np.isin(joints.kind, LIMITS), joints.gap, 0.0)
        if gaps.min(initial=0.0) >= -_LEAST_BEYOND:
            return ()
        at = int(gaps.argmin())
        name = self.collector.joint_name(int(joints.kind[at]), int(joints.id[at]))
        return (f"{name} starts {-gaps[at]:.2g} rad or m beyond its limit, which is removed over several steps",)

    def _rebound(self, contacts: ContactRows, before: Floats) -> Floats:
        """Offset of each normal row by restitution; infinite for contacts that do not bounce."""
        offsets: Floats = np.full(len(contacts.gap), np.inf)
        if self.restitution > 0.0 and len(offsets):
            time_step = self.model.opt.timestep
            approach = contacts.J[:, 0] @ before
            least = _BOUNCE * time_step * _length(self.model.opt.gravity)
            hits = (approach < -least) & (contacts.gap + time_step * approach < 0.0)
            offsets[hits] = self.restitution * approach[hits]
        return offsets

    def _complain(self, text: str) -> None:
        if self.unsolved == "raise":
            raise TumbleError(f'{text}; unsolved="warn" takes such steps')
        if self.unsolved == "warn":
            warnings.warn(text, UnsolvedStep, stacklevel=5)

    def _start(self, contacts: ContactRows, joints: JointRows) -> tuple[Floats, Floats, Floats] | None:
        """Impulses of the last step, for contacts, moments and joint rows that it had too."""
        if self._last is None:
            return None
        known, moments, rows = self._last
        none, keys = np.zeros(3), contact_keys(contacts)
        first = [known.get(key, none) for key in keys]
        second = [moments.get(keys[place], none) for place in contacts.resisting]
        third = [rows.get(key, 0.0) for key in joint_keys(joints)]
        return np.array(first).reshape(-1, 3), np.array(second).reshape(-1, 3), np.array(third, dtype=np.float64)

    def _write_forces(
        self, data: Any, report: HardStep, contacts: ContactRows, joints: JointRows, before: Floats
    ) -> None:
        """Forces and accelerations of the step, where MuJoCo has a place for them."""
        model, step = self.model, report._parts["step"]
        forces = step["impulses"] / step["time_step"]
        count = len(contacts.gap)
        pushes = forces[: 3 * count].reshape(-1, 3).copy()
        pushes[:, 1:] *= contacts.stretch
        moments = np.zeros((count, 3))
        ends = 3 * (count + len(contacts.resisting))
        moments[contacts.resisting] = forces[3 * count : ends].reshape(-1, 3)
        moments[contacts.resisting, :2] *= contacts.turn_stretch
        rows = np.zeros(len(data.efc_force))
        rows[joints.index] = forces[ends:]
        if count:
            # Torsional friction is before rolling friction.
            _write_contacts(model, data, rows, contacts, np.column_stack([pushes, moments[:, [2, 0, 1]]]))
        data.efc_force[:] = rows
        data.qfrc_constraint[:] = step["J"].T @ forces
        if is_discrete(model):
            # MuJoCo's acceleration is the change of velocity of the step.
            data.qacc[:] = (step["velocity_after"] - before) / step["time_step"]
        else:
            loads = (data.qfrc_smooth + data.qfrc_constraint).reshape(1, -1)
            mujoco.mj_solveM(model, data, data.qacc.reshape(1, -1), loads)
        data.qacc_warmstart[:] = data.qacc
        if model.nsensor:
            data.qvel[:] = before
            # Accelerations of bodies are computed once a step, by mj_forward with the integrator "discrete".
            mujoco.mj_rnePostConstraint(model, data)
            mujoco.mj_sensorAcc(model, data)


def _length(vector: Any) -> float:
    return float(np.sqrt(vector @ vector))


def _write_contacts(model: Any, data: Any, rows: Floats, contacts: ContactRows, pushes: Floats) -> None:
    """Forces and moments of contacts, (C, 6) in MuJoCo's order, in MuJoCo's rows."""
    found, index = data.contact, contacts.index
    at = np.asarray(found.efc_address)[index]
    dims = np.asarray(found.dim)[index]
    flat = (dims == 1) & (at >= 0)
    rows[at[flat]] = pushes[flat, 0]
    cones = (dims > 1) & (at >= 0)
    if model.opt.cone == int(mujoco.mjtCone.mjCONE_ELLIPTIC):
        for axis in range(int(dims.max())):
            own = cones & (dims > axis)
            rows[at[own] + axis] = pushes[own, axis]
        return
    # Edges of a pyramid: their sum is the normal force, the difference of two is a tangent force by its friction.
    shares = pushes[:, 0] / np.maximum(dims - 1, 1)
    pulls = pushes[:, 1:] / np.asarray(found.friction).reshape(-1, 5)[index]
    for axis in range(int(dims.max()) - 1):
        own = cones & (dims - 1 > axis)
        pull = pulls[own, axis]
        rows[at[own] + 2 * axis] = 0.5 * (shares[own] + pull)
        rows[at[own] + 2 * axis + 1] = 0.5 * (shares[own] - pull)


def _body_radii(model: Any) -> Floats:
    """Distance of the farthest point of each body's geoms from the body's origin."""
    radii = np.zeros(model.nbody)
    reach = np.linalg.norm(model.geom_pos, axis=1) + model.geom_rbound
    np.maximum.at(radii, model.geom_bodyid, reach)
    return radii
