"""Steps of recorded runs of MuJoCo, for audits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ._arrays import numbers
from ._audit import Recorded
from ._mujoco_certify import measured_step
from ._mujoco_metric import mujoco
from ._mujoco_step import HardStepper
from ._tumble import TumbleError
from ._types import Floats

_FIELDS = ("qpos", "qvel", "act", "ctrl", "qfrc_applied", "xfrc_applied", "mocap_pos", "mocap_quat", "qacc_warmstart")
"""Fields of MjData that a recording may have, besides the time."""


def recorded_steps(model: Any, recording: Any, every: int) -> Iterator[Recorded]:
    """The step that ``mj_step`` takes from every ``every``-th recorded state."""
    check_model(model)
    stepper = HardStepper(model, unsolved="ignore")
    if isinstance(recording, Mapping):
        states: Sequence[Any] = _States(model, recording)
    elif isinstance(recording, Sequence):
        states = recording
    else:
        raise TumbleError(
            f"recording is {type(recording).__name__}; a list of mujoco.MjData, or a dict with qpos and qvel, is needed"
        )
    time_step = model.opt.timestep
    for k in range(0, len(states), every):
        data = states[k]
        step, after = measured_step(stepper, data)
        replay = 0.0
        if k + 1 < len(states):
            position, velocity, time = _motion(states, k + 1)
            if abs(time - data.time - time_step) < 1e-6 * time_step:
                moved = np.zeros(model.nv)
                mujoco.mj_differentiatePos(model, moved, time_step, after.qpos, position)
                replay = float(np.abs([velocity - after.qvel, moved]).max(initial=0.0))
        yield Recorded(k, float(data.time) + time_step, step, replay)


def check_model(model: Any) -> None:
    """Raises TumbleError unless ``model`` is a mujoco.MjModel."""
    if not isinstance(model, mujoco.MjModel):
        raise TumbleError(f"model is {type(model).__name__}; a mujoco.MjModel is needed")


def velocity_names(model: Any) -> tuple[str, ...]:
    """Joint and number of each degree of freedom (nv,)."""
    check_model(model)
    names = []
    for joint in model.dof_jntid:
        kind = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, int(joint))
        body = int(model.jnt_bodyid[joint])
        own = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or f"body {body}"
        names.append(kind or own)
    axes = np.arange(model.nv) - model.jnt_dofadr[model.dof_jntid]
    several = np.isin(
        model.jnt_type[model.dof_jntid], [int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)]
    )
    free = model.jnt_type[model.dof_jntid] == int(mujoco.mjtJoint.mjJNT_FREE)
    words = [("vx", "vy", "vz", "wx", "wy", "wz")[axis if whole else axis + 3] for axis, whole in zip(axes % 6, free)]
    return tuple(f"{name} {word}" if many else name for name, word, many in zip(names, words, several))


class _States(Sequence[Any]):
    """States of a recording in arrays, as MjData."""

    def __init__(self, model: Any, recording: Mapping[str, Any]) -> None:
        for name in recording:
            if name not in (*_FIELDS, "time"):
                raise TumbleError(f"recording has {name!r}; the names are time, {', '.join(_FIELDS)}")
        for name in ("qpos", "qvel"):
            if name not in recording:
                raise TumbleError(f"recording lacks {name}")
        data = mujoco.MjData(model)
        count = len(numbers("recording['qpos']", recording["qpos"], ("K", model.nq)))
        self.model, self._length = model, count
        self.arrays = {
            name: numbers(f"recording[{name!r}]", value, (count, *np.shape(getattr(data, name))))
            for name, value in recording.items()
            if name != "time"
        }
        if "time" in recording:
            self.times: Floats = numbers("recording['time']", recording["time"], (count,))
        else:
            self.times = model.opt.timestep * np.arange(count)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, k: Any) -> Any:
        data = mujoco.MjData(self.model)
        for name, values in self.arrays.items():
            getattr(data, name)[:] = values[k]
        data.time = self.times[k]
        return data


def _motion(states: Sequence[Any], k: int) -> tuple[Floats, Floats, float]:
    """Positions, velocities and time of state ``k``."""
    if isinstance(states, _States):
        return states.arrays["qpos"][k], states.arrays["qvel"][k], float(states.times[k])
    return states[k].qpos, states[k].qvel, float(states[k].time)
