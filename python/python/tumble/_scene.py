"""Scenes from files or built in code."""

from __future__ import annotations

import inspect
import json
import os
import re
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Never, TypedDict, Unpack

from ._checks import name_list, tables, whole
from ._core import core_property
from ._files import replaced
from ._query import Queries
from ._statics import Statics, vector
from ._toml import document, toml_value
from ._tumble import SCENE_HEAD, CoreScene, TumbleError, name_hint, remedy
from ._types import ByJoint, Fields, Floats, Location

if TYPE_CHECKING:
    from ._gradients import Derivatives
    from ._live import Live
    from ._simulation import Simulation
    from ._trajectory import Trajectory

_LARGEST_FILE = 4 << 20
_LARGEST_ROBOT = 16 << 20
_LARGEST_SEED = 2**32 - 1
_MOST_STEPS = 9_999_999
_LARGEST_START = 9_000_000_000_000_000
_GROUND = '{"friction": 0.3}'
_SEED = re.compile(r"^\s*\"?seed\"?\s*=", re.MULTILINE)


_RANGES = {"seed": (0, _LARGEST_SEED), "steps": (1, _MOST_STEPS), "start_index": (0, _LARGEST_START)}


_PATHS = {
    "friction": "ground.friction",
    "restitution": "ground.restitution",
    "solver": "solver.name",
    "residual": "solver.residual",
}
"""Paths in a scenario of keywords with another name."""

_OTHERS = ("packages", "leave_out", "point_contacts", "model")
"""Keywords that are not fields of a scenario."""


class Settings(TypedDict, total=False):
    """Keywords that override a scenario file."""

    seed: int | None
    steps: int | None
    start_index: int | None
    time_step: float | None
    rotation: str | None
    integrator: str | None
    accuracy: float | None
    impacts: str | None
    friction: float | None
    restitution: float | None
    solver: str | None
    residual: float | None
    packages: Location | None
    leave_out: Iterable[str] | None
    point_contacts: bool | None
    model: str | None
    """Bodies of a simulation, which replace those of the file: see Simulation.scene."""


