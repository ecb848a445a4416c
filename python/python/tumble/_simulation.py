"""A running simulation."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _log as log
from ._arrays import numbers
from ._checks import made, room, whole
from ._core import core_property
from ._files import replaced
from ._names import ByName, unknown
from ._progress import callback
from ._query import Queries
from ._robot import Robot
from ._scene import Scene
from ._status import BY_WORD, Status
from ._toml import document
from ._trajectory import Trajectory, by_name, camera_of, contacts_frame
from ._tumble import CoreSimulation, Recording, TumbleError
from ._types import Floats, Location, Progress

if TYPE_CHECKING:
    import pandas as pd

    from ._contacts import Contacts

_MOST_STEPS = 2**53 - 1


_AXES = {0: "x", 1: "y", 2: "slide", 3: "turn_x", 4: "turn_y", 5: "turn"}
"""Names of the joint axes with drives."""


class Step(NamedTuple):
    """Result of a step."""

    status: Status
    """Status. A step with Status.FAILED did not converge."""
    residual: float
    """Certified residual of the step in the exact laws, m/s."""
    iterations: int
    """Iterations of the solver."""

    @property
    def ok(self) -> bool:
        """True if the step converged to a physical solution."""
        return self.status.ok


class Simulation(Queries):
    """Running simulation of a scene of N bodies, from its start or from ``states`` (N, 13).

    It starts at step ``index``, by default the scene's ``start_index``. Its time is ``index``
    time steps, and loads depend on this time.

    A state is x, y, z (m, world), the quaternion w, x, y, z (body to world), the velocity (m/s,
    world) and the spin (rad/s, body). A single body also accepts the shape (13,).

    The native solver solves islands, groups of touching bodies, in parallel on at most
    ``threads`` threads. The results do not depend on their number. Ipopt uses one thread. A
    forked process continues on one thread.

    One thread at a time may use a simulation; other threads raise TumbleError meanwhile. Copy
    it for each thread.

    Pickles and copies continue with the same results, to the last bit. The methods of Queries
    look at its current states.
    """

    # Slots refuse mistyped names.
    __slots__ = ("_core", "_start", "_scene", "_threads", "_changed", "_robots", "__weakref__")

    _core: CoreSimulation
    _start: tuple[Scene, Any, int | None]
    """Scene, states and index of the start."""
    _changed: bool
    """True if bodies were added or removed since the scene was created."""
    _robots: dict[str, Robot]

    def __init__(self, scene: Scene, states: Any = None, *, threads: int = 1, index: int | None = None) -> None:
        scene, self._threads = made("scene", scene, Scene), whole("threads", threads, 1)
        if index is not None:
            index = whole("index", index, 0, _MOST_STEPS)
        self._begin(scene, None if states is None else _states(scene, states).copy(), index)

    def _begin(self, scene: Scene, states: Any = None, index: int | None = None, saved: bytes | None = None) -> None:
        self._start = scene, states, index
        self._core = CoreSimulation(scene._core, states, self._threads, index, saved)
        self._scene, self._changed = scene, False
        self._robots = ByName("robot", {prefix: Robot(self, place) for place, prefix in enumerate(scene.robots)})

    def reset(self) -> None:
        """Returns to the start of the simulation, as if it were new.

        Wrenches, motors and forces of joints, gains and controls of robots, and added, removed and
        held bodies are as at the start. A simulation of ``restore`` returns to the start of its scene.
        """
        scene, states, index = self._start
        self._core = CoreSimulation(scene._core, states, self._threads, index)
        self._scene, self._changed = scene, False
        for robot in self._robots.values():
            robot._reset()

    @classmethod
    def _restored(cls, scene: Scene, threads: int, saved: bytes, start: Any = None) -> Simulation:
        self = cls.__new__(cls)
        scene, self._threads = made("scene", scene, Scene), whole("threads", threads, 1)
        self._begin(scene, saved=saved)
        self._start = start or self._start
        kept = json.loads(self._core.kept_besides() or "{}")
        # Data of a robot with another name is ignored.
        for name in kept.keys() & self.robots.keys():
            self.robots[name]._keep(kept[name])
        return self

    @classmethod
    def restore(cls, scene: Scene, path: Location, *, threads: int = 1) -> Simulation:
        """Restores a simulation of ``scene`` from a file of save or a state.bin.

        The command line writes state.bin. Raises OSError for an unreadable file. Raises
        TumbleError for a file that is not a state, is damaged or belongs to another scene.
        """
        with open(path, "rb") as stream:
            content = stream.read()
        try:
            return cls._restored(scene, threads, content)
        except TumbleError as error:
            raise TumbleError(f"{os.fspath(path)}: {error}") from None

    def save(self, path: Location) -> Path:
        """Writes the simulation's state to a file.

        It has index, body states, forces, wrenches, and the memory of detection and solver.
        It includes turns of joints, targets and gains of robots, but not the scene: see
        restore.
        """
        return replaced(Path(path), self._saved())

    def _saved(self) -> bytes:
        """Content of the file of save."""
        return self._core.saved_with(json.dumps({name: robot._kept for name, robot in self._robots.items()}))

    def __reduce__(self) -> Any:
        """Pickles a simulation as its scene and its state."""
        return type(self)._restored, (self.scene, self._threads, self._saved(), self._start)

    def __copy__(self) -> Simulation:
        return type(self)._restored(self.scene, self._threads, self._saved(), self._start)

    def __deepcopy__(self, memo: Any) -> Simulation:
        # Scenes are immutable.
        return self.__copy__()

    def set_state(self, body: int | str, state: Any) -> None:
        """Sets the state (13,) of a body, by its index or its name.

        The state is checked like a start. The next step still warm-starts from the last forces.
        Assign to ``states`` to set all bodies at once.
        """
        self._core.exchange(self._index(body), numbers("state", state, (13,)))

    def add_body(self, body: Mapping[str, Any]) -> str:
        """Adds a body as the last one, and returns its name.

        ``body`` has the fields of a ``[[bodies]]`` table. The name is the field ``name``, or
        the first free ``body-…``. The body starts where its fields say, and must fit there as
        at a start. Joints, loads and forces of other bodies stay unchanged. Coefficients
        between pairs are the world's and its own.
        """
        if not isinstance(body, Mapping):
            raise TumbleError(f"body is {body!r}; a dictionary is needed")
        name = self._core.join(document(body), self._scene._source[1])
        self._changed = True
        return name

    def remove_body(self, body: int | str, *, joints: bool = False) -> None:
        """Removes a body, by its index or its name, with all forces on it.

        Later bodies move up by one index. A body with joints is refused unless ``joints`` is
        True, which also removes these joints.
        """
        self._core.leave(self._index(body), joints)
        self._changed = True

    def hold(self, body: int | str) -> None:
        """Fixes a body, by its index or its name, at its pose until it is released.

        A fixed body has no loads, no contacts and no computational cost.
        """
        self._core.keep(self._index(body), True)

    @property
    def held(self) -> list[str]:
        """Names of the bodies that hold fixes."""
        bodies = self.bodies
        return [bodies[index] for index in self._core.kept()]

    def release(self, body: int | str) -> None:
        """Releases a fixed body from rest.

        Raises TumbleError if it penetrates another body too deeply.
        """
        self._core.keep(self._index(body), False)

    def _folder(self) -> Path:
        return Path(self._scene._source[1])

    def _index(self, body: int | str) -> int:
        bodies = self._core.bodies
        if isinstance(body, str):
            if body not in bodies:
                raise unknown("body", body, bodies)
            return bodies.index(body)
        return whole("body", body, 0, len(bodies) - 1)

    @property
    def states(self) -> Any:
        """Current states: (N, 13)."""
        return self._core.states

    @states.setter
    def states(self, states: Any) -> None:
        self._core.exchange_all(_states(self.scene, states))

    @property
    def step_states(self) -> Any:
        """States from which the next step starts: (N, 13).

        With the integrator "leapfrog" they have the velocities of the middle of the last step, of which
        ``Scene.jacobian`` is the derivative. Derivatives of successive steps then multiply.
        """
        return self._core.step_states

    bodies: list[str] = core_property("bodies", "Names of its bodies.")
    index: int = core_property("index", "Step index k.")
    time: float = core_property("time", "Time t = k h, s.")
    forces: Floats = core_property(
        "forces", "Sum of the contact forces on each body over the last step, N, world: (N, 3)."
    )
    contacts: Contacts = core_property(
        "contacts", "Contacts of the last step as columns. The object keeps the contacts of that step."
    )

    @property
    def scene(self) -> Scene:
        """Scene of the simulation.

        After a body was added or removed, this is a new scene of the current bodies. It starts
        from their states at the first access after the change.
        """
        if self._changed:
            self._scene = self._scene._with_model(self._core.model_text(), self.index)
            self._changed = False
        return self._scene

    def step(self, wrenches: Any = None, *, at_instant: bool = False) -> Step:
        """Takes one step.

        ``wrenches`` (N, 6), for one body also (6,), are added to gravity and the scene's
        loads. A wrench is a force (N, world frame) at the centre of mass and a torque (N m,
        body frame). It stays in effect in later steps until another one is given: ``step(0 * wrenches)``
        ends it.

        A wrench is held during its step, as by a sampled controller. One that is computed from the
        present state is of second order ``at_instant``: it then acts half a step before and after
        the state, as in Verlet's method.
        """
        if wrenches is not None:
            bodies = len(self.bodies)
            shapes = _shapes((bodies, 6), bodies)
            wrenches = numbers("wrenches", wrenches, *shapes).reshape(bodies, 6)
        status, residual, iterations = self._core.advance(wrenches, at_instant)
        return Step(BY_WORD[status], residual, iterations)

    def run(
        self,
        steps: int,
        wrenches: Any = None,
        *,
        motors: Any = None,
        joint_forces: Any = None,
        at_instant: bool = False,
        contacts: bool = True,
        progress: Progress = False,
    ) -> Trajectory:
        """Takes ``steps`` steps and records them.

        ``wrenches`` (T, N, 6), for one body also (T, 6), act on the bodies in each of the T
        steps, see step. ``motors`` (T, M) are targets of the motors, first those of
        ``scene.motor_axes``, then those of ``scene.motor_gears``. ``joint_forces`` (T, A) act on the
        axes of ``scene.driven_axes``, in addition to their own (N or N m). Wrenches are held during each
        step or act ``at_instant``, see step. Without ``contacts``
        only states and total forces on each body are recorded, which needs a sixth of the memory while contacts change. Too
        large a recording raises MemoryError.

        Ctrl-C raises KeyboardInterrupt, and the simulation stays at its last step. Any
        exception that ends the run early has the recorded part as its attribute ``trajectory``.
        """
        steps = whole("steps", steps, 0)
        bodies = len(self.bodies)
        of_step = Recording.step_bytes(bodies, len(self.scene.joints))
        of_bodies = f"{bodies} {'body' if bodies == 1 else 'bodies'}"
        kept = "contacts not counted" if contacts else "without contacts"
        room(f"{steps} recorded steps of {of_bodies}, {kept},", steps * of_step)
        if wrenches is not None:
            shapes = _shapes((steps, bodies, 6), bodies)
            wrenches = numbers("wrenches", wrenches, *shapes).reshape(steps, bodies, 6)
        targets = len(self.scene.motor_axes) + len(self.scene.motor_gears)
        if motors is not None:
            motors = numbers("motors", motors, (steps, targets))
        if joint_forces is not None:
            joint_forces = numbers("joint_forces", joint_forces, (steps, len(self.scene.driven_axes)))
        recorded, raised = self._core.record(
            steps,
            wrenches,
            motors,
            joint_forces,
            at_instant=at_instant,
            contacts=contacts,
            progress=callback(progress),
        )
        trajectory = Trajectory(self.scene, recorded)
        log.unsolved(len(trajectory.unsolved), len(trajectory.status), "the trajectory's attribute unsolved")
        if raised is not None:
            raised.trajectory = trajectory  # type: ignore[attr-defined]
            raise raised
        return trajectory

    def picture(self, size: int = 480, camera: tuple[float, float] = (-32.0, 20.0)) -> Any:
        """Image of the current state: (size, size, 3), red, green and blue from 0 to 255.

        ``camera`` is azimuth and elevation in degrees. The image follows the moving bodies.
        """
        size = whole("size", size, 100, 2000)
        return self.run(0, contacts=False)._recording.pixels(size, camera_of(camera))

    def set_motor(
        self,
        joint: str,
        *,
        speed: float | None = None,
        position: float | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
        axis: str | None = None,
    ) -> None:
        """Sets the motor of a joint for the following steps.

        ``speed`` (m/s or rad/s) is held, or approached with ``damping``. ``position`` (m or
        rad) is approached with ``stiffness`` and ``damping``. ``max_force`` limits force or torque.
        Without speed and position the motor is removed. ``axis`` is needed for a joint with
        several axes: "slide", "turn", "x", "y", "turn_x", "turn_y" or "turn_z".
        """
        number, place = self._axis(joint, axis)
        max_force = _max_force(speed, position, max_force)
        self._core.put_motor(number, place, (speed, position, stiffness, damping, max_force))

    def set_gear_motor(
        self,
        gear: int,
        *,
        speed: float | None = None,
        position: float | None = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        max_force: float | None = None,
    ) -> None:
        """Sets the motor of the coordinate sum of a gear with a drive.

        ``gear`` is an index in ``scene.gears``. Other arguments are those of ``set_motor``,
        in the units of the gear's first coordinate.
        """
        gear = whole("gear", gear, 0)
        max_force = _max_force(speed, position, max_force)
        self._core.put_gear_motor(gear, (speed, position, stiffness, damping, max_force))

    def set_force(self, joint: str, force: float, *, axis: str | None = None) -> None:
        """Sets the constant force (N) or torque (N m) of a joint axis for the following steps."""
        self._core.put_force(*self._axis(joint, axis), force)

    def _axis(self, joint: str, axis: str | None) -> tuple[int, int]:
        names, axes = self.scene.joints, self.scene.joint_axes
        if joint not in names:
            raise unknown("joint", joint, names)
        number = names.index(joint)
        # The third of three angular axes is named like the other two.
        third = "turn_z" if 3 in axes[number] else "turn"
        driven = {third if place == 5 else _AXES[place]: place for place in axes[number]}
        if axis is None and len(driven) == 1:
            return number, axes[number][0]
        if axis not in driven:
            raise TumbleError(f"axis of {joint} is {axis!r}; one of {', '.join(driven) or 'none'} is needed")
        return number, driven[axis]

    @property
    def robots(self) -> dict[str, Robot]:
        """Robots from files, by the prefix of their names in the scene."""
        return self._robots

    @property
    def robot(self) -> Robot:
        """The only robot of the scene."""
        if not self._robots:
            raise TumbleError("robot: the scene has no robot from a file; add one to robots of the scene")
        if len(self._robots) > 1:
            raise TumbleError(f"robot: the scene has {len(self._robots)} robots; use robots[prefix]")
        return next(iter(self._robots.values()))

    @property
    def joints(self) -> dict[str, dict[str, Any]]:
        """Joints by name, in the form of Trajectory.joints.

        Coordinates are current; rates, force and torque belong to the last step, 0 before the
        first.
        """
        return by_name(self.scene, self._core.joint_columns, ...)

    def contacts_to_pandas(self) -> pd.DataFrame:
        """Contacts of the last step, one row each: see Trajectory.contacts_to_pandas, without k."""
        return contacts_frame(self.scene, self.contacts)

    def __repr__(self) -> str:
        return f"<tumble.Simulation of {self.scene.name!r} at k = {self.index}, t = {self.time} s>"

    def _repr_html_(self) -> str:
        from ._html import shown

        return shown(repr(self), self.run(0, contacts=False).gif().data)


def _states(scene: Scene, states: Any) -> Any:
    bodies = len(scene.bodies)
    return numbers("states", states, *_shapes((bodies, 13), bodies)).reshape(bodies, 13)


def _shapes(shape: Any, bodies: int) -> Any:
    """The shape, and for one body also the shape without the body axis."""
    return [shape, shape[:-2] + shape[-1:]] if bodies == 1 else [shape]


def _max_force(speed: float | None, position: float | None, max_force: float | None) -> float:
    """Checks the arguments of a motor and returns its force limit."""
    if speed is not None and position is not None:
        raise TumbleError("speed: only one of speed and position can be given")
    if (speed is not None or position is not None) and max_force is None:
        raise TumbleError("max_force: the force or torque of the motor, N or N m, is needed")
    return max_force or 0.0
