"""Writes data/robots/sdf.json: quantities of SDF files as Drake reads them.

    python robots_sdf.py                     # files of data/robots/sdf
    python robots_sdf.py FOLDER OUT.json     # all SDF files below another folder

For each file it contains masses, centres, inertias and poses of all links at zero coordinates, and
axes, anchors, limits and damping of the joints. Files that Drake refuses are printed. Requires
drake 1.51.1.
"""

import json
import sys
from pathlib import Path

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, PrismaticJoint, RevoluteJoint

HERE = Path(__file__).resolve().parent.parent / "robots"


def scoped(plant, element):
    """Name behind those of its models."""
    return f"{plant.GetModelInstanceName(element.model_instance())}::{element.name()}"


def figures(path):
    """Quantities of one file at zero coordinates."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    links, joints = [], []
    for number in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(number))
        inertia = body.default_spatial_inertia()
        centre = inertia.get_com()
        moments = inertia.Shift(centre).CalcRotationalInertia().CopyToFullMatrix3()
        pose = plant.EvalBodyPoseInWorld(context, body)
        links.append(
            {
                "name": scoped(plant, body),
                "mass": inertia.get_mass(),
                "centre": centre.tolist(),
                "inertia": moments.flatten().tolist(),
                "position": pose.translation().tolist(),
                "rotation": pose.rotation().matrix().flatten().tolist(),
            }
        )
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if not isinstance(joint, (RevoluteJoint, PrismaticJoint)):
            continue
        turns = isinstance(joint, RevoluteJoint)
        axis = joint.revolute_axis() if turns else joint.translation_axis()
        frame = joint.frame_on_child().CalcPoseInWorld(context)
        limits = [joint.position_lower_limits()[0], joint.position_upper_limits()[0]]
        joints.append(
            {
                "name": scoped(plant, joint),
                "turns": turns,
                "axis": (frame.rotation().matrix() @ axis).tolist(),
                "anchor": frame.translation().tolist(),
                "damping": joint.default_damping(),
                "limits": limits if max(map(abs, limits)) < 1e15 else None,
            }
        )
    return {"links": links, "joints": joints}


def main():
    """Writes the quantities of all files of a folder."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "sdf"
    out = Path(sys.argv[2]) if len(sys.argv) > 2 else HERE / "sdf.json"
    found = {}
    for path in sorted(folder.rglob("*.sdf")):
        try:
            found[str(path.relative_to(folder))] = figures(path)
        except Exception as error:
            print(f"{path}: {str(error)[:300]}")
    out.write_text(json.dumps(found, indent=1) + "\n")


main()
