"""Robots from URDF, SDF and MJCF files in a simulation: coordinates, joints, motors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import inf
from operator import getitem
from typing import TYPE_CHECKING, Any, NamedTuple

from ._arrays import numbers, quaternion
from ._checks import name_list, pandas, real, whole
from ._core import core_property
from ._names import by_name, unknown
from ._tumble import CoreRobot, TumbleError
from ._types import ByJoint, Floats

if TYPE_CHECKING:
    import pandas as pd

    from ._scene import Scene
    from ._simulation import Simulation
    from ._trajectory import Trajectory


class Links(NamedTuple):
    """Motion of the L links of a robot, the world first."""

    positions: Floats
    """Positions of the links' origins, m, world: (L, 3)."""
    attitudes: Floats
    """Attitudes w, x, y, z, link to world: (L, 4)."""
    velocities: Floats
    """Velocities of the links' origins, m/s, world: (L, 3)."""
    spins: Floats
    """Spins, rad/s, world: (L, 3)."""


class Site(NamedTuple):
    """Motion of a frame on a link."""

    position: Floats
    """Position, m, world: (3,)."""
    attitude: Floats
    """Attitude w, x, y, z, site to world: (4,)."""
    velocity: Floats
    """Velocity of the origin, m/s, world: (3,)."""
    spin: Floats
    """Spin, rad/s, world: (3,)."""


class Inertial(NamedTuple):
    """Readings of an inertial measurement unit."""

    gyroscope: Floats
    """Spin, rad/s, site frame: (3,)."""
    accelerometer: Floats
    """Mean acceleration over a step minus gravity, m/s², site frame: (3,). It is g upwards at rest."""


def _locked(values: Floats) -> Floats:
    """Read-only copy of an array."""
    copy = values.copy()
    copy.setflags(write=False)
    return copy


def _from_zero(name: str, value: float) -> float:
    """Finite number that is not negative."""
    value = real(name, value)
    if not 0.0 <= value < inf:
        raise TumbleError(f"{name} is {value}; a number from 0 is needed")
    return value


def _above_zero(name: str, value: float) -> float:
    """Finite number above zero."""
    value = real(name, value)
    if not 0.0 < value < inf:
        raise TumbleError(f"{name} is {value}; a number above 0 is needed")
    return value


def _checked(option: str, given: ByJoint, names: list[str], check: Callable[[str, float], float]) -> dict[str, float]:
    """Numbers of an option by name, checked."""
    each = by_name(option, given, names, each=option != "max_force").items()
    return {name: check(f"{option} of {name}" if isinstance(given, Mapping) else option, value) for name, value in each}


