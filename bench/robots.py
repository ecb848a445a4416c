"""Batches of robots beside MuJoCo: processor time per step, as a ratio.

python bench/robots.py [--worlds 64] [--steps 500] [--rounds 5] [--threads 1] [--environments]

It needs the packages tumble, gymnasium (files of hopper, half-cheetah, walker and ant) and mujoco.
Both engines take the same number of steps of the same length from the initial state of the file.
Both get the same random controls, held for five steps each. MuJoCo runs by its ``rollout`` with
the solver, cone and integrator of the file.

The first models are mechanisms written here: free chains of hinges, and a walker that lands and
stands on four feet by twelve motors. Rounds of the engines alternate. The table shows medians
and the range of the ratio over the rounds.

``--environments`` compares steps of Gymnasium's environments instead, one world on one thread, with
the same random actions. An episode that ends is reset; the time includes it.
"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import gymnasium
import mujoco
import mujoco.rollout
import numpy as np
import tumble
import tumble.locomotion  # registers the environments

MODELS = {"hopper.xml": 1, "half_cheetah.xml": 4, "walker2d_v5.xml": 1, "ant.xml": 1}
"""Each with how many steps tumble takes in one of the file: the half-cheetah turns its feet too far in 10 ms."""
HELD = 5


def chain(links: int) -> str:
    """Chain of links of 0.2 m and 1 kg, horizontal at the start and fixed at one end by a hinge."""
    body = (
        '<body pos="{at} 0 0"><inertial pos="0.1 0 0" mass="1" diaginertia="2.7e-4 3.5e-3 3.5e-3"/>'
        '<joint type="hinge" axis="0 1 0" damping="0.01"/>'
    )
    bodies = "".join(body.format(at=0.2 if link else 0) for link in range(links)) + "</body>" * links
    return f'<mujoco><option timestep="0.001" cone="elliptic" integrator="implicitfast"/><worldbody>{bodies}</worldbody></mujoco>'


def walker() -> str:
    """Trunk on four legs of three hinges each, with balls as feet."""
    legs, motors = "", ""
    for leg in range(4):
        x, y = 0.2 if leg < 2 else -0.2, 0.12 if leg % 2 == 0 else -0.12
        legs += f'''
<body pos="{x} {y} 0">
  <inertial pos="0 0 0" mass="0.5" diaginertia="3e-4 3e-4 3e-4"/>
  <joint name="roll{leg}" axis="1 0 0"/>
  <body pos="0 {y / 3:g} 0">
    <inertial pos="0 0 -0.1" mass="0.8" diaginertia="2.8e-3 2.8e-3 2e-4"/>
    <joint name="pitch{leg}" axis="0 1 0"/>
    <body pos="0 0 -0.2">
      <inertial pos="0 0 -0.1" mass="0.3" diaginertia="1e-3 1e-3 3e-5"/>
      <joint name="knee{leg}" axis="0 1 0"/>
      <geom type="sphere" size="0.02" pos="0 0 -0.2"/>
    </body>
  </body>
</body>'''
        for joint in ("roll", "pitch", "knee"):
            motors += f'<position joint="{joint}{leg}" kp="80" kv="3" forcerange="-25 25"/>'
    return f'''<mujoco>
<option timestep="0.002" cone="elliptic" integrator="implicitfast"/>
<default><joint armature="0.01" range="-2.8 2.8" limited="true"/><geom friction="0.7 0.005 0.0001"/></default>
<compiler angle="radian"/>
<worldbody>
<geom type="plane" size="5 5 1"/>
<body pos="0 0 0.45">
  <freejoint/>
  <inertial pos="0 0 0" mass="8" diaginertia="0.035 0.17 0.19"/>{legs}
</body>
</worldbody>
<actuator>{motors}</actuator>
</mujoco>'''


STANCE = np.tile([0.0, 0.8, -1.6], 4)
"""To where the motors of the walker pull: roll, pitch and knee of each leg, rad."""
MECHANISMS = {
    "chain of 10": (chain(10), 4000),
    "chain of 100": (chain(100), 400),
    "walker on its feet": (walker(), 2000),
}
"""Each with how many steps one world takes."""


class Mechanism:
    """Mechanism in both engines, held at its motors' targets."""

    def __init__(self, text: str, steps: int) -> None:
        self.mujoco = mujoco.MjModel.from_xml_string(text)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "mechanism.xml"
            file.write_text(text)
            self.scene = tumble.load(file)
        self.controls = np.tile(STANCE[: self.mujoco.nu], (1, steps, 1))
        self.driven = {"motors": self.controls} if self.mujoco.nu else {"steps": steps}


