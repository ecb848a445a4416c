"""A humanoid of 29 joints whose links are meshes, beside MuJoCo: time of loading and of steps.

python bench/humanoid.py [--segments 96] [--seconds 2] [--step 0.002]

It needs the packages tumble, gymnasium and mujoco. Links are tubes with rounded rims, one STL file each,
of 12 circles of --segments corners. Feet are four balls. All links collide with each other, except
parents with children and pairs that overlap at the start. Both engines run the same targets of its
motors: the start, or random ones that are held for ten steps, within a part of the joints' ranges.
Times are processor time on one thread.
"""

import argparse
import struct
import tempfile
import time
import warnings
from pathlib import Path

import mujoco
import numpy as np
import tumble
from tumble.bench._report import table
from tumble.locomotion import RobotEnv

HELD = 10
RIM = 0.3
"""Radius of the rounded rim, relative to the tube's."""
RINGS = 6
"""Circles of each rounded rim."""

LEG = [
    # name, position in the parent, axis, range, tubes (from, to, radius), mass
    ("hip_pitch", (0, 0.064, -0.1), "0 1 0", (-2.5, 2.8), [((0, 0.01, 0), (0, 0.075, 0), 0.045)], 1.35),
    ("hip_roll", (0, 0.052, -0.03), "1 0 0", (-0.5, 2.9), [((0.025, 0, -0.12), (0.025, 0, -0.03), 0.05)], 1.5),
    ("hip_yaw", (0.025, 0, -0.124), "0 0 1", (-2.7, 2.7), [((0, 0, -0.02), (-0.06, 0, -0.16), 0.05)], 1.7),
    ("knee", (-0.078, 0.002, -0.177), "0 1 0", (-0.1, 2.8), [((0, 0, 0), (0, 0, -0.27), 0.04)], 1.9),
    ("ankle_pitch", (0, 0, -0.3), "0 1 0", (-0.9, 0.5), [((0, -0.02, 0), (0, 0.02, 0), 0.015)], 0.1),
    ("ankle_roll", (0, 0, -0.018), "1 0 0", (-0.26, 0.26), [], 0.6),
]
ARM = [
    ("shoulder_pitch", (0, 0.1, 0.25), "0 1 0", (-3, 2.6), [((0, 0, 0), (0, 0.06, 0), 0.035)], 0.7),
    ("shoulder_roll", (0, 0.038, -0.014), "1 0 0", (-1.6, 2.2), [((0, 0, 0.01), (0, 0.01, -0.1), 0.035)], 0.6),
    ("shoulder_yaw", (0, 0.006, -0.103), "0 0 1", (-2.6, 2.6), [((0, 0, 0), (0.016, 0, -0.08), 0.03)], 0.7),
    ("elbow", (0.016, 0, -0.08), "0 1 0", (-1, 2), [((0, 0, 0), (0.1, 0, -0.01), 0.03)], 0.6),
    ("wrist_roll", (0.1, 0.002, -0.01), "1 0 0", (-1.9, 1.9), [((0, 0, 0), (0.04, 0, 0), 0.025)], 0.1),
    ("wrist_pitch", (0.038, 0, 0), "0 1 0", (-1.6, 1.6), [((0, 0, 0), (0.045, 0, 0), 0.025)], 0.5),
    ("wrist_yaw", (0.046, 0, 0), "0 0 1", (-1.6, 1.6), [((0, 0, 0), (0.12, 0, 0), 0.025)], 0.25),
]
TRUNK = [((0, 0, 0.03), (0, 0, 0.28), 0.1), ((0, 0, 0.3), (0, 0, 0.46), 0.08)]
WAIST = [
    ("waist_yaw", (0, 0, 0), "0 0 1", (-2.6, 2.6), [], 0.2),
    ("waist_roll", (0, 0, 0.044), "1 0 0", (-0.5, 0.5), [], 0.1),
    ("waist_pitch", (0, 0, 0), "0 1 0", (-0.5, 0.5), TRUNK, 6.8),
]
PELVIS = [((0, 0, -0.12), (0, 0, -0.02), 0.06)]
FEET = [(-0.05, 0.025), (-0.05, -0.025), (0.12, 0.03), (0.12, -0.03)]


