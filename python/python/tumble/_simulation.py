"""A running simulation."""

from __future__ import annotations

from typing import Any, NamedTuple

from ._arrays import numbers
from ._progress import Progress, callback
from ._scene import Scene
from ._trajectory import Trajectory
from ._tumble import CoreSimulation, TumbleError


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
    the same time; the numbers are the same on any number. Ipopt has one.
    """

    scene: Scene

    def __new__(cls, scene: Scene, states: Any = None, *, threads: int = 1) -> "Simulation":
        bodies = len(scene.bodies)
        if not isinstance(threads, int) or threads < 1:
            raise TumbleError(f"threads is {threads!r}; a whole number from 1 is needed")
        if states is not None:
            states = numbers("states", states, *_shapes((bodies, 13), bodies)).reshape(bodies, 13)
        self = super().__new__(cls, scene, states, threads)
        self.scene = scene
        return self

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
        in step. Without ``contacts`` only the states are kept, a tenth of the memory. Ctrl-C raises
        KeyboardInterrupt; the simulation is then where it had come to.
        """
        if not isinstance(steps, int) or steps < 0:
            raise TumbleError(f"steps is {steps!r}; a whole number from 0 is needed")
        if wrenches is not None:
            bodies = len(self.scene.bodies)
            shapes = _shapes((steps, bodies, 6), bodies)
            wrenches = numbers("wrenches", wrenches, *shapes).reshape(steps, bodies, 6)
        recorded = self.record(steps, wrenches, contacts=contacts, progress=callback(progress))
        return Trajectory(self.scene, recorded)

    def __repr__(self) -> str:
        return f"<tumble.Simulation of {self.scene.name!r} at k = {self.index}, t = {self.time} s>"


def _shapes(shape: Any, bodies: int) -> Any:
    """The shape, and the same without the axis of the bodies where there is one body."""
    return [shape, shape[:-2] + shape[-1:]] if bodies == 1 else [shape]
