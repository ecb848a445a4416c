"""A Go1 robot learns to walk by proximal policy optimisation; its learning curve is drawn.

python python/examples/learn_walk.py go1.urdf --out DIR [--minutes 60] [--seed 1]

The robot file is in https://github.com/unitreerobotics/unitree_ros (robots/go1_description/urdf).
The script needs gymnasium and stable-baselines3. DIR gets policy.pt, curve.csv, curve.svg and walk.png.
walk_task.py has the task, and walk_mujoco.py plays the policy.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from learn_locomotion import svg
from PIL import Image
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecEnv
from tumble.locomotion import RobotVectorEnv
from walk_task import EPISODE, STAND, STRIDE, Floats, targets, tumbling

ENVIRONMENTS = 16
TESTS = 6
TESTED = 20
"""Number of updates between tests of the policy."""


class Adapter(VecEnv):  # type: ignore[misc,unused-ignore]
    """Vector environment for stable-baselines3, with actions from -1 to 1.

    Gymnasium's step after the end of an episode is the last step of it here, with reward 0.
    """

    def __init__(self, envs: VectorEnv, seed: int) -> None:  # type: ignore[type-arg,unused-ignore]
        self.envs, self.seed_of_starts = envs, seed
        self.seen: Floats
        action = spaces.Box(-1.0, 1.0, (len(STAND),), np.float32)
        super().__init__(envs.num_envs, envs.single_observation_space, action)

    def reset(self) -> Floats:
        """Draws all starts."""
        self.seen, _ = self.envs.reset(seed=self.seed_of_starts)
        self.ended = np.zeros(self.num_envs, bool)
        self.cut = np.zeros(self.num_envs, bool)
        return self.seen

    def step_async(self, actions: Any) -> None:
        """Keeps the actions for ``step_wait``."""
        self.actions = actions

    def step_wait(self) -> Any:
        """Takes a step of every environment."""
        seen, rewards, over, cut, _ = self.envs.step(targets(self.seen, self.actions))
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for index in np.flatnonzero(self.ended):
            infos[index] = {"terminal_observation": self.seen[index], "TimeLimit.truncated": bool(self.cut[index])}
        done, self.ended, self.cut, self.seen = self.ended, over | cut, cut & ~over, seen
        return seen, rewards, done, infos

    def close(self) -> None:
        """Closes the environments."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Attribute of the vector environment, for each environment."""
        return [getattr(self.envs, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Sets an attribute of the vector environment."""
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **keywords: Any) -> list[Any]:
        """Result of a method of the vector environment, for each environment."""
        return [getattr(self.envs, method_name)(*args, **keywords)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False: no environment has a wrapper of stable-baselines3."""
        return [False] * self.num_envs


class Episodes(NamedTuple):
    """Results of one episode in each environment."""

    rewards: Floats
    distances: Floats
    falls: npt.NDArray[np.bool_]
    unsolved: int
    """Number of steps of tumble that failed or are wild."""


def evaluate(envs: VectorEnv, policy: BasePolicy, seed: int) -> Episodes:  # type: ignore[type-arg,unused-ignore]
    """Plays an episode in each environment with the mean action of the policy."""
    seen, _ = envs.reset(seed=seed)
    rewards, distances = np.zeros(envs.num_envs), np.zeros(envs.num_envs)
    falls, unsolved = np.zeros(envs.num_envs, bool), 0
    for _ in range(EPISODE):
        on = ~falls
        actions, _ = policy.predict(seen, deterministic=True)
        seen, reward, over, _, info = envs.step(targets(seen, actions))
        rewards[on] += reward[on]
        distances[on] = info["x"][on]
        unsolved += int(info.get("unsolved", np.zeros(envs.num_envs, int))[on].sum())
        falls |= over
    return Episodes(rewards, distances, falls, unsolved)


class Curve(BaseCallback):  # type: ignore[misc,unused-ignore]
    """Tests the policy after every TESTED updates, and stops after some minutes."""

    def __init__(self, envs: VectorEnv, minutes: float, out: Path) -> None:  # type: ignore[type-arg,unused-ignore]
        super().__init__()
        self.envs, self.minutes, self.out = envs, minutes, out
        self.began, self.updates = time.monotonic(), 0
        self.points: list[tuple[int, float, float, float]] = []
        with open(out / "curve.csv", "w", encoding="utf-8") as file:
            file.write("steps,minutes,processor_minutes,reward,least,most,distance_m,falls,unsolved\n")

    def remaining(self, _: float = 1.0) -> float:
        """Share of the time that remains."""
        return max(0.0, 1.0 - (time.monotonic() - self.began) / 60.0 / self.minutes)

    def _on_step(self) -> bool:
        return self.remaining() > 0.0

    def _on_rollout_start(self) -> None:
        if self.updates % TESTED == 0:
            self.test()
        self.updates += 1

    def test(self) -> None:
        """Adds a point to the curve."""
        done = evaluate(self.envs, self.model.policy, seed=1_000_000)
        self.points.append((self.num_timesteps, done.rewards.mean(), done.rewards.min(), done.rewards.max()))
        minutes = (time.monotonic() - self.began) / 60.0
        row = [self.num_timesteps, f"{minutes:.2f}", f"{time.process_time() / 60.0:.2f}"]
        row += [f"{number:.2f}" for number in (*self.points[-1][1:], done.distances.mean())]
        row += [int(done.falls.sum()), done.unsolved]
        with open(self.out / "curve.csv", "a", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerow(row)
        print(*row, flush=True)
        self.model.policy.save(self.out / "policy.pt")


def learn(envs: VectorEnv, tests: VectorEnv, out: Path, minutes: float, seed: int) -> BasePolicy:  # type: ignore[type-arg,unused-ignore]
    """Trains a policy, and writes it to ``out`` with its learning curve."""
    torch.set_num_threads(1)
    curve = Curve(tests, minutes, out)
    model = PPO(
        "MlpPolicy",
        Adapter(envs, seed),
        learning_rate=lambda _: 1e-3 * max(0.1, curve.remaining()),
        n_steps=128,
        batch_size=512,
        n_epochs=5,
        target_kl=0.03,
        policy_kwargs={"net_arch": [128, 128], "log_std_init": -1.0, "activation_fn": torch.nn.ELU},
        seed=seed,
        device="cpu",
    )
    model.learn(10**9, callback=curve)
    curve.test()
    (out / "curve.svg").write_text(svg(curve.points), encoding="utf-8")
    return model.policy


def strip(envs: RobotVectorEnv, policy: BasePolicy, path: Path) -> None:
    """Draws a stride after two seconds of walking, in pictures of one tenth of a second."""
    seen, _ = envs.reset(seed=1)
    pictures = []
    for count in range(100 + STRIDE):
        if count >= 100 and count % 5 == 0:
            pictures.append(envs.envs[0].simulation.picture(240, (-70.0, 8.0)))
        actions, _ = policy.predict(seen, deterministic=True)
        seen, *_ = envs.step(targets(seen, actions))
    Image.fromarray(np.concatenate(pictures, axis=1)[40:200]).save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    tests = tumbling(args.robot, TESTS)
    policy = learn(tumbling(args.robot, ENVIRONMENTS), tests, args.out, args.minutes, args.seed)
    strip(tests, policy, args.out / "walk.png")


if __name__ == "__main__":
    main()
