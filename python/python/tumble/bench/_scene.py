"""Scenes of the benchmark: plain numbers that every engine's adapter reads.

All vectors are in the world's frame, except spins and points of shapes, which are in the body's frame.
The body's frame has its origin in the centre of mass and the principal axes of inertia.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._tumble import TumbleError
from .._types import Floats
from ._formula import evaluate
from ._solids import conjugated, matrix_of, product, quaternion_of, solid


@dataclass(frozen=True)
class Body:
    """Rigid body with its initial state."""

    name: str
    kind: str
    """``box``, ``sphere``, ``capsule`` or ``hull``."""
    size: tuple[float, ...]
    """Half sides of a box; radius of a sphere; radius and half length (between centres) of a capsule along z, m."""
    points: Floats
    """Corners of a box or a hull, (n, 3); centres of the ends of a capsule, (2, 3); centre of a sphere, (1, 3)."""
    fixed: bool
    mass: float
    inertia: Floats
    """Principal moments, (3,)."""
    position: Floats
    attitude: Floats
    """Unit quaternion w, x, y, z from body to world."""
    velocity: Floats
    spin: Floats

    @property
    def radius(self) -> float:
        """Radius around ``points``: zero for boxes and hulls."""
        return self.size[0] if self.kind in ("sphere", "capsule") else 0.0

    @property
    def state(self) -> Floats:
        """Position, attitude, velocity, spin: (13,)."""
        return np.concatenate([self.position, self.attitude, self.velocity, self.spin])


@dataclass(frozen=True)
class Force:
    """Force and torque on a body during a time."""

    body: int
    force: Sequence[Any]
    """Numbers or formulas of the time ``t``, N."""
    torque: Sequence[Any]
    """N m."""
    at: Floats
    """Point of action in the body's frame, m."""
    start: float
    end: float
    names: Mapping[str, float]


@dataclass(frozen=True)
class Scene:
    """Bodies, forces and constants of a run."""

    time_step: float
    steps: int
    gravity: Floats
    friction: float
    restitution: float
    ground: bool
    """True for the plane z = 0, with the bodies above it."""
    bodies: list[Body]
    """Free bodies first, then fixed ones."""
    forces: list[Force] = field(default_factory=list)

    @property
    def free(self) -> list[Body]:
        """Bodies that move."""
        return [body for body in self.bodies if not body.fixed]

    @property
    def states(self) -> Floats:
        """Initial states of the free bodies, (N, 13)."""
        return np.array([body.state for body in self.free])

    def wrenches(self, step: int, states: Floats) -> Floats:
        """Forces and torques on the free bodies in a step, world's frame, (N, 6): their values in its middle."""
        wrenches = np.zeros((len(states), 6))
        time = (step + 0.5) * self.time_step
        for force in self.forces:
            if not force.start <= time < force.end:
                continue
            names = {**force.names, "t": time}
            push = np.array([evaluate(part, names) for part in force.force])
            twist = np.array([evaluate(part, names) for part in force.torque])
            arm = matrix_of(states[force.body, 3:7]) @ force.at
            wrenches[force.body] += np.concatenate([push, twist + np.cross(arm, push)])
        return wrenches


_SCENE = {"time_step", "duration", "gravity", "friction", "restitution", "ground", "bodies", "forces"}
_SHAPES = ("box", "sphere", "capsule", "prism")
_BODY = {*_SHAPES, "name", "fixed", "mass", "inertia", "position", "attitude", "velocity", "spin", "copies"}
_FORCE = {"body", "force", "torque", "at", "from", "until"}
_MOST_STEPS = 100_000


def scene_of(table: Mapping[str, Any], parameters: Mapping[str, float]) -> Scene:
    """Scene of the table ``[scene]`` of a case with values of its parameters."""
    known("scene", table, _SCENE, ("time_step", "duration", "bodies"))
    number = _Numbers(parameters)
    time_step, duration = number("time_step", table["time_step"]), number("duration", table["duration"])
    if not time_step > 0.0 or not 1 <= round(duration / time_step) <= _MOST_STEPS:
        raise TumbleError(f"a duration of {duration:g} s with steps of {time_step:g} s is not 1 to {_MOST_STEPS} steps")
    bodies: list[Body] = []
    for entry in table["bodies"]:
        bodies += _bodies(entry, number)
    bodies.sort(key=lambda body: body.fixed)
    names = [body.name for body in bodies]
    if len(set(names)) < len(names):
        raise TumbleError(f"the bodies {', '.join(names)} have equal names; give each its own")
    if not bodies or bodies[0].fixed:
        raise TumbleError("the scene has no body that moves; add one to [[scene.bodies]]")
    return Scene(
        time_step=time_step,
        steps=round(duration / time_step),
        gravity=number.vector("gravity", table.get("gravity", [0, 0, -9.81])),
        friction=number("friction", table.get("friction", 0.0)),
        restitution=number("restitution", table.get("restitution", 0.0)),
        ground=bool(table.get("ground", True)),
        bodies=bodies,
        forces=[_force(entry, bodies, number) for entry in table.get("forces", [])],
    )


