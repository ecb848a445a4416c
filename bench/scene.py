"""Scenes: boxes on one plane, the same for every engine.

All quantities are in the ground frame: z is the plane's normal, and the plane is at z = 0. For a
slope, gravity is tilted instead of the ground, which is equivalent. State vectors are r (3),
q (4, scalar first, body to ground frame), v (3), ω (3, body frame), as in tumble.
"""

import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

POSITION, ATTITUDE, VELOCITY, SPIN = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
FILES = Path(__file__).resolve().parent / "scenes"


@dataclass(frozen=True)
class Box:
    """Box and its initial state."""

    sides: np.ndarray
    mass: float
    inertia: np.ndarray  # diagonal, kg m²
    start: np.ndarray  # 13

    @property
    def corners(self) -> np.ndarray:
        """Corners (8×3) in the body frame: x changes fastest, then y, then z."""
        signs = (-1.0, 1.0)
        unit = np.array([(x, y, z) for z in signs for y in signs for x in signs])
        return unit * self.sides / 2


@dataclass(frozen=True)
class Scene:
    """Boxes, a plane and the duration of the simulation."""

    name: str
    kind: str  # "one" box, "several" boxes, "growth" of their number, or the "first" step of a structure
    steps: int
    step_seconds: float
    boxes: tuple[Box, ...]
    friction: float
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))  # m/s²
    # Rotation from the file's world frame to the ground frame.
    to_ground: np.ndarray = field(default_factory=lambda: np.eye(3))
    offset: float = 0.0  # plane's distance from the world's origin along its normal, m
    file: Path | None = None
    seed: int | None = None
    moves: bool = True  # True if the boxes should move
    untimed: int = 0  # steps before the timed ones

    @property
    def box(self) -> Box:
        """First box, which is the only one in a scene of one box."""
        return self.boxes[0]

    @property
    def seconds(self) -> float:
        """Simulated time (s)."""
        return self.steps * self.step_seconds

    def request(self) -> dict:
        """Scene as JSON data for another program."""
        boxes = [
            {
                "half_sides": (box.sides / 2).tolist(),
                "mass": box.mass,
                "inertia": box.inertia.tolist(),
                "start": box.start.tolist(),
            }
            for box in self.boxes
        ]
        return {
            "steps": self.steps,
            "step_seconds": self.step_seconds,
            "friction": self.friction,
            "gravity": self.gravity.tolist(),
            "boxes": boxes,
        }


def drop(seed: int) -> Scene:
    """Cube of the tutorial, thrown from 2.5 m in a random attitude (numpy's draws), 999 steps.

    Its inertia is the tutorial's, 667 times smaller than the inertia of a solid cube.
    """
    draws = np.random.RandomState(seed).rand(4)
    attitude = draws / np.linalg.norm(draws)
    start = np.concatenate(((0.0, 0.0, 2.5), attitude, (0.0, 4.0, 0.0), (0.0, -2.0, 1.0)))
    cube = Box(sides=np.full(3, 2.0), mass=10.0, inertia=np.full(3, 0.01), start=start)
    return Scene(
        name=f"drop-{seed}",
        kind="one",
        steps=999,
        step_seconds=0.002,
        boxes=(cube,),
        friction=0.3,
        seed=seed,
    )


def load(name: str) -> Scene:
    """Loads a scene from bench/scenes/*.toml, the scenario files for tumble."""
    path = FILES / f"{name}.toml"
    data = tomllib.loads(path.read_text())
    body, ground, start = data["body"], data["ground"], data["start"]
    if body["inertia"] != "solid" or start["frame"] != "ground":
        raise ValueError(f"{path}: the comparison takes solid boxes started in the ground frame")
    normal = np.array(ground["normal"])
    to_ground = rotation_to_vertical(normal / np.linalg.norm(normal))
    state = (start[key] for key in ("position", "attitude", "velocity", "spin"))
    return Scene(
        name=data["name"],
        kind="one",
        steps=data["steps"] - 1,
        step_seconds=data["time_step"],
        boxes=(solid(body["box"], body["mass"], np.concatenate(tuple(state))),),
        friction=ground["friction"],
        gravity=to_ground @ np.array(data["gravity"]),
        to_ground=to_ground,
        offset=ground["offset"],
        file=path,
    )


