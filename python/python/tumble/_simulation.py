"""A running simulation."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, NamedTuple, Optional, Tuple, Union

from ._arrays import numbers
from ._checks import made, room, whole
from ._files import written
from ._progress import Progress, callback
from ._robot import Robot
from ._scene import Scene
from ._toml import document
from ._trajectory import Trajectory, by_name, contacts_frame
from ._tumble import CoreSimulation, Recording, TumbleError

if TYPE_CHECKING:
    import pandas as pd

_MOST_STEPS = 2**53 - 1


_AXES = {0: "x", 1: "y", 2: "slide", 3: "turn_x", 4: "turn_y", 5: "turn"}
"""What the axes of joints are called that drives act on."""


class Step(NamedTuple):
    """How a step ended."""

    status: str
    """One of tumble.STATUSES; a step of status "failed" has no answer that counts."""
    residual: float
    """By how much it misses the exact laws, m/s: its certificate."""
    iterations: int
    """Iterations of the solver."""

    @property
    def ok(self) -> bool:
        """Whether the step was solved."""
        return self.status not in ("failed", "wild")


class Simulation(CoreSimulation):
    """A running simulation of a scene of N bodies, from its start or from ``states`` (N, 13).

    It starts at step ``index``, without one at the scene's ``start_index``: its time is that many time steps, and
    loads are those of the times from there on.

    A state is x, y, z (m, world), the quaternion w, x, y, z (body to world), the velocity (m/s,
    world) and the spin (rad/s, body). Of a single body (13,) will do.

    The native solver solves islands, bodies that touch each other, on at most ``threads`` threads at
    the same time; the numbers are the same on any number. Ipopt has one. A process that was forked
    has none of them, and goes on on one.

    One thread at a time may use it: while it runs, another one raises TumbleError. Each thread needs a copy of its own.

    It can be pickled and copied: what comes of it goes on with the same numbers, to the last bit.
    """

    # A name that is mistyped is refused.
    __slots__ = ("_scene", "_threads", "_changed", "_robots", "__weakref__")

    _scene: Scene
    _threads: int
    _changed: bool
    """Whether bodies came or went since the scene was told."""
    _robots: Dict[str, Robot]

    def __new__(
        cls, scene: Scene, states: Any = None, *, threads: int = 1, index: Optional[int] = None
    ) -> "Simulation":
        scene, threads = made("scene", scene, Scene), whole("threads", threads, 1)
        if index is not None:
            index = whole("index", index, 0, _MOST_STEPS)
        if states is not None:
            states = _states(scene, states)
        self = super().__new__(cls, scene, states, threads, index)
        self._begin(scene, threads)
        return self

    def _begin(self, scene: Scene, threads: int) -> None:
        self._scene = scene
        self._threads = threads
        self._changed = False
        prefixes = enumerate(scene.robots)
        self._robots = {prefix: Robot(self, index) for index, prefix in prefixes}

    @classmethod
    def _restored(cls, scene: Scene, threads: int, saved: bytes) -> "Simulation":
        scene, threads = made("scene", scene, Scene), whole("threads", threads, 1)
        self = super().__new__(cls, scene, None, threads, None, saved)
        self._begin(scene, threads)
        kept = json.loads(self.kept_besides() or "{}")
        # What a robot of another name kept is of nobody here.
        for name in kept.keys() & self.robots.keys():
            self.robots[name]._keep(kept[name])
        return self

    @classmethod
    def restore(
        cls, scene: Scene, path: Union[str, "os.PathLike[str]"], *, threads: int = 1
    ) -> "Simulation":
        """The simulation of ``scene`` that goes on from the file ``path``, which save wrote, or the
        command line as state.bin.

        Raises OSError where the file cannot be read, TumbleError where it is no state, is damaged, or
        is one of another scene.
        """
        with open(path, "rb") as stream:
            content = stream.read()
        try:
            return cls._restored(scene, threads, content)
        except TumbleError as error:
            raise TumbleError(f"{os.fspath(path)}: {error}") from None

    def save(self, path: Union[str, "os.PathLike[str]"]) -> Path:
        """Writes where the simulation is: index, states, forces, wrenches, and what detection and
        solver remember; of robots the turns of their joints, their targets and gains. The scene is not in it: see
        restore."""
        return written(Path(path), self.saved())

    def saved(self) -> bytes:
        """What save writes."""
        return self.saved_with(json.dumps({name: robot._kept for name, robot in self._robots.items()}))

    def __reduce__(self) -> Any:
        """A simulation goes to another process as its scene and its state."""
        return type(self)._restored, (self.scene, self._threads, self.saved())

    def __copy__(self) -> "Simulation":
        return type(self)._restored(self.scene, self._threads, self.saved())

    def __deepcopy__(self, memo: Any) -> "Simulation":
        # A scene never changes.
        return self.__copy__()

    def set_state(self, body: Union[int, str], state: Any) -> None:
        """Sets the state (13,) of a body, by its index or its name, as if it had come to be there.

        Checked as a start is; the last step's forces stay what the next one starts from. Assign to
        ``states`` to set those of all bodies at once.
        """
        self.exchange(self._index(body), numbers("state", state, (13,)))

    def add_body(self, body: Mapping[str, Any]) -> str:
        """Adds a body, which has the fields of a table ``[[bodies]]``, as the last one, and returns its name: the
        one that is given, or the first free ``body-…``.

        It starts where its fields say, now, and must fit there as at a start. All that ties or pushes the
        others stays as it was, as do their forces; coefficients between pairs are the world's and its own.
        """
        if not isinstance(body, Mapping):
            raise TumbleError(f"body is {body!r}; a dictionary is needed")
        name = self.join(document(body), self._scene._source[1])
        self._changed = True
        return name

    def remove_body(self, body: Union[int, str], *, joints: bool = False) -> None:
        """Takes a body out, by its index or its name, with all forces on it; bodies after it move up by one.

        One that joints tie is refused, unless ``joints`` says that they go too."""
        self.leave(self._index(body), joints)
        self._changed = True

    def hold(self, body: Union[int, str]) -> None:
        """Holds a body, by its index or its name, at rest where it is: nothing pushes it, it touches
        nothing and costs nothing, until it is released."""
        self.keep(self._index(body), True)

    def release(self, body: Union[int, str]) -> None:
        """Lets a body go that is held, from rest. Raises TumbleError where it is too deep in another one
        by now."""
        self.keep(self._index(body), False)

    def _index(self, body: Union[int, str]) -> int:
        bodies = self.bodies
        if isinstance(body, str):
            if body not in bodies:
                known = ", ".join(bodies[:4]) + (", …" if len(bodies) > 4 else "")
                raise TumbleError(f"body is {body!r}; the name of one is needed: {known}")
            return bodies.index(body)
        return whole("body", body, 0, len(bodies) - 1)

    @property
    def states(self) -> Any:
        """The states now: (N, 13)."""
        return super().states

    @states.setter
    def states(self, states: Any) -> None:
        self.exchange_all(_states(self.scene, states))

    @property
    def scene(self) -> Scene:
        """What is simulated.

        After bodies came or went it is a scene of those that there are, which start where they were when it
        was first asked for."""
        if self._changed:
            self._scene = self._scene._with_model(self.told(), self.index)
            self._changed = False
        return self._scene

    def step(self, wrenches: Any = None) -> Step:
        """Takes one step.

        ``wrenches`` (N, 6), of one body also (6,), push the bodies in it besides gravity and the
        scene's loads: force in N, world frame, at the centre of mass; torque in N m, body frame.
        Given once they stay until others are.
        """
        if wrenches is not None:
            bodies = len(self.bodies)
            shapes = _shapes((bodies, 6), bodies)
            wrenches = numbers("wrenches", wrenches, *shapes).reshape(bodies, 6)
        return Step(*self.advance(wrenches))

    def run(
        self,
        steps: int,
        wrenches: Any = None,
        *,
        contacts: bool = True,
        progress: Progress = False,
    ) -> Trajectory:
        """Takes ``steps`` steps and records them.

        ``wrenches`` (T, N, 6), of one body also (T, 6), push the bodies in each of the T steps, as
        in step. Without ``contacts`` only the states and the sum of forces on each body are kept, a
        tenth of the memory. More than the machine's memory raises MemoryError.

        Ctrl-C raises KeyboardInterrupt; the simulation is then where it had come to. That exception,
        or any other that ends the run early, has what was recorded in its attribute ``trajectory``.
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
        recorded, raised = self.record(
            steps, wrenches, contacts=contacts, progress=callback(progress)
        )
        trajectory = Trajectory(self.scene, recorded)
        if raised is not None:
            raised.trajectory = trajectory  # type: ignore[attr-defined]
            raise raised
        return trajectory

    def set_motor(
        self,
        joint: str,
        *,
        speed: Optional[float] = None,
        position: Optional[float] = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        most: Optional[float] = None,
        axis: Optional[str] = None,
    ) -> None:
        """Gives a joint another motor in the steps to come: one that holds ``speed`` (m/s or rad/s), or with a
        ``damping`` pulls to it, or pulls to ``position`` (m or rad) with ``stiffness`` and ``damping``, with up to the force or torque
        ``most``; without either, none. ``axis`` is "slide", "turn", "x", "y", "turn_x", "turn_y" or "turn_z", of a
        joint that has several."""
        number, place = self._axis(joint, axis)
        most = _most(speed, position, most)
        self.put_motor(number, place, speed, position, stiffness, damping, most)

    def set_gear_motor(
        self,
        gear: int,
        *,
        speed: Optional[float] = None,
        position: Optional[float] = None,
        stiffness: float = 0.0,
        damping: float = 0.0,
        most: Optional[float] = None,
    ) -> None:
        """Gives the sum of coordinates of a gear that has a drive, by its place in ``scene.gears``, another motor in the
        steps to come, as ``set_motor`` does of a joint, in the units of the gear's first coordinate."""
        gear = whole("gear", gear, 0)
        most = _most(speed, position, most)
        self.put_gear_motor(gear, speed, position, stiffness, damping, most)

    def set_force(self, joint: str, force: float, *, axis: Optional[str] = None) -> None:
        """Sets the constant force (N) or torque (N m) of a joint along or about its axis in the steps to
        come."""
        self.put_force(*self._axis(joint, axis), force)

    def _axis(self, joint: str, axis: Optional[str]) -> Tuple[int, int]:
        names, axes = self.scene.joints, self.scene.joint_axes
        if joint not in names:
            raise TumbleError(f"joint is {joint!r}; one of {', '.join(names) or 'none'} is needed")
        number = names.index(joint)
        # The third axis of three is called as the other two.
        third = "turn_z" if 3 in axes[number] else "turn"
        driven = {third if place == 5 else _AXES[place]: place for place in axes[number]}
        if axis is None and len(driven) == 1:
            return number, axes[number][0]
        if axis not in driven:
            raise TumbleError(
                f"axis of {joint} is {axis!r}; one of {', '.join(driven) or 'none'} is needed"
            )
        return number, driven[axis]

    @property
    def robots(self) -> Dict[str, Robot]:
        """The robots from files, by what stands before their names in the scene."""
        return self._robots

    @property
    def robot(self) -> Robot:
        """The one robot of the scene."""
        if len(self._robots) != 1:
            raise TumbleError(f"robot: the scene has {len(self._robots)}; see robots")
        return next(iter(self._robots.values()))

    @property
    def joints(self) -> Dict[str, Dict[str, Any]]:
        """Each joint by its name, as Trajectory.joints has it: where it is now, and the rates, force and
        torque of the last step, 0 before the first."""
        return by_name(self.scene, self.joint_columns, ...)

    def contacts_to_pandas(self) -> "pd.DataFrame":
        """The contacts of the last step, a row each: as Trajectory.contacts_to_pandas, without k."""
        return contacts_frame(self.scene, self.contacts)

    def __repr__(self) -> str:
        return f"<tumble.Simulation of {self.scene.name!r} at k = {self.index}, t = {self.time} s>"


def _states(scene: Scene, states: Any) -> Any:
    bodies = len(scene.bodies)
    return numbers("states", states, *_shapes((bodies, 13), bodies)).reshape(bodies, 13)


def _shapes(shape: Any, bodies: int) -> Any:
    """The shape, and the same without the axis of the bodies where there is one body."""
    return [shape, shape[:-2] + shape[-1:]] if bodies == 1 else [shape]


def _most(speed: Optional[float], position: Optional[float], most: Optional[float]) -> float:
    """What a motor has, of one that is given whole."""
    if speed is not None and position is not None:
        raise TumbleError("speed: either speed or position can be given")
    if (speed is not None or position is not None) and most is None:
        raise TumbleError("most: the force or torque of the motor, N or N m, is needed")
    return most or 0.0