def known(what: str, table: Any, fields: Any, required: Sequence[str]) -> None:
    """Checks the names of the fields of a table."""
    if not isinstance(table, Mapping):
        raise TumbleError(f"{what} is {table!r}; a table is needed")
    for name in table:
        if name not in fields:
            raise TumbleError(f"{what} has the unknown field {name}; known are {', '.join(sorted(fields))}")
    for name in required:
        if name not in table:
            raise TumbleError(f"{what} has no {name}; add it")


class _Numbers:
    """Evaluation of fields."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.parameters = parameters

    def __call__(self, name: str, value: Any) -> float:
        try:
            return float(evaluate(value, self.parameters))
        except (TumbleError, TypeError) as error:
            raise TumbleError(f"{name}: {error}") from None

    def vector(self, name: str, value: Any, length: int = 3) -> Floats:
        if not isinstance(value, list) or len(value) != length:
            raise TumbleError(f"{name} is {value!r}; a list of {length} numbers is needed")
        return np.array([self(name, part) for part in value])


def _force(entry: Mapping[str, Any], bodies: list[Body], number: _Numbers) -> Force:
    known("a force", entry, _FORCE, ("body",))
    free = [body.name for body in bodies if not body.fixed]
    if entry["body"] not in free:
        raise TumbleError(f"a force acts on {entry['body']!r}; the bodies that move are {', '.join(free)}")
    return Force(
        body=free.index(entry["body"]),
        force=entry.get("force", [0, 0, 0]),
        torque=entry.get("torque", [0, 0, 0]),
        at=number.vector("at", entry.get("at", [0, 0, 0])),
        start=number("from", entry.get("from", 0.0)),
        end=number("until", entry.get("until", 1e9)),
        names=number.parameters,
    )


def _bodies(entry: Mapping[str, Any], number: _Numbers) -> list[Body]:
    """Body of an entry, or its copies."""
    known("a body", entry, _BODY, ("name", "position"))
    name, fixed = str(entry["name"]), bool(entry.get("fixed", False))
    shapes = [shape for shape in _SHAPES if shape in entry]
    if len(shapes) != 1:
        raise TumbleError(f"the body {name} has {len(shapes)} shapes; it needs one of {', '.join(_SHAPES)}")
    if not fixed and "mass" not in entry:
        raise TumbleError(f"the body {name} has no mass; add mass, or fixed = true")
    mass = number("mass", entry.get("mass", 1.0))
    made = solid(shapes[0], _dimensions(shapes[0], entry[shapes[0]], number), mass)
    inertia = number.vector("inertia", entry["inertia"]) if "inertia" in entry else made.inertia
    shape = _attitude(entry.get("attitude", [1, 0, 0, 0]), number)
    attitude = product(shape, made.axes)
    spin = matrix_of(conjugated(made.axes)) @ number.vector("spin", entry.get("spin", [0, 0, 0]))
    place = number.vector("position", entry["position"]) + matrix_of(shape) @ made.centre
    velocity = number.vector("velocity", entry.get("velocity", [0, 0, 0]))
    body = Body(name, made.kind, made.size, made.points, fixed, mass, inertia, place, attitude, velocity, spin)
    return _copies(body, entry["copies"], number) if "copies" in entry else [body]


def _copies(body: Body, grid: Any, number: _Numbers) -> list[Body]:
    """Grid of copies, x varying fastest, named ``name-0``, ``name-1``, …"""
    known("copies", grid, {"count", "step"}, ("count", "step"))
    nx, ny, nz = (int(value) for value in number.vector("count", grid["count"]))
    step = number.vector("step", grid["step"])
    places = [(i, j, k) for k in range(nz) for j in range(ny) for i in range(nx)]
    fields = {name: value for name, value in vars(body).items() if name not in ("name", "position")}
    return [
        Body(name=f"{body.name}-{index}", position=body.position + step * np.array(place), **fields)
        for index, place in enumerate(places)
    ]


def _dimensions(shape: str, value: Any, number: _Numbers) -> Any:
    if shape == "box":
        return number.vector(shape, value if isinstance(value, list) else [value] * 3)
    if shape == "sphere":
        return number(shape, value)
    if shape == "capsule":
        known(shape, value, {"length", "radius"}, ("length", "radius"))
        return number("length", value["length"]), number("radius", value["radius"])
    known(shape, value, {"polygon", "regular", "width"}, ("width",))
    if "regular" in value:
        known("regular", value["regular"], {"corners", "radius"}, ("corners", "radius"))
        count, radius = int(number("corners", value["regular"]["corners"])), number("radius", value["regular"]["radius"])
        turns = 2.0 * np.pi * (np.arange(count) + 0.5) / count
        polygon = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    else:
        corners = value.get("polygon", [])
        polygon = np.array([number.vector("polygon", corner, 2) for corner in corners]).reshape(-1, 2)
    return polygon, number("width", value["width"])


def _attitude(value: Any, number: _Numbers) -> Floats:
    """Quaternion of ``[w, x, y, z]`` or ``{ axis, degrees }``."""
    if isinstance(value, Mapping):
        known("attitude", value, {"axis", "degrees"}, ("axis", "degrees"))
        axis = number.vector("axis", value["axis"])
        half = 0.5 * np.radians(number("degrees", value["degrees"]))
        return quaternion_of(np.concatenate([[np.cos(half)], np.sin(half) * axis / np.linalg.norm(axis)]))
    return quaternion_of(number.vector("attitude", value, 4))
