"""Certificates for steps of any engine: how well a step meets Newton's law, hard contact and Coulomb's law.

    >>> from tumble import referee
    >>> certificate = referee.certify_bodies(masses=[1.0], ...)
    >>> print(certificate)
    contact hand–capsule slips 0.1 mm/s inside its cone (ratio 0.42)

``certify_bodies`` takes rigid bodies as arrays, ``certify`` generalised coordinates. ``audit`` takes a whole run.
Formulas: docs/referee.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from ._arrays import numbers
from ._audit import Audit, Finding, Recorded, audit_steps
from ._certificate import Certificate, CertificateRow
from ._certificate_file import exported
from ._checks import real, texts, whole
from ._measured_step import MeasuredStep, checked_step, labels_of, positive
from ._problem import Law
from ._tumble import TumbleError
from ._types import Floats, Integers, Location

__all__ = ["Audit", "Certificate", "CertificateRow", "Finding", "audit", "certify", "certify_bodies", "export", "step_momentum"]


def certify(
    *,
    M: Any,
    J: Any,
    velocity_before: Any,
    velocity_after: Any,
    force: Any,
    impulses: Any,
    laws: Sequence[Law],
    time_step: float,
    w: Any = None,
    lengths: Any = None,
    dimension: int = 3,
    motion: Any = None,
    names: Sequence[str] | None = None,
    notes: Sequence[str] = (),
) -> Certificate:
    """Certificate of a step in generalised coordinates.

    The exact step is ``M (v⁺ - v) = h force + Jᵀ p``, with a law on ``u = J v⁺ + w``. ``laws`` has an entry for
    each group of rows, as in ``tumble.ContactProblem``: a friction coefficient, the moment of a contact, or a list
    of row laws. A contact's rows are its normal and then its tangents, ``dimension`` in total.

    :param M: mass matrix (n, n), symmetric and positive definite.
    :param J: row directions (R, n).
    :param velocity_before: v (n,).
    :param velocity_after: v⁺ (n,).
    :param force: generalised force without the rows (n,), N.
    :param impulses: p = h · force of every row (R,), N s.
    :param laws: law of each group.
    :param time_step: h, s.
    :param w: offset of every row (R,), m/s: gap / h for a contact's normal row. Zero by default.
    :param lengths: length by which each velocity is multiplied in the residual of dynamics (n,). One by default.
    :param dimension: rows of a contact.
    :param motion: mean velocity of every row over the step (R,), m/s, without the gap, for the energy. By default that
        of the end of the step.
    :param names: name of each group.
    :param notes: parts of the model that the rows do not cover.
    :raises TumbleError: if an argument has a wrong shape or value.
    """
    return checked_step(
        M=M,
        J=J,
        velocity_before=velocity_before,
        velocity_after=velocity_after,
        force=force,
        impulses=impulses,
        laws=laws,
        time_step=time_step,
        w=w,
        lengths=lengths,
        dimension=dimension,
        motion=motion,
        names=names,
        notes=notes,
    ).certificate()


def certify_bodies(
    *,
    masses: Any,
    inertias: Any,
    positions: Any,
    attitudes: Any,
    velocities: Any,
    spins: Any,
    velocities_after: Any,
    spins_after: Any,
    points: Any,
    normals: Any,
    pairs: Any,
    forces: Any,
    friction: Any,
    time_step: float,
    gaps: Any = None,
    gravity: Any = (0.0, 0.0, -9.81),
    wrenches: Any = None,
    attitudes_after: Any = None,
    gaps_after: Any = None,
    slips: Any = None,
    names: Sequence[str] | None = None,
    notes: Sequence[str] = (),
) -> Certificate:
    """Certificate of a step of N rigid bodies with C contacts. All vectors are in the world's frame.

    :param masses: (N,), kg.
    :param inertias: (N, 3, 3) about the centres of mass, in the bodies' frames, kg m².
    :param positions: centres of mass at the start (N, 3), m.
    :param attitudes: unit quaternions w, x, y, z at the start (N, 4), body to world.
    :param velocities: at the start (N, 3), m/s.
    :param spins: angular velocities at the start (N, 3), rad/s.
    :param velocities_after: at the end (N, 3).
    :param spins_after: at the end (N, 3).
    :param points: contact points (C, 3), m.
    :param normals: unit normals from A to B (C, 3).
    :param pairs: bodies A and B of each contact (C, 2), -1 for the world.
    :param forces: contact forces on A (C, 3), N.
    :param friction: coefficient, one or (C,).
    :param time_step: h, s.
    :param gaps: at the start (C,), m. Zero by default.
    :param gravity: (3,), m/s².
    :param wrenches: other forces and torques at the centres of mass (N, 6), N and N m.
    :param attitudes_after: attitudes at the end (N, 4). With them the balance of angular momentum is exact. Without
        them the gyroscopic torque is that of the start.
    :param gaps_after: gaps at the end (C,), instead of the linearised ones.
    :param slips: slip velocities of B against A (C, 3), instead of those of the points at the start.
    :param names: names of the bodies.
    :param notes: parts of the model that the arrays do not cover.
    :raises TumbleError: if an argument has a wrong shape or value.
    """
    time_step = positive("time_step", time_step)
    weights = numbers("masses", masses, ("N",))
    count = len(weights)
    if (weights <= 0.0).any():
        raise TumbleError(f"masses has {weights.min():g} kg; positive masses are needed")
    turned = _turned("inertias", inertias, attitudes, count)
    where = numbers("positions", positions, (count, 3))
    before = np.hstack([numbers("velocities", velocities, (count, 3)), numbers("spins", spins, (count, 3))])
    after = np.hstack(
        [numbers("velocities_after", velocities_after, (count, 3)), numbers("spins_after", spins_after, (count, 3))]
    )
    at = numbers("points", points, ("C", 3))
    contacts = len(at)
    frames = _frames(numbers("normals", normals, (contacts, 3)))
    bodies = _pairs(pairs, contacts, count)
    pushes = numbers("forces", forces, (contacts, 3))
    coefficients = np.broadcast_to(numbers("friction", friction, (), (contacts,)), (contacts,))
    if (coefficients < 0.0).any():
        raise TumbleError(f"friction has {coefficients.min():g}; coefficients from 0 are needed")
    start = np.zeros(contacts) if gaps is None else numbers("gaps", gaps, (contacts,))
    loads = np.zeros((count, 6)) if wrenches is None else numbers("wrenches", wrenches, (count, 6)).copy()
    loads[:, :3] += weights[:, None] * numbers("gravity", gravity, (3,))
    if attitudes_after is None:
        loads[:, 3:] -= np.cross(before[:, 3:], np.einsum("nij,nj->ni", turned, before[:, 3:]))
    else:
        change = _turned("inertias", inertias, attitudes_after, count, "attitudes_after") - turned
        loads[:, 3:] -= np.einsum("nij,nj->ni", change, after[:, 3:]) / time_step

    mass = np.zeros((6 * count, 6 * count))
    J = np.zeros((3 * contacts, 6 * count))
    for body in range(count):
        mass[6 * body : 6 * body + 3, 6 * body : 6 * body + 3] = weights[body] * np.eye(3)
        mass[6 * body + 3 : 6 * body + 6, 6 * body + 3 : 6 * body + 6] = turned[body]
    for contact in range(contacts):
        for body, sign in zip(bodies[contact], (-1.0, 1.0)):
            if body >= 0:
                arm = at[contact] - where[body]
                block = sign * np.hstack([frames[contact], np.cross(arm, frames[contact])])
                J[3 * contact : 3 * contact + 3, 6 * body : 6 * body + 6] += block
    w = np.zeros((contacts, 3))
    w[:, 0] = start / time_step
    moved = (J @ after.ravel()).reshape(contacts, 3)
    motion = moved.copy()
    if gaps_after is not None:
        ends = numbers("gaps_after", gaps_after, (contacts,))
        w[:, 0] = ends / time_step - moved[:, 0]
        motion[:, 0] = (ends - start) / time_step
    if slips is not None:
        given = np.einsum("cij,cj->ci", frames, numbers("slips", slips, (contacts, 3)))
        w[:, 1:] = given[:, 1:] - moved[:, 1:]
        motion[:, 1:] = given[:, 1:]
    gyration = np.sqrt(np.trace(turned, axis1=1, axis2=2) / (2.0 * weights))
    labels = labels_of(names, count)
    step = checked_step(
        M=mass,
        J=J,
        velocity_before=before.ravel(),
        velocity_after=after.ravel(),
        force=loads.ravel(),
        impulses=-time_step * np.einsum("cij,cj->ci", frames, pushes).ravel(),
        laws=[float(value) for value in coefficients],
        time_step=time_step,
        w=w.ravel(),
        lengths=np.hstack([np.ones((count, 3)), np.repeat(gyration[:, None], 3, axis=1)]).ravel(),
        names=[f"{_name(labels, a)}–{_name(labels, b)}" for a, b in bodies],
        notes=notes,
        motion=motion.ravel(),
    )
    axes = ("vx", "vy", "vz", "wx", "wy", "wz")
    names_of = tuple(f"{name} {axis}" for name in labels for axis in axes)
    moving: dict[str, Any] = {
        "position": where,
        "attitude": numbers("attitudes", attitudes, (count, 4)),
        "velocity": before[:, :3],
        "spin": before[:, 3:],
        "velocity_after": after[:, :3],
        "spin_after": after[:, 3:],
        "mass": weights,
        "inertia": numbers("inertias", inertias, (count, 3, 3)),
    }
    if wrenches is not None:
        moving["wrench"] = numbers("wrenches", wrenches, (count, 6))
    if attitudes_after is not None:
        moving["attitude_after"] = numbers("attitudes_after", attitudes_after, (count, 4))
    touching: dict[str, Any] = {
        "bodies": bodies,
        "point": at,
        "normal": numbers("normals", normals, (contacts, 3)),
        "friction": coefficients,
        "gap": start,
        "impulse": -time_step * pushes,
    }
    if gaps_after is not None:
        touching["gap_after"] = numbers("gaps_after", gaps_after, (contacts,))
    if slips is not None:
        touching["slip"] = numbers("slips", slips, (contacts, 3))
    content = {
        "gravity": numbers("gravity", gravity, (3,)).tolist(),
        "bodies": _entries(moving, count),
        "contacts": _entries(touching, contacts),
        "names": labels,
    }
    return replace(step, velocity_names=names_of, bodies=content).certificate()


def export(path: Location, certificates: Iterable[Certificate], *, engine: str, about: str = "") -> Path:
    """Writes certificates to a file that others can check, and returns its path.

    ``python -m tumble.certificate_check`` checks it with NumPy alone. The format is that of
    docs/reference/certificate-format.md.

    :param certificates: of ``certify``, ``certify_bodies``, ``tumble.mujoco.certify`` or ``tumble.referee_adapters``.
    :param engine: name and version of the engine.
    :param about: a sentence about the run.
    :raises TumbleError: if an entry is not a certificate.
    """
    return exported(path, certificates, engine, about)


def step_momentum(inertia: Any, spin: Any, time_step: float) -> Floats:
    """Angular momentum of a body in a step of tumble (N m s, body frame), for a referee of its steps.

    A step turns a body by ``time_step * spin``, and its angular momentum is (34) of docs/formulation.md: P⁺ at the
    start of the step, and P⁻ at its end, with ``-time_step``. The rotation of the step maps P⁻ to P⁺.

    :param inertia: I (3, 3) (kg m²), body frame.
    :param spin: ω at the end of the step (3,) (rad/s), body frame.
    :param time_step: h (s); -h for P⁻.
    :raises TumbleError: for arrays of other shapes or values that are not finite.
    """
    own, spin = numbers("inertia", inertia, (3, 3)), numbers("spin", spin, (3,))
    momentum, half = own @ spin, 0.5 * real("time_step", time_step)
    s = half * half * float(spin @ spin)
    # Stretch γ of the spin (8e), its derivative γ′, and α and β of (34).
    stretch = 1 + s / 3 + 2 * s**2 / 15 + 17 * s**3 / 315
    slope = 1 / 3 + 4 * s / 15 + 17 * s**2 / 105
    beta = (stretch**3 - 2 * slope) / (stretch * (stretch + 2 * s * slope))
    along = half * half * beta * float(spin @ momentum)
    return np.asarray(momentum / stretch + half * np.cross(spin, momentum) + along * spin)


def _entries(columns: Mapping[str, Any], count: int) -> list[dict[str, Any]]:
    """Rows of columns."""
    return [{name: column[place].tolist() for name, column in columns.items()} for place in range(count)]


def audit(
    recording: Any,
    *,
    model: Any = None,
    every: int = 1,
    tolerance: float = 1e-6,
    title: str = "Audit of a run",
    velocity_names: Sequence[str] | None = None,
) -> Audit:
    """Certificates of a whole run, and the exact step from each state beside the engine's.

    With ``model``, a ``mujoco.MjModel``, the recording has the states of a run of MuJoCo: a list of ``mujoco.MjData``
    (copies), or a dict with arrays qpos (K, nq), qvel (K, nv) and, if the model has them, ctrl (K, nu), act, mocap_pos,
    mocap_quat, qfrc_applied, xfrc_applied, qacc_warmstart and time (K,), s. The step that ``mj_step`` takes from each
    state is audited.

    Without ``model``, the recording has one entry per step: a dict with the arguments of ``certify`` or
    ``certify_bodies``, and optionally ``time`` at the end of the step, s. An entry may also be a ``Certificate``, for
    example of ``tumble.referee_adapters``, or a ``tumble.mujoco.HardStep``.

    :param every: only steps 0, every, 2 every and so on are audited.
    :param tolerance: residual up to which a law counts as met, m/s. Energy counts as gained from this speed times
        the sum of all momenta and impulses.
    :param title: title of the page.
    :param velocity_names: name of each velocity (n,), for tables.
    :raises TumbleError: if a step has a wrong shape or value. The message names the step.
    """
    every, tolerance = whole("every", every, 1), positive("tolerance", tolerance)
    names = None if velocity_names is None else tuple(texts("velocity_names", velocity_names))
    if not isinstance(title, str):
        raise TumbleError(f"title is {title!r}; a string is needed")
    if model is not None:
        from ._mujoco_record import recorded_steps
        from ._mujoco_record import velocity_names as names_of

        return audit_steps(recorded_steps(model, recording, every), tolerance, title, names or names_of(model))
    if isinstance(recording, (Mapping, str)) or not isinstance(recording, Iterable):
        raise TumbleError(
            f"recording is {type(recording).__name__}; one dict for each step is needed, or the argument model"
        )
    return audit_steps(_recorded(recording, every), tolerance, title, names)


def _recorded(recording: Iterable[Any], every: int) -> Iterator[Recorded]:
    """Every ``every``-th step of a recording without a model."""
    end = 0.0
    for k, entry in enumerate(recording):
        try:
            step, time = _step_of(entry)
        except TumbleError as error:
            raise TumbleError(f"step {k} of the recording: {error}") from None
        end = end + step.time_step if time is None else time
        if k % every == 0:
            yield Recorded(k, end, step)


def _step_of(entry: Any) -> tuple[MeasuredStep, float | None]:
    """Step of an entry of a recording, and the time at its end if the entry has one."""
    if isinstance(entry, Mapping):
        given = dict(entry)
        time = given.pop("time", None)
        certificate = _certified(certify_bodies if "masses" in given else certify, given)
        end = None if time is None else real("time", time)
        if end is not None and not np.isfinite(end):
            raise TumbleError(f"time is {end:g}; a finite number is needed")
        return certificate.measured(), end
    if hasattr(entry, "measured"):
        measured: MeasuredStep = entry.measured()
        return measured, None
    raise TumbleError(f"it is {type(entry).__name__}; a dict with the arguments of certify or certify_bodies is needed")


def _certified(function: Callable[..., Certificate], given: dict[Any, Any]) -> Certificate:
    """Certificate of a step whose arguments are ``given``."""
    known = signature(function).parameters
    for name in given:
        if name not in known:
            raise TumbleError(f"{name!r} is not an argument of {function.__name__}")
    lacking = [name for name, one in known.items() if one.default is one.empty and name not in given]
    if lacking:
        raise TumbleError(f"{', '.join(lacking)} must be given, as arguments of {function.__name__}")
    return function(**given)


def _name(labels: list[str], body: int) -> str:
    return labels[body] if body >= 0 else "world"


def _turned(name: str, inertias: Any, attitudes: Any, count: int, of: str = "attitudes") -> Floats:
    """Inertias in the world's frame (N, 3, 3)."""
    tensors = numbers(name, inertias, (count, 3, 3))
    for body, tensor in enumerate(tensors):
        moments = np.linalg.eigvalsh(tensor)
        if not (np.abs(tensor - tensor.T).max() <= 1e-9 * moments[2] and moments[0] > 0.0):
            raise TumbleError(f"{name}[{body}] is not a symmetric matrix with positive moments")
        if moments[2] > (1.0 + 1e-9) * (moments[0] + moments[1]):
            raise TumbleError(f"{name}[{body}] has a moment above the sum of the two others, which no body has")
    quaternions = numbers(of, attitudes, (count, 4))
    lengths = np.linalg.norm(quaternions, axis=1)
    if (np.abs(lengths - 1.0) > 1e-6).any():
        raise TumbleError(f"{of} has a quaternion of length {lengths[np.argmax(np.abs(lengths - 1.0))]:g}; 1 is needed")
    w, x, y, z = (quaternions / lengths[:, None]).T
    matrices = np.empty((count, 3, 3))
    matrices[:, 0] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1)
    matrices[:, 1] = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1)
    matrices[:, 2] = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    turned: Floats = np.einsum("nij,njk,nlk->nil", matrices, tensors, matrices)
    return turned


