"""tumble, run as a separate program."""

import csv
import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from certificate import certify
from engines.base import Engine, Motion, Unavailable, ask, one_or_all
from scene import Scene, quaternion_product

STATE = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]
STATE += ["vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s", "wy_rad_s", "wz_rad_s"]
BINARY = os.environ.get("TUMBLE", "target/release/tumble")
LIBRARY = os.environ.get("BENCH_BOXES", "target/release/examples/several_bodies")
# The certificates differ by rounding, which the division by h amplifies.
AGREEMENT = 1e-9


class Tumble(Engine):
    """tumble with one of its solvers."""

    kinds = ["one"]

    def __init__(self, solver: str, settings: str) -> None:
        self.solver = solver
        self.slow = solver == "ipopt"
        self.name = f"tumble {solver}"
        self.settings = f"{settings}; timed: `solve_seconds` of run.json, certificates included"

    def time(self, scene: Scene) -> float:
        with tempfile.TemporaryDirectory() as out:
            return self.simulate(scene, Path(out))["solve_seconds"]

    def record(self, scene: Scene) -> Motion:
        with tempfile.TemporaryDirectory() as out:
            summary = self.simulate(scene, Path(out))
            with (Path(out) / "trajectory.csv").open() as file:
                rows = list(csv.DictReader(file))
        states = column_block(rows, STATE)
        blocks = [column_block(rows, [f"f{axis}{i}_N" for i in range(8)]) for axis in "xyz"]
        forces = np.stack(blocks, axis=2)[:-1]
        motion = Motion(*to_ground_frame(scene, states, forces), summary["failed"])
        check_certificate(scene, motion, rows)
        return motion

    def simulate(self, scene: Scene, out: Path) -> dict:
        """Runs the program and returns the summary in run.json."""
        start = ["--seed", str(scene.seed)] if scene.file is None else ["--scenario", scene.file]
        command = [BINARY, "--solver", self.solver, *start, "--out", out, "--quiet"]
        code = subprocess.run(command, check=False).returncode
        # Exit code 3: the run is complete, but steps failed; the summary has their number.
        if code not in (0, 3):
            raise RuntimeError(f"{' '.join(map(str, command))} ended with exit code {code}")
        return json.loads((out / "run.json").read_text())["summary"]


class Several(Engine):
    """tumble's native solver on several boxes, by bench/measure/src/bin/several_bodies.rs."""

    kinds = ["several", "growth", "first"]
    name = "tumble"
    settings = (
        "native, no settings, by `examples/several_bodies.rs`; timed: the loop over `step`, "
        "certificates and overlap included, processor time"
    )

    def time(self, scene: Scene) -> float:
        return self.simulate(scene, record=False)["seconds"]

    def record(self, scene: Scene) -> Motion:
        done = self.simulate(scene, record=True)
        steps = scene.steps
        remarks = (
            f"{done['certified']} of {steps} steps certified at 1e-9 m/s "
            f"({100 * done['certified'] / steps:.2f} %), largest residual {done['residual']:.1e} "
            f"m/s; {done['iterations'] / steps:.2f} iterations a step, at most "
            f"{done['contacts']} contacts, slowest step {1e3 * done['slowest_seconds']:.2g} ms"
        )
        return Motion(one_or_all(done["states"]), None, done["failed"], remarks)

    def memory(self, scene: Scene) -> int:
        return self.simulate(scene, record=False)["memory_kib"]

    def simulate(self, scene: Scene, record: bool) -> dict:
        """Runs the program on the scene."""
        asked = {"untimed": scene.untimed, "record": record}
        return ask(LIBRARY, scene.request() | asked)


def column_block(rows: list[dict[str, str]], names: list[str]) -> np.ndarray:
    return np.array([[float(row[name]) for name in names] for row in rows])


def to_ground_frame(
    scene: Scene, states: np.ndarray, forces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Converts states and forces from the file's world frame to the ground frame."""
    turn = scene.to_ground
    # The rotation is the smallest one, less than a right angle: w = √(1 + trace) / 2.
    w = np.sqrt(1 + np.trace(turn)) / 2
    vector = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    attitude = np.concatenate(([w], vector / (4 * w)))
    turned = np.concatenate(
        (
            states[:, :3] @ turn.T - (0.0, 0.0, scene.offset),
            quaternion_product(np.broadcast_to(attitude, (len(states), 4)), states[:, 3:7]),
            states[:, 7:10] @ turn.T,
            states[:, 10:],
        ),
        axis=1,
    )
    return turned, forces @ turn.T


def check_certificate(scene: Scene, motion: Motion, rows: list[dict[str, str]]) -> None:
    """Checks that the certificate in numpy equals tumble's own column."""
    own = np.array([float(row["certificate_m_s"]) for row in rows[:-1]])
    ours = certify(scene, motion.states, motion.forces).whole
    worst = float(np.abs(own - ours).max())
    if not worst <= AGREEMENT:
        raise RuntimeError(f"{scene.name}: the two certificates differ by {worst:.1e} m/s")


def engines() -> list[Engine]:
    programs = [program for program in (BINARY, LIBRARY) if Path(program).is_file()]
    if not programs:
        raise Unavailable(f"there is no program {BINARY} or {LIBRARY}")
    # The command line is only built for scenes of one box.
    version = "tumble"
    if BINARY in programs:
        asked = subprocess.run([BINARY, "--version"], capture_output=True, text=True, check=True)
        version = asked.stdout.strip()
    return [
        Tumble("ipopt", f"{version}, the default: tolerance 1e-6, ladder of starts"),
        Tumble("native", "`--solver native`, no settings"),
        Several(),
    ]