def tube(start: np.ndarray, end: np.ndarray, radius: float, segments: int) -> list:
    """Triangles of a tube with rounded rims, counter-clockwise seen from outside."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    angle = np.linspace(0, np.pi / 2, RINGS)
    rim = RIM * radius
    radii = radius - rim + rim * np.sin(angle)
    heights = rim - rim * np.cos(angle)
    radii = np.concatenate([[0], radii, radii[::-1], [0]])
    heights = np.concatenate([[0], heights, np.linalg.norm(end - start) - heights[::-1], [np.linalg.norm(end - start)]])
    turn = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), np.cross(along, across))
    points = start + heights[:, None, None] * along + radii[:, None, None] * circle
    triangles = []
    for ring in range(len(radii) - 1):
        for at in range(segments):
            after = (at + 1) % segments
            a, b = points[ring, at], points[ring, after]
            c, d = points[ring + 1, after], points[ring + 1, at]
            if radii[ring] > 0:
                triangles.append((a, b, c))
            if radii[ring + 1] > 0:
                triangles.append((a, c, d))
    return triangles


def write_stl(file: Path, triangles: list) -> None:
    body = (struct.pack("<12fH", 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles)
    file.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + b"".join(body))


class Model:
    """MJCF text of the humanoid, and its mesh files in a folder."""

    def __init__(self, folder: Path, segments: int) -> None:
        self.folder, self.segments = folder, segments
        self.assets, self.motors = "", ""

    def shape(self, name: str, tubes: list, mass: float, mirror: float) -> str:
        """Geometry of a link. A link without a mesh has its mass alone."""
        sides = np.array([1, mirror, 1])
        if tubes:
            parts = [tube(start * sides, end * sides, radius, self.segments) for start, end, radius in tubes]
            write_stl(self.folder / f"{name}.stl", sum(parts, []))
            self.assets += f'<mesh name="{name}" file="{name}.stl"/>'
            return f'<geom type="mesh" mesh="{name}" mass="{mass}"/>'
        inertial = f'<inertial pos="0 0 0" mass="{mass}" diaginertia="1e-3 1e-3 1e-3"/>'
        if not name.endswith("ankle_roll"):
            return inertial
        return inertial + "".join(f'<geom size="0.005" pos="{x} {y} -0.03"/>' for x, y in FEET)

    def limb(self, prefix: str, links: list, mirror: float, end: str = "") -> str:
        """Nested bodies of a limb. ``end`` is inside the last one."""
        if not links:
            return end
        (name, position, axis, limits, tubes, mass), rest = links[0], links[1:]
        if mirror < 0 and axis == "1 0 0":
            limits = (-limits[1], -limits[0])
        x, y, z = position
        self.motors += f'<position joint="{prefix}{name}" kp="100" kv="5" ctrlrange="{limits[0]} {limits[1]}" forcerange="-88 88"/>'
        return (
            f'<body name="{prefix}{name}" pos="{x} {mirror * y} {z}">'
            f'<joint name="{prefix}{name}" axis="{axis}" armature="0.01" range="{limits[0]} {limits[1]}"/>'
            f"{self.shape(prefix + name, tubes, mass, mirror)}{self.limb(prefix, rest, mirror, end)}</body>"
        )

    def text(self, step: float) -> str:
        arms = self.limb("left_", ARM, 1) + self.limb("right_", ARM, -1)
        body = self.limb("left_", LEG, 1) + self.limb("right_", LEG, -1) + self.limb("", WAIST, 1, arms)
        body = self.shape("pelvis", PELVIS, 3.8, 1) + body
        return (
            f'<mujoco><compiler angle="radian"/><option timestep="{step}" cone="elliptic" integrator="implicitfast"/>'
            f"<asset>{self.assets}</asset><worldbody><geom type='plane' size='9 9 1'/>"
            f'<body name="pelvis" pos="0 0 0.82"><freejoint/>{body}</body></worldbody><actuator>{self.motors}</actuator></mujoco>'
        )


class Humanoid(RobotEnv):
    """Environment that keeps its actions as they are."""

    def judge(self, before: np.ndarray, action: np.ndarray) -> tuple:
        return 0.0, False, {}


def main() -> None:
    parser = argparse.ArgumentParser(description="Humanoid with mesh links: times of loading and of steps.")
    parser.add_argument("--segments", type=int, default=96)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--step", type=float, default=0.002)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        model = Model(Path(folder), arguments.segments)
        file = Path(folder) / "humanoid.xml"
        file.write_text(model.text(arguments.step))
        measure(file, arguments)


def measure(file: Path, arguments: argparse.Namespace) -> None:
    # MuJoCo keeps meshes that it has read, so each engine loads once.
    start = time.process_time()
    scene = tumble.load(file)
    middle = time.process_time()
    soft = mujoco.MjModel.from_xml_path(str(file))
    ours, theirs = middle - start, time.process_time() - middle
    print(f"loading: {ours:.2f} s, {ours / theirs:.1f} times MuJoCo's\n")
    steps, rows = HELD * round(arguments.seconds / arguments.step / HELD), []
    env = Humanoid(scene, frame_skip=HELD)
    low, high = env.action_space.low, env.action_space.high
    for part in (0.0, 0.1, 0.5, 1.0):
        wanted = np.random.default_rng(1).uniform(part * low, part * high, (steps // HELD, len(low)))
        env.reset(seed=1)
        start = time.process_time()
        unsolved = sum(env.step(action)[4]["unsolved"] for action in wanted)
        ours = (time.process_time() - start) / steps
        data = mujoco.MjData(soft)
        start = time.process_time()
        for action in wanted:
            data.ctrl[:] = action
            mujoco.mj_step(soft, data, HELD)
        theirs = (time.process_time() - start) / steps
        speed = arguments.step / ours
        rows.append([f"{part:.0%}", f"{ours * 1e6:.0f}", f"{theirs * 1e6:.0f}", f"{ours / theirs:.1f}", f"{speed:.1f}", f"{unsolved} of {steps}"])
    print(table([["", "tumble, µs", "MuJoCo, µs", "ratio", "times real time", "failed or wild"], *rows]))


if __name__ == "__main__":
    main()
