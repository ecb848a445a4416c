"""Batches of robots beside MuJoCo: processor time a step, as a ratio of one run.

python bench/robots.py [--worlds 64] [--steps 500] [--rounds 5] [--threads 1]

With the packages tumble, gymnasium (for its files of hopper, half-cheetah, walker and ant) and mujoco. Both take the same
number of steps of the same length from the start of the file under the same random controls, held for five steps
each; MuJoCo by its ``rollout``, with the solver, the cone and the integrator of the file. Rounds of the two follow each other; of each the median counts, and the
ratio's range over the rounds is said.
"""

import argparse
import statistics
import time
from pathlib import Path

import gymnasium
import mujoco
import mujoco.rollout
import numpy as np
import tumble

MODELS = {"hopper.xml": 1, "half_cheetah.xml": 4, "walker2d_v5.xml": 1, "ant.xml": 1}
"""Each with how many steps tumble takes in one of the file: the half-cheetah turns its feet too far in 10 ms."""
HELD = 5


class Model:
    """A robot in both, and its controls."""

    def __init__(self, path: Path, substeps: int, worlds: int, steps: int) -> None:
        self.mujoco = mujoco.MjModel.from_xml_path(str(path))
        self.mujoco.opt.timestep /= substeps
        self.scene = tumble.load(path, time_step=self.mujoco.opt.timestep)
        rng = np.random.default_rng(1)
        held = -(-steps // HELD)
        drawn = rng.uniform(-1.0, 1.0, (worlds, held, self.mujoco.nu))
        self.controls = np.repeat(drawn, HELD, axis=1)[:, :steps]
        axes = [name for name, _ in self.scene.driven_axes]
        self.forces = np.zeros((worlds, steps, len(axes)))
        for actuator in range(self.mujoco.nu):
            joint = self.mujoco.joint(self.mujoco.actuator_trnid[actuator, 0]).name
            gear = self.mujoco.actuator_gear[actuator, 0]
            self.forces[:, :, axes.index(joint)] = gear * self.controls[:, :, actuator]

    def by_tumble(self, threads: int) -> tuple[float, int, float]:
        """Processor time, s, steps that are not solved, and the largest residual, m/s."""
        clock = time.process_time()
        batch = tumble.rollout(self.scene, joint_forces=self.forces, threads=threads)
        return time.process_time() - clock, len(batch.unsolved), float(batch.residuals.max())

    def by_mujoco(self, threads: int) -> float:
        """Processor time, s."""
        worlds = len(self.controls)
        data = [mujoco.MjData(self.mujoco) for _ in range(threads)]
        mujoco.mj_forward(self.mujoco, data[0])
        size = mujoco.mj_stateSize(self.mujoco, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start = np.zeros(size)
        mujoco.mj_getState(
            self.mujoco, data[0], start, mujoco.mjtState.mjSTATE_FULLPHYSICS
        )
        starts = np.tile(start, (worlds, 1))
        clock = time.process_time()
        mujoco.rollout.rollout(self.mujoco, data, starts, self.controls)
        return time.process_time() - clock


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, usual in (("worlds", 64), ("steps", 500), ("rounds", 5), ("threads", 1)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    args = parser.parse_args()
    folder = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
    print(f"MuJoCo {mujoco.__version__}, tumble {tumble.__version__}; {args.worlds} worlds, {args.steps} steps")
    print("| model | step, ms | tumble, us | MuJoCo, us | tumble / MuJoCo | not solved | largest residual, m/s |")
    print("|---|---|---|---|---|---|---|")
    for name, substeps in MODELS.items():
        model = Model(folder / name, substeps, args.worlds, args.steps)
        rounds = [(model.by_tumble(args.threads), model.by_mujoco(args.threads)) for _ in range(args.rounds)]
        ours, theirs = [own[0] for own, _ in rounds], [their for _, their in rounds]
        ratios = [a / b for a, b in zip(ours, theirs)]
        _, unsolved, residual = rounds[0][0]
        a, b = (1e6 * statistics.median(all) / (args.worlds * args.steps) for all in (ours, theirs))
        print(
            f"| {name.removesuffix('.xml')} | {1e3 * model.scene.time_step:g} | {a:.1f} | {b:.1f} "
            f"| {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}) "
            f"| {unsolved} of {args.worlds * args.steps} | {residual:.1e} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
