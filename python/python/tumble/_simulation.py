"""A running simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, NamedTuple, Optional, Tuple

from ._arrays import numbers
from ._checks import room, whole
from ._progress import Progress, callback
from ._scene import Scene
from ._trajectory import Trajectory, by_name, contacts_frame
from ._tumble import CoreSimulation, Recording, TumbleError

if TYPE_CHECKING:
    import pandas as pd


_AXES = {0: "x", 1: "y", 2: "slide", 5: "turn"}
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

    A state is x, y, z (m, world), the quaternion w, x, y, z (body to world), the velocity (m/s,
    world) and the spin (rad/s, body). Of a single body (13,) will do.

    The native solver solves islands, bodies that touch each other, on at most ``threads`` threads at
    the same time; the numbers are the same on any number. Ipopt has one. A process that was forked
    has none of them, and goes on on one.
    """

    _scene: Scene

    def __new__(cls, scene: Scene, states: Any = None, *, threads: int = 1) -> "Simulation":
        bodies = len(scene.bodies)
        threads = whole("threads", threads, 1)
        if states is not None:
            states = numbers("states", states, *_shapes((bodies, 13), bodies)).reshape(bodies, 13)
        self = super().__new__(cls, scene, states, threads)
        self._scene = scene
        return self

    @property
    def scene(self) -> Scene:
        """What is simulated."""
        return self._scene

    def step(self, wrenches: Any = None) -> Step:
        """Takes one step.

        ``wrenches`` (N, 6), of one body also (6,), push the bodies in it besides gravity and the
        scene's loads: force in N, world frame, at the centre of mass; torque in N m, body frame.
        Given once they stay until others are.
        """
        if wrenches is not None:
            bodies = len(self.scene.bodies)
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
        bodies = len(self.scene.bodies)
        of_step = Recording.step_bytes(bodies, len(self.scene.joints))
        room(f"{steps} recorded steps of {bodies} bodies", steps * of_step)
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
        """Gives a joint another motor in the steps to come: one that holds ``speed`` (m/s or rad/s), or
        pulls to ``position`` (m or rad) with ``stiffness`` and ``damping``, with up to the force or torque
        ``most``; without either, none. ``axis`` is "slide", "turn", "x" or "y", of a joint that has
        several."""
        if speed is not None and position is not None:
            raise TumbleError("speed: either speed or position can be given")
        if (speed is not None or position is not None) and most is None:
            raise TumbleError("most: the force or torque of the motor, N or N m, is needed")
        number, place = self._axis(joint, axis)
        self.put_motor(number, place, speed, position, stiffness, damping, most or 0.0)

    def set_force(self, joint: str, force: float, *, axis: Optional[str] = None) -> None:
        """Sets the constant force (N) or torque (N m) of a joint along or about its axis in the steps to
        come."""
        self.put_force(*self._axis(joint, axis), force)

    def _axis(self, joint: str, axis: Optional[str]) -> Tuple[int, int]:
        names, axes = self.scene.joints, self.scene.joint_axes
        if joint not in names:
            raise TumbleError(f"joint is {joint!r}; one of {', '.join(names) or 'none'} is needed")
        number = names.index(joint)
        driven = {_AXES[place]: place for place in axes[number]}
        if axis is None and len(driven) == 1:
            return number, axes[number][0]
        if axis not in driven:
            raise TumbleError(
                f"axis of {joint} is {axis!r}; one of {', '.join(driven) or 'none'} is needed"
            )
        return number, driven[axis]

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


def _shapes(shape: Any, bodies: int) -> Any:
    """The shape, and the same without the axis of the bodies where there is one body."""
    return [shape, shape[:-2] + shape[-1:]] if bodies == 1 else [shape]
