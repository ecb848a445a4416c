"""MuJoCo: compliant contacts, one convex problem a step."""

from __future__ import annotations

import time
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from .._scene import Scene
from ._base import Engine, Motion, Stopwatch, no_restitution
from ._mjcf import mjcf_of

GRASPING = 'integrator="implicitfast" cone="elliptic" impratio="10"'
"""Settings that MuJoCo's documentation recommends for grasping."""


class Mujoco(Engine):
    """MuJoCo with attributes of its element option, and with stiff contacts or its own."""

    compliant = True

    def __init__(self, name: str, option: str, settings: str, stiff: bool = False) -> None:
        self.name, self.option, self.settings, self.stiff = name, option, settings, stiff

    def version(self) -> str:
        return str(mujoco.__version__)

    def run(self, scene: Scene) -> Motion:
        model, data = model_and_data(scene, self.option, self.stiff)
        states = np.empty((scene.steps + 1, len(scene.free), 13))
        states[0] = scene.states
        stopwatch, exhausted = Stopwatch(), 0
        for step in range(scene.steps):
            # Fixed bodies are geoms of the world, which is body 0.
            data.xfrc_applied[1:] = scene.wrenches(step, states[step])
            with stopwatch:
                mujoco.mj_step(model, data)
            most = max(data.solver_niter[: max(1, min(data.nisland, len(data.solver_niter)))])
            exhausted += int(data.nefc > 0 and most >= model.opt.iterations)
            states[step + 1] = read_states(data.qpos, data.qvel)
        warned = sum(int(warning.number) for warning in data.warning)
        note = f"{warned} warnings" if warned else ""
        return Motion(states, stopwatch.seconds, note, stopwatch.slowest, {"not converged": exhausted})

    def time(self, scene: Scene, before: int) -> float:
        model, data = model_and_data(scene, self.option, self.stiff)
        for _ in range(before):
            mujoco.mj_step(model, data)
        warm = data.qacc_warmstart.copy() if before else None
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        begin = time.process_time()
        rollout.rollout(model, data, state, nstep=scene.steps - before, initial_warmstart=warm)
        return time.process_time() - begin


def model_and_data(scene: Scene, option: str, stiff: bool = False) -> Any:
    """Model and data at the start of a scene."""
    no_restitution(scene, elastic=True)
    model = model_of(scene, option, stiff)
    data = mujoco.MjData(model)
    states = scene.states
    # Both have position, attitude, velocity and the spin in the body's frame.
    data.qpos[:] = states[:, :7].ravel()
    data.qvel[:] = states[:, 7:].ravel()
    return model, data


def model_of(scene: Scene, option: str, stiff: bool = False) -> Any:
    """Model of a scene with further attributes of the element option, and with stiff contacts if they do not bounce."""
    return mujoco.MjModel.from_xml_string(mjcf_of(scene, option, stiff))


def read_states(qpos: Any, qvel: Any) -> Any:
    """States (N, 13) of free bodies."""
    return np.concatenate([np.asarray(qpos).reshape(-1, 7), np.asarray(qvel).reshape(-1, 6)], axis=1)


ENGINES: list[Engine] = [
    Mujoco("mujoco", GRASPING, "elliptic cone, Newton, implicitfast, impratio 10; for restitution 1 solref -10000 0"),
    Mujoco("mujoco-noslip", f'{GRASPING} noslip_iterations="10"', "as mujoco, with noslip_iterations 10"),
    Mujoco("mujoco-default", 'cone="elliptic"', "elliptic cone, otherwise defaults: Newton, Euler"),
    Mujoco(
        "mujoco-stiff",
        GRASPING.replace('"10"', '"100"'),
        "as mujoco, with impratio 100, solref 2 h 1 and solimp 0.99 0.999 0.0005",
        stiff=True,
    ),
    Mujoco("mujoco-discrete", GRASPING.replace("implicitfast", "discrete"), "as mujoco, with the integrator discrete"),
]