class Model:
    """Robot in both engines, and its controls."""

    def __init__(self, path: Path, substeps: int, worlds: int, steps: int) -> None:
        self.mujoco = mujoco.MjModel.from_xml_path(str(path))
        self.mujoco.opt.timestep /= substeps
        self.scene = tumble.load(path, time_step=self.mujoco.opt.timestep)
        rng = np.random.default_rng(1)
        held = -(-steps // HELD)
        drawn = rng.uniform(-1.0, 1.0, (worlds, held, self.mujoco.nu))
        self.controls = np.repeat(drawn, HELD, axis=1)[:, :steps]
        axes = [name for name, _ in self.scene.driven_axes]
        forces = np.zeros((worlds, steps, len(axes)))
        for actuator in range(self.mujoco.nu):
            joint = self.mujoco.joint(self.mujoco.actuator_trnid[actuator, 0]).name
            gear = self.mujoco.actuator_gear[actuator, 0]
            forces[:, :, axes.index(joint)] = gear * self.controls[:, :, actuator]
        self.driven = {"joint_forces": forces}


def by_tumble(model: Mechanism | Model, threads: int) -> tuple[float, int, float]:
    """Processor time (s), number of unsolved steps and largest residual (m/s)."""
    clock = time.process_time()
    batch = tumble.rollout(model.scene, threads=threads, **model.driven)
    return time.process_time() - clock, len(batch.unsolved), float(batch.residuals.max())


def by_mujoco(model: Mechanism | Model, threads: int) -> float:
    """Processor time (s)."""
    worlds, steps, _ = model.controls.shape
    data = [mujoco.MjData(model.mujoco) for _ in range(threads)]
    mujoco.mj_forward(model.mujoco, data[0])
    size = mujoco.mj_stateSize(model.mujoco, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros(size)
    mujoco.mj_getState(model.mujoco, data[0], start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    starts = np.tile(start, (worlds, 1))
    controls = model.controls if model.mujoco.nu else None
    clock = time.process_time()
    mujoco.rollout.rollout(model.mujoco, data, starts, controls, nstep=steps)
    return time.process_time() - clock


ENVIRONMENTS = {
    "Hopper": "Hopper-v5",
    "Walker2d": "Walker2d-v5",
    "Ant": "Ant-v5",
    "HalfCheetah": "HalfCheetah-v5",
}
"""Name of each environment in tumble and in Gymnasium."""


def of_environment(name: str, actions: np.ndarray) -> float:
    """Processor time of a step of environment ``name`` (s)."""
    environment = gymnasium.make(name)
    environment.reset(seed=0)
    clock = time.process_time()
    for action in actions:
        _, _, over, truncated, _ = environment.step(action)
        if over or truncated:
            environment.reset()
    return (time.process_time() - clock) / len(actions)


def compare_environments(steps: int, rounds: int) -> None:
    """Prints the times of environment steps in both engines."""
    print("| environment | tumble, us | MuJoCo, us | tumble / MuJoCo |")
    print("|---|---|---|---|")
    for name, other in ENVIRONMENTS.items():
        space = gymnasium.make(other).action_space
        drawn = np.random.default_rng(0).uniform(space.low, space.high, (steps, *space.shape))
        actions = drawn.astype(np.float32)
        times = [
            (of_environment(f"tumble/{name}-v0", actions), of_environment(other, actions))
            for _ in range(rounds)
        ]
        ratios = [a / b for a, b in times]
        a, b = (1e6 * statistics.median(all) for all in zip(*times))
        spread = f"({min(ratios):.2f} to {max(ratios):.2f})"
        print(f"| {name} | {a:.0f} | {b:.0f} | {statistics.median(ratios):.2f} {spread} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--environments", action="store_true")
    for name, usual in (("worlds", 64), ("steps", 500), ("rounds", 5), ("threads", 1)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    args = parser.parse_args()
    if args.environments:
        compare_environments(args.steps, args.rounds)
        return
    folder = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
    print(f"MuJoCo {mujoco.__version__}, tumble {tumble.__version__}; {args.worlds} worlds, {args.steps} steps")
    print("| model | step, ms | tumble, us | MuJoCo, us | tumble / MuJoCo | not solved | largest residual, m/s |")
    print("|---|---|---|---|---|---|---|")
    models = {name: Mechanism(text, steps) for name, (text, steps) in MECHANISMS.items()}
    for name, substeps in MODELS.items():
        models[name.removesuffix(".xml")] = Model(folder / name, substeps, args.worlds, args.steps)
    for name, model in models.items():
        rounds = [(by_tumble(model, args.threads), by_mujoco(model, args.threads)) for _ in range(args.rounds)]
        ours, theirs = [own[0] for own, _ in rounds], [their for _, their in rounds]
        ratios = [a / b for a, b in zip(ours, theirs)]
        _, unsolved, residual = rounds[0][0]
        steps = model.controls.shape[0] * model.controls.shape[1]
        a, b = (1e6 * statistics.median(all) / steps for all in (ours, theirs))
        print(
            f"| {name} | {1e3 * model.scene.time_step:g} | {a:.1f} | {b:.1f} "
            f"| {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}) "
            f"| {unsolved} of {steps} | {residual:.1e} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
