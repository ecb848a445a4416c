"""A recorded run."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._arrays import numbers
from ._checks import made, pandas, real, whole
from ._files import folder_of_a_run, replaced, written
from ._names import ByName, unknown
from ._progress import callback
from ._scene import Scene
from ._status import Status
from ._tumble import RESIDUAL_PARTS, Recording, TumbleError
from ._types import Bytes, Floats, Integers, Location, Progress

if TYPE_CHECKING:
    import pandas as pd


STATE_COLUMNS = "x_m y_m z_m qw qx qy qz vx_m_s vy_m_s vz_m_s wx_rad_s wy_rad_s wz_rad_s".split()
"""Table columns of the 13 numbers of a state, in their order."""

_TABLES = ("states", "contacts", "steps", "joints", "gears", "ends")

RUN_FILES = (*(f"{name}.csv" for name in _TABLES), "trajectory.csv", "run.json")
"""Names of the files that a run may have."""

_JOINT_COLUMNS = {
    "place": ("", "_m"),
    "angles": ("angle_", "_rad"),
    "velocity": ("v", "_m_s"),
    "spin": ("w", "_rad_s"),
    "force": ("force_", "_N"),
    "torque": ("torque_", "_N_m"),
}
"""Columns of joints, with prefix and suffix of their components in joints.csv."""


def camera_of(camera: Any) -> tuple[float, float]:
    """Azimuth and elevation of a camera, degrees."""
    azimuth, elevation = map(float, numbers("camera", camera, (2,)))
    if not (abs(azimuth) <= 360.0 and 0.0 <= elevation <= 90.0):
        raise TumbleError(
            f"camera is {camera}; an azimuth from -360 to 360 and an elevation from 0 to 90 degrees are needed"
        )
    return azimuth, elevation


class Trajectory:
    """A recorded run of N bodies: T steps, and K = T + 1 states.

    Arrays are created once, cached and read-only. Positions, attitudes, velocities and spins
    are views of ``states``. ``run[k]`` is the states (N, 13) at row k, and ``run[100:200]`` a
    part of the run as a trajectory. Copies share the data. A notebook shows a trajectory as a
    playable page.
    """

    _scene: Scene
    _recording: Recording

    def __init__(self, scene: Scene, recording: Recording) -> None:
        self.__dict__.update(_scene=scene, _recording=recording)

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuses changes."""
        raise AttributeError(f"{name}: a trajectory cannot be changed")

    @property
    def scene(self) -> Scene:
        """Scene of the run."""
        return self._scene

    @cached_property
    def states(self) -> Floats:
        """States (K, N, 13).

        Columns are position (m, world), quaternion w, x, y, z (body to world), velocity (m/s,
        world) and spin (rad/s, body).
        """
        return self._recording.states()

    @property
    def positions(self) -> Floats:
        """Centres of mass, m, world: (K, N, 3), a view."""
        return self.states[..., 0:3]

    @property
    def attitudes(self) -> Floats:
        """Unit quaternions w, x, y, z, body to world: (K, N, 4), a view."""
        return self.states[..., 3:7]

    @property
    def velocities(self) -> Floats:
        """Velocities of the centres of mass, m/s, world: (K, N, 3), a view."""
        return self.states[..., 7:10]

    @property
    def spins(self) -> Floats:
        """Angular velocities, rad/s, body: (K, N, 3), a view."""
        return self.states[..., 10:13]

    @cached_property
    def forces(self) -> Floats:
        """Sum of the contact forces on each body over each step, N, world: (T, N, 3)."""
        return self._recording.forces()

    @cached_property
    def contacts(self) -> dict[str, Any]:
        """Candidate contacts of all steps, C in all, as columns.

        - ``k``, ``body`` (C,), ``partner`` (C names);
        - ``partner_body`` (C,): index of the partner in ``scene.bodies``, -1 for the ground and
          fixed pieces;
        - ``point`` (m, world), ``normal`` (world, away from the partner), (C, 3);
        - ``force`` (N, world, on the body), ``slip`` (m/s, world), (C, 3);
        - ``moment`` (N m, world, on the body about the point) of rolling and torsional friction, (C, 3);
        - ``normal_force`` (N), ``gap`` (m), (C,).

        Raises TumbleError for a run recorded without contacts.
        """
        self._need_contacts("contacts")
        return ByName("column", self._recording.contacts())

    @cached_property
    def joints(self) -> dict[str, dict[str, Any]]:
        """Joints by name, as columns.

        - ``coordinate`` (K,) is the angle of a hinge including full turns, rad, or the
          position along a slide, m. It is (K, D) for a joint with several such axes, and
          (K, 0) for a ball or fixed joint.
        - ``speed`` (T,) is the mean rate of ``coordinate`` over each step.
        - ``place`` (m) and ``angles`` (rad), (K, 3) each, are all six coordinates. Those of
          locked axes are the joint's error.
        - ``velocity`` and ``spin``, (T, 3), are their rates.
        - ``force`` (N) and ``torque`` (N m), (T, 3) each, act on the first body over each
          step, and their opposites on the second. They are in the second body's joint frame.
        """
        return by_name(self.scene, self._recording.joints(), slice(None, -1))

    @cached_property
    def gears(self) -> dict[str, Floats]:
        """Gears of the scene.

        ``coordinates`` (K, G, 2) are those of the following and the leading joint, m or rad
        including full turns. ``force`` (T, G) acts along the first coordinate over each step,
        N or N m.
        """
        columns = self._recording.gears()
        return ByName("column", {"coordinates": columns["coordinates"], "force": columns["force"][:-1]})

    @cached_property
    def _steps(self) -> dict[str, Any]:
        return self._recording.steps()

    @property
    def time(self) -> Floats:
        """Time t of each state, s: (K,)."""
        return self._steps["time"]  # type: ignore[no-any-return]

    @property
    def energy(self) -> Floats:
        """Kinetic and potential energy relative to the world's origin, J: (K,).

        With the rotation "momentum" it is the energy at the states' times, which free motion
        conserves. With "tutorial" it uses the stored velocities, which are half a step behind
        (docs/formulation.md, section 14).
        """
        return self._steps["energy"]  # type: ignore[no-any-return]

    @property
    def residuals(self) -> Floats:
        """Certified residual of each step, m/s: (T,)."""
        return self._steps["residual"][:-1]  # type: ignore[no-any-return]

    @property
    def iterations(self) -> Integers:
        """Iterations of the solver in each step: (T,)."""
        return self._steps["iterations"][:-1]  # type: ignore[no-any-return]

    @property
    def overlaps(self) -> Floats:
        """Largest overlap of pieces after each step, m: (T,)."""
        return self._steps["overlap"][:-1]  # type: ignore[no-any-return]

    @property
    def restitution_shares(self) -> Floats:
        """Applied fraction of the restitution in each step: (T,).

        It is below 1 in steps where full restitution would have created energy.
        """
        return self._steps["restitution_share"][:-1]  # type: ignore[no-any-return]

    @property
    def stiffness(self) -> Floats:
        """Product h ω of each step, (T,), with ω the highest frequency of taut joints.

        More than 2 in consecutive steps makes a taut chain unstable. It is 0 without joints.
        """
        return self._steps["stiffness"][:-1]  # type: ignore[no-any-return]

    @property
    def status(self) -> Bytes:
        """Status of each step as a number of tumble.Status: (T,)."""
        return self._steps["status"][:-1]  # type: ignore[no-any-return]

    @property
    def unsolved(self) -> list[tuple[int, Status]]:
        """Steps that failed or are wild: index in the T steps, and status."""
        found = enumerate(map(Status, self.status.tolist()))
        return [(k, status) for k, status in found if not status.ok]

    def __len__(self) -> int:
        """Number of states K."""
        return len(self._recording)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, slice):
            first, end, stride = key.indices(len(self))
            if stride != 1 or first >= end:
                raise TumbleError(
                    f"[{first}:{end}:{stride}] is not a part of a trajectory; consecutive states are "
                    "needed, for example run[100:200]; run.states[::10] has every tenth state"
                )
            return Trajectory(self.scene, self._recording.part(first, end))
        return self.states[key]

    def __iter__(self) -> Iterator[Floats]:
        """Iterates over the states (N, 13) of each row."""
        return iter(self.states)

    def __reduce__(self) -> Any:
        """Pickles a trajectory as its tables."""
        recording = self._recording
        forces = None if recording.has_contacts else recording.forces()
        return _restored, (self.scene, recording.tables(loaded_contacts=False), forces)

    def __copy__(self) -> Trajectory:
        return Trajectory(self.scene, self._recording)

    def __deepcopy__(self, _: Any) -> Trajectory:
        return self.__copy__()

    def to_pandas(self) -> pd.DataFrame:
        """One row per state and body.

        Columns are k, time_s, body (its name), and the 13 numbers of the state.
        ``frame[tumble.STATE_COLUMNS]`` of such rows are states for simulate and rollout.
        """
        import numpy as np

        pd = pandas()
        rows, bodies, _ = self.states.shape
        states = self.states.reshape(rows * bodies, 13).copy()
        frame = pd.DataFrame(states, columns=STATE_COLUMNS)
        frame.insert(0, "k", np.repeat(self._steps["k"], bodies))
        frame.insert(1, "time_s", np.repeat(self.time, bodies))
        frame.insert(2, "body", self.scene.bodies * rows)
        return frame

    def steps_to_pandas(self) -> pd.DataFrame:
        """One row per step.

        Columns are k, time_s, status, iterations, residual_m_s, its parts, overlap_m, placement_m
        and energy_J. The parts have the names of steps.csv: dynamics_m_s, penetration_m_s and so on.
        Scenes with joints also have stiffness.
        """
        pd = pandas()
        steps = {name: column[:-1] for name, column in self._steps.items()}
        tied = {"stiffness": steps["stiffness"]} if self.scene.joints else {}
        return pd.DataFrame(
            {
                "k": steps["k"],
                "time_s": steps["time"],
                "status": [Status(number).word for number in steps["status"].tolist()],
                "iterations": steps["iterations"],
                "residual_m_s": steps["residual"],
                **{f"{part}_m_s": steps["parts"][:, place] for place, part in enumerate(RESIDUAL_PARTS)},
                "overlap_m": steps["overlap"],
                "placement_m": steps["placement"],
                "energy_J": steps["energy"],
                **tied,
            }
        )

    def contacts_to_pandas(self) -> pd.DataFrame:
        """One row per candidate contact.

        Columns are k, body and partner (names), the components of point_m, normal, force_N
        and slip_m_s as ``point_x_m``, ``normal_x``, ``force_x_N``, ``slip_x_m_s`` and so on,
        then normal_force_N, gap_m and, with rolling or torsional friction, the components of moment_N_m.
        """
        frame = contacts_frame(self.scene, self.contacts)
        frame.insert(0, "k", self.contacts["k"])
        return frame

    def joints_to_pandas(self) -> pd.DataFrame:
        """One row per state and joint.

        Columns are k, time_s, joint (its name), and those of joints.csv. Rates, forces and
        torques are 0 in the last state.
        """
        import numpy as np

        pd = pandas()
        names = self.scene.joints
        rows, columns = len(self), self._recording.joints()
        table = {}
        for name, (start, unit) in _JOINT_COLUMNS.items():
            for place, axis in enumerate("xyz"):
                table[f"{start}{axis}{unit}"] = columns[name][:, :, place].reshape(-1)
        frame = pd.DataFrame(table)
        frame.insert(0, "k", np.repeat(self._steps["k"], len(names)))
        frame.insert(1, "time_s", np.repeat(self.time, len(names)))
        frame.insert(2, "joint", names * rows)
        return frame

    def to_csv(self, folder: Location, overwrite: bool = False, *, all_contacts: bool = False) -> list[Path]:
        """Writes the run as tables and run.json, as the command line does.

        The tables are states.csv, contacts.csv and steps.csv, plus joints.csv and gears.csv
        for scenes that have them, and ends.csv for a run with converted velocities. Numbers are
        written without loss. Contacts that add nothing to the residual have rows only with
        ``all_contacts``. The command line verifies and displays the run from run.json.

        run.json marks a run as ``pushed`` if inputs outside the scene moved it: wrenches,
        motors or states set during the run, or added or removed bodies. The command line
        displays such a run but cannot verify it.

        Files in the folder's run.json belong to an earlier run and are replaced or removed.
        Any other file with one of the names is refused, unless ``overwrite`` is true.
        """
        return self._to_folder(folder, overwrite, {}, all_contacts)

    def _to_folder(
        self, folder: Location, overwrite: bool, more: Mapping[str, bytes], all_contacts: bool = False
    ) -> list[Path]:
        """Writes the run as to_csv, with more files of the same run."""
        self._need_contacts("to_csv")
        folder, recording = Path(folder), self._recording
        loaded = not all_contacts
        written_tables = recording.tables(loaded)
        tables = {f"{name}.csv": written_tables[name] for name in _TABLES if name in written_tables}
        tables.update(more)
        files: dict[str, bytes | None] = {**tables, "run.json": recording.run_json(tables, loaded)}
        given = {name: content for name, content in files.items() if content is not None}
        with folder_of_a_run(folder, list(given), overwrite):
            return [written(folder / name, content) for name, content in given.items()]

    @classmethod
    def from_csv(cls, scene: Scene, folder: Location) -> Trajectory:
        """Reads the tables of a run of ``scene`` or of a part of one.

        ``folder`` contains tables of to_csv or the command line, also with ``--compact``. The
        command line leaves contacts without force out, unless its run had ``--all-contacts``.
        A run.json beside the tables that has other bodies is refused.
        """
        import gzip

        scene, folder = made("scene", scene, Scene), Path(folder)
        json = folder / "run.json"
        run = json.read_text("utf-8") if json.is_file() else None
        is_compressed = (folder / "states.csv.gz").is_file()
        tables = {}
        needed = _TABLES[: 5 if scene.gears else 4 if scene.joints else 3]
        for name in _TABLES:
            file = folder / (f"{name}.csv.gz" if is_compressed else f"{name}.csv")
            if name not in needed and not (name == "ends" and file.is_file()):
                continue
            content = file.read_bytes()
            tables[name] = gzip.decompress(content) if is_compressed else content
        return cls(scene, Recording.from_tables(scene._core, tables, run=run))

    def plot(self, path: Location | None = None, *, sheet: str = "motion", body: Any = None, ax: Any = None) -> Any:
        """Plots of a body over time as SVG.

        ``sheet`` is "motion", with contact forces, or "energy". ``body`` is an index or a
        name, and by default the first body that moves. The plot is written to ``path``, which ends in .svg or .png.
        Without a path, the result is an object that a notebook shows. With matplotlib's axes ``ax``, the position (m)
        of the body or the energy of the scene (J) is drawn there, and they are returned.
        """
        if ax is not None:
            return self._plot_on(ax, path, sheet, body)
        ends = Path(path).suffix if path is not None else ".svg"
        if ends not in (".svg", ".png"):
            raise TumbleError(f"{path}: a name that ends in .svg or .png is needed")
        if sheet == "motion":
            self._need_contacts("the plot of motion")
        svg = self._recording.svg(sheet, None if body is None else self._body(body))
        if path is None:
            return Picture("image/svg+xml", svg.encode())
        return replaced(Path(path), svg.encode() if ends == ".svg" else Recording.png(svg))

    def _plot_on(self, ax: Any, path: Location | None, sheet: str, body: Any) -> Any:
        if path is not None:
            raise TumbleError("ax and path are both given; save the figure of ax instead")
        import numpy as np

        if sheet == "energy":
            ax.plot(self.time, self.energy)
            ax.set(xlabel="t (s)", ylabel="energy (J)")
        elif sheet == "motion":
            moves = np.any(self.positions != self.positions[0], axis=(0, 2))
            place = self._body(body) if body is not None else int(np.argmax(moves))
            for axis, name in enumerate("xyz"):
                ax.plot(self.time, self.positions[:, place, axis], label=name)
            ax.set(xlabel="t (s)", ylabel=f"position of {self.scene.bodies[place]} (m)")
            ax.legend()
        else:
            raise TumbleError(f'sheet is {sheet!r}; "motion" or "energy" is needed')
        return ax

    def gif(
        self,
        path: Location | None = None,
        *,
        speed: float = 1.0,
        size: int = 480,
        camera: tuple[float, float] | None = None,
        dark: bool = False,
        progress: Progress = False,
    ) -> Any:
        """Animation of the motion as a GIF.

        It runs at ``speed`` times real time and is ``size`` pixels wide. ``camera`` is
        azimuth and elevation in degrees. The default is that of the page: azimuth -32, or
        -62 for motion along x, and the lowest tested elevation, from 20 on, with a clear
        view. ``dark`` selects a dark background. The GIF is written to ``path``. Without a
        path, the result is an object that a notebook shows.
        """
        ends = Path(path).suffix if path is not None else ".gif"
        if ends != ".gif":
            raise TumbleError(f"{path}: a name that ends in .gif is needed")
        if not 1e-4 <= real("speed", speed) <= 1e4:
            raise TumbleError(f"speed is {speed}; allowed: 0.0001 to 10000")
        if not 100 <= whole("size", size, 0) <= 2000:
            raise TumbleError(f"size is {size}; allowed: 100 to 2000")
        view = None if camera is None else camera_of(camera)
        content = self._recording.gif(speed, size, view, bool(dark), callback(progress))
        return Picture("image/gif", content) if path is None else replaced(Path(path), content)

    def page(self, other: Trajectory | None = None) -> str:
        """Self-contained HTML page that plays the motion, side by side with ``other``."""
        runs = [self] if other is None else [self, made("other", other, Trajectory)]
        for run in runs:
            run._need_contacts("the page")
        return self._recording.page(None if other is None else other._recording)

    def view(self, path: Location | None = None, other: Trajectory | None = None) -> Any:
        """Page that plays the motion.

        It is written to ``path``, which ends in .html. Without a path, the result is an
        object that a notebook shows.
        """
        if path is not None and Path(path).suffix not in (".html", ".htm"):
            raise TumbleError(f"{path}: a name that ends in .html is needed")
        page = self.page(other)
        return Page(page) if path is None else replaced(Path(path), page.encode())

    def _body(self, body: Any) -> int:
        names = self.scene.bodies
        if body in names:
            return names.index(body)
        if isinstance(body, str):
            raise unknown("body", body, names)
        try:
            return whole("body", body, 0, len(names) - 1)
        except TumbleError:
            raise TumbleError(
                f"body is {body!r}; a name, for example {names[0]!r}, or an index from 0 to {len(names) - 1} is needed"
            ) from None

    def _need_contacts(self, what: str) -> None:
        if not self._recording.has_contacts:
            raise TumbleError(
                f"{what}: the run was recorded without contacts; record it with contacts=True, or "
                "use forces, their sum on each body"
            )

    def __repr__(self) -> str:
        steps = len(self) - 1
        seconds = steps * self.scene.time_step
        unsolved = len(self.unsolved)
        return f"<tumble.Trajectory of {self.scene.name!r}: {steps} steps, {seconds:.3f} s, {unsolved} not solved>"

    def _repr_html_(self) -> str | None:
        return Page(self.page())._repr_html_() if self._recording.has_contacts else None


