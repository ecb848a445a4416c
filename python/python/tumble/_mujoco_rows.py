"""Rows of a MuJoCo step: contacts, limits, friction losses and equality constraints in generalised coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ._arrays import numbers
from ._mujoco_metric import free_bodies
from ._mujoco_metric import mujoco as mujoco
from ._problem import Law
from ._tumble import TumbleError
from ._types import Floats, Integers

_EQUALITY = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
_LOSSES = (int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF), int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON))
_LIMIT_JOINT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
_LIMIT_TENDON = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON)
LIMITS = (_LIMIT_JOINT, _LIMIT_TENDON)
"""Constraints that are limits of joints and tendons."""
_PASSIVE = 2
"""Values of ``contact.exclude`` from which a contact has no rows."""
_IMMOVABLE = 1e-9
"""Largest entry of a normal row that counts as zero."""
_LEAST_FRICTION = 1e-5
"""MuJoCo raises coefficients to this one, mjMINMU."""
_FLATTER = 1e-3
"""Least difference of the cosine of a contact's slope from that of a height field that is none of its surface."""


@dataclass
class JointRows:
    """Rows of limits, friction losses and equality constraints, as MuJoCo makes them."""

    index: Integers
    """Place of each row in MuJoCo's list."""
    kind: Integers
    """mjtConstraint of each row."""
    id: Integers
    """Joint, degree of freedom, tendon or equality constraint of each row."""
    J: Floats
    """Directions (R, nv)."""
    gap: Floats
    """Distance from the limit, or position error, m or rad; zero for friction losses."""
    loss: Floats
    """Largest friction, N or N m; zero for other rows."""


@dataclass
class ContactRows:
    """Contacts with a normal and two tangents each."""

    index: Integers
    """Place of each contact in MuJoCo's list."""
    geoms: Integers
    """Geoms of each contact (C, 2)."""
    J: Floats
    """Velocity of the second geom against the first along normal and tangents (C, 3, nv)."""
    gap: Floats
    """Distance beyond MuJoCo's margin (C,), m."""
    friction: Floats
    """Larger coefficient along the tangents (C,); zero for contacts without friction."""
    stretch: Floats
    """Coefficients along both tangents over the larger one (C, 2)."""
    surface: Floats
    """Velocities of the surfaces along the tangents (C, 2), m/s."""
    resisting: Integers
    """Contacts with rolling or torsional friction (T,), as places in these arrays."""
    turns: Floats
    """Spin of the second geom against the first about tangents and normal (T, 3, nv)."""
    turning: Floats
    """Larger coefficient of rolling friction about the tangents, and that of torsional friction (T, 2), m."""
    turn_stretch: Floats
    """Coefficients of rolling about both tangents over the larger one (T, 2)."""
    immovable: int
    """Contacts left out, because no joint moves the geoms along the normal."""

    def kept(self, chosen: Any) -> ContactRows:
        """Contacts that a mask chooses."""
        places = np.cumsum(chosen) - 1
        own = chosen[self.resisting]
        arrays = ("index", "geoms", "J", "gap", "friction", "stretch", "surface")
        chosen_arrays = {name: getattr(self, name)[chosen] for name in arrays}
        moments = {name: getattr(self, name)[own] for name in ("turns", "turning", "turn_stretch")}
        return replace(self, resisting=places[self.resisting[own]], **chosen_arrays, **moments)

    def directions(self) -> Floats:
        """Rows of contacts, then of moments (3 C + 3 T, nv)."""
        rows: Floats = np.concatenate([*self.J, *self.turns, np.zeros((0, self.J.shape[2]))])
        return rows

    def factors(self) -> Floats:
        """Factors of the same rows (3 C + 3 T,)."""
        contacts = np.column_stack([np.ones(len(self.gap)), self.stretch])
        moments = np.column_stack([self.turn_stretch, np.ones(len(self.resisting))])
        return np.concatenate([contacts.ravel(), moments.ravel()])

    def laws(self) -> list[Law]:
        """Laws of the same rows."""
        moments = zip(self.resisting.tolist(), self.turning.tolist())
        return [*self.friction.tolist(), *(("moment", place, *limits) for place, limits in moments)]


