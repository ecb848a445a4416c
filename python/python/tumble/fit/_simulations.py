"""Parameters of a scene, and simulations of recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._rollout import Rollouts, rollout
from .._scene import Scene
from .._tumble import PARAMETERS, TumbleError, constant_numbers, parameter_shape
from .._types import Floats
from ._recordings import Recording, turn_between

# Scales of both errors, in longest sides and rad: accuracy of good engines on the recorded cube.
_DISTANCE, _ANGLE = 0.13, np.radians(17.0)
_BEND = 6.0  # Error at which the robust loss is half of the error.
_LEAD = 3  # Frames between the start of a toss and the first frame in which the body may touch the ground.
_LEAST_REFIT = 4  # Frames before the start that a refit of its velocities needs.
REFUSED = 1e9  # Loss of values that cannot be simulated.
_BATCH = 32  # Most recordings in a batch, which bounds its memory.
# Constants whose single numbers may have either sign.
_OFFSETS = "joint_rest joint_force joint_limits motor_target anchor gear_ratio gear_offset inertia".split()


class Errors(NamedTuple):
    """Deviations of simulations from R recordings.

    ``position`` (in longest sides of a body) and ``rotation`` (degrees) are means over frames
    and bodies. ``end`` is the largest angle at the end. These and the ``loss`` are (R,).
    ``failed`` is the number of failed steps, and ``residual`` the largest residual of a step,
    m/s.
    """

    position: Floats
    rotation: Floats
    end: Floats
    loss: Floats
    failed: int
    residual: float


class Parameter(NamedTuple):
    """Scalar that varies a constant of a scene.

    ``slope`` is the derivative of the constant's numbers, and ``own`` the scene's value.
    """

    name: str
    constant: str
    slope: Floats
    own: float
    bounds: tuple[float, float] | None


def parameter(name: str, scene: Scene) -> Parameter:
    """Parameter with a name such as ``friction`` or ``joint_damping:elbow``."""
    constant, _, owner = (part.strip() for part in name.partition(":"))
    if constant not in PARAMETERS or constant == "time_step":
        known = ", ".join(known for known in PARAMETERS if known != "time_step")
        raise TumbleError(f"{name!r} is not a parameter; use {known}")
    found = constant_numbers(constant, scene._core)
    own, names = np.array(found["own"]), found["names"]
    if len(own) == 0:
        raise TumbleError(f"{name}: the scene has no {constant} to fit; leave it out")
    if owner:
        if names.count(owner) != 1:
            raise TumbleError(f"{name}: one of {'; '.join(dict.fromkeys(names))} is needed after the colon")
        value = float(own[names.index(owner)])
        bounds = (value / 3, 3 * value) if value > 0 and constant not in _OFFSETS else None
        return Parameter(name, constant, np.array([float(known == owner) for known in names]), value, bounds)
    value, least = float(found["whole"]), float(scene.extents[0].min())
    usual = {"friction": (0.02, 1.0), "restitution": (0.0, 0.6), "size": (0.9, 1.1), "radius": (0.0, 0.3 * least)}
    usual.update(gravity=(0.9 * value, 1.1 * value), ground=(-0.1 * least, 0.1 * least))
    slope = np.array(found["at_one"]) - np.array(found["at_zero"])
    return Parameter(name, constant, slope, value, usual.get(constant, (0.5, 2.0)))


class Simulations:
    """Simulations of recordings with values of parameters."""

    def __init__(
        self, scene: Scene, recordings: list[Recording], parameters: list[Parameter], begin: str, substeps: int,
        loss: str, threads: int | None,
    ) -> None:
        self.scene, self.recordings, self.parameters = scene, recordings, parameters
        self.substeps, self.loss, self.threads = substeps, loss, threads
        self.length = 2 * float(scene.extents.max()) or 1.0
        self.base: dict[str, Floats] = {}
        for name in dict.fromkeys(parameter.constant for parameter in parameters):
            varied = np.array([parameter.slope != 0 for parameter in parameters if parameter.constant == name])
            if (varied.sum(axis=0) > 1).any():
                raise TumbleError(f"{name} is given as a whole and by one of its numbers; give only one of them")
            self.base[name] = np.where(varied.any(axis=0), 0.0, constant_numbers(name, scene._core)["own"])
        self.starts: list[tuple[int, Floats]] = []
        scenes: dict[tuple[float, int], Scene] = {}
        groups: dict[tuple[float, int], list[int]] = {}
        text, path, settings = scene._source
        for place, recording in enumerate(recordings):
            bodies = recording.states.shape[1]
            if bodies != len(scene.bodies):
                raise TumbleError(f"recording {recording.name} has {bodies} bodies; {len(scene.bodies)} are needed")
            index = 0 if begin == "touch" else round(recording.begin * recording.rate * substeps)
            key = (recording.rate, index)
            if key not in scenes:
                timed = {"time_step": 1.0 / (recording.rate * substeps), "start_index": index}
                scenes[key] = Scene.from_text(text, path, **{**settings, **timed})
            groups.setdefault(key, []).append(place)
            self.starts.append(_at_touch(recording, scene) if begin == "touch" else (0, _first(recording, scenes[key])))
        # A batch is as long as its longest recording, so recordings are batched by length.
        self.batches: list[tuple[Scene, list[int]]] = []
        for key, places in groups.items():
            places.sort(key=self.frames)
            self.batches += [(scenes[key], places[first : first + _BATCH]) for first in range(0, len(places), _BATCH)]

    def frames(self, place: int) -> int:
        """Frames of a recording after its start."""
        return len(self.recordings[place].states) - 1 - self.starts[place][0]

    def vector(self, values: Mapping[str, float]) -> Floats:
        """Values in the order of the parameters, with the scene's as defaults."""
        return np.array([values.get(of.name, of.own) for of in self.parameters], dtype=float)

    def constants(self, values: Floats) -> dict[str, Floats]:
        """Numbers of constants with V sets of ``values``, (V, P)."""
        found = {name: np.repeat(base[None], len(values), axis=0) for name, base in self.base.items()}
        for place, of in enumerate(self.parameters):
            found[of.constant] += values[:, place, None] * of.slope
        shapes = {name: parameter_shape(name, self.scene._core) for name in found}
        return {name: array.reshape(len(values), *shapes[name]) for name, array in found.items()}

    def run(self, values: Floats, chosen: Sequence[int], by: Any = None) -> Iterator[tuple[list[int], Floats, Rollouts]]:
        """Batches of simulations with V sets of ``values``.

        Yields the recordings, the states at frames (V, R, F, N, 13) from the start on, and
        the rollouts. ``by`` computes cotangents from recordings and such states.
        """
        wanted, every = set(chosen), slice(self.substeps - 1, None, self.substeps)
        for scene, batch in self.batches:
            places = [place for place in batch if place in wanted]
            if not places:
                continue
            starts = np.tile(np.stack([self.starts[place][1] for place in places]), (len(values), 1, 1))

            def frames(states: Floats) -> Any:
                found = np.concatenate([starts[:, None], states[:, every]], axis=1)
                return found.reshape(len(values), len(places), *found.shape[1:])

            def duals(states: Floats) -> Floats:
                made = np.zeros((*states.shape[:3], 12))
                made[:, every, :, :6] = by(places, frames(states))
                return made

            constants = {name: np.repeat(of, len(places), axis=0) for name, of in self.constants(values).items()}
            how: Any = {"steps": self.substeps * max(map(self.frames, places)), "parameters": constants}
            done = rollout(scene, starts, threads=self.threads, gradients=by and duals, **how)
            yield places, frames(done.states), done

    def deviations(self, places: Sequence[int], states: Floats) -> tuple[Floats, Floats, Floats]:
        """Scaled position and rotation errors (V, R, F, N, 3), and weights (R, F, N) of frames."""
        recorded, weights = np.zeros(states.shape[1:]), np.zeros(states.shape[1:4])
        for row, place in enumerate(places):
            rest = self.recordings[place].states[self.starts[place][0] :]
            recorded[row], recorded[row, : len(rest)] = rest[-1], rest
            weights[row, : len(rest)] = 1 / rest[..., 0].size
        shifts = (states[..., :3] - recorded[..., :3]) / (_DISTANCE * self.length)
        turns = turn_between(np.broadcast_to(recorded, states.shape)[..., 3:7], states[..., 3:7])
        return shifts, turns / _ANGLE, weights

    def losses(self, shifts: Floats, turns: Floats, weights: Floats) -> Floats:
        """Loss of each recording, (V, R)."""
        if self.loss == "squares":
            return _mean((shifts**2 + turns**2).sum(axis=-1), weights)
        error = _mean(_norm(shifts) + _norm(turns), weights)
        return error / (1 + error / _BEND) if self.loss == "robust" else error

    def errors(self, values: Floats, chosen: Sequence[int]) -> list[Errors]:
        """Errors of the chosen recordings, in their order, with each of V sets of ``values``."""
        row = {place: k for k, place in enumerate(chosen)}
        table = np.zeros((4, len(values), len(chosen)))
        failed, residual = np.zeros((2, len(values)))
        for places, states, done in self.run(values, chosen):
            shifts, turns, weights = self.deviations(places, states)
            lengths = np.array([self.frames(place) for place in places])
            angles = np.degrees(_norm(turns) * _ANGLE)
            ends = angles[:, np.arange(len(places)), lengths].max(axis=-1)
            means = [_DISTANCE * _mean(_norm(shifts), weights), _mean(angles, weights)]
            table[:, :, [row[place] for place in places]] = [*means, ends, self.losses(shifts, turns, weights)]
            residual = np.maximum(residual, done.residuals.reshape(len(values), -1).max(axis=1))
            np.add.at(failed, [step.rollout // len(places) for step in done.unsolved], 1)
        return [Errors._make(of) for of in zip(*table, failed.astype(int).tolist(), residual.tolist())]

    def losses_or_worst(self, values: Floats, chosen: Sequence[int]) -> Floats:
        """Losses (V, R) with each of V sets of ``values``; large ones for refused values."""
        try:
            return np.array([errors.loss for errors in self.errors(values, chosen)])
        except TumbleError:
            if len(values) == 1:
                return np.full((1, len(chosen)), REFUSED)
            return np.asarray(np.concatenate([self.losses_or_worst(one[None], chosen) for one in values]))

    def gradient(self, value: Floats, chosen: Sequence[int]) -> tuple[Floats, Floats]:
        """Losses (R,) with one set of values, and the derivatives (P,) of their mean."""
        found, slopes, row = np.zeros(len(chosen)), np.zeros(len(value)), {place: k for k, place in enumerate(chosen)}

        def cotangents(places: list[int], states: Floats) -> Any:
            shifts, turns, weights = self.deviations(places, states)
            losses = self.losses(shifts, turns, weights)
            found[[row[place] for place in places]] = losses[0]
            by_shifts, by_turns, share = 2 * shifts, 2 * turns, np.ones_like(losses)
            if self.loss != "squares":
                by_shifts, by_turns = (of / np.maximum(_norm(of), 1e-300)[..., None] for of in (shifts, turns))
            if self.loss == "robust":
                # Derivative of e/(1 + e/b) with respect to e.
                share = (1 - losses / _BEND) ** 2
            factor = (share[..., None, None] * weights)[..., None]
            # A rotation vector is an eigenvector of its derivative by a further rotation,
            # eigenvalue 1.
            both = [factor * by_shifts / (_DISTANCE * self.length), factor * by_turns / _ANGLE]
            return np.concatenate(both, axis=-1)[0, :, 1:]

        for _, _, done in self.run(value[None], chosen, cotangents):
            assert done.gradients is not None
            for place, of in enumerate(self.parameters):
                # Derivatives with respect to a size are relative to the body's current size.
                scale = 1 / value[place] if of.constant == "size" else 1.0
                slopes[place] += scale * (done.gradients[of.constant].sum(axis=0).ravel() @ of.slope)
        return found, np.asarray(slopes / len(chosen))


def _norm(vectors: Floats) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _mean(of: Floats, weights: Floats) -> Floats:
    """Means over frames and bodies, (V, R)."""
    return np.asarray((of * weights).sum(axis=(-2, -1)))


def _at_touch(recording: Recording, scene: Scene) -> tuple[int, Floats]:
    """Start frame and state (1, 13) of a toss: the protocol of docs/reality.md."""
    extents, gravity = scene.extents[0], float(np.linalg.norm(scene.gravity))
    states, reach = recording.states[:, 0], float(np.linalg.norm(extents))
    heights = states[:, 2]
    if not 0.5 * extents.min() < heights.min() <= reach:
        raise TumbleError(
            f"recording {recording.name}: the lowest height of the centre is {heights.min():.4g} m; allowed: {extents.min():.4g} to "
            f"{reach:.4g} m, with z upwards and the ground at z = 0"
        )
    i = min(max(int(np.argmax(heights <= reach)) - _LEAD, 0), len(states) - 2)
    start = states[i].copy()
    if i >= _LEAST_REFIT:
        times = np.arange(i) / recording.rate
        start[10:] = turn_between(states[0, 3:7], states[i, 3:7]) * recording.rate / i
        start[7:9] = (states[i - 1, :2] - states[0, :2]) / times[-1]
        falling = np.polynomial.polynomial.polyfit(times, heights[:i] + 0.5 * gravity * times**2, 1)[1]
        start[9] = falling - gravity * times[-1]
    return i, start[None]


def _first(recording: Recording, scene: Scene) -> Floats:
    """First frame, or the nearest states with closed joints if a camera recorded them open."""
    first: Floats = recording.states[0].copy()
    try:
        scene.simulate(first)
        return first
    except TumbleError:
        return np.asarray(scene._core.assembled(first))
