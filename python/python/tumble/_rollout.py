"""Parallel rollouts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple, overload

from . import _log as log
from ._arrays import apart, numbers, output
from ._checks import made, room, whole
from ._gradients import RolloutDerivatives, constant_names, smoothing_of
from ._progress import callback
from ._scene import Scene
from ._status import BY_WORD, Status
from ._tumble import TumbleError, parameter_shape
from ._tumble import rollout as _roll_out
from ._tumble import rollout_gradients as _gradients
from ._types import Bytes, Floats, Progress

if TYPE_CHECKING:
    from ._trajectory import Trajectory


class Unsolved(NamedTuple):
    """A step that failed or is wild."""

    rollout: int
    step: int
    status: Status
    residual: float


@dataclass(repr=False, eq=False)
class Rollouts:
    """Results of B rollouts of T steps of N bodies, as a sequence of B runs.

    ``rollouts[3]`` is a trajectory with the start and T more states. The arrays of the other fields
    have a row for each of the T steps. They are numpy's in C order. torch and jax take them without
    a copy (``torch.from_dlpack``, ``jax.dlpack.from_dlpack``).
    """

    states: Floats
    """States after each step: (B, T, N, 13), in the form of Trajectory.states."""
    forces: Floats
    """Sum of the contact forces on each body over each step, N, world: (B, T, N, 3)."""
    residuals: Floats
    """Certified residual of each step, m/s: (B, T)."""
    status: Bytes
    """Status of each step as a number of tumble.Status: (B, T)."""
    unsolved: list[Unsolved]
    """Steps that failed or are wild, sorted by rollout and step."""
    tempered: list[int]
    """Number of steps of each rollout that applied only part of their restitution.

    Full restitution would have created energy in these steps.
    """
    counts: dict[str, int]
    """Number of steps with each status."""
    _batch: Batch
    gradients: RolloutDerivatives | None = None
    """Requested derivatives."""

    def __len__(self) -> int:
        """Number of rollouts B."""
        return len(self.status)

    @overload
    def __getitem__(self, index: int) -> Trajectory: ...
    @overload
    def __getitem__(self, index: slice) -> list[Trajectory]: ...
    def __getitem__(self, index: int | slice) -> Trajectory | list[Trajectory]:
        """One rollout as a trajectory with its contacts, or a list of them.

        It is simulated again, to the same bits.

        :raises IndexError: for an index beyond the rollouts.
        :raises TumbleError: if the rollouts differ in mass, inertia, gravity or another constant that
            no keyword of a scene sets.
        """
        if isinstance(index, slice):
            return [self._run(each) for each in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(f"rollout {index} does not exist; there are {len(self)}")
        return self._run(index % len(self))

    def __repr__(self) -> str:
        rollouts, steps = self.status.shape
        arrays = ("states", "forces", "residuals", "status")
        sizes = ", ".join(f"{name} {getattr(self, name).shape}" for name in arrays)
        derivatives = "" if self.gradients is None else ", with gradients"
        return (
            f"<tumble.Rollouts: {rollouts} rollouts of {steps} steps of {self.states.shape[2]} bodies, "
            f"{len(self.unsolved)} steps not solved; {sizes}{derivatives}>"
        )

    def _run(self, index: int) -> Trajectory:
        steps = self.status.shape[1]
        scene, _, _, starts, pushes, motors, joint_forces, values = self._batch
        text, path, settings = scene._source
        settings = dict(settings)
        for name, array in values:
            if name not in ("friction", "restitution", "time_step"):
                raise TumbleError(
                    f"each rollout had its own {name}, which is not a setting of a scene; "
                    "use states and forces"
                )
            settings[name] = float(array[index])
        scene = Scene.from_text(text, path, **settings)
        start, push, target, force = (
            None if of is None else of[index if len(of) > 1 else 0] for of in (starts, pushes, motors, joint_forces)
        )
        return scene.simulate(start).run(steps, push, motors=target, joint_forces=force)


def rollout(
    scene: Scene,
    initial_states: Any = None,
    controls: Any = None,
    *,
    motors: Any = None,
    joint_forces: Any = None,
    steps: int | None = None,
    parameters: Mapping[str, Any] | None = None,
    threads: int | None = None,
    out: Mapping[str, Any] | None = None,
    gradients: Any = None,
    by: Iterable[str] | None = None,
    compliance: float | None = None,
    central_path: float | None = None,
    progress: Progress = False,
) -> Rollouts:
    """Simulates a scene of N bodies B times over T steps, on all cores.

    The numbers equal those of a loop over simulations to the last bit, on any number of threads.

    :param initial_states: (B, N, 13), (1, N, 13) for a shared start, or None for the scene's; for
        one body also (B, 13). Position m, quaternion w x y z, velocity m/s (world), spin rad/s
        (body).
    :param controls: (B, T, N, 6) or (1, T, N, 6); for one body also (B, T, 6) or (1, T, 6): force
        (N, world) and torque (N m, body) in each step, added to gravity and the scene's loads.
    :param motors: (B, T, M) or (1, T, M): target of each motor in each step, first those of
        ``scene.motor_axes``, then those of ``scene.motor_gears``. ``Scene.with_motors`` adds
        motors to robots without them, such as URDF and SDF files and robots driven by torques.
    :param joint_forces: (B, T, D) or (1, T, D): force (N or N m) along each axis of
        ``scene.driven_axes`` in each step, added to its drive.
    :param steps: T, required if no array has a step axis.
    :param parameters: constants that differ between the rollouts, as arrays by name. Coefficients
        of bodies, fixed pieces and pairs have the scene's order; pairs are sorted by their bodies.

        - ``friction`` (B,), ``restitution`` (B,);
        - ``mass`` (B, N) in kg, which scales the inertia unless that is also set;
        - ``inertia`` (B, N, 3, 3) in kg m², ``gravity`` (B, 3) in m/s², ``time_step`` (B,) in s;
        - ``body_friction``, ``body_restitution``, ``fixed_friction``, ``fixed_restitution``,
          ``pair_friction``, ``pair_restitution``, ``static_friction``, ``rolling_friction``,
          ``torsional_friction``, ``adhesion`` (N), ``friction_factor``: (B, number of coefficients in the scene);
        - ``joint_friction``, ``joint_stiffness``, ``joint_rest``, ``joint_damping``,
          ``joint_force``, ``armature`` and ``joint_restitution`` (B, D);
        - ``joint_limits`` (B, L, 2) of the axes that have limits;
        - ``motor_target``, ``motor_stiffness``, ``motor_damping``, ``motor_max_force`` (B, M);
        - ``anchor`` (B, J, 2, 3), ``gear_ratio`` and ``gear_offset`` (B, G).
    :param threads: largest number of threads; None uses all cores.
    :param out: output arrays by name: ``states``, ``forces``, ``residuals``, ``status``.
    :param gradients: derivatives of a scalar loss of each rollout with respect to its states after
        each step, (B, T, N, 12) or (1, T, N, 12), or to its end states, (B, N, 12) or (1, N, 12).
        A function computes them from ``states``, (B, T, N, 13). ``Rollouts.gradients`` then holds
        the derivatives with respect to initial states, controls, given motors and joint_forces,
        and constants. One reverse pass per rollout computes them.
    :param by: constants to differentiate; default are the differentiable ones of ``parameters``.
    :param compliance: smooths the derivatives of the exact rollouts' steps, see ``Scene.jacobian``.
    :param central_path: smooths them by the central path.
    :param progress: callback for steps done and all steps; True writes them to stderr.
    :raises MemoryError: for arrays of more bytes than the machine has.
    :raises TumbleError: for arrays of a wrong shape or dtype or with NaN, by name, and for the
        first rollout that cannot be simulated, by its index.
    """
    import numpy as np

    if out is not None and not isinstance(out, Mapping):
        raise TypeError(f"out is {type(out).__name__}; a dictionary of arrays by name is needed")
    for name, given in (("by", by), ("compliance", compliance), ("central_path", central_path)):
        if gradients is None and given is not None:
            raise TypeError(f"{name} needs gradients")
    smoothing = smoothing_of(compliance, central_path)
    batch = batch_of(scene, initial_states, controls, motors, joint_forces, steps, parameters)
    rollouts, length, bodies = batch.rollouts, batch.steps, len(scene.bodies)
    shapes = {
        "states": ((rollouts, length, bodies, 13), "float64"),
        "forces": ((rollouts, length, bodies, 3), "float64"),
        "residuals": ((rollouts, length), "float64"),
        "status": ((rollouts, length), "uint8"),
    }
    wanted = {}
    for name, array in (out or {}).items():
        if name not in shapes:
            raise TumbleError(f"out: {name!r} is unknown; use {', '.join(shapes)}")
        wanted[name] = output(name, array, *shapes[name])
    apart(wanted, batch.arrays())
    missing = {name: sizes for name, sizes in shapes.items() if name not in wanted}
    room(
        f"the arrays of {rollouts} rollouts of {length} steps",
        sum(prod(shape) * np.dtype(dtype).itemsize for shape, dtype in missing.values()),
    )
    made = {name: np.empty(shape, dtype) for name, (shape, dtype) in missing.items()}
    arrays: dict[str, Any] = {**wanted, **made}
    threads = threads_of(threads)
    counts, tempered, unsolved = _roll_out(
        batch.inputs(),
        threads,
        arrays["states"],
        None,
        arrays["forces"],
        arrays["residuals"],
        arrays["status"],
        callback(progress),
    )
    log.unsolved(len(unsolved), rollouts * length, "the attribute unsolved of the rollouts")
    done = Rollouts(
        arrays["states"],
        arrays["forces"],
        arrays["residuals"],
        arrays["status"],
        [Unsolved(index, step, BY_WORD[word], residual) for index, step, word, residual in unsolved],
        tempered,
        dict(zip(BY_WORD, counts)),
        batch,
    )
    if gradients is not None:
        duals = gradients(done.states) if callable(gradients) else gradients
        done.gradients = batch.gradients(duals, by, threads, smoothing)
    return done


class Batch(NamedTuple):
    """Input of B rollouts: arrays for B rollouts, or for one shared by all."""

    scene: Scene
    rollouts: int
    steps: int
    starts: Floats
    controls: Floats | None
    motors: Floats | None
    joint_forces: Floats | None
    values: list[tuple[str, Floats]]

    def inputs(self) -> Any:
        """Input in the order of the compiled module."""
        scene, rollouts, length, *arrays = self
        return (scene._core, rollouts, length, *arrays)

    def arrays(self) -> dict[str, Floats]:
        """Arrays by name."""
        given = {"controls": self.controls, "motors": self.motors, "joint_forces": self.joint_forces}
        return {
            **{f"parameters[{name!r}]": value for name, value in self.values},
            "initial_states": self.starts,
            **{name: array for name, array in given.items() if array is not None},
        }

    def gradients(
        self, duals: Any, by: Iterable[str] | None, threads: int | None, smoothing: tuple[str, float] | None = None
    ) -> RolloutDerivatives:
        """Derivatives for the derivatives ``duals`` with respect to states."""
        import numpy as np

        bodies = len(self.scene.bodies)
        shapes: list[Any] = []
        for count in {1, self.rollouts}:
            shapes += [(count, self.steps, bodies, 12), (count, bodies, 12)]
        array = numbers("gradients", duals, *shapes)
        varied = [name for name, _ in self.values]
        names = varied if by is None else constant_names(by)
        room("the derivatives by controls", 48 * self.rollouts * self.steps * bodies)
        of_ends = array.ndim == 3
        found, noted = _gradients(self.inputs(), threads_of(threads), array, of_ends, names, smoothing)
        given = {"motors": self.motors, "joint_forces": self.joint_forces}
        driven = [name for name, array in given.items() if array is not None]
        margins, at, counts = (np.array(of) for of in zip(*noted))
        unsolved, unknown, kept, limited, untimed = counts.T
        return RolloutDerivatives(
            dict(zip(("states", "controls", *driven, *names), found)),
            margins[:, 0],
            margins[:, 1],
            at,
            unsolved,
            unknown,
            kept,
            limited,
            untimed,
        )


def batch_of(
    scene: Scene,
    initial_states: Any,
    controls: Any,
    motors: Any,
    joint_forces: Any,
    steps: int | None,
    parameters: Mapping[str, Any] | None,
) -> Batch:
    """Checks the arguments of a rollout and creates its batch."""
    scene = made("scene", scene, Scene)
    if parameters is not None and not isinstance(parameters, Mapping):
        raise TypeError(f"parameters is {type(parameters).__name__}; a dictionary of arrays by name is needed")
    bodies = len(scene.bodies)
    starts = _starts(scene, initial_states, bodies)
    pushes = None if controls is None else _controls(controls, bodies)
    values = [(name, _parameter(name, value, scene)) for name, value in (parameters or {}).items()]
    if motors is not None and not (scene.motor_axes or scene.motor_gears):
        raise TumbleError(
            "motors: the scene has no motors; Scene.with_motors adds them to robots, and joint_forces "
            "drive axes without motors"
        )
    given = {
        "controls": pushes,
        "motors": _of_steps("motors", motors, len(scene.motor_axes) + len(scene.motor_gears)),
        "joint_forces": _of_steps("joint_forces", joint_forces, len(scene.driven_axes)),
    }
    timed = {name: array for name, array in given.items() if array is not None}
    length = _steps(steps, timed)
    sizes = {"initial_states": len(starts), **{name: len(array) for name, array in timed.items()}}
    rollouts = max([*sizes.values(), *(len(value) for _, value in values)])
    for name, size in sizes.items():
        if size not in (1, rollouts):
            needed = "1 or more" if rollouts == 1 else f"1 or {rollouts}"
            raise TumbleError(f"{name} has {size} rollouts; {needed} are needed")
    for name, value in values:
        if len(value) != rollouts:
            raise TumbleError(f"parameters[{name!r}] has {len(value)} values; {rollouts}, one per rollout, are needed")
    return Batch(scene, rollouts, length, starts, pushes, given["motors"], given["joint_forces"], values)


def threads_of(threads: int | None) -> int:
    """Number of threads; None selects all cores."""
    if threads is not None:
        return whole("threads", threads, 1)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0
    return cores or os.cpu_count() or 1


def _starts(scene: Scene, states: Any, bodies: int) -> Floats:
    if states is None:
        return scene.states.reshape(1, bodies, 13)
    shapes: list[Any] = [("B", bodies, 13)]
    if bodies == 1:
        shapes.append(("B", 13))
    array = numbers("initial_states", states, *shapes)
    return array.reshape(len(array), bodies, 13)


def _controls(controls: Any, bodies: int) -> Floats:
    shapes: list[Any] = [("B", "T", bodies, 6)]
    if bodies == 1:
        shapes.append(("B", "T", 6))
    array = numbers("controls", controls, *shapes)
    return array.reshape(array.shape[0], array.shape[1], bodies, 6)


def _of_steps(name: str, given: Any, count: int) -> Floats | None:
    return None if given is None else numbers(name, given, ("B", "T", count))


def _parameter(name: Any, value: Any, scene: Scene) -> Floats:
    if not isinstance(name, str):
        raise TumbleError(f'parameters: {name!r} is not a name; a constant is needed, for example "friction"')
    shape = parameter_shape(name, scene._core)
    return numbers(f"parameters[{name!r}]", value, ("B", *shape))


def _steps(steps: int | None, timed: dict[str, Floats]) -> int:
    if not timed:
        name = "without controls, steps" if steps is None else "steps"
        return whole(name, steps, 1)
    (first, array), *others = timed.items()
    length = int(array.shape[1])
    for name, other in others:
        if other.shape[1] != length:
            raise TumbleError(f"{name} has {other.shape[1]} steps, but {first} has {length}")
    if steps is not None and steps != length:
        raise TumbleError(f"steps is {steps}, but {first} has {length}")
    return length