class Scene(Queries):
    """Bodies, their surroundings, their start and the solver.

    A scene is built from the tables of a scenario file, as dictionaries::

        Scene(
            bodies=[{"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "velocity": [1, 0, 0]}],
            ground={"friction": 0.3},
        )

    Lengths are in m, masses in kg, times in s. Gravity is in m/s²: a number downwards, or a vector
    in the world frame. ``start_index`` is the step k of the start, at time k times the time step.

    Positions and velocities are in the world frame. Spins (rad/s) and inertias (kg m², about the
    centre of mass) are in the body frame. Attitudes are unit quaternions w, x, y, z from body to
    world. ``rotation`` selects the discretisation of the rotation, "momentum" or "tutorial", and
    ``integrator`` the meaning of the velocities in a run, "leapfrog" or "euler"
    (scenarios/README.md). With ``accuracy`` (m), steps are taken in substeps that keep the error of the
    time step: it grows by at most so much in a second. With ``impacts="located"``, substeps only
    begin at impacts (docs/accuracy.md). Raises TumbleError for an invalid scene.

    ``jacobian`` and ``vjp`` compute derivatives. The methods of Queries look at its start.
    """

    __slots__ = ("_core", "_source", "__weakref__")

    _core: CoreScene
    _source: tuple[str, str, dict[str, Any]]
    """Text, path and settings of the scene."""

    def __init__(
        self,
        bodies: Iterable[Fields],
        ground: Fields,
        fixed: Iterable[Fields] = (),
        friction: Iterable[Fields] = (),
        restitution: Iterable[Fields] = (),
        joints: Iterable[Fields] = (),
        motors: Iterable[Fields] = (),
        gears: Iterable[Fields] = (),
        driven: Iterable[Fields] = (),
        surfaces: Iterable[Fields] = (),
        robots: Iterable[Fields] = (),
        apart: Iterable[Fields] = (),
        terrain: Iterable[Fields] = (),
        static_friction: Iterable[Fields] = (),
        rolling_friction: Iterable[Fields] = (),
        torsional_friction: Iterable[Fields] = (),
        adhesion: Iterable[Fields] = (),
        *,
        gravity: float | Iterable[float] = 9.81,
        time_step: float = 0.002,
        rotation: str = "momentum",
        integrator: str = "leapfrog",
        accuracy: float | None = None,
        impacts: str | None = None,
        steps: int = 1000,
        start_index: int = 0,
        name: str = "scene",
        seed: int | None = None,
        folder: Location = ".",
        **unknown: Never,
    ) -> None:
        for keyword in unknown:
            known = [*inspect.signature(Scene).parameters]
            raise TypeError(f"keyword {keyword!r} is unknown{_meant(keyword, known)}")
        if ground is not None and not isinstance(ground, Mapping):
            raise TumbleError(f"ground is {ground!r}; a dictionary, for example {_GROUND}, is needed")
        ours = f": for the coefficient of the ground, use ground={_GROUND}"
        text = document(
            {
                "name": name,
                "steps": whole("steps", steps, 1, _MOST_STEPS) + 1,
                "start_index": whole("start_index", start_index, 0, _LARGEST_START) or None,
                "time_step": time_step,
                "rotation": rotation,
                "integrator": integrator,
                "accuracy": accuracy,
                "impacts": impacts,
                "gravity": gravity,
                "ground": ground,
                "bodies": tables("bodies", bodies),
                "fixed": tables("fixed", fixed),
                "friction": tables("friction", friction, ours),
                "static_friction": tables("static_friction", static_friction),
                "rolling_friction": tables("rolling_friction", rolling_friction),
                "torsional_friction": tables("torsional_friction", torsional_friction),
                "adhesion": tables("adhesion", adhesion),
                "restitution": tables("restitution", restitution, ours.replace("friction", "restitution")),
                "joints": tables("joints", joints),
                "motors": tables("motors", motors),
                "gears": tables("gears", gears),
                "driven": tables("driven", driven),
                "surfaces": tables("surfaces", surfaces),
                "robots": tables("robots", robots),
                "apart": tables("apart", apart),
                "terrain": tables("terrain", terrain),
            }
        )
        self._parse(text, Path(folder) / "scene", {"seed": seed})
        _warn(self)

    def _parse(self, text: str, path: Location, settings: Settings) -> None:
        given = {name: _checked(name, value) for name, value in settings.items() if value is not None}
        others = {name: given[name] for name in _OTHERS if name in given}
        if "model" in given:
            # The model is at its own step, the text at that of its start.
            others["start_index"] = given.get("start_index")
        fields = [
            (name, _PATHS.get(name, name), toml_value(name, value + 1 if name == "steps" else value))
            for name, value in given.items()
            if name not in others
        ]
        self._core = CoreScene(text, os.fspath(path), fields, **others)
        self._source = text, os.fspath(path), given

    @classmethod
    def from_text(cls, text: str, path: Location = "scene", **settings: Unpack[Settings]) -> Scene:
        """Parses a scenario's text. ``path`` is its name, and meshes are relative to it.

        The keywords are those of ``load``.
        """
        scene = cls.__new__(cls)
        scene._parse(text, path, settings)
        return scene

    name: str = core_property("name", "Name of the scene.")
    seed: int | None = core_property("seed", "Random seed of its start; None if nothing was random.")
    bodies: list[str] = core_property("bodies", "Names of its N bodies.")
    fixed: list[str] = core_property("fixed", "Names of its fixed pieces.")
    joints: list[str] = core_property("joints", "Names of its J joints.")
    joint_axes: list[list[int]] = core_property(
        "joint_axes", "Axes of each joint that can have drives: 0, 1, 2 along x, y, z and 3, 4, 5 about them."
    )
    driven_axes: list[tuple[str, int]] = core_property(
        "driven_axes", "Axes of ``joint_forces`` and of the constants of joints: joint and number as in ``joint_axes``."
    )
    motor_axes: list[tuple[str, int]] = core_property(
        "motor_axes", "Driven axes with motors, used by ``motors`` and the constants of motors."
    )
    gears: list[tuple[str, str]] = core_property("gears", "Names of the following and the leading joint of each gear.")
    motor_gears: list[int] = core_property("motor_gears", "Indices in ``gears`` of the gears whose sum has a motor.")
    robots: list[str] = core_property("robots", "Prefixes of its robots.")
    start_index: int = core_property("start_index", "Step index k of its start.")
    steps: int = core_property("steps", "Number of steps of a whole run.")
    time_step: float = core_property("time_step", "Time step h, s.")
    rotation: str = core_property("rotation", 'Discretisation of the rotation: "momentum" or "tutorial".')
    integrator: str = core_property("integrator", 'Velocities in a run: of the middle of steps ("leapfrog"), or "euler".')
    accuracy: float | None = core_property("accuracy", "Error of the time step that runs keep, m in a second, or None.")
    impacts: str = core_property("impacts", 'When impacts happen: within steps ("stepped") or at their time ("located").')
    solver: str = core_property("solver", "Solver of contact steps: native, ipopt, or rk4 without a ground.")
    friction: float = core_property("friction", "Coefficient of friction of the world.")
    restitution: float = core_property("restitution", "Coefficient of restitution of the world.")
    gravity: Floats = core_property("gravity", "Gravity, m/s², world: (3,).")
    masses: Floats = core_property("masses", "Mass of each body, kg: (N,).")
    inertias: Floats = core_property("inertias", "Inertia of each body, kg m², body frame: (N, 3, 3).")
    extents: Floats = core_property("extents", "Half the extents of each body along its own axes, m: (N, 3).")
    states: Floats = core_property("states", "Initial states of the bodies: (N, 13).")

    def _folder(self) -> Path:
        return Path(self._source[1])

    def __reduce__(self) -> Any:
        """Pickles a scene as its text."""
        return _made, self._source

    def save(self, path: Location) -> Path:
        """Writes the scene as a scenario file for load and the command line.

        Keywords that override a file are not part of its text. A scene with them is refused,
        except for a seed that the text does not have. Files of meshes and robots must exist
        relative to ``path``.
        """
        text, _, settings = self._source
        given = {name: value for name, value in settings.items() if value is not None}
        if "model" in given:
            raise TumbleError(
                "the scene has motors of with_motors, or is from a simulation with added or removed "
                "bodies, which a file cannot describe; use pickle"
            )
        seed = given.pop("seed", None)
        if seed is not None:
            # A second seed would make the text invalid.
            given = {"seed": seed, **given} if _SEED.search(text) else given
            text = f"seed = {seed}\n{text}"
        if given:
            raise TumbleError(
                f"{', '.join(given)} of this scene were given as keywords; write them into its file, and load that"
            )
        Scene.from_text(text, path)
        if not text.lstrip().startswith(("<", SCENE_HEAD)):
            text = SCENE_HEAD + text
        return replaced(Path(path), text.encode())

    def _with_model(self, model: str, index: int) -> Scene:
        """Scene with the bodies of a simulation's model at step ``index``."""
        text, path, settings = self._source
        return Scene.from_text(text, path, **{**settings, "start_index": index, "model": model})

    def with_motors(
        self,
        *,
        stiffness: ByJoint,
        damping: ByJoint = 0.0,
        max_force: ByJoint | None = None,
        joints: Iterable[str] | None = None,
    ) -> Scene:
        """Scene with a position motor on slides and hinges of its robots.

        The motors hold the coordinates of the start. They replace motors and forces of the
        file's actuators on these joints, and are axes of ``motor_axes``: ``rollout`` takes
        targets for them. ``joints`` are names of joints with the prefix of their robot, by
        default all slides and hinges. ``max_force`` limits the forces, by default to the limits of
        the file. Gains and limits are one number for all, or numbers by these names.

        :raises TumbleError: for a joint without a limit of its force, or an unknown joint.
        """
        from ._robot import position_motors

        motors = position_motors(self, stiffness, damping, max_force, joints)
        text, path, settings = self._source
        return Scene.from_text(text, path, **{**settings, "model": self._core.motored(motors)})

    def simulate(self, states: Any = None, *, threads: int = 1, index: int | None = None) -> Simulation:
        """Creates a simulation from the scene's start, or from ``states`` (N, 13).

        It begins at step ``index``, by default ``start_index``, and uses at most ``threads``
        threads: see Simulation.
        """
        from ._simulation import Simulation

        return Simulation(self, states, threads=threads, index=index)

    def run(self, steps: int | None = None, *, threads: int = 1, **keywords: Any) -> Trajectory:
        """Runs the whole scene, or its first ``steps`` steps: see Simulation and Simulation.run."""
        simulation = self.simulate(threads=threads)
        return simulation.run(self.steps if steps is None else steps, **keywords)

    def live(self, record: Location | None = None, *, overwrite: bool = False, port: int = 0) -> Live:
        """Serves a page in which bodies are pulled and constants changed while the scene runs.

        The page is that of ``tumble run --live``, at a free port of 127.0.0.1 or at ``port``. Its
        address ``url`` has a random token. ``record`` is a folder for the run, written at the end
        and accepted by ``tumble verify``. A change of the scene begins a new run. The runs before
        it are kept as scenario files part-1.toml, part-2.toml and so on. ``overwrite`` is that of
        Trajectory.to_csv. See Live.
        """
        from ._live import Live

        return Live(self, record, overwrite=overwrite, port=port)

    def stands(
        self,
        *,
        push: tuple[str, Iterable[float]] | None = None,
        mass: str | None = None,
        tilt: Iterable[float] | None = None,
        base: Iterable[float] | None = None,
        at: Iterable[float] = (0.0, 0.0, 0.0),
        least_friction: bool = False,
        friction: tuple[float, float] | None = None,
        move: Mapping[str, Iterable[float]] | None = None,
    ) -> Statics:
        """Whether the scene can stand at its start, by how much, and where it is weak.

        At most one of four loads asks for its largest factor:

        - ``push``: a body and a force (N)
        - ``mass``: a body that carries the factor in kg
        - ``tilt``: a horizontal axis about which gravity turns, by the angle with this tangent
        - ``base``: an acceleration (m/s²)

        ``at`` is the point of a push or mass from the body's centre (m, world axes). ``least_friction``
        asks for the smallest factor on all coefficients of friction, and ``friction`` for the worst case
        of a range. ``move`` asks for derivatives of the factor by translations of bodies along vectors.
        Velocities count as zero (docs/statics.md).
        """
        place = vector("at", at)
        loads = []
        if push is not None:
            loads.append(("push", push[0], vector("push", push[1]), place))
        if mass is not None:
            loads.append(("mass", mass, [0.0, 0.0, 0.0], place))
        if tilt is not None:
            loads.append(("tilt", "", vector("tilt", tilt), place))
        if base is not None:
            loads.append(("base", "", vector("base", base), place))
        if len(loads) > 1:
            raise TumbleError(f"{loads[1][0]}: {loads[0][0]} is given too; ask for one load at a time")
        if move and not loads:
            raise TumbleError("move: a load is needed, whose largest factor has derivatives")
        moves = [(str(body), vector("move", along)) for body, along in (move or {}).items()]
        low_high = None if friction is None else [float(end) for end in friction]
        return Statics(json.loads(self._core.stands(loads[0] if loads else None, least_friction, low_high, moves)))

    def jacobian(
        self,
        states: Any = None,
        wrenches: Any = None,
        *,
        index: int | None = None,
        by: Iterable[str] = (),
        compliance: float | None = None,
        central_path: float | None = None,
    ) -> Derivatives:
        """Derivative of one step from ``states`` (N, 13), by default the scene's start.

        ``wrenches`` (N, 6) act in the step. ``index`` is the step k, by default ``start_index``;
        states of a scene with prescribed motions or loads over time need theirs. The result has
        ``["states"]`` (N, 12, N, 12), ``["wrenches"]`` (N, 12, N, 6), and the derivatives by the
        constants named in ``by``, such as "friction" or "mass".

        Smoothing yields a search direction where the exact derivative is zero. ``compliance``
        (1e-9 to 1) differentiates a step with compliant contacts. ``central_path`` (1e-6 to 10
        m/s) differentiates a step on the central path of an interior-point method, whose
        complementarity products equal its square. See Derivatives.
        """
        from ._gradients import jacobian, smoothing_of

        return jacobian(self, states, wrenches, index, by, smoothing_of(compliance, central_path))

    def vjp(
        self,
        cotangents: Any,
        states: Any = None,
        controls: Any = None,
        *,
        steps: int | None = None,
        index: int | None = None,
        by: Iterable[str] = (),
        compliance: float | None = None,
        central_path: float | None = None,
        impact_times: bool = False,
    ) -> Derivatives:
        """Derivatives of a scalar loss of a run with ``steps`` steps.

        ``cotangents`` (N, 12) are the loss derivatives with respect to the end states. The
        result has ``["states"]`` (N, 12), ``["controls"]`` (T, N, 6), and the derivatives by
        the constants named in ``by``. ``compliance`` or ``central_path`` smooth the derivatives
        of the steps; the run stays exact. With ``impact_times`` the derivative of a bounce has its
        time, which the steps do not resolve: the result is the derivative of the motion, not of
        the steps. The run begins at step ``index``, by default ``start_index``. See Derivatives.
        """
        from ._gradients import smoothing_of, vjp

        smoothing = smoothing_of(compliance, central_path)
        return vjp(self, (cotangents, states, controls), steps, index, by, smoothing, impact_times)

    def __repr__(self) -> str:
        bodies = len(self.bodies)
        plural = "body" if bodies == 1 else "bodies"
        return f"<tumble.Scene {self.name!r}: {bodies} {plural}, h = {self.time_step} s>"

    def _repr_html_(self) -> str:
        from ._html import shown

        return shown(repr(self), self.run(0, contacts=False).gif().data)


