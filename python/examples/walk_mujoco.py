"""The walk of learn_walk.py in MuJoCo, and its policies in both engines.

python python/examples/walk_mujoco.py go1.urdf --policy DIR/policy.pt [--episodes 20] [--friction 1]
python python/examples/walk_mujoco.py go1.urdf --out DIR [--minutes 60] [--seed 1]

The first form plays episodes of 10 s with a policy in tumble and in MuJoCo, from the same random
starts. The second form trains in MuJoCo as learn_walk.py trains in tumble.
"""

from __future__ import annotations

import argparse
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers import TimeLimit
from walk_task import DAMPING, EPISODE, PERIOD, STIFFNESS, Task, tumbling

TIME_STEP = 0.002
"""Time step of MuJoCo, s: its default. Its contacts are stiffer with shorter steps."""


def model_of(file: str, friction: float) -> mujoco.MjModel:
    """The robot on level ground, with position motors."""
    robot = ElementTree.parse(file).getroot()
    for link in robot.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
    spec.option.timestep = TIME_STEP
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50.0, 50.0, 1.0])
    for geom in spec.geoms:
        geom.friction[0] = friction
    spec.worldbody.first_body().add_freejoint()
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
            motor = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            motor.set_to_position(kp=STIFFNESS, kv=DAMPING)
    return spec.compile()


class MujocoWalk(gymnasium.Env):  # type: ignore[misc,type-arg,unused-ignore]
    """The walk in MuJoCo."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model, self.data, self.task = model, mujoco.MjData(model), Task()
        low, high = model.jnt_range[1:].astype(np.float32).T
        self.action_space = spaces.Box(low, high)
        self.observation_space = spaces.Box(-np.inf, np.inf, self.observe().shape, np.float64)

    def observe(self) -> Any:
        """Observation of the task."""
        return self.task.observation(self.data.qpos, self.data.qvel)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Draws a new start."""
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:], self.data.qvel[:] = self.task.start(self.np_random)
        return self.observe(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Takes the steps of one action."""
        self.data.ctrl[:] = action
        mujoco.mj_step(self.model, self.data, round(PERIOD / self.model.opt.timestep))
        reward, over, info = self.task.judge(self.data.qpos.copy(), self.data.qvel.copy(), action)
        return self.observe(), reward, over, False, info


def soft(file: str, number: int, friction: float = 1.0) -> SyncVectorEnv:
    """Environments in MuJoCo."""
    model = model_of(file, friction)
    return SyncVectorEnv([lambda: TimeLimit(MujocoWalk(model), EPISODE) for _ in range(number)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot")
    doing = parser.add_mutually_exclusive_group(required=True)
    doing.add_argument("--policy", type=Path)
    doing.add_argument("--out", type=Path)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--friction", type=float, default=1.0)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    # The environments do without stable-baselines3.
    from learn_walk import ENVIRONMENTS, TESTS, evaluate, learn
    from stable_baselines3.common.policies import ActorCriticPolicy

    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        training, tests = (soft(args.robot, number, args.friction) for number in (ENVIRONMENTS, TESTS))
        learn(training, tests, args.out, args.minutes, args.seed)
        return
    policy = ActorCriticPolicy.load(args.policy, device="cpu")
    for name, make in (("tumble", tumbling), ("MuJoCo", soft)):
        envs = make(args.robot, args.episodes, args.friction)
        began = time.process_time()
        done = evaluate(envs, policy, args.seed)
        spent = time.process_time() - began
        print(
            f"{name}: {done.distances.mean():.2f} m walked ({done.distances.min():.2f} to "
            f"{done.distances.max():.2f}), {done.falls.sum()} of {args.episodes} fell, reward "
            f"{done.rewards.mean():.0f} ({done.rewards.min():.0f} to {done.rewards.max():.0f}), "
            f"{spent:.0f} s of processor time, {done.unsolved} steps not solved"
        )


if __name__ == "__main__":
    main()
