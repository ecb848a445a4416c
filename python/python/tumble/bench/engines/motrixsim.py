"""MotrixSim: MuJoCo's models and compliant contacts, solved in single precision."""

from __future__ import annotations

from importlib.metadata import version

import motrixsim
import numpy as np

from .._scene import Scene
from ._base import Engine, Motion, Stopwatch, no_restitution
from ._mjcf import mjcf_of


class Motrixsim(Engine):
    """MotrixSim with its own contacts, or with stiff ones."""

    compliant = True

    def __init__(self, name: str, settings: str, stiff: bool) -> None:
        self.name, self.settings, self.stiff = name, settings, stiff

    def version(self) -> str:
        return version("motrixsim")

    def run(self, scene: Scene) -> Motion:
        no_restitution(scene, elastic=True)
        model = motrixsim.load_mjcf_str(mjcf_of(scene, "", self.stiff))
        data = motrixsim.SceneData(model)
        start = scene.states
        # A free joint has the quaternion x, y, z, w and the spin in the body's frame.
        data.set_dof_pos(start[:, [0, 1, 2, 4, 5, 6, 3]].astype(np.float32).ravel(), model)
        data.set_dof_vel(start[:, 7:].astype(np.float32).ravel())
        links = [model.get_link(body.name) for body in scene.free]
        states = np.empty((scene.steps + 1, *start.shape))
        states[0] = start
        stopwatch = Stopwatch()
        for step in range(scene.steps):
            if scene.forces:
                for link, wrench in zip(links, scene.wrenches(step, states[step]).astype(np.float32)):
                    link.add_external_force(data, wrench[:3], local=False)
                    link.add_external_torque(data, wrench[3:], local=False)
            with stopwatch:
                motrixsim.step(model, data)
            states[step + 1, :, :7] = np.asarray(data.dof_pos).reshape(-1, 7)[:, [0, 1, 2, 6, 3, 4, 5]]
            states[step + 1, :, 7:] = np.asarray(data.dof_vel).reshape(-1, 6)
        return Motion(states, stopwatch.seconds, slowest=stopwatch.slowest)


ENGINES: list[Engine] = [
    Motrixsim("motrixsim", "single precision; contacts of MJCF's defaults, for restitution 1 solref -10000 0", False),
    Motrixsim("motrixsim-stiff", "as motrixsim, with solref 2 h 1 and solimp 0.99 0.999 0.0005", True),
]
