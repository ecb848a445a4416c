"""A recorded run."""

from __future__ import annotations

import base64
import html
import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Dict, Iterator, List, Mapping, Optional, Tuple, Union

from ._arrays import numbers
from ._checks import made, real, whole
from ._files import folder_of_a_run, written
from ._progress import Progress, callback
from ._scene import Scene
from ._tumble import STATUSES, Recording, TumbleError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import pandas as pd

    Floats = npt.NDArray[np.float64]

Location = Union[str, "os.PathLike[str]"]

STATE_COLUMNS = "x_m y_m z_m qw qx qy qz vx_m_s vy_m_s vz_m_s wx_rad_s wy_rad_s wz_rad_s".split()
"""The 13 numbers of a state as columns of a table, in their order."""

_TABLES = ("states", "contacts", "steps", "joints", "gears")

_OF_ONE = "trajectory.csv"

_JOINT_COLUMNS = {
    "place": ("", "_m"),
    "angles": ("angle_", "_rad"),
    "velocity": ("v", "_m_s"),
    "spin": ("w", "_rad_s"),
    "force": ("f", "_N"),
    "torque": ("t", "_N_m"),
}
"""The columns of joints, and how their components are called in joints.csv."""


class Trajectory:
    """A recorded run of N bodies: T steps, and K = T + 1 states.

    Arrays are made once and then kept, and cannot be written to; positions, attitudes, velocities
    and spins are views of ``states``. ``run[k]`` is the states (N, 13) at row k, ``run[100:200]`` a
    part of the run as a trajectory; copies share what they are of. In a notebook it shows itself
    as a page that can be played.
    """

    _scene: Scene
    _recording: Recording

    def __init__(self, scene: Scene, recording: Recording) -> None:
        self.__dict__.update(_scene=scene, _recording=recording)

    def __setattr__(self, name: str, value: Any) -> None:
        """Refused: what was recorded does not change."""
        raise AttributeError(f"{name}: a trajectory cannot be changed")

    @property
    def scene(self) -> Scene:
        """What was simulated."""
        return self._scene

    @property
    def recording(self) -> Recording:
        """The run as the compiled part keeps it."""
        return self._recording

    @cached_property
    def states(self) -> "Floats":
        """(K, N, 13): position (m, world), quaternion w, x, y, z (body to world), velocity (m/s,
        world), spin (rad/s, body)."""
        return self.recording.states()

    @property
    def positions(self) -> "Floats":
        """Centres of mass, m, world: (K, N, 3), a view."""
        return self.states[..., 0:3]

    @property
    def attitudes(self) -> "Floats":
        """Unit quaternions w, x, y, z, body to world: (K, N, 4), a view."""
        return self.states[..., 3:7]

    @property
    def velocities(self) -> "Floats":
        """m/s, world: (K, N, 3), a view."""
        return self.states[..., 7:10]

    @property
    def spins(self) -> "Floats":
        """rad/s, body: (K, N, 3), a view."""
        return self.states[..., 10:13]

    @cached_property
    def forces(self) -> "Floats":
        """The sum of the contact forces on each body over each step, N, world: (T, N, 3)."""
        return self.recording.forces()

    @cached_property
    def contacts(self) -> Dict[str, Any]:
        """Every candidate contact of every step, C in all, as columns: ``k`` (C,), ``body`` (C,),
        ``partner`` (names, C), ``point`` (m, world), ``normal`` (world, away from the partner),
        ``force`` (N, world, on the body) and ``slip`` (m/s, world), each (C, 3), ``normal_force``
        (N) and ``gap`` (m), each (C,). A run that was recorded without contacts raises TumbleError.
        """
        self._need_contacts("contacts")
        return self.recording.contacts()

    @cached_property
    def joints(self) -> Dict[str, Dict[str, Any]]:
        """Each joint by its name, as columns.

        ``coordinate`` (K,) is the angle of a hinge with all its turns, rad, or the place along a slide,
        m; of a joint with several such axes (K, D), of a ball joint or a fixed one (K, 0). ``speed`` is
        its mean rate over each step: (T,). ``place`` (m) and ``angles`` (rad), (K, 3) each, are all six
        coordinates, those of what is locked how far it is off; ``velocity`` and ``spin``, (T, 3), their
        rates. ``force`` (N, along the axes of the second body's frame of the joint) and ``torque`` (N m)
        act on the first body over each step, their opposites on the second: (T, 3) each."""
        return by_name(self.scene, self.recording.joints(), slice(None, -1))

    @cached_property
    def gears(self) -> Dict[str, "Floats"]:
        """The gears of the scene: ``coordinates`` (K, G, 2), of the joint that follows and of the one that it
        follows, m or rad with all turns, and ``force`` (T, G) along the first over each step, N or N m."""
        columns = self.recording.gears()
        return {"coordinates": columns["coordinates"], "force": columns["force"][:-1]}

    @cached_property
    def _steps(self) -> Dict[str, Any]:
        return self.recording.steps()

    @property
    def time(self) -> "Floats":
        """t of each state, s: (K,)."""
        return self._steps["time"]  # type: ignore[no-any-return]

    @property
    def energy(self) -> "Floats":
        """Kinetic and in gravity, from the world's origin, J: (K,). With the rotation "momentum" it
        is that at the states' times, which free motion keeps; with "tutorial" that of the stored
        velocities, which are half a step behind (docs/formulation.md, section 14)."""
        return self._steps["energy"]  # type: ignore[no-any-return]

    @property
    def residuals(self) -> "Floats":
        """The certificate of each step, m/s: (T,)."""
        return self._steps["residual"][:-1]  # type: ignore[no-any-return]

    @property
    def iterations(self) -> "npt.NDArray[np.uint32]":
        """Iterations of the solver in each step: (T,)."""
        return self._steps["iterations"][:-1]  # type: ignore[no-any-return]

    @property
    def overlaps(self) -> "Floats":
        """How deep pieces overlap after each step, m: (T,)."""
        return self._steps["overlap"][:-1]  # type: ignore[no-any-return]

    @property
    def restitution_shares(self) -> "Floats":
        """The part of its restitution that each step took: below 1 where the whole would have made
        energy: (T,)."""
        return self._steps["restitution_share"][:-1]  # type: ignore[no-any-return]

    @property
    def stiffness(self) -> "Floats":
        """h ω of each step, (T,): how fast what joints hold taut can vibrate, against the time step. With more than 2
        in one step after another a taut chain shakes itself to pieces. 0 without joints."""
        return self._steps["stiffness"][:-1]  # type: ignore[no-any-return]

    @property
    def status(self) -> "npt.NDArray[np.uint8]":
        """How each step ended, an index of tumble.STATUSES: (T,)."""
        return self._steps["status"][:-1]  # type: ignore[no-any-return]

    @property
    def unsolved(self) -> List[Tuple[int, str]]:
        """The steps that failed or were wild: the place in the T steps, and the status."""
        words = (STATUSES[place] for place in self.status)
        return [(k, word) for k, word in enumerate(words) if word in ("failed", "wild")]

    def __len__(self) -> int:
        """K."""
        return len(self.recording)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, slice):
            first, end, stride = key.indices(len(self))
            if stride != 1 or first >= end:
                raise TumbleError(
                    f"[{first}:{end}:{stride}] is no part of a trajectory; one state or more in a "
                    "row are needed, as in run[100:200], and run.states[::10] has every tenth"
                )
            return Trajectory(self.scene, self.recording.part(first, end))
        return self.states[key]

    def __iter__(self) -> "Iterator[Floats]":
        """The states (N, 13) of each row."""
        return iter(self.states)

    def __reduce__(self) -> Any:
        """A trajectory goes to another process as its tables."""
        recording = self.recording
        forces = None if recording.has_contacts else recording.forces()
        return _restored, (self.scene, recording.tables(), forces)

    def __copy__(self) -> "Trajectory":
        return Trajectory(self.scene, self.recording)

    def __deepcopy__(self, _: Any) -> "Trajectory":
        return self.__copy__()

    def to_pandas(self) -> "pd.DataFrame":
        """One row a state and body: k, time_s, body (its name), and the 13 numbers of the state.

        ``frame[tumble.STATE_COLUMNS]`` of such rows are states again, for simulate and rollout."""
        import numpy as np
        import pandas as pd

        rows, bodies, _ = self.states.shape
        states = self.states.reshape(rows * bodies, 13).copy()
        frame = pd.DataFrame(states, columns=STATE_COLUMNS)
        frame.insert(0, "k", np.repeat(self._steps["k"], bodies))
        frame.insert(1, "time_s", np.repeat(self.time, bodies))
        frame.insert(2, "body", self.scene.bodies * rows)
        return frame

    def steps_to_pandas(self) -> "pd.DataFrame":
        """One row a step: k, time_s, status, iterations, residual_m_s, overlap_m, energy_J, and of a scene with
        joints stiffness."""
        import pandas as pd

        steps = {name: column[:-1] for name, column in self._steps.items()}
        tied = {"stiffness": steps["stiffness"]} if self.scene.joints else {}
        return pd.DataFrame(
            {
                "k": steps["k"],
                "time_s": steps["time"],
                "status": [STATUSES[place] for place in steps["status"]],
                "iterations": steps["iterations"],
                "residual_m_s": steps["residual"],
                "overlap_m": steps["overlap"],
                "energy_J": steps["energy"],
                **tied,
            }
        )

    def contacts_to_pandas(self) -> "pd.DataFrame":
        """One row a candidate contact: k, body and partner (names), the components of point_m,
        normal, force_N and slip_m_s as ``point_x_m``, ``normal_x``, ``force_x_N``, ``slip_x_m_s``
        and so on, then normal_force_N and gap_m."""
        frame = contacts_frame(self.scene, self.contacts)
        frame.insert(0, "k", self.contacts["k"])
        return frame

    def joints_to_pandas(self) -> "pd.DataFrame":
        """One row a state and joint: k, time_s, joint (its name), and the columns of joints.csv, rates,
        forces and torques being 0 in the last state."""
        import numpy as np
        import pandas as pd

        names = self.scene.joints
        rows, columns = len(self), self.recording.joints()
        table = {}
        for name, (start, unit) in _JOINT_COLUMNS.items():
            for place, axis in enumerate("xyz"):
                table[f"{start}{axis}{unit}"] = columns[name][:, :, place].reshape(-1)
        frame = pd.DataFrame(table)
        frame.insert(0, "k", np.repeat(self._steps["k"], len(names)))
        frame.insert(1, "time_s", np.repeat(self.time, len(names)))
        frame.insert(2, "joint", names * rows)
        return frame

    def to_csv(self, folder: Location, overwrite: bool = False) -> List[Path]:
        """Writes states.csv, contacts.csv, steps.csv, of a scene with joints joints.csv, and of one with
        gears gears.csv, which read back to the same doubles; and run.json, with which the command line verifies and shows them.
        Of a scene written with ``[body]`` this is the run.json of a table more, trajectory.csv, as the command line writes both.

        Where more moved the run than the scene says (wrenches, motors or states set on the way, bodies that came or
        went), the run.json says that (``pushed``): the command line shows such a run and cannot verify it.

        Files of another run in the folder, which its run.json lists, are replaced or removed. Any other file in the way is
        refused, unless ``overwrite`` is true."""
        self._need_contacts("to_csv")
        folder, recording = Path(folder), self.recording
        tables = {f"{name}.csv": table for name, table in zip(_TABLES, recording.tables())}
        of_one = recording.trajectory()
        if of_one is not None:
            tables[_OF_ONE] = of_one
        files: Dict[str, Optional[bytes]] = {**tables, "run.json": recording.run_json(tables)}
        given = {name: content for name, content in files.items() if content is not None}
        with folder_of_a_run(folder, list(given), overwrite):
            return [written(folder / name, content) for name, content in given.items()]

    @classmethod
    def from_csv(cls, scene: Scene, folder: Location) -> "Trajectory":
        """Reads the tables that to_csv or the command line has written of a run of ``scene``, or of a
        part of one; or trajectory.csv, the one table that the command line writes of a run of ``[body]``,
        in its folder or by its own name."""
        scene, folder = made("scene", scene, Scene), Path(folder)
        of_one = folder if folder.is_file() else folder / _OF_ONE
        if of_one.is_file():
            trajectory = cls(scene, Recording.of_trajectory(scene, of_one.read_bytes()))
            if of_one == folder or not (folder / "states.csv").exists():
                return trajectory
        else:
            trajectory = None
        names = _TABLES[: 5 if scene.gears else 4 if scene.joints else 3]
        tables = [(folder / f"{name}.csv").read_bytes() for name in names]
        run = cls(scene, _recording(scene, tables))
        # The tables have more of the same run.
        if trajectory is not None and run.states.tobytes() != trajectory.states.tobytes():
            raise TumbleError(
                f"{folder}: states.csv and {_OF_ONE} are of two runs; {of_one} names the second, "
                "and the first needs a folder of its own"
            )
        return run

    def plot(self, path: Optional[Location] = None, *, sheet: str = "motion", body: Any = 0) -> Any:
        """Plots of a body over time, as SVG: motion and contact forces, or the "energy" sheet.

        ``body`` is an index or a name. With a ``path`` that ends in .svg or .png the plot is
        written there; without, an object comes back that a notebook shows.
        """
        ends = Path(path).suffix if path is not None else ".svg"
        if ends not in (".svg", ".png"):
            raise TumbleError(f"{path}: a name that ends in .svg or .png is needed")
        if sheet == "motion":
            self._need_contacts("the plot of motion")
        svg = self.recording.svg(sheet, self._body(body))
        if path is None:
            return Picture("image/svg+xml", svg.encode())
        return written(Path(path), svg.encode() if ends == ".svg" else Recording.png(svg))

    def gif(
        self,
        path: Optional[Location] = None,
        *,
        speed: float = 1.0,
        size: int = 480,
        camera: Optional[Tuple[float, float]] = None,
        progress: Progress = False,
    ) -> Any:
        """The motion as an animation: ``speed`` times real time, ``size`` pixels wide, seen from
        ``camera`` (azimuth and elevation, degrees; without, from azimuth -32 and the lowest of some elevations, from
        20 on, from which what moves is seen). Written to ``path``, a GIF; without a path, the result is an object that a
        notebook shows."""
        ends = Path(path).suffix if path is not None else ".gif"
        if ends != ".gif":
            raise TumbleError(f"{path}: a name that ends in .gif is needed")
        if not 1e-4 <= real("speed", speed) <= 1e4:
            raise TumbleError(f"speed is {speed}; allowed is 0.0001 to 10000")
        if not 100 <= whole("size", size, 0) <= 2000:
            raise TumbleError(f"size is {size}; allowed is 100 to 2000")
        view: Optional[Tuple[float, float]] = None
        if camera is not None:
            azimuth, elevation = map(float, numbers("camera", camera, (2,)))
            view = (azimuth, elevation)
            if not (abs(azimuth) <= 360.0 and 0.0 <= elevation <= 90.0):
                raise TumbleError(
                    f"camera is {camera}; an azimuth from -360 to 360 and an elevation from 0 to 90 "
                    "degrees are needed"
                )
        content = self.recording.gif(speed, size, view, callback(progress))
        return Picture("image/gif", content) if path is None else written(Path(path), content)

    def page(self, other: Optional["Trajectory"] = None) -> str:
        """The motion as one HTML page that plays it and loads nothing, beside that of ``other``."""
        runs = [self] if other is None else [self, made("other", other, Trajectory)]
        for run in runs:
            run._need_contacts("the page")
        return self.recording.page(None if other is None else other.recording)

    def view(self, path: Optional[Location] = None, other: Optional["Trajectory"] = None) -> Any:
        """The page, written to ``path``, whose name ends in .html, or as an object that a notebook shows."""
        if path is not None and Path(path).suffix not in (".html", ".htm"):
            raise TumbleError(f"{path}: a name that ends in .html is needed")
        page = self.page(other)
        return Page(page) if path is None else written(Path(path), page.encode())

    def _body(self, body: Any) -> int:
        names = self.scene.bodies
        if body in names:
            return names.index(body)
        try:
            return whole("body", body, 0, len(names) - 1)
        except TumbleError:
            raise TumbleError(
                f"body is {body!r}; a name, as {names[0]!r}, or an index from 0 to "
                f"{len(names) - 1} is needed"
            ) from None

    def _need_contacts(self, what: str) -> None:
        if not self.recording.has_contacts:
            raise TumbleError(
                f"{what}: the run was recorded without contacts; contacts=True keeps them, and "
                "forces has their sum on each body"
            )

    def __repr__(self) -> str:
        steps = len(self) - 1
        seconds = steps * self.scene.time_step
        unsolved = len(self.unsolved)
        return (
            f"<tumble.Trajectory of {self.scene.name!r}: {steps} steps, {seconds:.3f} s, "
            f"{unsolved} not solved>"
        )

    def _repr_html_(self) -> Optional[str]:
        return Page(self.page())._repr_html_() if self.recording.has_contacts else None


