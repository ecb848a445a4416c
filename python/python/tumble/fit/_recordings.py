"""Recorded motions: reading and checks."""

from __future__ import annotations

import gzip
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import numbers
from .._checks import made, real
from .._scene import Scene
from .._trajectory import STATE_COLUMNS
from .._tumble import TumbleError
from .._types import Floats, Location

_LEAST_FRAMES = 5
# Largest deviation of a quaternion's length from 1. Files in single precision or with few digits pass.
_UNIT = 1e-3
# Largest deviation of a frame's time from equal spacing, in intervals between frames.
_LATE = 0.01
# Relative deviation of a recorded velocity from the differences of the poses that is a contradiction.
# Filtered recordings deviate by hundredths, frames with impacts by about 1.
_APART = 0.5
# Speeds (m/s, rad/s) below which velocities are not compared with the poses.
_SLOW, _SLOW_SPIN = 0.05, 0.5
# Columns of a tensor in the order of a state: position, quaternion, velocity, spin.
# The tensor itself has the order quaternion, position, spin, velocity.
_TENSOR_COLUMNS = [4, 5, 6, 0, 1, 2, 3, 10, 11, 12, 7, 8, 9]
# Endings of the files that are read.
_KINDS = (".csv", ".csv.gz", ".pt")


@dataclass(frozen=True)
class Recording:
    """Recorded motion of N bodies.

    ``states`` (F, N, 13) have F frames with the columns of Trajectory.states. The first frame is at
    the time ``begin`` (s), and ``rate`` is the number of frames per second. Raises TumbleError for fewer than 5 frames, numbers that
    are not finite, quaternions whose length is not 1, and velocities that contradict the
    poses.
    """

    name: str
    rate: float
    states: Floats
    begin: float = 0.0

    def __post_init__(self) -> None:
        def refused(why: str) -> TumbleError:
            return TumbleError(f"recording {self.name}: {why}")

        states = numbers(f"recording {self.name}: states", self.states, ("F", "N", 13), ("F", 13))
        states = states.reshape(len(states), -1, 13).copy()
        if len(states) < _LEAST_FRAMES:
            raise refused(f"it has {len(states)} frames; {_LEAST_FRAMES} or more are needed")
        if not 1 <= real("rate", self.rate) <= 1e5:
            raise refused(f"its rate is {self.rate} frames per second; allowed: 1 to 100000")
        lengths = np.linalg.norm(states[..., 3:7], axis=-1)
        off = np.abs(lengths - 1)
        if off.max() > _UNIT:
            frame, length = off.max(axis=1).argmax(), lengths.flat[off.argmax()]
            raise refused(f"a quaternion in frame {frame} has length {length:.4f}; 1 is needed")
        states[..., 3:7] /= lengths[..., None]
        turns = turn_between(states[:-1, :, 3:7], states[1:, :, 3:7])
        shifts = np.diff(states[..., :3], axis=0)
        if _contradicts(states[1:, :, 7:10], shifts * self.rate, _SLOW):
            raise refused("its velocities do not match its positions; m, m/s and the right rate are needed")
        if _contradicts(states[1:, :, 10:], turns * self.rate, _SLOW_SPIN):
            needed = "rad/s in the body's frame and quaternions w, x, y, z from body to world are needed"
            raise refused(f"its spins do not match its attitudes; {needed}")
        states.setflags(write=False)
        object.__setattr__(self, "states", states)


def turn_between(first: Floats, second: Floats) -> Floats:
    """Rotation vectors (..., 3) of the shortest rotations from attitudes ``first`` to ``second``.

    Both are unit quaternions w, x, y, z (..., 4). The vectors are in rad, in the frame of ``first``.
    """
    # Product conj(first) second = (scalar, vector) = (cos θ/2, sin θ/2 · axis).
    (a, u), (b, v) = ((of[..., :1], of[..., 1:]) for of in (first, second))
    scalar = a * b + (u * v).sum(axis=-1, keepdims=True)
    vector = np.where(scalar < 0, -1.0, 1.0) * (a * v - b * u - np.cross(u, v))
    sine = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.asarray(vector * np.where(sine > 0, 2 * np.arctan2(sine, np.abs(scalar)) / np.where(sine > 0, sine, 1.0), 2.0))


def _contradicts(recorded: Floats, expected: Floats, slow: float) -> bool:
    """True if three quarters of the velocities (F, N, 3) of a body contradict the expected ones.

    Frames in which both are below ``slow`` are ignored. At least 3 others are needed.
    """
    found, sizes = np.linalg.norm(recorded, axis=-1), np.linalg.norm(expected, axis=-1)
    off = np.linalg.norm(recorded - expected, axis=-1) / np.maximum(sizes, slow)
    fast = np.maximum(found, sizes) > slow
    bodies = range(off.shape[1])
    return any(fast[:, k].sum() >= 3 and np.quantile(off[fast[:, k], k], 0.25) > _APART for k in bodies)


