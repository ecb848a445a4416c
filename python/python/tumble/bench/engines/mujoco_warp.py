"""MuJoCo Warp on the processor: MuJoCo's method in single precision."""

from __future__ import annotations

import mujoco_warp
import numpy as np
import warp

from .._scene import Scene
from ._base import Engine, Motion, Stopwatch
from .mujoco_c import GRASPING, model_and_data, read_states

MOST_CONTACTS = 400
"""Room for contacts: 27 boxes have less than half as many."""


class MujocoWarp(Engine):
    """MuJoCo Warp with the settings of the adapter of MuJoCo."""

    name = "mujoco-warp"
    settings = "elliptic cone, Newton, implicitfast, impratio 10, single precision, on the processor"
    compliant = True

    def version(self) -> str:
        return str(mujoco_warp.__version__)

    def run(self, scene: Scene) -> Motion:
        warp.config.quiet = True
        own_model, own_data = model_and_data(scene, GRASPING)
        with warp.ScopedDevice("cpu"):
            model = mujoco_warp.put_model(own_model)
            room = {"nconmax": MOST_CONTACTS, "njmax": 4 * MOST_CONTACTS}
            # The first step compiles kernels, in data of its own.
            mujoco_warp.step(model, mujoco_warp.put_data(own_model, own_data, **room))
            data = mujoco_warp.put_data(own_model, own_data, **room)
            states = np.empty((scene.steps + 1, len(scene.free), 13))
            states[0] = scene.states
            pushes = np.zeros((1, own_model.nbody, 6), np.float32)
            stopwatch = Stopwatch()
            for step in range(scene.steps):
                if scene.forces:
                    pushes[0, 1:] = scene.wrenches(step, states[step])
                    data.xfrc_applied.assign(pushes)
                with stopwatch:
                    mujoco_warp.step(model, data)
                states[step + 1] = read_states(data.qpos.numpy()[0], data.qvel.numpy()[0])
        states[:, :, 3:7] /= np.linalg.norm(states[:, :, 3:7], axis=2, keepdims=True)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


ENGINES: list[Engine] = [MujocoWarp()]