def _gains(
    names: list[str], stiffness: ByJoint, damping: ByJoint, max_force: ByJoint | None
) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Stiffness, damping and given force limits of motors by name."""
    limits = {} if max_force is None else _checked("max_force", max_force, names, _from_zero)
    return _checked("stiffness", stiffness, names, _above_zero), _checked("damping", damping, names, _from_zero), limits


def position_motors(
    scene: Scene, stiffness: ByJoint, damping: ByJoint, max_force: ByJoint | None, joints: Iterable[str] | None
) -> list[tuple[int, int, float, float, float, float]]:
    """Position motors of slides and hinges at the scene's start.

    Each has joint, axis, target, stiffness, damping and force limit.
    """
    found: dict[str, tuple[tuple[int, int], float, float | None]] = {}
    wanted = None if joints is None else name_list("joints", joints)
    for index in range(len(scene.robots)):
        robot = CoreRobot(scene._core, index)
        for number, (name, _, at, _, reference) in enumerate(robot.joint_list):
            name, axis, effort = robot.prefix + name, robot.axis(number), robot.bounds(number)[1]
            is_default = wanted is None and number not in robot.followers
            if axis is None or not (is_default or name in (wanted or ())):
                continue
            limit = None if effort is None else min(-effort[0], effort[1])
            found[name] = axis, float(robot.start[at]) - reference, limit
    for name in wanted or ():
        if name not in found:
            raise unknown("slide or hinge", name, list(found))
    if not found:
        raise TumbleError("motors: the scene has no robot with slides or hinges; use its motors table")
    stiff, damp, limits = _gains(list(found), stiffness, damping, max_force)
    motors = []
    for name, (axis, target, own) in found.items():
        limit = limits.get(name, own)
        if limit is None:
            raise TumbleError(f"max_force of {name}, the force limit of its motor, is needed; set max_force")
        motors.append((*axis, target, stiff[name], damp[name], limit))
    return motors


class RobotJoint:
    """Slide or hinge of a robot in a simulation: ``robot["knee"]``.

    It has one motor at a time: a position motor to ``target`` with ``stiffness`` and
    ``damping``, or a speed motor (``hold_speed``). A position motor of the scene or the file is the first
    one. The force of ``set_force`` is added. Units are m and N for a slide, rad and N m for a hinge.
    """

    # Slots refuse mistyped names.
    __slots__ = (
        *("name", "range", "place", "_stiffness", "_damping", "_limit"),
        *("_robot", "_axis", "_rate", "_reference", "_effort"),
    )

    name: str
    """Name in the file."""
    range: tuple[float, float] | None
    """Limits of the coordinate, or None."""
    place: int
    """Index of its coordinate in ``robot.q``."""

    def __init__(self, robot: Robot, index: int) -> None:
        name, _, at, rate, reference = robot._core.joint_list[index]
        axis = robot._core.axis(index)
        if axis is None:
            raise TumbleError(f"joint: {name!r} is not a slide or hinge")
        limits, self._effort = robot._core.bounds(index)
        self.name = name
        self.range = None if limits is None else (limits[0], limits[1])
        self._robot, self._axis = robot, axis
        self.place, self._rate, self._reference = at, rate, reference
        self._reset()

    def _reset(self) -> None:
        """Sets gains and force limit to those of its position motor, or to those of the file without gains."""
        self._stiffness, self._damping = 0.0, 0.0
        self._limit = None if self._effort is None else min(-self._effort[0], self._effort[1])
        motor = self._robot.simulation._core.position_motor(*self._axis)
        if motor is not None:
            _, self._stiffness, self._damping, self._limit = motor

    @property
    def stiffness(self) -> float:
        """Stiffness of its position motor, used from the next target on."""
        return self._stiffness

    @stiffness.setter
    def stiffness(self, stiffness: float) -> None:
        self._stiffness = _from_zero(f"stiffness of {self.name}", stiffness)

    @property
    def damping(self) -> float:
        """Damping of that motor."""
        return self._damping

    @damping.setter
    def damping(self, damping: float) -> None:
        self._damping = _from_zero(f"damping of {self.name}", damping)

    @property
    def max_force(self) -> float | None:
        """Force limit of its motors, from the file, or None."""
        return self._limit

    @max_force.setter
    def max_force(self, max_force: float | None) -> None:
        self._limit = None if max_force is None else _from_zero(f"max_force of {self.name}", max_force)

    @property
    def coordinate(self) -> float:
        """Current coordinate in the convention of the file, including full turns."""
        return float(self._robot.q[self.place])

    @property
    def speed(self) -> float:
        """Current rate."""
        return float(self._robot.v[self._rate])

    @property
    def target(self) -> float | None:
        """Target coordinate of its position motor, however it was set; None without one."""
        motor = self._robot.simulation._core.position_motor(*self._axis)
        return None if motor is None else motor[0] + self._reference

    @target.setter
    def target(self, target: float | None) -> None:
        put = self._robot.simulation._core.put_motor
        if target is None:
            put(*self._axis, (None, None, 0.0, 0.0, 0.0))
        elif not self.stiffness > 0.0:
            raise TumbleError(f"stiffness of {self.name} is needed for a target; set it first")
        else:
            place, max_force = float(target) - self._reference, self._max_force(self.max_force)
            put(*self._axis, (None, place, self.stiffness, self.damping, max_force))

    @property
    def _motor(self) -> list[float | None]:
        """Stiffness, damping and force limit of its motor."""
        return [self.stiffness, self.damping, self.max_force]

    @_motor.setter
    def _motor(self, motor: list[Any]) -> None:
        self._stiffness, self._damping, self._limit = motor

    def hold_speed(self, speed: float, max_force: float | None = None) -> None:
        """Sets a speed motor with the force limit ``max_force``, by default the one of the file."""
        max_force = self._max_force(self.max_force if max_force is None else max_force)
        self._robot.simulation._core.put_motor(*self._axis, (speed, None, 0.0, 0.0, max_force))

    def _max_force(self, max_force: float | None) -> float:
        if max_force is None:
            raise TumbleError(f"max_force of {self.name}, the force limit of its motor, is needed; set it first")
        return max_force

    def set_force(self, force: float) -> None:
        """Sets the constant force (N) or torque (N m) along the joint for the following steps."""
        self._robot.simulation._core.put_force(*self._axis, force)

    @property
    def torque(self) -> float:
        """Force (N) or torque (N m) along it over the last step, as in ``robot.torques``.

        Setting it is ``set_force``.
        """
        names = [joint.name for joint in self._robot.slides_and_hinges]
        return float(self._robot.torques[names.index(self.name)])

    @torque.setter
    def torque(self, torque: float) -> None:
        self.set_force(real(f"torque of {self.name}", torque))

    def __reduce__(self) -> Any:
        """Pickles a joint as a part of its robot."""
        return getitem, (self._robot, self.name)

    def __repr__(self) -> str:
        return f"<joint {self.name!r} at {self.coordinate:.6g}>"


class _PairForces(dict[tuple[str, str], Floats]):
    """Forces by pairs of names. That of a pair without a contact is zero."""

    def __init__(self, own: set[str], others: set[str]) -> None:
        super().__init__()
        self._known = own, others

    def __missing__(self, pair: tuple[str, str]) -> Floats:
        import numpy as np

        if not isinstance(pair, tuple) or len(pair) != 2:
            raise TumbleError(f"contact_forces: {pair!r} is no pair of names; (of this robot, of another object) is needed")
        for what, name, known in zip(("object of the robot", "object"), pair, self._known):
            if name not in known:
                raise unknown(what, name, sorted(known))
        return np.zeros(3)


class Robot:
    """Robot of a simulation: ``simulation.robot``, or ``simulation.robots["prefix"]``.

    Coordinates q and rates v are ordered by joint as in MuJoCo:

    - free joint: position (m) and attitude (w, x, y, z) of its link; rates are the velocity of the
      link's origin (m/s, world) and the spin (rad/s, link);
    - ball: attitude and spin;
    - slide: m and m/s;
    - hinge: rad and rad/s.

    ``robot["knee"]`` is the joint with this name in the file::

        robot = simulation.robot
        robot.set_gains(stiffness=80.0, damping=2.0)
        robot["knee"].target = -1.5
        simulation.step()
    """

    __slots__ = ("simulation", "_core", "_near", "_controls", "_handles", "__weakref__")

    simulation: Simulation
    """Simulation of the robot."""
    _near: Floats
    _controls: Floats

    def __init__(self, simulation: Simulation, index: int) -> None:
        self.simulation = simulation
        self._core = CoreRobot(simulation.scene._core, index)
        self._handles: dict[str, RobotJoint] = {}
        self._reset()

    def _reset(self) -> None:
        """Sets the data beyond the simulation's own as at the start."""
        self._near = self._core.start
        self._controls = _locked(self._core.first_controls)
        for joint in self._handles.values():
            joint._reset()

    name: str = core_property("name", "Name in its file.")
    prefix: str = core_property("prefix", "Prefix of its names in the scene.")
    notes: list[str] = core_property("notes", "Contents of its file that are ignored.")
    links: list[str] = core_property("links", "Names of its links, the world first.")
    bodies: list[int | None] = core_property("bodies", "Index of the scene's body of each link; None for fixed links.")
    actuators: list[str] = core_property("actuators", "Names of its actuators.")
    control_ranges: list[list[float] | None] = core_property(
        "control_ranges", "Control ranges of its actuators; None for unlimited ones."
    )
    start: Floats = core_property("start", "Initial coordinates: (Q,).")
    counts: tuple[int, int] = core_property("counts", "Numbers of coordinates Q and rates V.")

    @property
    def joints(self) -> list[str]:
        """Names of its joints, in the order of its coordinates."""
        return [joint[0] for joint in self._core.joint_list]

    @property
    def joint_types(self) -> list[str]:
        """Types of its joints: "free", "ball", "slide" or "hinge"."""
        return [joint[1] for joint in self._core.joint_list]

    def lowest(self, q: Any, v: Any = None) -> float:
        """Height of the lowest body of the simulation above the ground with the robot at ``q``, m."""
        return self._core.lowest(self._placed(q, v))

    def _placed(self, q: Any, v: Any) -> Floats:
        """States of the simulation with the robot at other coordinates and rates."""
        return self._core.placed(*self._given(q, v), self.simulation.states)

    @property
    def slides_and_hinges(self) -> list[RobotJoint]:
        """Joints with one coordinate."""
        one = [joint[0] for joint in self._core.joint_list if joint[1] in ("slide", "hinge")]
        return [self[name] for name in one]

    def __getitem__(self, name: str) -> RobotJoint:
        if name not in self._handles:
            names = self.joints
            if name not in names:
                raise unknown("joint", name, names)
            self._handles[name] = RobotJoint(self, names.index(name))
        return self._handles[name]

    def set_gains(self, *, stiffness: ByJoint, damping: ByJoint = 0.0, max_force: ByJoint | None = None) -> None:
        """Sets stiffness, damping and force limit of all slides and hinges.

        Each is one number for all, or numbers by the joints' names. The gains apply from the next
        targets on. Without ``max_force`` the force limits stay.

        :raises TumbleError: if a stiffness is not positive, another value is negative, or a joint
            has no stiffness or damping.
        """
        joints = list(self.slides_and_hinges)
        stiff, damp, limits = _gains([joint.name for joint in joints], stiffness, damping, max_force)
        for joint in joints:
            joint.stiffness, joint.damping = stiff[joint.name], damp[joint.name]
            joint.max_force = limits.get(joint.name, joint.max_force)

    @property
    def _kept(self) -> dict[str, Any]:
        """Data beyond the simulation's own, for JSON.

        It has the last joint coordinates, the controls, and the motors by joint.
        """
        motors = {name: joint._motor for name, joint in self._handles.items()}
        return {"near": self._near.tolist(), "controls": self._controls.tolist(), "motors": motors}

    def _keep(self, kept: dict[str, Any]) -> None:
        """Restores the data ``kept`` of another robot. The simulation already has the motors."""
        self._near = numbers("near", kept["near"], self._near.shape)
        self._controls = _locked(numbers("controls", kept["controls"], self._controls.shape))
        for name, motor in kept["motors"].items():
            self[name]._motor = motor

    def _now(self) -> tuple[Floats, Floats]:
        q, v = self.simulation._core.coordinates_of(self._core, self._near)
        self._near = q
        return q, v

    @property
    def q(self) -> Floats:
        """Current coordinates, (Q,).

        Hinge angles include full turns, as in the simulation and its motors.
        """
        return self._now()[0]

    @q.setter
    def q(self, q: Any) -> None:
        self.set(q, self.v)

    @property
    def v(self) -> Floats:
        """Current rates, (V,)."""
        return self._now()[1]

    @v.setter
    def v(self, v: Any) -> None:
        self.set(self.q, v)

    def set(self, q: Any, v: Any = None) -> None:
        """Sets coordinates and rates. Without ``v`` the robot is at rest.

        The simulation then counts the turns of hinges from the angles nearest to the previous
        ones.
        """
        q, v = self._given(q, v)
        self.simulation.states = self._core.placed(q, v, self.simulation.states)
        self._near = q

    @property
    def links_now(self) -> Links:
        """Current motion of its links."""
        return Links(*self._core.moving(self.simulation.states))

    def kinematics(self, q: Any, v: Any = None) -> Links:
        """Motion of its links at other coordinates and rates."""
        return Links(*self._core.forward(*self._given(q, v)))

    def mass_matrix(self, q: Any = None) -> Floats:
        """Mass matrix (V, V) including armatures, at coordinates ``q`` or the current ones."""
        return self._core.masses(self._given(q, None)[0])

    def bias_forces(self, q: Any = None, v: Any = None) -> Floats:
        """Bias forces (V,) of the equation of motion, including gravity.

        M dv/dt equals the applied generalised forces minus these.
        """
        if q is None and v is None:
            return self._core.biases(*self._now())
        return self._core.biases(*self._given(q, v))

    def jacobian(self, link: int | str, point: Any = (0.0, 0.0, 0.0), q: Any = None) -> tuple[Floats, Floats]:
        """Jacobians (3, V) of a point's position and of its link's rotation.

        ``point`` is in the link frame, m.
        """
        x, y, z = (float(x) for x in numbers("point", point, (3,)))
        return self._core.jacobians(self._link(link), [x, y, z], self._given(q, None)[0])

    def _link(self, name: int | str) -> int:
        """Index of a link."""
        links = self.links
        if isinstance(name, str):
            if name not in links:
                raise unknown("link", name, links)
            return links.index(name)
        return whole("link", name, 0, len(links) - 1)

    def _given(self, q: Any, v: Any) -> tuple[Floats, Floats]:
        positions, rates = self.counts
        q = self.q if q is None else numbers("q", q, (positions,))
        return q, numbers("v", [0.0] * rates if v is None else v, (rates,))

    @property
    def controls(self) -> Floats:
        """Controls of its actuators, (A,), in the order of the file.

        Setting them replaces all other motors of the actuated joints by the file's actuators. The
        array is read-only: assign a whole array to change one control.
        """
        return self._controls

    @controls.setter
    def controls(self, controls: Any) -> None:
        controls = numbers("controls", controls, (len(self.actuators),))
        self.simulation._core.put_controls(self._core, controls)
        self._controls = _locked(controls)

    @property
    def targets(self) -> Floats:
        """Target of each of ``slides_and_hinges``; NaN without one."""
        import numpy as np

        return np.array([np.nan if joint.target is None else joint.target for joint in self.slides_and_hinges])

    @targets.setter
    def targets(self, targets: Any) -> None:
        joints = self.slides_and_hinges
        for joint, target in zip(joints, numbers("targets", targets, (len(joints),))):
            joint.target = target

    @property
    def torques(self) -> Floats:
        """Force (N) or torque (N m) along each of ``slides_and_hinges`` over the last step.

        It is the sum of motor, spring, damping, friction, stop and constant force. Setting it sets the
        constant forces of the following steps (``RobotJoint.set_force``): without motors they are the
        torques of a controller.
        """
        import numpy as np

        columns = self.simulation._core.joint_columns
        drives = np.concatenate([columns["force"], columns["torque"]], axis=1)
        found: Floats = drives[tuple(np.transpose([joint._axis for joint in self.slides_and_hinges]))]
        return found

    @torques.setter
    def torques(self, torques: Any) -> None:
        joints = self.slides_and_hinges
        for joint, torque in zip(joints, numbers("torques", torques, (len(joints),))):
            joint.set_force(torque)

    @property
    def sites(self) -> dict[str, tuple[str, list[float], list[float]]]:
        """Sites of an MJCF file by name: link, point (m) and attitude (w, x, y, z).

        ``robot.imu(*robot.sites["imu"])`` reads the sensors at a site.
        """
        links = self.links
        return {name: (links[link], point, attitude) for name, (link, point, attitude) in self._core.site_list}

    def site(
        self, link: int | str, point: Any = (0.0, 0.0, 0.0), attitude: Any = (1.0, 0.0, 0.0, 0.0), *, states: Any = None
    ) -> Site:
        """Motion of a site: a frame at a point of a link (m) with an attitude (w, x, y, z).

        It is the current motion, or the motion for the scene's body states ``states`` (N, 13).
        """
        states = self.simulation.states if states is None else self._states("states", states)
        return Site(*self._core.site_motion(self._site(link, point, attitude), states))

    def imu(
        self,
        link: int | str,
        point: Any = (0.0, 0.0, 0.0),
        attitude: Any = (1.0, 0.0, 0.0, 0.0),
        *,
        before: Any = None,
        after: Any = None,
    ) -> Inertial:
        """Readings of a gyroscope and an accelerometer at a site over a step.

        The step is the last one, or the one from the states ``before`` to ``after``, (N, 13)
        each, such as ``run.states[k]`` and ``run.states[k + 1]``. Contacts act as impulses
        within a step. The acceleration is therefore the change of the site's velocity over the
        step, divided by h.
        """
        if (before is None) != (after is None):
            raise TumbleError("before and after: the states of both are needed, or none")
        if before is None:
            last = self.simulation._core.last_states
            if last is None:
                raise TumbleError("imu: no step was taken yet; give before and after")
            before, after = last
        before, after = self._states("before", before), self._states("after", after)
        return Inertial(*self._core.site_inertial(self._site(link, point, attitude), before, after))

    def touch(
        self, link: int | str, partner: str | None = None, *, point: Any = None, radius: float | None = None
    ) -> float:
        """Sum of the normal forces of the last step on a link and on links fixed to it, N.

        ``partner`` selects contacts with one partner: a body of the scene, "ground", or a fixed
        piece. ``radius`` selects contacts within this distance of ``point`` (m, link frame).
        """
        if (point is None) != (radius is None):
            raise TumbleError("point and radius: both are needed, or none")
        within = None
        if point is not None:
            x, y, z = (float(x) for x in numbers("point", point, (3,)))
            size = float(numbers("radius", radius, ()))
            if size <= 0.0:
                raise TumbleError(f"radius is {size}; a number above 0 is needed")
            within = ([x, y, z], size)
        return self.simulation._core.touched(self._core, self._link(link), partner, within)

    def to_pandas(self, run: Trajectory) -> pd.DataFrame:
        """Coordinates and rates of a run of its scene, one row per state.

        Columns are k, time_s, and for every slide and hinge NAME (m or rad, including full
        turns of the run) and ``NAME.rate``. Free joints and balls have ``NAME.x`` to
        ``NAME.qz``, and the rates ``NAME.vx`` to ``NAME.wz``.
        """
        import numpy as np

        pd = pandas()
        q, v, near = [], [], self.start
        for states in run.states:
            near, rates = self._core.coordinates(np.ascontiguousarray(states), near)
            q.append(near)
            v.append(rates)
        places, rates_of = ("x", "y", "z"), ("vx", "vy", "vz")
        turns, spins = ("qw", "qx", "qy", "qz"), ("wx", "wy", "wz")
        words = {"free": (places + turns, rates_of + spins), "ball": (turns, spins)}
        table: dict[str, Any] = {"k": run._steps["k"], "time_s": run.time}
        all_q, all_v = np.array(q), np.array(v)
        for name, kind, at, rate, _ in self._core.joint_list:
            if kind in words:
                for first, numbers_of, parts in zip((at, rate), (all_q, all_v), words[kind]):
                    table.update({f"{name}.{part}": numbers_of[:, first + i] for i, part in enumerate(parts)})
            else:
                table[name], table[f"{name}.rate"] = all_q[:, at], all_v[:, rate]
        return pd.DataFrame(table)

    def _site(self, link: int | str, point: Any, attitude: Any) -> tuple[int, list[float], list[float]]:
        place = [float(x) for x in numbers("point", point, (3,))]
        return self._link(link), place, [float(x) for x in numbers("attitude", quaternion(attitude), (4,))]

    def _states(self, name: str, states: Any) -> Floats:
        return numbers(name, states, (len(self.simulation.bodies), 13))

    @property
    def contact_forces(self) -> dict[tuple[str, str], Floats]:
        """Contact forces of the last step, (3,), N, world, by pairs of names.

        The force acts on the first object of the pair, which belongs to this robot: a body, or
        a fixed piece of a link held by the world. The second name is a body of the scene,
        "ground" or a fixed piece. It has the pairs that touch; the force of another one is zero.
        """
        scene, contacts = self.simulation.scene, self.simulation.contacts
        own = {scene.bodies[body] for body in self.bodies if body is not None}
        own.update(scene.fixed[piece] for pieces in self._core.pieces[1:] for piece in pieces)
        forces = _PairForces(own, {*scene.bodies, *scene.fixed, "ground"})
        for body, other, force in zip(contacts["body"], contacts["partner"], contacts["force"]):
            name = scene.bodies[body]
            for pair, part in (((name, other), force), ((other, name), -force)):
                if pair[0] in own:
                    forces[pair] = forces[pair] + part
        return forces

    def __reduce__(self) -> Any:
        """Pickles a robot as a part of its simulation."""
        return _robot_of, (self.simulation, self.prefix)

    def __repr__(self) -> str:
        positions, rates = self.counts
        return f"<tumble.Robot {self.name!r}: {positions} coordinates, {rates} rates>"


def _robot_of(simulation: Simulation, prefix: str) -> Robot:
    return simulation.robots[prefix]