def several(name: str) -> Scene:
    """Loads a scene from bench/scenes/*.json, several boxes on level ground."""
    data = json.loads((FILES / f"{name}.json").read_text())
    return Scene(
        name=data["name"],
        kind="several",
        steps=data["steps"],
        step_seconds=data["step_seconds"],
        boxes=tuple(
            Box(
                sides=2 * np.array(box["half_sides"]),
                mass=box["mass"],
                inertia=np.array(box["inertia"]),
                start=np.array(box["start"]),
            )
            for box in data["boxes"]
        ),
        friction=data["friction"],
        gravity=np.array(data["gravity"]),
        moves=data["moves"],
    )


def wall(rows: int, across: int) -> Scene:
    """First step of a wall of touching bricks, every second row shifted by half a brick."""
    places = [(k + 0.5 * (row % 2), 0.0, 0.25 + 0.5 * row) for row in range(rows) for k in range(across)]
    bricks = [solid(np.array((1.0, 0.5, 0.5)), 2.0, at_rest(place)) for place in places]
    return structure("wall", bricks, 0.7)


def pyramid(rows: int) -> Scene:
    """First step of a pyramid of cubes, 0.1 m apart, each cube on two of the row below."""
    places = [
        (1.1 * k + 0.55 * row, 0.0, 0.5 + row) for row in range(rows) for k in range(rows - row)
    ]
    return structure("pyramid", [solid(np.ones(3), 1.0, at_rest(place)) for place in places], 0.5)


def structure(what: str, boxes: list[Box], friction: float) -> Scene:
    name = f"{what} of {len(boxes)}"
    return Scene(name, "first", 1, 0.002, tuple(boxes), friction, moves=False)


def stacks(count: int, steps: int) -> Scene:
    """Stacks of ten cubes of 1 m and 1 kg at rest, three metres apart; `count` cubes in total."""
    side = int(np.ceil(np.sqrt(count / 10)))
    boxes = []
    for k in range(count):
        stack, level = divmod(k, 10)
        place = (3.0 * (stack % side), 3.0 * (stack // side), 0.5 + level)
        boxes.append(solid(np.ones(3), 1.0, at_rest(place)))
    return Scene(
        name=f"{count} boxes",
        kind="growth",
        steps=steps,
        step_seconds=0.002,
        boxes=tuple(boxes),
        friction=0.5,
        moves=False,
        # First steps have scenes of their own.
        untimed=20,
    )


def solid(sides: np.ndarray, mass: float, start: np.ndarray) -> Box:
    """Box of uniform density: I_x = m (b² + c²) / 12."""
    sides = np.array(sides)
    return Box(sides, mass, mass / 12 * (np.sum(sides**2) - sides**2), start)


def at_rest(position: tuple[float, float, float], attitude=(1.0, 0.0, 0.0, 0.0)) -> np.ndarray:
    """State with zero velocity."""
    return np.concatenate((position, attitude, np.zeros(6)))


def rotation_to_vertical(normal: np.ndarray) -> np.ndarray:
    """Smallest rotation that maps the unit vector `normal` to e_z.

    With a = n × e_z:  E + [a]× + [a]×² / (1 + n·e_z).
    """
    a = np.cross(normal, (0.0, 0.0, 1.0))
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + normal[2])


def rotations(attitudes: np.ndarray) -> np.ndarray:
    """Rotation matrices (n×3×3), body to ground frame, of the quaternions (n×4)."""
    w, x, y, z = attitudes.T
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def corner_positions(scene: Scene, states: np.ndarray) -> np.ndarray:
    """Corner positions C_i = r + A(q) c_i of a scene's only box (n×8×3)."""
    turned = np.einsum("nij,cj->nci", rotations(states[:, ATTITUDE]), scene.box.corners)
    return states[:, None, POSITION] + turned


def quaternion_product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton product p ⊗ q, scalar first, along the last axis."""
    pw, qw, pv, qv = p[..., :1], q[..., :1], p[..., 1:], q[..., 1:]
    scalar = pw * qw - np.sum(pv * qv, axis=-1, keepdims=True)
    return np.concatenate((scalar, pw * qv + qw * pv + np.cross(pv, qv)), axis=-1)
