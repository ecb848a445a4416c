"""Writes data/robots/figures.json: quantities of robot models in MuJoCo.

    python robots.py                     # models of data/robots
    python robots.py FOLDER OUT.json     # all models in another folder

For each model the file contains masses, joints and actuators. For three configurations it contains
the poses and inertias of all bodies, the mass matrix and the bias forces. Requires mujoco 4.0.0
and numpy.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent.parent / "robots"


def model_of(path):
    """Model of a file. A URDF keeps all its links, and its root is fixed."""
    spec = mujoco.MjSpec.from_file(str(path))
    if path.suffix == ".urdf":
        spec.compiler.fusestatic = False
    return spec.compile()


def name(model, kind, index):
    return mujoco.mj_id2name(model, kind, index)


def draw(model, draws):
    """Random coordinates and rates."""
    q = model.qpos0 + 0.4 * draws.standard_normal(model.nq)
    for joint in range(model.njnt):
        kind, at = model.jnt_type[joint], model.jnt_qposadr[joint]
        start = {mujoco.mjtJoint.mjJNT_FREE: at + 3, mujoco.mjtJoint.mjJNT_BALL: at}.get(kind)
        if start is not None:
            four = draws.standard_normal(4)
            q[start : start + 4] = four / np.linalg.norm(four)
    return q, draws.standard_normal(model.nv)


def pose(model, q, v):
    """Poses of all bodies at q, mass matrix, and bias forces at rates v."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    bodies = []
    for body in range(1, model.nbody):
        turn = data.ximat[body].reshape(3, 3)
        inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
        bodies.append(
            {
                "position": data.xpos[body].tolist(),
                "rotation": data.xmat[body].tolist(),
                "centre": data.xipos[body].tolist(),
                "inertia": inertia.reshape(-1).tolist(),
            }
        )
    return {
        "q": list(q),
        "v": list(v),
        "bodies": bodies,
        "mass_matrix": mass.reshape(-1).tolist(),
        "bias": data.qfrc_bias.tolist(),
    }


def figures(path):
    model = model_of(path)
    draws = np.random.default_rng(1)
    poses = [(model.qpos0.copy(), np.zeros(model.nv)), draw(model, draws), draw(model, draws)]
    body, joint, actuator = (mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_JOINT, mujoco.mjtObj.mjOBJ_ACTUATOR)
    return {
        "gravity": (model.opt.gravity * has_gravity(model)).tolist(),
        "time_step": model.opt.timestep,
        "bodies": [
            {"name": name(model, body, index), "mass": model.body_mass[index]} for index in range(1, model.nbody)
        ],
        "joints": [
            {
                "name": name(model, joint, index),
                "kind": int(model.jnt_type[index]),
                "range": model.jnt_range[index].tolist() if model.jnt_limited[index] else None,
                "reference": model.qpos0[model.jnt_qposadr[index]] if model.jnt_type[index] > 1 else 0.0,
                "rest": model.qpos_spring[model.jnt_qposadr[index]] if model.jnt_type[index] > 1 else 0.0,
                "damping": model.dof_damping[model.jnt_dofadr[index]],
                "friction": model.dof_frictionloss[model.jnt_dofadr[index]],
                "armature": model.dof_armature[model.jnt_dofadr[index]],
                "stiffness": model.jnt_stiffness[index],
            }
            for index in range(model.njnt)
        ],
        "actuators": [
            {
                "name": name(model, actuator, index),
                "joint": int(model.actuator_trnid[index][0]),
                "gear": model.actuator_gear[index][0],
                "gain": model.actuator_gainprm[index][0],
                "bias": model.actuator_biasprm[index][:3].tolist(),
                "control_range": model.actuator_ctrlrange[index].tolist()
                if model.actuator_ctrllimited[index]
                else None,
            }
            for index in range(model.nu)
        ],
        "poses": [pose(model, q, v) for q, v in poses],
    }


def has_gravity(model):
    return not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY


def plain(value):
    return value.item() if isinstance(value, np.generic) else value


def main():
    folder = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else HERE
    out = Path(sys.argv[2]) if len(sys.argv) > 2 else HERE / "figures.json"
    models = {}
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.urdf")]):
        try:
            models[str(path.relative_to(folder))] = figures(path)
        except ValueError as error:
            print(f"{path}: {error}", file=sys.stderr)
    told = {"folder": "." if folder == HERE else str(folder), "models": models}
    out.write_text(json.dumps(told, default=plain) + "\n")


if __name__ == "__main__":
    main()
