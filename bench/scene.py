"""The scenes: one box on one plane, the same for every engine.

Everything here is in the ground frame: z along the plane's normal, the plane at z = 0. For a
slope that means gravity is tilted instead of the ground, which is the same problem. State
vectors are r (3), q (4, scalar first, body to ground frame), v (3), ω (3, body), as in tumble.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

POSITION, ATTITUDE, VELOCITY, SPIN = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)
FILES = Path(__file__).resolve().parent / "scenes"


@dataclass(frozen=True)
class Scene:
    """A box, a plane, a start, and how long to simulate."""

    name: str
    steps: int
    step_seconds: float
    sides: np.ndarray
    mass: float
    inertia: np.ndarray  # diagonal, kg m²
    friction: float
    gravity: np.ndarray  # m/s²
    start: np.ndarray  # 13
    to_ground: np.ndarray  # rotation from the file's world frame to the ground frame
    offset: float = 0.0  # of the plane along its normal in the world frame, m
    file: Path | None = None
    seed: int | None = None

    @property
    def corners(self) -> np.ndarray:
        """8×3, body frame: x changes fastest, then y, then z."""
        signs = (-1.0, 1.0)
        unit = np.array([(x, y, z) for z in signs for y in signs for x in signs])
        return unit * self.sides / 2

    @property
    def seconds(self) -> float:
        """Simulated time."""
        return self.steps * self.step_seconds


def drop(seed: int) -> Scene:
    """The tutorial's cube: thrown from 2.5 m in a random attitude (numpy's draws), 999 steps.

    Its inertia is the tutorial's, 667 times smaller than that of a solid cube.
    """
    draws = np.random.RandomState(seed).rand(4)
    attitude = draws / np.linalg.norm(draws)
    start = np.concatenate(((0.0, 0.0, 2.5), attitude, (0.0, 4.0, 0.0), (0.0, -2.0, 1.0)))
    return Scene(
        name=f"drop-{seed}",
        steps=999,
        step_seconds=0.002,
        sides=np.full(3, 2.0),
        mass=10.0,
        inertia=np.full(3, 0.01),
        friction=0.3,
        gravity=np.array([0.0, 0.0, -9.81]),
        start=start,
        to_ground=np.eye(3),
        seed=seed,
    )


def load(name: str) -> Scene:
    """One of bench/scenes/*.toml, the scenario files that tumble reads itself."""
    path = FILES / f"{name}.toml"
    data = tomllib.loads(path.read_text())
    body, ground, start = data["body"], data["ground"], data["start"]
    if body["inertia"] != "solid" or start["frame"] != "ground":
        raise ValueError(f"{path}: the comparison takes solid boxes started in the ground frame")
    sides = np.array(body["box"])
    # Solid box: I_x = m (b² + c²) / 12.
    inertia = body["mass"] / 12 * (np.sum(sides**2) - sides**2)
    normal = np.array(ground["normal"])
    to_ground = rotation_to_vertical(normal / np.linalg.norm(normal))
    state = (start[key] for key in ("position", "attitude", "velocity", "spin"))
    return Scene(
        name=data["name"],
        steps=data["steps"] - 1,
        step_seconds=data["time_step"],
        sides=sides,
        mass=body["mass"],
        inertia=inertia,
        friction=ground["friction"],
        gravity=to_ground @ np.array(data["gravity"]),
        start=np.concatenate(tuple(state)),
        to_ground=to_ground,
        offset=ground["offset"],
        file=path,
    )


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
    """C_i = r + A(q) c_i, n×8×3."""
    turned = np.einsum("nij,cj->nci", rotations(states[:, ATTITUDE]), scene.corners)
    return states[:, None, POSITION] + turned


def quaternion_product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton's product p ⊗ q, scalar first, along the last axis."""
    pw, qw, pv, qv = p[..., :1], q[..., :1], p[..., 1:], q[..., 1:]
    scalar = pw * qw - np.sum(pv * qv, axis=-1, keepdims=True)
    return np.concatenate((scalar, pw * qv + qw * pv + np.cross(pv, qv)), axis=-1)
