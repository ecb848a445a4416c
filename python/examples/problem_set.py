"""A hundred contact problems with solutions, for authors of solvers: OUT/NAME.hdf5, OUT/NAME.png, OUT/README.md.

python python/examples/problem_set.py OUT [--count 100]

The problems are steps of scenario files (piles, walls, arches), of a grasp and of a robot. Half of each scene's problems
are those with the most iterations, the others are evenly spaced. Each file has FCLIB's form with the solution beside
it, whose residual is at most 1e-9 m/s. Needs h5py, matplotlib, mujoco, and the command line ($TUMBLE or tumble).
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np
import pinched_capsule
import tumble
import tumble.mujoco

ROOT = Path(__file__).resolve().parents[2]
SCENES = ("block-on-block", "stack", "arch", "card-house", "dominoes", "bricks", "marbles", "pyramid", "pile")
"""Scenario files, from easy to hard."""
ROBOT = """
<mujoco>
  <option timestep="0.004" cone="elliptic"/>
  <worldbody>
    <geom type="plane" size="5 5 1" friction="0.8"/>
    <body pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.25 0.12 0.05" mass="6"/>
      {legs}
    </body>
  </worldbody>
</mujoco>
"""
LEG = """
      <body pos="{x} {y} 0">
        <joint type="hinge" axis="0 1 0" stiffness="60" damping="2" springref="40"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.5"/>
        <body pos="0 0 -0.2">
          <joint type="hinge" axis="0 1 0" stiffness="60" damping="2" springref="-80"/>
          <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.3"/>
        </body>
      </body>
"""
LARGEST = 400_000
"""Bytes of the largest problem that is taken."""


def of_scene(name: str, count: int) -> Iterator[tuple[str, tumble.ContactProblem]]:
    """Problems of a scenario file."""
    program = os.environ.get("TUMBLE", "tumble")
    with tempfile.TemporaryDirectory() as folder:
        out, problems = Path(folder) / "out", Path(folder) / "problems"
        call = [program, "--scenario", str(ROOT / "scenarios" / f"{name}.toml"), "--out", str(out)]
        end = subprocess.run([*call, "--export-problems", str(problems)], capture_output=True, text=True)
        if end.returncode not in (0, 3):
            raise SystemExit(end.stderr)
        with open(out / "steps.csv") as table:
            iterations = {int(row["k"]): int(row["iterations"]) for row in csv.DictReader(table)}
        files = {k: problems / f"step-{k:08d}.dat" for k in iterations}
        small = [k for k, file in files.items() if file.exists() and file.stat().st_size <= LARGEST]
        hard = sorted(small, key=lambda k: (-iterations[k], k))[: count // 2]
        rest = [k for k in small if k not in hard]
        even = [rest[at] for at in np.linspace(0, len(rest) - 1, count - len(hard)).astype(int)]
        for k in sorted({*hard, *even}):
            yield f"{name}-{k}", tumble.ContactProblem.read(files[k])


def of_grasp(count: int) -> Iterator[tuple[str, tumble.ContactProblem]]:
    """Steps in which two fingers close on a capsule and hold it."""
    model, data = pinched_capsule.scene(1.0)
    for k in range(count):
        yield f"grasp-{k}", tumble.mujoco.hard_step(model, data).problem()


def of_robot(count: int) -> Iterator[tuple[str, tumble.ContactProblem]]:
    """Steps of a robot on springs that falls on its feet."""
    legs = "".join(LEG.format(x=x, y=y) for x in (-0.2, 0.2) for y in (-0.12, 0.12))
    model = mujoco.MjModel.from_xml_string(ROBOT.format(legs=legs))
    data, found = mujoco.MjData(model), 0
    for k in range(500):
        problem = tumble.mujoco.hard_step(model, data).problem()
        if found < count and k % 10 == 0 and problem.sizes:
            found += 1
            yield f"robot-{k}", problem


def picture(problem: tumble.ContactProblem, solution: tumble.ContactSolution, path: Path) -> None:
    """Sizes of the entries of W, and the impulses of the contacts."""
    W = np.abs((problem if problem.is_local else problem.to_local()).matrix("W"))
    impulses = solution.impulses.reshape(-1, 3)
    figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3), constrained_layout=True)
    image = left.imshow(np.log10(np.maximum(W, 1e-12 * W.max())), cmap="viridis")
    figure.colorbar(image, ax=left, label="log10 |W|")
    right.bar(range(len(impulses)), impulses[:, 0], label="normal")
    right.bar(range(len(impulses)), np.linalg.norm(impulses[:, 1:], axis=1), width=0.4, label="friction")
    right.set(xlabel="contact", ylabel="impulse, N s")
    right.legend(loc="upper right")
    figure.savefig(path, dpi=60)
    plt.close(figure)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("out", type=Path)
    arguments.add_argument("--count", type=int, default=100, help="number of problems")
    chosen = arguments.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    each = max(2, chosen.count // (len(SCENES) + 2))
    # The robot fills up what the others leave.
    sources = [of_scene(name, each) for name in SCENES] + [of_grasp(each), of_robot(chosen.count)]
    lines, count = [], 0
    for source in sources:
        for name, problem in source:
            solution = problem.solve(rule="compliance")
            if count == chosen.count or not solution.solved:
                continue
            count += 1
            problem.write(chosen.out / f"{name}.hdf5", solution)
            picture(problem, solution, chosen.out / f"{name}.png")
            digest = hashlib.sha256((chosen.out / f"{name}.hdf5").read_bytes()).hexdigest()
            lines.append(
                f"| [{name}]({name}.hdf5) | {len(problem.sizes)} | {problem.mu.max():.2g} | {solution.iterations} "
                f"| {solution.residual:.1e} | ![]({name}.png) | `{digest[:16]}` |"
            )
    text = (
        f"# {count} contact problems\n\nForm: FCLIB's HDF5, with r, u and v of the solution. "
        "Licence: CC0. Residuals are in m/s, by tumble's certificate.\n\n"
        "| problem | contacts | μ | iterations | residual | W, impulses | SHA-256 begins |\n|---|---|---|---|---|---|---|\n"
    )
    (chosen.out / "README.md").write_text(text + "\n".join(lines) + "\n")
    size = sum(file.stat().st_size for file in chosen.out.iterdir())
    print(f"{count} problems, {size / 1e6:.1f} MB in {chosen.out}")


if __name__ == "__main__":
    main()
