"""MuJoCo: compliant contacts, one convex problem a step."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from .._scene import Body, Scene
from ._base import Engine, Motion, Stopwatch, no_restitution

MODEL = """
<mujoco>
  <option timestep="{step}" gravity="{gravity}" {option}/>
  <default><geom {contact}/></default>
  <asset>{meshes}</asset>
  <worldbody>{bodies}</worldbody>
  <contact>{pairs}</contact>
</mujoco>
"""
ELASTIC = ' solref="-10000 0"'
"""Stiffness without damping: an impact takes 0.03 s and returns the energy to 0.5 %."""
GRASPING = 'integrator="implicitfast" cone="elliptic" impratio="10"'
"""Settings that MuJoCo's documentation recommends for grasping."""
STIFF = ' solref="{} 1" solimp="0.99 0.999 0.0005"'
"""Contacts with a time constant of two steps, the stiffest that MuJoCo allows, and little yielding."""
PAIR = '<pair geom1="{}" geom2="{}" condim="3" friction="{} {} 0 0 0" solref="-10000 0" solreffriction="0.02 1"/>'
"""Elastic contact with friction. Only a pair has a damping of its own for friction, which does nothing without it."""
GROUND = '<geom name="the ground" type="plane" size="50 50 1"/>'
FREE = """<body name="{name}" pos="{pos}" quat="{quat}"><freejoint/>
  <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>{geom}</body>"""


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
    hulls = [body for body in scene.bodies if body.kind == "hull"]
    bodies = GROUND if scene.ground else ""
    for body in scene.bodies:
        place = {"pos": numbers(body.position), "quat": numbers(body.attitude)}
        if body.fixed:
            bodies += _geom(body, f'pos="{place["pos"]}" quat="{place["quat"]}"')
            continue
        inertia = numbers(body.inertia)
        bodies += FREE.format(name=body.name, mass=body.mass, inertia=inertia, geom=_geom(body, ""), **place)
    # MuJoCo takes friction from 1e-5 upwards; condim 1 is without friction.
    contact = f'condim="3" friction="{scene.friction!r} 0 0"' if scene.friction > 0.0 else 'condim="1"'
    if scene.restitution == 1.0:
        contact += ELASTIC
    elif stiff:
        contact += STIFF.format(2.0 * scene.time_step)
    pairs = ""
    if scene.restitution == 1.0 and scene.friction > 0.0:
        named = ["the ground"] * scene.ground + [body.name for body in scene.bodies if body.fixed]
        for body in scene.free:
            pairs += "".join(PAIR.format(other, body.name, scene.friction, scene.friction) for other in named)
            named.append(body.name)
    text = MODEL.format(
        step=scene.time_step,
        gravity=numbers(scene.gravity),
        option=option,
        contact=contact,
        meshes="".join(f'<mesh name="{body.name}" vertex="{numbers(body.points.ravel())}"/>' for body in hulls),
        bodies=bodies,
        pairs=pairs,
    )
    return mujoco.MjModel.from_xml_string(text)


def read_states(qpos: Any, qvel: Any) -> Any:
    """States (N, 13) of free bodies."""
    return np.concatenate([np.asarray(qpos).reshape(-1, 7), np.asarray(qvel).reshape(-1, 6)], axis=1)


def _geom(body: Body, place: str) -> str:
    if body.kind == "hull":
        return f'<geom name="{body.name}" type="mesh" mesh="{body.name}" {place}/>'
    return f'<geom name="{body.name}" type="{body.kind}" size="{numbers(body.size)}" {place}/>'


def numbers(values: Iterable[float]) -> str:
    """Numbers as text with all digits."""
    return " ".join(repr(float(value)) for value in values)


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
