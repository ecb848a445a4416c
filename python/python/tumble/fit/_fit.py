"""Search for the values with the least loss, and their uncertainty."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.stats import qmc

from .._checks import made, real, whole
from .._scene import Scene
from .._tumble import TumbleError
from .._types import Floats, Location
from ._recordings import Recording
from ._simulations import REFUSED, Errors, Parameter, Simulations, parameter

_SAME = 1e-5  # Recordings whose heights differ by less, m, are one recording, moved or turned about the vertical.
_SAMPLES = 1000  # Samples of the bootstrap.


class Fold(NamedTuple):
    """Fit without the recordings ``kept``, and the errors on these."""

    kept: list[int]
    values: dict[str, float]
    errors: Errors
    errors_at_start: Errors


@dataclass(frozen=True)
class Fit:
    """Parameter ``values`` with the least loss, and the errors on all recordings.

    ``progress`` is the least loss at the start, after each generation of the search, and
    after the polish. ``intervals`` has a 95 % bootstrap interval of each parameter. A
    bootstrap sample takes the best of all evaluated values on resampled recordings.
    """

    values: dict[str, float]
    errors: Errors
    errors_at_start: Errors
    progress: list[float]
    intervals: dict[str, tuple[float, float]]
    folds: list[Fold]
    _simulations: Simulations = field(repr=False)

    @property
    def constants(self) -> dict[str, Floats]:
        """Constants with the fitted values, in the form of ``rollout(parameters=...)``."""
        return self._simulations.constants(self._simulations.vector(self.values)[None])

    def __str__(self) -> str:
        errors = self.errors
        lines = [f"loss {self.errors_at_start.loss.mean():.6g} at the start, {errors.loss.mean():.6g} found"]
        lines.append(f"position and rotation {_means(errors)}, {(errors.end > 45).sum()} end beyond 45°")
        lines.append(f"{errors.failed} steps failed, the largest residual is {errors.residual:.1e} m/s")
        for name, value in self.values.items():
            interval = self.intervals.get(name)
            lines.append(f"{name} {value:.6g}" + (f", {interval[0]:.4g} to {interval[1]:.4g}" if interval else ""))
        for fold in self.folds:
            found = ", ".join(f"{name} {value:.4g}" for name, value in fold.values.items())
            scores = f"{_means(fold.errors)}, at the start {_means(fold.errors_at_start)}"
            lines.append(f"{len(fold.kept)} kept back: {scores}; {found}")
        return "\n".join(lines)

    def plot(self, path: Location) -> None:
        """Writes a figure of the errors and the search progress.

        It also has the heights in six recordings from best to worst.
        """
        from matplotlib.figure import Figure

        figure = Figure(figsize=(14, 7), layout="constrained")
        scatter, progress, *others = figure.subplots(2, 4).flat
        for name, errors in (("start", self.errors_at_start), ("found", self.errors)):
            scatter.plot(100 * errors.position, errors.rotation, ".", label=name)
        scatter.set(xlabel="position, % of the side", ylabel="rotation, °", title="errors of the recordings")
        scatter.legend()
        progress.plot(self.progress)
        progress.set(xlabel="generation", title="least loss")
        order, simulations = np.argsort(self.errors.loss), self._simulations
        for axes, share in zip(others, np.linspace(0, 1, 6)):
            place = int(order[round(share * (len(order) - 1))])
            recording, (first, _) = simulations.recordings[place], simulations.starts[place]
            times = np.arange(len(recording.states)) / recording.rate
            axes.plot(times, recording.states[..., 2], color="black", linewidth=0.8)
            for _, states, _ in simulations.run(simulations.vector(self.values)[None], [place]):
                axes.plot(times[first:], states[0, 0, ..., 2], linestyle="--")
            axes.set(xlabel="time, s", ylabel="height, m", title=f"{recording.name}: {self.errors.loss[place]:.3g}")
        figure.savefig(path)


def _means(errors: Errors) -> str:
    return f"{100 * errors.position.mean():.2f} %, {errors.rotation.mean():.2f}°"


def fit(
    scene: Scene,
    recordings: Iterable[Recording],
    parameters: Iterable[str] = ("friction", "restitution"),
    *,
    values: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    begin: str | None = None,
    substeps: int = 10,
    loss: str = "robust",
    evaluations: int = 240,
    polish: int = 30,
    folds: int = 0,
    seed: int = 1,
    threads: int | None = None,
) -> Fit:
    """Constants of a scene with which its simulations are nearest to recordings.

    The search is differential evolution over the bounds, then L-BFGS with the exact derivatives of
    all steps. The result does not depend on the number of threads.

    :param parameters: names of constants in ``rollout``, ``friction``, or of one number,
        ``mass:bob``.
    :param values: initial values of the search, and values of other constants, by the same names.
    :param bounds: lowest and highest values. Defaults exist, except for single numbers that may be
        negative.
    :param begin: "touch" starts a toss shortly before the body may touch the ground, "first" at the
        first frame. The default is "touch" for one body without joints and fixed pieces.
    :param substeps: simulation steps per frame.
    :param loss: "robust" for chaotic motions, "mean" for the mean error, "squares" for least
        squares.
    :param evaluations: simulations of all recordings in the search.
    :param polish: largest number of evaluations with derivatives after it.
    :param folds: number of parts of the recordings for cross-validation. Each part is held out
        once, with a fit to the others.
    """
    made("scene", scene, Scene)
    listed = [made("a recording", recording, Recording) for recording in recordings]
    if isinstance(parameters, str):
        raise TypeError(f"parameters is the string {parameters!r}; a list of names is needed")
    sought, given, limits = list(parameters), dict(values or {}), dict(bounds or {})
    is_toss = len(scene.bodies) == 1 and not scene.joints and not scene.fixed
    begin = begin or ("touch" if is_toss else "first")
    unknown = [name for name in limits if name not in sought]
    for wrong, why in (
        (not listed, "recordings is empty; one or more are needed"),
        (loss not in ("robust", "mean", "squares"), f"loss is {loss!r}; 'robust', 'mean' or 'squares' is needed"),
        (begin not in ("touch", "first"), f"begin is {begin!r}; 'touch' or 'first' is needed"),
        (begin == "touch" and not is_toss, "begin is 'touch' without a single free body; 'first' is needed"),
        (len(set(sought)) < len(sought), f"parameters has one of {', '.join(sought)} twice; list each once"),
        (unknown, f"bounds has {', '.join(unknown)}, which parameters does not have; leave it out"),
    ):
        if wrong:
            raise TumbleError(why)
    every = [parameter(name, scene) for name in dict.fromkeys([*sought, *given])]
    simulations = Simulations(scene, listed, every, begin, whole("substeps", substeps, 1, 1000), loss, threads)
    start = simulations.vector({name: real(f"values[{name!r}]", value) for name, value in given.items()})
    box = [_bounds(of, at, limits) for of, at in zip(every[: len(sought)], start)]
    evaluations, polish, seed = whole("evaluations", evaluations, 0), whole("polish", polish, 0), whole("seed", seed, 0)
    search = _Search(simulations, start, np.array(box).reshape(-1, 2), evaluations, polish, seed)
    parts = _parts(listed, whole("folds", folds, 0), seed)
    all_places = list(range(len(listed)))
    (at_start,) = simulations.errors(start[None], all_places)
    found, progress, tried = search.run(all_places, at_start.loss)
    errors = at_start if found is start else simulations.errors(found[None], all_places)[0]
    names = [of.name for of in every]
    kept = []
    for part in parts:
        others = sorted(set(all_places) - set(part))
        own, _, _ = search.run(others, at_start.loss[others])
        kept.append(Fold(part, dict(zip(names, own.tolist())), *simulations.errors(np.stack([own, start]), part)))
    return Fit(dict(zip(names, found.tolist())), errors, at_start, progress, _bootstrap(sought, tried, seed), kept, simulations)


def _bounds(of: Parameter, start: float, given: dict[str, tuple[float, float]]) -> list[float]:
    if of.name not in given and of.bounds is None:
        raise TumbleError(f"{of.name} is {of.own:.6g} in the scene; bounds are needed for it")
    pair = [real(f"bounds[{of.name!r}]", bound) for bound in given.get(of.name, of.bounds) or ()]
    if len(pair) != 2 or not pair[0] <= start <= pair[1] or pair[0] == pair[1]:
        raise TumbleError(f"{of.name} starts at {start:.6g}; a value within its bounds, {pair}, is needed")
    return pair


def _parts(recordings: list[Recording], folds: int, seed: int) -> list[list[int]]:
    """Random parts of the recordings. Copies of one recording stay in one part."""
    different: list[list[int]] = []
    for place, recording in enumerate(recordings):
        for known in different:
            off = [of.states[..., 2] for of in (recording, recordings[known[0]])]
            if off[0].shape == off[1].shape and np.abs(off[0] - off[1]).max() <= _SAME:
                known.append(place)
                break
        else:
            different.append([place])
    if folds == 1 or len(different) < 2 * folds:
        raise TumbleError(f"folds is {folds} with {len(different)} different recordings; at least 2 folds with at least 2 recordings each are needed")
    order = np.random.default_rng(seed).permutation(len(different))
    return [sorted(place for k in order[fold::folds] for place in different[k]) for fold in range(folds)]


Tried = list[tuple[Floats, Floats]]  # Values (P,), and the loss of each recording with them, (R,).


def _bootstrap(sought: list[str], tried: Tried, seed: int) -> dict[str, tuple[float, float]]:
    losses = np.array([losses for _, losses in tried])
    count = losses.shape[1]
    drawn = np.random.default_rng([seed, 1]).multinomial(count, np.full(count, 1 / count), _SAMPLES)
    best = np.array([values for values, _ in tried])[(losses @ drawn.T).argmin(axis=0)]
    ends = np.quantile(best[:, : len(sought)], [0.025, 0.975], axis=0).T
    return {name: (float(low), float(high)) for name, (low, high) in zip(sought, ends)}


class _Search(NamedTuple):
    """Search from ``start``, with the first values varied within the bounds ``box`` (S, 2)."""

    simulations: Simulations
    start: Floats
    box: Floats
    evaluations: int
    polish: int
    seed: int

    def values(self, unit: Floats) -> Floats:
        """Values (V, P) at points (V, S) of the unit cube."""
        values = np.repeat(self.start[None], len(unit), axis=0)
        low, high = self.box.T
        values[:, : len(low)] = np.clip(low + unit * (high - low), low, high)
        return values

    def run(self, places: list[int], at_start: Floats) -> tuple[Floats, list[float], Tried]:
        """Values with the least loss on some recordings, progress, and all evaluations.

        ``at_start`` are the losses at the start.
        """
        count, width, simulations = len(self.box), np.ptp(self.box, axis=1), self.simulations
        tried, progress, size = [(self.start, at_start)], [float(at_start.mean())], 4 + 4 * count

        def losses(points: Floats) -> Floats:
            values = self.values(points.T)
            found = simulations.losses_or_worst(values, places)
            tried.extend(zip(values, found))
            progress.append(min(progress[-1], float(found.mean(axis=1).min())))
            return np.asarray(found.mean(axis=1))

        def with_slopes(point: Floats) -> tuple[float, Floats]:
            value = self.values(point[None])[0]
            try:
                found, slopes = simulations.gradient(value, places)
            except TumbleError:
                return REFUSED, np.zeros(count)
            tried.append((value, found))
            return float(found.mean()), slopes[:count] * width

        best = (self.start[:count] - self.box[:, 0]) / width
        if count and self.evaluations >= 2 * size:
            population = qmc.LatinHypercube(count, rng=self.seed).random(size)
            population[0] = best
            best = differential_evolution(
                losses, [(0.0, 1.0)] * count, init=population, maxiter=self.evaluations // size - 1, tol=1e-3,
                mutation=(0.3, 0.8), recombination=0.9, polish=False, vectorized=True, updating="deferred", rng=self.seed,
            ).x
        if count and self.polish:
            options = {"maxfun": self.polish, "maxiter": self.polish, "ftol": 0.0, "gtol": 0.0}
            minimize(with_slopes, best, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * count, options=options)
        values, found = min(tried, key=lambda of: float(of[1].mean()))
        return values, [*progress, float(found.mean())], tried