def read(path: Location, scene: Scene, *, rate: float = 148.0) -> list[Recording]:
    """Reads the recordings of a scene's bodies from a file, or from all such files of a folder.

    A table (``.csv``, ``.csv.gz``) has a column ``time_s`` and the columns of
    ``tumble.STATE_COLUMNS``. It also has ``body``, names or indices, for several bodies, and
    ``toss_id`` for several recordings. Other columns are ignored. A tensor (``.pt``), read by
    torch, has T × 13 numbers of one body: quaternion, position, spin (body), velocity
    (world). ``rate`` is the frame rate (1/s) of tensors; a table has its own times. Raises TumbleError for a file that is not a
    recording.
    """
    made("scene", scene, Scene)
    folder = Path(path)
    files = sorted(folder.iterdir()) if folder.is_dir() else [folder]
    files = [file for file in files if file.name.endswith(_KINDS)]
    if not files:
        raise TumbleError(f"{path}: there is no recording; a file {', '.join(_KINDS)} is needed")
    found: dict[str, Recording] = {}
    for file in files:
        for recording in _read(file, scene, rate):
            if recording.name in found:
                raise TumbleError(f"{file}: recording {recording.name} is also in another file; leave one of them out")
            found[recording.name] = recording
    return list(found.values())


def _read(file: Path, scene: Scene, rate: float) -> list[Recording]:
    stem = file.name.split(".", 1)[0]
    try:
        if file.suffix == ".pt":
            return [Recording(stem, rate, _tensor(file)[:, _TENSOR_COLUMNS])]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # An empty table is refused below.
            table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")
        return _of_table(np.atleast_1d(table), scene.bodies, stem)
    except (ValueError, EOFError, gzip.BadGzipFile) as error:
        raise TumbleError(f"{file}: {' '.join(str(error).split())}") from None


# Reads a tensor (T, 13) of one body, with the columns in the order of the file.
def _tensor(file: Path) -> Floats:
    try:
        import torch
    except ImportError:
        raise TumbleError("tensors need torch, which is not installed; install torch or use a table") from None
    try:
        tensor = torch.load(file, weights_only=True).double().numpy()
    except Exception as error:
        raise TumbleError(f"torch cannot read a tensor from it: {str(error).splitlines()[0]}") from None
    return numbers("the tensor", tensor, ("T", 13))


def _of_table(table: Any, bodies: list[str], name: str) -> list[Recording]:
    """Splits a table into recordings at changes of ``toss_id``. Without ids it is one, ``name``."""
    needed = ["time_s", *(["body"] if len(bodies) > 1 else []), *STATE_COLUMNS]
    missing = [column for column in needed if column not in (table.dtype.names or ())]
    if missing:
        raise TumbleError(f"the table has no column {missing[0]}; {', '.join(needed)} are needed, in SI units")
    if not len(table):
        raise TumbleError("the table has no rows")
    ids = table["toss_id"].astype(str) if "toss_id" in table.dtype.names else np.full(len(table), name)
    groups = np.split(np.arange(len(table)), np.nonzero(ids[1:] != ids[:-1])[0] + 1)
    if len(groups) > len(set(ids)):
        raise TumbleError("the rows of a recording are not contiguous; sort them by toss_id")
    return [_of_rows(str(ids[rows[0]]), table[rows], bodies) for rows in groups]


# Recording of the rows of a table: one row per body and frame, frame after frame.
def _of_rows(name: str, table: Any, bodies: list[str]) -> Recording:
    def refused(why: str) -> TumbleError:
        return TumbleError(f"recording {name}: {why}")

    count = len(bodies)
    if len(table) % count or len(table) < _LEAST_FRAMES * count:
        raise refused(f"it has {len(table)} rows; {_LEAST_FRAMES} frames or more of {count} bodies are needed")
    frames = np.stack([table[column] for column in ("time_s", *STATE_COLUMNS)], axis=-1)
    if frames.dtype.kind not in "fi":
        raise refused("a field of its table is not a number; numbers are needed")
    frames = frames.reshape(-1, count, 14)
    if count > 1:
        known = {**{str(place): place for place in range(count)}, **{body: place for place, body in enumerate(bodies)}}
        order = np.array([known.get(str(of).strip(), -1) for of in table["body"]]).reshape(-1, count)
        wrong = np.nonzero((np.sort(order, axis=1) != np.arange(count)).any(axis=1))[0]
        if len(wrong):
            raise refused(f"frame {wrong[0]} does not have each of {', '.join(bodies)} once; one row of each is needed")
        frames = np.take_along_axis(frames, np.argsort(order, axis=1)[..., None], axis=1)
    times = frames[..., 0]
    rate = (len(times) - 1) / max(times[-1, 0] - times[0, 0], 1e-300)
    late = np.abs(times - times[0, 0] - np.arange(len(times))[:, None] / rate).max(axis=1) * rate
    if not late.max() <= _LATE:
        frame = int(np.argmin(late <= _LATE))
        raise refused(f"frame {frame} is at time_s = {times[frame, 0]}; equal intervals are needed")
    # Removes rounding errors of the file: 148 frames per second, not 148.00003.
    rate = float(round(rate)) if abs(rate - round(rate)) < 1e-4 * rate else float(rate)
    return Recording(name, rate, frames[..., 1:], float(times[0, 0]))