@dataclass
class Reach:
    """Distances ahead of a step up to which contacts and limits are detected."""

    travel: float
    """Raise of the margin of every pair of geoms, m."""
    bodies: Floats
    """Distance ahead for each body (nbody,), m."""
    joints: Floats
    """Raise of the margin of each joint (njnt,), m or rad."""
    tendons: Floats
    """Raise of the margin of each tendon (ntendon,), m."""


@contextmanager
def raised_margins(model: Any, ahead: Reach) -> Iterator[None]:
    """Detects contacts and limits ahead, and restores the model at the end."""
    travel = ahead.travel
    fields = (
        (model.geom_margin, 0.5 * travel if _margins_add_up() else travel),
        (model.pair_margin, travel),
        (model.jnt_margin, ahead.joints),
        (model.tendon_margin, ahead.tendons),
    )
    saved = [array.copy() for array, _ in fields]
    override = model.opt.o_margin
    try:
        for array, change in fields:
            array += change
        model.opt.o_margin = override + travel
        yield
    finally:
        for (array, _), value in zip(fields, saved):
            array[:] = value
        model.opt.o_margin = override


class RowCollector:
    """Collects the rows of a model's steps."""

    def __init__(self, model: Any) -> None:
        if not isinstance(model, mujoco.MjModel):
            raise TumbleError(f"model is {type(model).__name__}; a mujoco.MjModel is needed")
        if not hasattr(model, "M_rownnz"):
            raise TumbleError(f"mujoco {mujoco.__version__} is too old for tumble.mujoco; 3.10 or later is needed")
        _refuse_options(model)
        self.model = model
        moved = np.zeros((model.nbody, model.nv))
        for body in range(model.nbody):
            own = np.flatnonzero(model.dof_bodyid == body)
            if body:
                moved[body] = moved[model.body_parentid[body]]
            moved[body, own] = 1.0
        self.moved = moved
        """Whether a degree of freedom moves a body (nbody, nv)."""
        self.free_bodies = free_bodies(model)
        """First degree of freedom of each free body without joints below it."""
        self.notes = _notes(model)
        none, integers = np.zeros(0), np.zeros(0, np.int64)
        self._no_joints = JointRows(integers, integers, integers, np.zeros((0, model.nv)), none, none)
        pairs, rows = np.zeros((0, 2)), np.zeros((0, 3, model.nv))
        self._no_contacts = ContactRows(
            integers, pairs.astype(np.int64), rows, none, none, pairs, pairs, integers, rows, pairs, pairs, 0
        )

    def check(self, data: Any) -> None:
        """Raises TumbleError unless ``data`` fits the model."""
        if not isinstance(data, mujoco.MjData):
            raise TumbleError(f"data is {type(data).__name__}; a mujoco.MjData is needed")
        if len(data.qpos) != self.model.nq or len(data.qvel) != self.model.nv:
            raise TumbleError("data belongs to another model; mujoco.MjData(model) is needed")
        _refuse_options(self.model)
        for name in ("qpos", "qvel", "act", "ctrl"):
            numbers(f"data.{name}", getattr(data, name), ("n",))

    def contacts(self, data: Any, ahead: Reach | None = None) -> ContactRows:
        """Contacts of ``data``. ``ahead`` is how the margins were raised with which they were detected."""
        if not data.ncon:
            return self._no_contacts
        found, model = data.contact, self.model
        geoms = np.asarray(found.geom, np.int64).reshape(-1, 2)
        gap = np.asarray(found.dist) - np.asarray(found.includemargin)
        used = (geoms >= 0).all(axis=1) & (np.asarray(found.exclude) < _PASSIVE)
        if ahead is not None:
            gap += ahead.travel
            used &= gap <= ahead.bodies[model.geom_bodyid[geoms]].sum(axis=1)
            used &= (gap <= 0.0) | ~self._beside_fields(data, geoms)
        kept = np.flatnonzero(used)
        if not len(kept):
            return self._no_contacts
        J, turns = self._contact_directions(data, geoms, kept)
        movable = np.abs(J[:, 0]).max(axis=1, initial=0.0) > _IMMOVABLE
        immovable = len(kept) - int(movable.sum())
        if immovable:
            kept, J, turns = kept[movable], J[movable], turns[movable]
        geoms = geoms[kept]
        dim = np.asarray(found.dim)[kept]
        frictions = np.asarray(found.friction).reshape(-1, 5)[kept]
        friction, stretch = _stretched(frictions[:, :2], dim >= 3)
        J[:, 1:] *= stretch[:, :, None]
        rolling, turn_stretch = _stretched(frictions[:, 3:], dim >= 6)
        torsion = np.where((dim >= 4) & (frictions[:, 2] > _LEAST_FRICTION), frictions[:, 2], 0.0)
        turning = np.stack([rolling, torsion], axis=1)
        resisting = np.flatnonzero(turning.any(axis=1))
        turns, turning, turn_stretch = turns[resisting][:, [1, 2, 0]], turning[resisting], turn_stretch[resisting]
        turns[:, :2] *= turn_stretch[:, :, None]
        surface = np.zeros((len(kept), 2))
        if hasattr(found, "surfacevel"):
            surface += np.asarray(found.surfacevel).reshape(-1, 3)[kept, :2] * stretch
        return ContactRows(
            index=kept,
            geoms=geoms,
            J=J,
            gap=gap[kept],
            friction=friction,
            stretch=stretch,
            surface=surface,
            resisting=resisting,
            turns=turns,
            turning=turning,
            turn_stretch=turn_stretch,
            immovable=immovable,
        )

    def _beside_fields(self, data: Any, geoms: Integers) -> Any:
        """Mask of contacts (C,) with the side of a height field's prisms: their normal is flatter than the field near
        them."""
        model, found = self.model, data.contact
        beside = np.zeros(len(geoms), bool)
        for geom in np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_HFIELD)):
            field = model.geom_dataid[geom]
            rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
            width, depth, height, _ = model.hfield_size[field]
            start = int(model.hfield_adr[field])
            heights = height * np.asarray(model.hfield_data)[start : start + rows * columns].reshape(rows, columns)
            steps = 2.0 * width / (columns - 1), 2.0 * depth / (rows - 1)
            along, across = np.abs(np.diff(heights, axis=1)) / steps[0], np.abs(np.diff(heights, axis=0)) / steps[1]
            # Largest slope of both triangles of each cell.
            slopes = np.hypot(np.maximum(along[1:], along[:-1]), np.maximum(across[:, 1:], across[:, :-1]))
            own = np.flatnonzero((geoms == geom).any(axis=1))
            axes = np.asarray(data.geom_xmat[geom]).reshape(3, 3)
            local = (np.asarray(found.pos).reshape(-1, 3)[own] - data.geom_xpos[geom]) @ axes
            rises = np.abs(np.asarray(found.frame).reshape(-1, 9)[own, :3] @ axes[:, 2])
            cells = (local[:, :2] + [width, depth]) / steps
            for place, rise, (column, row) in zip(own, rises, np.floor(cells).astype(int)):
                if not (0 <= column < columns - 1 and 0 <= row < rows - 1):
                    continue
                near = slopes[max(row - 1, 0) : max(row + 2, 1), max(column - 1, 0) : max(column + 2, 1)]
                beside[place] = rise < 1.0 / np.hypot(1.0, near.max(initial=0.0)) - _FLATTER
        return beside

    def _contact_directions(self, data: Any, geoms: Integers, kept: Integers) -> tuple[Floats, Floats]:
        """Velocity and spin of the second geom against the first in each contact's frame (C, 3, nv)."""
        found, model = data.contact, self.model
        geoms = geoms[kept]
        bodies = model.geom_bodyid[geoms]
        moved = self.moved[bodies]
        points = np.asarray(found.pos).reshape(-1, 3)[kept]
        frames = np.asarray(found.frame).reshape(-1, 3, 3)[kept]
        turning, along = data.cdof[:, :3], data.cdof[:, 3:]
        levers = points[:, None] - data.subtree_com[model.body_rootid[bodies]]
        J, turns = np.zeros((2, len(kept), 3, model.nv))
        for side, sign in ((0, -1.0), (1, 1.0)):
            # Velocity of the point by each degree of freedom: v + ω × lever.
            speeds = along + turning @ _skew(levers[:, side])
            J += sign * moved[:, side, None, :] * (frames @ np.swapaxes(speeds, 1, 2))
            turns += sign * moved[:, side, None, :] * (frames @ turning.T)
        return J, turns

    def joints(self, data: Any, ahead: Reach | None = None) -> JointRows:
        """Rows of ``data`` that are not contacts. ``ahead`` is how the margins of limits were raised."""
        if not data.nefc:
            return self._no_joints
        kinds = np.asarray(data.efc_type, np.int64)
        index = np.flatnonzero(kinds <= _LIMIT_TENDON)
        kind, id_ = kinds[index], np.asarray(data.efc_id, np.int64)[index]
        gap = np.asarray(data.efc_pos)[index] - np.asarray(data.efc_margin)[index]
        if not len(index):
            return self._no_joints
        if ahead is not None:
            for limit, raised in ((_LIMIT_JOINT, ahead.joints), (_LIMIT_TENDON, ahead.tendons)):
                limited = kind == limit
                gap[limited] += raised[id_[limited]]
        loss = np.where((kind == _LOSSES[0]) | (kind == _LOSSES[1]), np.asarray(data.efc_frictionloss)[index], 0.0)
        gap[loss > 0.0] = 0.0
        return JointRows(index=index, kind=kind, id=id_, J=self._directions(data, index), gap=gap, loss=loss)

    def untouched(self, data: Any) -> Integers:
        """Free bodies (see ``free_bodies``) that no row of ``data`` moves."""
        rows = self._directions(data, np.arange(data.nefc))
        touched = (rows != 0.0).any(axis=0)
        return np.array([at for at in self.free_bodies if not touched[at : at + 6].any()], np.int64)

    def _directions(self, data: Any, index: Integers) -> Floats:
        """Rows of MuJoCo's constraint Jacobian, dense."""
        if not len(index):
            return np.zeros((0, self.model.nv))
        if not mujoco.mj_isSparse(self.model):
            dense: Floats = np.array(data.efc_J).reshape(-1, self.model.nv)[index]
            return dense
        last = int(index[-1]) + 1
        counts = np.asarray(data.efc_J_rownnz)[:last]
        starts = np.asarray(data.efc_J_rowadr)[:last]
        places = np.repeat(starts - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts) + np.arange(counts.sum())
        J = np.zeros((last, self.model.nv))
        columns = np.asarray(data.efc_J_colind)[places]
        J[np.repeat(np.arange(last), counts), columns] = np.asarray(data.efc_J).ravel()[places]
        return J[index]

    def contact_name(self, geoms: Any) -> str:
        """Names of both geoms, or of their bodies."""
        return "–".join(self._geom_name(int(geom)) for geom in geoms)

    def contact_names(self, contacts: ContactRows) -> list[str]:
        """Names of contacts, then of those with moments."""
        names = [self.contact_name(geoms) for geoms in contacts.geoms]
        return names + [names[place] for place in contacts.resisting]

    def _geom_name(self, geom: int) -> str:
        name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, geom)
        if name:
            return str(name)
        body = int(self.model.geom_bodyid[geom])
        return mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_BODY, body) or f"geom {geom}"

    def joint_name(self, kind: int, id_: int) -> str:
        """Name of the joint, tendon or equality constraint of a row."""
        if kind == _EQUALITY:
            of, word = mujoco.mjtObj.mjOBJ_EQUALITY, "equality"
        elif kind in (_LOSSES[1], _LIMIT_TENDON):
            of, word = mujoco.mjtObj.mjOBJ_TENDON, "tendon"
        else:
            of, word = mujoco.mjtObj.mjOBJ_JOINT, "joint"
            id_ = id_ if kind == _LIMIT_JOINT else int(self.model.dof_jntid[id_])
        return mujoco.mj_id2name(self.model, of, id_) or f"{word} {id_}"


