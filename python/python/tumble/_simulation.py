"""A running simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ._arrays import numbers
from ._checks import room, whole
from ._progress import Progress, callback
from ._scene import Scene
from ._trajectory import Trajectory, contacts_frame
from ._tumble import CoreSimulation, Recording

if TYPE_CHECKING:
    import pandas as pd


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
        room(f"{steps} recorded steps of {bodies} bodies", steps * Recording.step_bytes(bodies))
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

    def contacts_to_pandas(self) -> "pd.DataFrame":
        """The contacts of the last step, a row each: as Trajectory.contacts_to_pandas, without k."""
        return contacts_frame(self.scene, self.contacts)

    def __repr__(self) -> str:
        return f"<tumble.Simulation of {self.scene.name!r} at k = {self.index}, t = {self.time} s>"


def _shapes(shape: Any, bodies: int) -> Any:
    """The shape, and the same without the axis of the bodies where there is one body."""
    return [shape, shape[:-2] + shape[-1:]] if bodies == 1 else [shape]
