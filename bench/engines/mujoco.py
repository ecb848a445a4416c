"""MuJoCo: soft contacts, a convex problem per step."""

import time

import mujoco
import numpy as np
from engines.base import Engine, Motion, nearest_corner
from mujoco import rollout
from scene import Scene

MODEL = """
<mujoco>
  <option timestep="{h}" gravity="{gravity}" integrator="Euler" {option}/>
  <default><geom condim="3" friction="{mu} 0 0" {contact}/></default>
  <worldbody>
    <geom type="plane" size="50 50 1"/>{bodies}
  </worldbody>
</mujoco>
"""
BODY = """
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>
      <geom type="box" size="{half}"/>
    </body>"""


class Mujoco(Engine):
    """MuJoCo with given options and a given softness of its contacts."""

    def __init__(self, mode: str, kinds: str, option: str, contact: str, settings: str) -> None:
        self.name = f"MuJoCo {mode}"
        self.kinds = kinds.split()
        self.option, self.contact = option, contact
        timed = "one call of `mujoco.rollout`, a loop in C, processor time"
        self.settings = f"{settings}; timed: {timed}"

    def time(self, scene: Scene) -> float:
        model, data, state = self.begin(scene)
        warm = None
        if scene.untimed:
            mujoco.mj_step(model, data, nstep=scene.untimed)
            mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
            warm = data.qacc_warmstart.copy()
        clock = time.process_time()
        rollout.rollout(model, data, state, nstep=scene.steps, initial_warmstart=warm)
        return time.process_time() - clock

    def record(self, scene: Scene) -> Motion:
        model, data, _ = self.begin(scene)
        if scene.kind != "one":
            return self.record_several(scene, model, data)
        states, forces, unsolved = [scene.box.start], np.zeros((scene.steps, 8, 3)), 0
        for k in range(scene.steps):
            centre, turn = states[-1][:3], None
            mujoco.mj_step(model, data)
            # The contacts in `data` belong to the start of the step, where the forces act.
            for i in range(data.ncon):
                turn = rotation(states[-1][3:7]) if turn is None else turn
                corner = nearest_corner(scene, (data.contact[i].pos - centre) @ turn)
                forces[k, corner] += contact_force(model, data, i)
            unsolved += exhausted(model, data)
            states.append(np.concatenate((data.qpos, data.qvel)))
        return Motion(np.array(states), forces, unsolved)

    def record_several(self, scene: Scene, model: mujoco.MjModel, data: mujoco.MjData) -> Motion:
        """Simulates several boxes, without forces."""
        states, unsolved = [[box.start for box in scene.boxes]], 0
        for _ in range(scene.steps):
            mujoco.mj_step(model, data)
            unsolved += exhausted(model, data)
            rows = (data.qpos.reshape(-1, 7), data.qvel.reshape(-1, 6))
            states.append(np.concatenate(rows, axis=1))
        for warning in data.warning:
            if warning.number > 0:
                raise RuntimeError(f"{warning.number} warnings, the last info {warning.lastinfo}")
        return Motion(np.array(states), None, unsolved)

    def begin(self, scene: Scene) -> tuple:
        """Creates the model, the data and the full initial state."""
        text = MODEL.format(
            h=scene.step_seconds,
            gravity=numbers(scene.gravity),
            option=self.option,
            mu=scene.friction,
            contact=self.contact,
            bodies="".join(
                BODY.format(
                    mass=box.mass, inertia=numbers(box.inertia), half=numbers(box.sides / 2)
                )
                for box in scene.boxes
            ),
        )
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        # Both formats store position and attitude (scalar first) before velocity and body-frame
        # spin.
        starts = np.array([box.start for box in scene.boxes])
        data.qpos[:], data.qvel[:] = starts[:, :7].ravel(), starts[:, 7:].ravel()
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        return model, data, state


def exhausted(model: mujoco.MjModel, data: mujoco.MjData) -> int:
    """Returns 1 if the solver used all its iterations in the last step, in any island."""
    most = max(data.solver_niter[: max(1, min(data.nisland, len(data.solver_niter)))])
    return int(data.nefc > 0 and most >= model.opt.iterations)


def contact_force(model: mujoco.MjModel, data: mujoco.MjData, i: int) -> np.ndarray:
    """Force of the plane on the box at contact i (N)."""
    wrench = np.zeros(6)
    mujoco.mj_contactForce(model, data, i, wrench)
    # Rows of the frame: the normal, from the plane to the box, and two tangents.
    return data.contact[i].frame.reshape(3, 3).T @ wrench[:3]


def rotation(attitude: np.ndarray) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, attitude)
    return matrix.reshape(3, 3)


def numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def engines() -> list[Engine]:
    return [
        Mujoco(
            "default",
            "one several",
            "",
            "",
            f"{mujoco.__version__}: pyramidal cone, Newton, Euler",
        ),
        Mujoco(
            "elliptic",
            "one several growth first",
            'cone="elliptic" solver="Newton"',
            "",
            "elliptic cone, Newton, Euler, default softness",
        ),
        Mujoco(
            "no slip",
            "one",
            'cone="elliptic" solver="Newton" impratio="10" noslip_iterations="10"',
            "",
            "elliptic cone, Newton, `impratio` 10, `noslip_iterations` 10, default softness",
        ),
        Mujoco(
            "no slip, stiff",
            "one",
            'cone="elliptic" solver="Newton" impratio="100" noslip_iterations="10"',
            'solref="0.004 1" solimp="0.95 0.99 0.001"',
            "elliptic cone, Newton, `impratio` 100, `noslip_iterations` 10, `solref` 0.004 1 "
            "(twice the step, the least it allows), `solimp` 0.95 0.99 0.001",
        ),
    ]