def notes_of(collector: RowCollector, contacts: ContactRows) -> tuple[str, ...]:
    """Parts of a step that the rows do not cover."""
    if not contacts.immovable:
        return collector.notes
    return (*collector.notes, f"{contacts.immovable} contacts whose normal no joint moves are left out")


def laws_of(rows: JointRows, time_step: float) -> list[Law]:
    """Laws of the joint rows: equality constraints in groups of at most three rows, all others by themselves."""
    laws: list[Law] = []
    at, count = 0, len(rows.kind)
    while at < count:
        if rows.kind[at] == _EQUALITY:
            size = 1
            while (
                size < 3
                and at + size < count
                and rows.kind[at + size] == _EQUALITY
                and rows.id[at + size] == rows.id[at]
            ):
                size += 1
            laws.append(["locked"] * size)
            at += size
            continue
        if rows.loss[at] > 0.0:
            laws.append([("box", -time_step * float(rows.loss[at]), time_step * float(rows.loss[at]))])
        else:
            laws.append(["limit"])
        at += 1
    return laws


def groups_at(laws: list[Law]) -> list[int]:
    """First row of every group of joint rows."""
    sizes = [len(law) for law in laws if not isinstance(law, float)]
    return [int(at) for at in np.concatenate([[0], np.cumsum(sizes)[:-1]])] if sizes else []