def contacts_frame(scene: Scene, contacts: Mapping[str, Any]) -> "pd.DataFrame":
    """Columns of contacts as a table with a row each."""
    import pandas as pd

    bodies = scene.bodies
    columns: Dict[str, Any] = {
        "body": [bodies[place] for place in contacts["body"]],
        "partner": contacts["partner"],
    }
    for name, unit in (("point", "_m"), ("normal", ""), ("force", "_N"), ("slip", "_m_s")):
        for place, axis in enumerate("xyz"):
            columns[f"{name}_{axis}{unit}"] = contacts[name][:, place]
    columns["normal_force_N"] = contacts["normal_force"]
    columns["gap_m"] = contacts["gap"]
    return pd.DataFrame(columns)


def _restored(scene: Scene, tables: List[bytes], forces: Any) -> Trajectory:
    return Trajectory(scene, _recording(scene, tables, forces))


def _recording(scene: Scene, tables: List[bytes], forces: Any = None) -> Recording:
    states, contacts, steps, *others = tables
    joints = others[0] if others else None
    gears = others[1] if len(others) > 1 else None
    return Recording.of_tables(scene, states, contacts, steps, joints, gears, forces)


def by_name(
    scene: Scene, columns: Dict[str, "Floats"], steps: Any
) -> Dict[str, Dict[str, "Floats"]]:
    """Columns of all joints, (…, J, 3), as columns of each; what is of steps has those of ``steps``."""
    import numpy as np

    places = np.concatenate([columns["place"], columns["angles"]], axis=-1)
    rates = np.concatenate([columns["velocity"], columns["spin"]], axis=-1)
    places.flags.writeable = rates.flags.writeable = False
    joints = {}
    for number, (name, axes) in enumerate(zip(scene.joints, scene.joint_axes)):
        one: Any = axes[0] if len(axes) == 1 else axes
        of_steps = {"speed": rates[..., number, one]}
        names = ("velocity", "spin", "force", "torque")
        of_steps.update({column: columns[column][..., number, :] for column in names})
        joints[name] = {
            "coordinate": places[..., number, one],
            "place": columns["place"][..., number, :],
            "angles": columns["angles"][..., number, :],
            **{column: numbers[steps] for column, numbers in of_steps.items()},
        }
    return joints


class Page:
    """A page for the browser, as text in ``html``."""

    def __init__(self, text: str) -> None:
        self.html = text

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="640" '
            'style="border: 0"></iframe>'
        )


class Picture:
    """A picture: its ``data``, and what kind it is, ``media_type``."""

    def __init__(self, media_type: str, data: bytes) -> None:
        self.media_type = media_type
        self.data = data

    def _repr_mimebundle_(self, **_: Any) -> Dict[str, str]:
        if self.media_type == "image/svg+xml":
            return {self.media_type: self.data.decode()}
        return {self.media_type: base64.b64encode(self.data).decode()}