def contacts_frame(scene: Scene, contacts: Mapping[str, Any]) -> pd.DataFrame:
    """Table of contacts from their columns, one row each."""
    pd = pandas()
    bodies = scene.bodies
    columns: dict[str, Any] = {"body": [bodies[place] for place in contacts["body"]], "partner": contacts["partner"]}
    for name, unit in (("point", "_m"), ("normal", ""), ("force", "_N"), ("slip", "_m_s")):
        for place, axis in enumerate("xyz"):
            columns[f"{name}_{axis}{unit}"] = contacts[name][:, place]
    columns["normal_force_N"] = contacts["normal_force"]
    columns["gap_m"] = contacts["gap"]
    if scene._core.has_turning_friction:
        for place, axis in enumerate("xyz"):
            columns[f"moment_{axis}_N_m"] = contacts["moment"][:, place]
    return pd.DataFrame(columns)


def _restored(scene: Scene, tables: dict[str, bytes], forces: Any) -> Trajectory:
    return Trajectory(scene, Recording.from_tables(scene._core, tables, forces))


def by_name(scene: Scene, columns: dict[str, Floats], steps: Any) -> dict[str, dict[str, Floats]]:
    """Columns of all joints, (…, J, 3), by joint.

    ``steps`` selects the rows of quantities that belong to steps.
    """
    import numpy as np

    places = np.concatenate([columns["place"], columns["angles"]], axis=-1)
    rates = np.concatenate([columns["velocity"], columns["spin"]], axis=-1)
    places.flags.writeable = rates.flags.writeable = False
    joints: dict[str, dict[str, Floats]] = {}
    for number, (name, axes) in enumerate(zip(scene.joints, scene.joint_axes)):
        one: Any = axes[0] if len(axes) == 1 else axes
        of_steps = {"speed": rates[..., number, one]}
        names = ("velocity", "spin", "force", "torque")
        of_steps.update({column: columns[column][..., number, :] for column in names})
        columns_of = {
            "coordinate": places[..., number, one],
            "place": columns["place"][..., number, :],
            "angles": columns["angles"][..., number, :],
            **{column: numbers[steps] for column, numbers in of_steps.items()},
        }
        joints[name] = ByName("column", columns_of)
    return ByName("joint", joints)


class Page:
    """Page for the browser, as text in ``html``."""

    def __init__(self, text: str) -> None:
        self.html = text

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="640" style="border: 0"></iframe>'


class Picture:
    """Picture with its ``data`` and its type, ``media_type``."""

    def __init__(self, media_type: str, data: bytes) -> None:
        self.media_type = media_type
        self.data = data

    def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
        if self.media_type == "image/svg+xml":
            return {self.media_type: self.data.decode()}
        return {self.media_type: base64.b64encode(self.data).decode()}