def _frames(normals: Floats) -> Floats:
    """Normal and two tangents of each contact as rows (C, 3, 3)."""
    lengths = np.linalg.norm(normals, axis=1)
    if (np.abs(lengths - 1.0) > 1e-6).any():
        raise TumbleError(f"normals has a vector of length {lengths[np.argmax(np.abs(lengths - 1.0))]:g}; 1 is needed")
    n = normals / lengths[:, None]
    # The axis that is least along the normal.
    other = np.eye(3)[np.argmin(np.abs(n), axis=1)] if len(n) else np.zeros((0, 3))
    first = np.cross(n, other)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([n, first, np.cross(n, first)], axis=1)


def _pairs(pairs: Any, contacts: int, count: int) -> Integers:
    try:
        array = np.asarray(pairs)
    except ValueError:
        raise TumbleError(f"pairs has rows of different lengths; whole numbers ({contacts}, 2) are needed") from None
    if array.size == 0 and contacts == 0:
        return np.zeros((0, 2), np.int64)
    if array.shape != (contacts, 2) or array.dtype.kind not in "iu":
        raise TumbleError(
            f"pairs has shape {array.shape} and dtype {array.dtype}; whole numbers ({contacts}, 2) are needed"
        )
    if array.min() < -1 or array.max() >= count:
        raise TumbleError(
            f"pairs has body {array.min() if array.min() < -1 else array.max()}; -1 to {count - 1} are needed"
        )
    if (array[:, 0] == array[:, 1]).any():
        raise TumbleError(
            f"pairs has body {array[array[:, 0] == array[:, 1]][0, 0]} twice in a contact; two bodies are needed"
        )
    return array.astype(np.int64)
