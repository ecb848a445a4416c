"""The scenes: boxes on one plane, the same for every engine.

Everything here is in the ground frame: z along the plane's normal, the plane at z = 0. For a
slope that means gravity is tilted instead of the ground, which is the same problem. State
vectors are r (3), q (4, scalar first, body to ground frame), v (3), ω (3, body), as in tumble.
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
    """A box and its start."""

    sides: np.ndarray
    mass: float
    inertia: np.ndarray  # diagonal, kg m²
    start: np.ndarray  # 13

    @property
    def corners(self) -> np.ndarray:
        """8×3, body frame: x changes fastest, then y, then z."""
        signs = (-1.0, 1.0)
        unit = np.array([(x, y, z) for z in signs for y in signs for x in signs])
        return unit * self.sides / 2


@dataclass(frozen=True)
class Scene:
    """Boxes, a plane, and how long to simulate."""

    name: str
    kind: str  # "one" box, "several" boxes, "growth" of their number, or the "first" step of a structure
    steps: int
    step_seconds: float
    boxes: tuple[Box, ...]
    friction: float
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))  # m/s²
    # Rotation from the file's world frame to the ground frame.
    to_ground: np.ndarray = field(default_factory=lambda: np.eye(3))
    offset: float = 0.0  # of the plane along its normal in the world frame, m
    file: Path | None = None
    seed: int | None = None
    moves: bool = True  # whether anything should move
    untimed: int = 0  # steps before those that are timed

    @property
    def box(self) -> Box:
        """The first box; of a scene of one box, the box."""
        return self.boxes[0]

    @property
    def seconds(self) -> float:
        """Simulated time."""
        return self.steps * self.step_seconds

    def request(self) -> dict:
        """The scene for a program that reads it as JSON."""
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
    """The tutorial's cube: thrown from 2.5 m in a random attitude (numpy's draws), 999 steps.

    Its inertia is the tutorial's, 667 times smaller than that of a solid cube.
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
    """One of bench/scenes/*.toml, the scenario files that tumble reads itself."""
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
    """One of bench/scenes/*.json, several boxes on level ground."""
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
    """The first step of a wall of bricks that touch, every second row shifted by half a brick."""
    places = [(k + 0.5 * (row % 2), 0.0, 0.25 + 0.5 * row) for row in range(rows) for k in range(across)]
    bricks = [solid(np.array((1.0, 0.5, 0.5)), 2.0, at_rest(place)) for place in places]
    return structure("wall", bricks, 0.7)


def pyramid(rows: int) -> Scene:
    """The first step of a pyramid of cubes, 0.1 m between neighbours, each on two of the row below."""
    places = [
        (1.1 * k + 0.55 * row, 0.0, 0.5 + row) for row in range(rows) for k in range(rows - row)
    ]
    return structure("pyramid", [solid(np.ones(3), 1.0, at_rest(place)) for place in places], 0.5)


def structure(what: str, boxes: list[Box], friction: float) -> Scene:
    name = f"{what} of {len(boxes)}"
    return Scene(name, "first", 1, 0.002, tuple(boxes), friction, moves=False)


def stacks(count: int, steps: int) -> Scene:
    """`count` cubes of 1 m and 1 kg at rest in stacks of ten, three metres apart."""
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
    """A box of equal density: I_x = m (b² + c²) / 12."""
    sides = np.array(sides)
    return Box(sides, mass, mass / 12 * (np.sum(sides**2) - sides**2), start)


def at_rest(position: tuple[float, float, float], attitude=(1.0, 0.0, 0.0, 0.0)) -> np.ndarray:
    """A state without velocity."""
    return np.concatenate((position, attitude, np.zeros(6)))


def rotation_to_vertical(normal: np.ndarray) -> np.ndarray:
    """The smallest rotation that turns the unit vector `normal` into e_z.

    With a = n × e_z:  E + [a]× + [a]×² / (1 + n·e_z).
    """
    a = np.cross(normal, (0.0, 0.0, 1.0))
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + cross + cross @ cross / (1 + normal[2])


def rotations(attitudes: np.ndarray) -> np.ndarray:
    """Rotation matrices, body to ground frame, n×3×3, of the quaternions n×4."""
    w, x, y, z = attitudes.T
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def corner_positions(scene: Scene, states: np.ndarray) -> np.ndarray:
    """C_i = r + A(q) c_i of the one box, n×8×3."""
    turned = np.einsum("nij,cj->nci", rotations(states[:, ATTITUDE]), scene.box.corners)
    return states[:, None, POSITION] + turned


def quaternion_product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton's product p ⊗ q, scalar first, along the last axis."""
    pw, qw, pv, qv = p[..., :1], q[..., :1], p[..., 1:], q[..., 1:]
    scalar = pw * qw - np.sum(pv * qv, axis=-1, keepdims=True)
    return np.concatenate((scalar, pw * qv + qw * pv + np.cross(pv, qv)), axis=-1)
