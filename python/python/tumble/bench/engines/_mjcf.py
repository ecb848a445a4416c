"""Scenes as MJCF, for engines that read it."""

from __future__ import annotations

from collections.abc import Iterable

from .._scene import Body, Scene

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
STIFF = ' solref="{} 1" solimp="0.99 0.999 0.0005"'
"""Contacts with a time constant of two steps, the stiffest that MuJoCo allows, and little yielding."""
PAIR = '<pair geom1="{}" geom2="{}" condim="3" friction="{} {} 0 0 0" solref="-10000 0" solreffriction="0.02 1"/>'
"""Elastic contact with friction. Only a pair has a damping of its own for friction, which does nothing without it."""
GROUND = '<geom name="the ground" type="plane" size="50 50 1"/>'
FREE = """<body name="{name}" pos="{pos}" quat="{quat}"><freejoint/>
  <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>{geom}</body>"""


def mjcf_of(scene: Scene, option: str, stiff: bool = False) -> str:
    """MJCF of a scene with further attributes of the element option, and with stiff contacts if they do not bounce."""
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
    return MODEL.format(
        step=scene.time_step,
        gravity=numbers(scene.gravity),
        option=option,
        contact=contact,
        meshes="".join(f'<mesh name="{body.name}" vertex="{numbers(body.points.ravel())}"/>' for body in hulls),
        bodies=bodies,
        pairs=pairs,
    )


def _geom(body: Body, place: str) -> str:
    if body.kind == "hull":
        return f'<geom name="{body.name}" type="mesh" mesh="{body.name}" {place}/>'
    return f'<geom name="{body.name}" type="{body.kind}" size="{numbers(body.size)}" {place}/>'


def numbers(values: Iterable[float]) -> str:
    """Numbers as text with all digits."""
    return " ".join(repr(float(value)) for value in values)