def _meant(name: str, known: list[str]) -> str:
    """Hint for an unknown keyword."""
    return "; did you mean `time_step`?" if name in ("dt", "h", "timestep") else name_hint(name, known)


def _checked(name: str, value: Any) -> Any:
    """Value of a keyword that overrides a file."""
    if name not in Settings.__annotations__:
        meant = _meant(name, [*Settings.__annotations__])
        raise TypeError(f"keyword {name!r} is unknown{meant}")
    if name in _RANGES:
        return whole(name, value, *_RANGES[name])
    if name == "leave_out":
        return name_list(name, value)
    return os.fspath(value) if name == "packages" else value


def _warn(scene: Scene) -> None:
    """Warns of all notes on a scene. The caller's caller is named."""
    for note in scene._core.notes:
        warnings.warn(note, stacklevel=3)


def load(path: Location, **settings: Unpack[Settings]) -> Scene:
    """Reads a scenario file (TOML), or a robot's URDF, SDF or MJCF file.

    scenarios/README.md describes every field. A robot becomes a scene on level ground, unless
    its file has a ground. Keywords override the file:

    - ``seed``, ``steps``, ``friction``, ``restitution``;
    - ``start_index``: step k of the start;
    - ``time_step`` (s);
    - ``rotation``: discretisation of the rotation, "momentum" or "tutorial";
    - ``integrator``: meaning of the velocities in a run, "leapfrog" or "euler";
    - ``accuracy``: error of the time step that a run keeps, m in a second;
    - ``impacts``: when impacts happen, "stepped" or "located";
    - ``solver``: "native" (default), or "ipopt" if tumble.has_ipopt;
    - ``residual``: tolerance of the native solver, m/s, 1e-9 (default) to 1e-2.

    For a robot's file:

    - ``packages``: folder of the files ``package://name/rest``, as ``name/rest``. The default
      is the first folder that has the file, from the robot's folder upwards;
    - ``leave_out``: elements and attributes to ignore (["tendon", "body:goal", "@condim"]);
    - ``point_contacts``: True replaces the torsional and rolling friction of condim 4 and 6
      by sliding friction.

    Probable mistakes and deviations from a robot's file are warnings; ``robot.notes`` has the latter too.

    Raises TumbleError for an unreadable file and for an invalid scene.
    """
    try:
        path = os.fsdecode(path)
    except TypeError:
        raise TumbleError(f"path is {path!r}; the path of a scenario or a robot's file is needed") from None
    if why := remedy(path):
        raise TumbleError(f"{path}: {why}")
    most = _LARGEST_ROBOT if path.endswith((".urdf", ".sdf", ".xml")) else _LARGEST_FILE
    try:
        with open(path, "rb") as stream:
            content = stream.read(most + 1)
    except OSError as error:
        why = f"{path} cannot be read: {error.strerror}; give a scenario or a robot's file"
        raise TumbleError(why) from error
    if len(content) > most:
        raise TumbleError(f"{path}: it is longer than {most} bytes")
    try:
        text = content.decode()
    except UnicodeDecodeError:
        raise TumbleError(f"{path}: cannot be read as a scenario: it is not UTF-8 text; save it as UTF-8") from None
    scene = Scene.from_text(text, path, **settings)
    _warn(scene)
    return scene


def _made(text: str, path: str, settings: dict[str, Any]) -> Scene:
    return Scene.from_text(text, path, **settings)


_DROP = """
name = "drop"
rotation = "tutorial"
[body]
box = 2.0
mass = 10.0
inertia = 0.01
[ground]
friction = 0.3
[start]
position = [0.0, 0.0, 2.5]
attitude = "random"
velocity = [0.0, 4.0, 0.0]
spin = [0.0, -2.0, 1.0]
"""

_FLOATING = """
name = "floating"
steps = 1200
time_step = 0.001
gravity = 0.0
[body]
box = 2.0
mass = 10.0
inertia = 0.01
[start]
position = [0.0, 0.0, 3.0]
velocity = [2.0, 0.0, 0.0]
spin = [2.0, 4.0, 6.0]
"""


def drop(seed: int = 42, *, solver: str | None = None) -> Scene:
    """The tutorial's scene: a thrown cube of 2 m and 10 kg, its attitude random from ``seed``."""
    return Scene.from_text(_DROP, "drop", seed=seed, solver=solver)


def floating() -> Scene:
    """The tutorial's second scene: the cube floats, without gravity or ground."""
    return Scene.from_text(_FLOATING, "floating")
