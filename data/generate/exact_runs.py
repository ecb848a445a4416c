"""Exact trajectories of the drop scene, with every step solved to rounding.

    python exact_runs.py            all runs, into data/exact
    python exact_runs.py NAME ...   only these runs, without index.json

Requires numpy and casadi. A cube (half side 1 m, 10 kg) is dropped with spin on a floor with
friction 0.3. A run has 1000 rows at h = 0.002 s. exact_step.py describes the step and its
solution. The program is independent of the Rust code.

Each run has a file <name>.csv.gz with the state every 10 rows and in the last row. Its column
`residual` is the largest residual (m/s) of the steps since the previous row. index.json describes
the runs with these fields:

  solved_from       number of steps solved from each start
  not_warm          steps solved neither as free flight nor from the last impulses
  other_solutions   steps with a different motion from another start
  undetermined      steps with forces that the contact law alone does not
                    determine, and how many of them slide (there the selection
                    rule decides the motion)
  growth            largest difference of the pose over the run after a change of
                    the initial attitude by 1e-9, divided by 1e-9
  repeat            largest difference of the pose after a second solution with a
                    ten times larger compliance: the error of the run itself
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import gzip
import io
import json
import pathlib
import sys
import time

import exact_step as ex
import numpy as np

OUT = pathlib.Path(__file__).resolve().parent.parent / "exact"
ROWS, EVERY, EXTRA = 1000, 10, 2
STATE = "x y z qw qx qy qz vx vy vz wx wy wz".split()

# Eigenvalues close to 2, 5 and 6 with axes that differ from the cube's.
FULL = ((4.584, 1.209, -0.554), (1.209, 2.648, 0.288), (-0.554, 0.288, 5.768))


def ball(i):
    return ((i, 0.0, 0.0), (0.0, i, 0.0), (0.0, 0.0, i))


RUNS = {f"drop-seed{s}-inertia0.01": (s, ball(0.01)) for s in (42, 0, 1, 2, 3, 6)}
RUNS |= {f"drop-seed{s}-inertia6.666667": (s, ball(6.666667)) for s in (42, 0, 3, 6)}
RUNS["drop-seed42-inertia-full"] = (42, FULL)

# Steps k (from row k to k + 1) stored in hard-steps.json, and the reason.
HARD = {
    ("drop-seed1-inertia0.01", 204): "one corner takes the whole momentum, sticking",
    ("drop-seed3-inertia0.01", 204): "one corner takes the whole momentum, sticking",
    ("drop-seed2-inertia0.01", 276): "face lands, four corners slide, large impulses",
    ("drop-seed6-inertia0.01", 281): "a corner close to losing its grip",
    ("drop-seed6-inertia0.01", 282): "a corner close to losing its grip",
    ("drop-seed0-inertia6.666667", 388): "face lands; the rule decides the motion",
    ("drop-seed0-inertia6.666667", 389): "the step after; the rule decides the motion",
    ("drop-seed6-inertia6.666667", 479): "face lands; by the rule one corner is unloaded",
    ("drop-seed6-inertia6.666667", 816): "the sliding face comes to rest",
}


def start(seed, shift=0.0):
    q = np.random.RandomState(seed).rand(4)
    q = q / np.sqrt(q @ q)
    if shift:
        q = q + shift * np.array([0.3, -0.5, 0.7, 0.4])
        q = q / np.sqrt(q @ q)
    return np.concatenate([[0.0, 0.0, 2.5], q, [0.0, 4.0, 0.0], [0.0, -2.0, 1.0]])


def run(model, X, search=False, watch=None):
    """Simulates all rows. Returns rows (ROWS, 13), residuals by row and statistics of the run."""
    rng = np.random.default_rng(20240229) if search else None
    P = np.zeros((len(model.C), 3))
    rows, res = [X], [0.0]
    seen = dict(solved_from={}, not_warm={}, other_solutions={})
    undetermined = [0, 0]
    for k in range(ROWS - 1):
        step = ex.Step(model, X)
        got, name, others = step.solve(P, search=search, rng=rng, extra=EXTRA)
        if got is None:
            raise RuntimeError(f"step {k} has no solution")
        seen["solved_from"][name] = seen["solved_from"].get(name, 0) + 1
        if name not in ("free", "warm"):
            seen["not_warm"][k] = name
        if others:
            seen["other_solutions"][k] = [
                dict(start=label, modes=list(o.modes), residual=o.residual, distance=float(np.abs(o.V - got.V).max()))
                for label, o in others
            ]
        if got.free:
            undetermined[0] += 1
            undetermined[1] += ex.SLIP in got.modes
        Xn = ex.advance(model.par, X, got.V)
        if watch is not None:
            watch(k, X, P, Xn, got)
        X, P = Xn, got.P
        rows.append(X)
        res.append(got.residual)
    seen["undetermined"] = dict(steps=undetermined[0], sliding=undetermined[1])
    return np.array(rows), np.array(res), seen


def write(path, rows, res):
    text = io.StringIO()
    text.write("k," + ",".join(STATE) + ",residual\n")
    before = 0
    for k in sorted(set(range(0, ROWS, EVERY)) | {ROWS - 1}):
        worst = res[before + 1 : k + 1].max() if k else 0.0
        values = [float(x) for x in rows[k]] + [float(worst)]
        text.write(",".join([str(k)] + [repr(x) for x in values]) + "\n")
        before = k
    with open(path, "wb") as f:
        with gzip.GzipFile(filename="", mode="wb", fileobj=f, mtime=0) as z:
            z.write(text.getvalue().encode())


def dump(path, data):
    path.write_text(json.dumps(data, indent=1) + "\n")


def main(names):
    OUT.mkdir(parents=True, exist_ok=True)
    entries, hard = [], []
    for name in names or RUNS:
        seed, inertia = RUNS[name]
        began = time.time()
        par = ex.Params(inertia=inertia)
        model = ex.Model(par)

        def watch(k, X, P, Xn, got):
            if (name, k) in HARD:
                hard.append(
                    dict(
                        run=name,
                        step=k,
                        why=HARD[name, k],
                        state=X.tolist(),
                        impulses_before=P.tolist(),
                        next=Xn.tolist(),
                        impulses=got.P.tolist(),
                        modes=list(got.modes),
                        residual=got.residual,
                    )
                )

        X0 = start(seed)
        rows, res, seen = run(model, X0, search=True, watch=watch)
        moved = run(model, start(seed, 1e-9))[0]
        usual = ex.Step.EPS
        try:
            ex.Step.EPS = 10 * usual
            again = run(model, X0)[0]
        finally:
            ex.Step.EPS = usual
        write(OUT / f"{name}.csv.gz", rows, res)
        entries.append(
            dict(
                file=f"{name}.csv.gz",
                seed=seed,
                inertia=[list(r) for r in inertia],
                mass=par.mass,
                half_side=1.0,
                mu=par.mu,
                gravity=par.gravity,
                h=par.h,
                rows=ROWS,
                start=X0.tolist(),
                max_residual=float(res.max()),
                end_position=rows[-1, 0:3].tolist(),
                end_attitude=rows[-1, 3:7].tolist(),
                growth=float(f"{np.abs(moved - rows)[:, :7].max() / 1e-9:.2g}"),
                repeat=float(f"{np.abs(again - rows)[:, :7].max():.1g}"),
                **seen,
            )
        )
        print(
            f"{name}: residual {res.max():.1e}, end {rows[-1, :3].round(6)}, "
            f"growth {entries[-1]['growth']}, repeat {entries[-1]['repeat']}, "
            f"{time.time() - began:.1f} s",
            flush=True,
        )
    if names:
        return
    dump(
        OUT / "index.json",
        dict(
            about="Exact trajectories of the drop scene; made by "
            "data/generate/exact_runs.py, which explains the fields.",
            columns=["k"] + STATE + ["residual"],
            frames="x, v: world; q: body to world, scalar first; w: body",
            runs=entries,
        ),
    )
    dump(
        OUT / "hard-steps.json",
        dict(
            about="Single steps: state before, impulses of the step before (warm "
            "start), state after and impulses (N s, world, per corner; corners "
            "x fastest, then y, then z, from minus to plus). Modes: 0 open, "
            "1 sticking, 2 sliding.",
            columns=STATE,
            steps=hard,
        ),
    )


if __name__ == "__main__":
    main(sys.argv[1:])
