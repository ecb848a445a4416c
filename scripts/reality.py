"""Fits and scores the recorded tosses of docs/reality.md: see scripts/reality."""

import sys
import time
from pathlib import Path

import numpy as np
import tumble.fit

START = {"restitution": 0.1, "radius": 0.003}
BOUNDS = {
    "friction": (0.1, 0.3),
    "restitution": (0.0, 0.4),
    "inertia": (0.7, 1.7),
    "size": (0.94, 1.04),
    "radius": (0.0, 0.008),
}
SEARCH = 4
"""Most substeps of a search. What it finds is scored with ten."""
BEST = {"friction": 0.178, "restitution": 0.18, "inertia": 1.27, "radius": 0.0032}


def smoothed(scene, recordings, found, sought, count=40, substeps=10):
    """Smoothed mean errors at the values of a fit, and the scatter. A quadratic surface is fitted
    through ``count`` neighbours.

    Neighbours are drawn within a sixth of the bounds to both sides, and within a tenth of the value
    for the friction."""
    centre = np.array([found.values[name] for name in sought])
    low, high = np.array([BOUNDS[name] for name in sought]).T
    reach = (high - low) / 6
    reach[0] = min(reach[0], 0.1 * centre[0])
    places = np.random.default_rng(2).uniform(-1, 1, (count, len(sought)))
    points = np.clip(centre + reach * places, low, high)
    errors = []
    for point in points:
        values = {**found.values, **dict(zip(sought, point.tolist()))}
        errors.append(tumble.fit.fit(scene, recordings, [], values=values, substeps=substeps).errors)
    at = (points - centre) / reach
    first, second = np.triu_indices(len(sought))
    terms = np.concatenate([np.ones((count, 1)), at, at[:, first] * at[:, second]], axis=1)
    means = np.array([[100 * of.position.mean(), of.rotation.mean()] for of in errors])
    surface = np.linalg.lstsq(terms, means, rcond=None)[0]
    scatter = np.sqrt(((means - terms @ surface) ** 2).sum(axis=0) / max(count - terms.shape[1], 1))
    return f"smoothed {surface[0, 0]:.2f} ± {scatter[0]:.2f} %, {surface[0, 1]:.2f} ± {scatter[1]:.2f}°"


def main() -> None:
    data, out = (Path(argument) for argument in sys.argv[1:])
    scene = tumble.load("scenarios/real-cube.toml")
    recordings = tumble.fit.read(data, scene)
    out.mkdir(parents=True, exist_ok=True)

    def fit(name, *sought, values=None, neighbours=0, substeps=10, **how):
        begin = time.perf_counter()
        start = {**{of: START[of] for of in sought if of in START}, **(values or {})}
        lines = [f"== {name}"]
        if sought:
            bounds = {of: BOUNDS[of] for of in sought}
            how = {"substeps": min(substeps, SEARCH), "polish": 0, **how}
            found = tumble.fit.fit(scene, recordings, sought, values=start, bounds=bounds, **how)
            lines.append(f"found with {how['substeps']} substeps: {found}")
            start = found.values
        scored = tumble.fit.fit(scene, recordings, [], values=start, substeps=substeps)
        lines.append(f"scored with {substeps} substeps: {scored}")
        if neighbours:
            lines.append(smoothed(scene, recordings, scored, sought, neighbours, substeps))
        lines.append(f"{time.perf_counter() - begin:.0f} s\n")
        print(*lines, sep="\n", flush=True)
        (out / f"{name}.txt").write_text("\n".join(lines))
        scored.plot(out / f"{name}.svg")

    for friction in (0.17, 0.18, 0.19):
        fit(f"sharp-{friction}", values={"friction": friction})
    fit("best", values=BEST)
    fit("known-inertia", values={**BEST, "inertia": 1.0, "radius": 0.005})
    five = ("friction", "restitution", "radius", "inertia", "size")
    fit("five", *five, evaluations=288, neighbours=48)
    fit("folds", *five, evaluations=144, folds=3)
    fit("friction", "friction", evaluations=40, neighbours=24)
    fit("friction-restitution", *five[:2], evaluations=72, neighbours=24)
    fit("friction-radius", "friction", "radius", evaluations=72, neighbours=24)
    fit("three", *five[:3], evaluations=96, neighbours=24)
    fit("three-polished", *five[:3], evaluations=96, polish=8)
    for substeps in (1, 2, 4, 20):
        fit(f"substeps-{substeps}", values=BEST, substeps=substeps)


if __name__ == "__main__":
    main()
