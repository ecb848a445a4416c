"""The drop scene in one run and interleaved: the tutorial's program, tumble, MuJoCo.

Usage: compare.py TUMBLE [--seeds 42,0] [--rounds 3]

Every round runs every program once on every seed; the table shows medians over the rounds and
the ratio to the tutorial's program (for the native solver also to MuJoCo), taken round by round.
Times are of the stepping alone: tumble's own `solve_seconds`, the loop over the solver for the
tutorial's program, `mujoco.rollout` for MuJoCo.
"""

import argparse
import json
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "data" / "generate"))
import tutorial_runs  # noqa: E402

STEPS = 999
STEP_SECONDS = 0.002

# The tutorial's cube on a plane: elliptic cone, Newton solver, MuJoCo's own contact softness.
MUJOCO_MODEL = """
<mujoco>
  <option timestep="0.002" gravity="0 0 -9.81" cone="elliptic" solver="Newton" integrator="Euler"/>
  <worldbody>
    <geom type="plane" size="50 50 1" condim="3" friction="0.3 0 0"/>
    <body name="cube">
      <freejoint/>
      <inertial pos="0 0 0" mass="10" diaginertia="0.01 0.01 0.01"/>
      <geom type="box" size="1 1 1" condim="3" friction="0.3 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


class Tutorial:
    """The tutorial's program in CasADi."""

    name = "tutorial (CasADi + Ipopt)"

    def __init__(self) -> None:
        self.problem = tutorial_runs.Problem()

    def run(self, seed: int) -> dict:
        clock = time.perf_counter()
        steps = tutorial_runs.simulate(self.problem, seed)[1:]
        seconds = time.perf_counter() - clock
        unsolved = sum(step.status != "Solve_Succeeded" for step in steps)
        return {"seconds": seconds, "unsolved": unsolved}


class Tumble:
    """tumble with one of its solvers, as a program of its own."""

    def __init__(self, binary: str, solver: str) -> None:
        self.binary, self.solver = binary, solver
        self.name = f"tumble --solver {solver}"

    def run(self, seed: int) -> dict:
        with tempfile.TemporaryDirectory() as out:
            command = [self.binary, "--solver", self.solver, "--seed", str(seed), "--out", out]
            code = subprocess.run([*command, "--quiet"], check=False).returncode
            if code not in (0, 3):
                raise RuntimeError(f"{' '.join(command)} ended with exit code {code}")
            summary = json.loads((Path(out) / "run.json").read_text())["summary"]
        return {
            "seconds": summary["solve_seconds"],
            "unsolved": summary["failed"],
            "certificate": summary["certificate_max_m_s"],
        }


class Mujoco:
    """MuJoCo's rollout of the same cube from the same start."""

    name = "MuJoCo (elliptic, Newton)"

    def __init__(self) -> None:
        import mujoco
        from mujoco import rollout

        self.rollout = rollout
        self.model = mujoco.MjModel.from_xml_string(MUJOCO_MODEL)
        self.data = mujoco.MjData(self.model)
        signs = (-1.0, 1.0)
        self.corners = np.array([(x, y, z) for z in signs for y in signs for x in signs])

    def run(self, seed: int) -> dict:
        import mujoco

        mujoco.mj_resetData(self.model, self.data)
        # Both put position and attitude (scalar first) before velocity and body-frame spin.
        start = tutorial_runs.start_point(seed)
        self.data.qpos[:], self.data.qvel[:] = start[:7], start[7:13]
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, state, kind)
        clock = time.perf_counter()
        states, _ = self.rollout.rollout(self.model, self.data, state, nstep=STEPS)
        seconds = time.perf_counter() - clock
        return {"seconds": seconds, "penetration": self.deepest(states[0])}

    def deepest(self, states: np.ndarray) -> float:
        """How far a corner went below the ground, m."""
        w, x, y, z = states[:, 4:8].T
        # Third row of the rotation matrix: heights of the corners above the centre.
        row = np.stack((2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)), axis=1)
        heights = states[:, 3:4] + row @ self.corners.T
        return max(0.0, -float(heights.min()))


def engines(binary: str) -> list:
    """All programs that can be run here; one that cannot is left out with a line."""
    found = [Tutorial(), Tumble(binary, "ipopt"), Tumble(binary, "native")]
    try:
        found.append(Mujoco())
    except ImportError as error:
        print(f"left out: MuJoCo ({error})")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tumble")
    parser.add_argument("--seeds", default="42,0")
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    seeds = [int(seed) for seed in arguments.seeds.split(",")]
    programs = engines(arguments.tumble)
    print(f"{platform.machine()}, Python {platform.python_version()}, {arguments.rounds} rounds")

    for seed in seeds:
        results = {program.name: [] for program in programs}
        for _ in range(arguments.rounds):
            for program in programs:
                results[program.name].append(program.run(seed))
        print_table(seed, results)


def print_table(seed: int, results: dict[str, list[dict]]) -> None:
    """Medians over the rounds, ratios round by round."""
    print(f"\nseed {seed}, {STEPS} steps")
    print(f"{'':28} {'µs a step':>10} {'× real time':>11} {'to tutorial':>11} {'to MuJoCo':>9}  unsolved")
    base = [run["seconds"] for run in results[Tutorial.name]]
    mujoco = [run["seconds"] for run in results.get(Mujoco.name, [])]
    for name, runs in results.items():
        seconds = [run["seconds"] for run in runs]
        median = statistics.median(seconds)
        ratio = statistics.median(a / b for a, b in zip(seconds, base))
        to_mujoco = statistics.median(a / b for a, b in zip(seconds, mujoco)) if mujoco else None
        shown = f"{to_mujoco:9.2f}" if to_mujoco is not None else f"{'':9}"
        notes = [str(runs[0].get("unsolved", "-"))]
        if runs[0].get("certificate") is not None:
            notes.append(f"certificate at most {runs[0]['certificate']:.1e} m/s")
        if "penetration" in runs[0]:
            notes.append(f"deepest penetration {100 * runs[0]['penetration']:.1f} cm")
        print(
            f"{name:28} {1e6 * median / STEPS:10.2f} {STEPS * STEP_SECONDS / median:11.2f} "
            f"{ratio:11.5f} {shown}  {', '.join(notes)}"
        )


if __name__ == "__main__":
    main()