@lru_cache(maxsize=1)
def _margins_add_up() -> bool:
    """Whether this version of MuJoCo adds the margins of two geoms. Older ones take the larger one."""
    sphere = "<geom type='sphere' size='0.1' margin='1'/>"
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{sphere}<body pos='0 0 0.3'><freejoint/>{sphere}</body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(data.contact.includemargin[0] > 1.5)


def filled(factors: Floats, count: int) -> Floats:
    """Factors of the first of ``count`` rows, and 1 for the others (R,)."""
    return np.concatenate([factors, np.ones(count - len(factors))])


def _stretched(pairs: Floats, acts: Any) -> tuple[Floats, Floats]:
    """Larger coefficient of each pair (C,), 0 if it does not act, and both over it (C, 2)."""
    most = np.where(acts & (pairs.max(axis=1) > _LEAST_FRICTION), pairs.max(axis=1), 0.0)
    acts = most[:, None] > 0.0
    return most, np.where(acts, pairs / np.where(acts, most[:, None], 1.0), 1.0)


def _skew(levers: Floats) -> Floats:
    """Matrices with ω · S = ω × lever (C, 3, 3)."""
    skew = np.zeros((len(levers), 3, 3))
    x, y, z = levers.T
    skew[:, 1, 0], skew[:, 2, 0] = z, -y
    skew[:, 0, 1], skew[:, 2, 1] = -z, x
    skew[:, 0, 2], skew[:, 1, 2] = y, -x
    return skew


def _refuse_options(model: Any) -> None:
    """Raises TumbleError for options whose steps have contacts that are not rows."""
    if model.opt.enableflags & int(getattr(mujoco.mjtEnableBit, "mjENBL_IPC", 0)):
        raise TumbleError("the flag ipc has no hard step yet; switch it off")


def _notes(model: Any) -> tuple[str, ...]:
    notes = []
    integrator = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    if integrator not in ("EULER", "IMPLICITFAST", "DISCRETE"):
        instead = "EULER" if integrator == "RK4" else "IMPLICITFAST"
        notes.append(f"integrator {integrator} is replaced by {instead}")
    if (model.geom_condim > 3).any() or (model.pair_dim > 3).any():
        notes.append(
            "sliding, torsional and rolling friction (condim 4 and 6) have separate limits; together they exceed "
            "MuJoCo's common cone by a factor of up to √3"
        )
    if model.nflex:
        notes.append(f"contacts of {model.nflex} flexes are left out")
    if model.opt.enableflags & int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0)):
        notes.append("sleeping bodies have no rows")
    return tuple(notes)
