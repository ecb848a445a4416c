"""Writes data/tutorial/seed-S.csv.gz: the tutorial's 999 steps solved by CasADi and Ipopt.

Prints for each seed the statuses, the iterations, the wall time and the steps' residuals of the
contact law (`certificate`).
"""

import contextlib
import csv
import gzip
import io
import time
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import casadi as cs
import numpy as np

import step_nlp as nlp

OUTPUT = Path(__file__).resolve().parents[1] / "tutorial"
SEEDS = (42, 0, 1, 2)
SOLVES = 999
CONTACT_HEIGHT = 0.005  # m, at or below which a corner counts as touching
UNBOUNDED = 1e10
SOLVER_OPTIONS = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-6,
    "ipopt.max_iter": 300,
}

COLUMNS = ["k", "status", "iterations", "alpha"]
COLUMNS += ["rx", "ry", "rz", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"]
COLUMNS += [f"{name}{i}" for name in ("fx", "fy", "fz", "s1_", "s2_", "lambda") for i in range(8)]


@dataclass(frozen=True)
class Step:
    """One solve: step number, Ipopt's status, contact flags and the 61 variables."""

    k: int
    status: str
    iterations: int
    alpha: np.ndarray
    x: np.ndarray

    def row(self) -> list:
        flags = "".join(str(int(flag)) for flag in self.alpha)
        return [self.k, self.status, self.iterations, flags, *map(repr, self.x.tolist())]


class Problem:
    """Step problem of the tutorial: solver, rows g(x, p) and corner positions C(X)."""

    def __init__(self) -> None:
        self.constants = nlp.Constants()
        problem = nlp.step_nlp(self.constants)
        state = problem["p"][: nlp.STATE]
        positions = nlp.corner_positions(state, self.constants.corners)
        self.solver = cs.nlpsol("step", "ipopt", problem, SOLVER_OPTIONS)
        self.rows = cs.Function("rows", [problem["x"], problem["p"]], [problem["g"]])
        self.corners = cs.Function("corners", [state], [positions])
        self.row_upper = np.zeros(problem["g"].numel())
        self.row_upper[nlp.ROWS["height"].start :] = UNBOUNDED

    def flags(self, state: np.ndarray) -> np.ndarray:
        """Flags α_i = 1 of corners at most `CONTACT_HEIGHT` above the ground."""
        heights = np.array(self.corners(state))[:, 2]
        return (heights <= CONTACT_HEIGHT).astype(float)

    def solve(self, k: int, start: np.ndarray) -> Step:
        """Step k from the state in `start`, which is also the solver's first iterate."""
        state = start[: nlp.STATE]
        alpha = self.flags(state)
        lower, upper = bounds(alpha)
        # CasADi counts clamped variables as equalities and warns of an overconstrained problem.
        with contextlib.redirect_stderr(io.StringIO()):
            solution = self.solver(
                x0=start, p=np.concatenate((state, alpha)), lbx=lower, ubx=upper, lbg=0.0, ubg=self.row_upper
            )
        stats = self.solver.stats()
        x = np.array(solution["x"]).ravel()
        return Step(k, stats["return_status"], stats["iter_count"], alpha, x)


def bounds(alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds: state, fx and fy free; fz, s1, s2 and λ ≥ 0. All six variables of a corner with flag
    0 are 0."""
    lower, upper = np.full(nlp.VARIABLES, -UNBOUNDED), np.full(nlp.VARIABLES, UNBOUNDED)
    lower[nlp.FZ.start :] = 0.0
    for block in (nlp.FX, nlp.FY, nlp.FZ, nlp.S1, nlp.S2, nlp.LAMBDA):
        lower[block][alpha == 0.0] = 0.0
        upper[block][alpha == 0.0] = 0.0
    return lower, upper


def start_point(seed: int) -> np.ndarray:
    """Thrown cube at a height of 2.5 m with 4 m/s along y, a spin, a random attitude and no forces."""
    np.random.seed(seed)
    draws = np.random.rand(4)
    x = np.zeros(nlp.VARIABLES)
    x[nlp.POSITION] = (0.0, 0.0, 2.5)
    x[nlp.ATTITUDE] = draws / np.linalg.norm(draws)
    x[nlp.VELOCITY] = (0.0, 4.0, 0.0)
    x[nlp.SPIN] = (0.0, -2.0, 1.0)
    return x


def simulate(problem: Problem, seed: int) -> list[Step]:
    """Start as row −1, then `SOLVES` steps, each from the end of the previous one."""
    steps = [Step(-1, "start", 0, np.zeros(nlp.CORNERS), start_point(seed))]
    for k in range(SOLVES):
        steps.append(problem.solve(k, steps[-1].x))
    return steps


def certificate(problem: Problem, state: np.ndarray, x: np.ndarray) -> float:
    """Residual of (X, X⁺, F) with hard contact and exact Coulomb friction (m/s).

    It is the largest residual of the dynamics and of the contact law, and 0 exactly at a solution.
    """
    residuals = dynamics_residuals(problem, state, x) + contact_residuals(problem, state, x)
    return float(np.concatenate(residuals).max())


def dynamics_residuals(problem: Problem, state: np.ndarray, x: np.ndarray) -> list[np.ndarray]:
    """Residuals |rows of r⁺| / h,  |rows of q⁺| ℓ / h,  |rows of v⁺|,  |rows of ω⁺| ℓ.

    ℓ is the largest coordinate of a corner.
    """
    h, length = problem.constants.dt, np.abs(problem.constants.corners).max()
    p = np.concatenate((state, np.zeros(nlp.CORNERS)))
    rows = np.abs(np.array(problem.rows(x, p)).ravel()[nlp.ROWS["dynamics"]])
    return [rows[nlp.POSITION] / h, rows[nlp.ATTITUDE] * length / h, rows[nlp.VELOCITY], rows[nlp.SPIN] * length]


def contact_residuals(problem: Problem, state: np.ndarray, x: np.ndarray) -> list[np.ndarray]:
    """Residuals of the contact law at every corner (m/s). w_n and w_t are the responses of corner i
    to an impulse. p_i = w_t h f_xy,i, and Π projects onto the disc of radius μ w_t h max(f_z,i, 0):

        penetration   max(0, −z⁺_i) / h
        normal law    |min(w_n h f_z,i, z⁺_i / h)|
        friction law  ‖p_i − Π(p_i − c_xy,i)‖
        cone          max(0, ‖p_i‖ − μ w_t h f_z,i)
    """
    h, mu = problem.constants.dt, problem.constants.mu
    w_n, w_t = responses(problem, state)
    before, after = np.array(problem.corners(state)), np.array(problem.corners(x[: nlp.STATE]))
    slip, heights = (after - before)[:, :2] / h, after[:, 2]

    normal = h * x[nlp.FZ]
    friction = w_t[:, None] * h * np.column_stack((x[nlp.FX], x[nlp.FY]))
    limit = mu * w_t * normal
    target = friction - slip
    reach = np.maximum(np.linalg.norm(target, axis=1), np.finfo(float).tiny)
    projected = target * np.minimum(1.0, np.maximum(limit, 0.0) / reach)[:, None]
    return [
        np.maximum(-heights, 0.0) / h,
        np.abs(np.minimum(w_n * normal, heights / h)),
        np.linalg.norm(friction - projected, axis=1),
        np.maximum(np.linalg.norm(friction, axis=1) - limit, 0.0),
    ]


def responses(problem: Problem, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Responses W_zz and (W_xx + W_yy)/2 of every corner (1/kg): W = E/m − [r]× (A I Aᵀ)⁻¹ [r]×."""
    constants = problem.constants
    levers = np.array(problem.corners(state)) - state[nlp.POSITION]
    # The tutorial's inertia is a multiple of E and equal in every frame.
    moment = np.asarray(constants.inertia, dtype=float).ravel()[0]
    squares = (levers**2).sum(axis=1)
    diagonal = 1 / constants.mass + (squares[:, None] - levers**2) / moment
    return diagonal[:, 2], diagonal[:, :2].mean(axis=1)


def write(steps: list[Step], path: Path) -> None:
    """Writes the steps as CSV in a gzip file without time and name in its header."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(step.row() for step in steps)
    path.write_bytes(gzip.compress(text.getvalue().encode(), 9, mtime=0))


def summary(problem: Problem, seed: int, steps: list[Step], seconds: float) -> str:
    """Statuses, iterations, time and certificates of one run as printed lines."""
    solved = steps[1:]
    statuses = Counter(step.status for step in solved)
    values = [certificate(problem, a.x[: nlp.STATE], b.x) for a, b in pairwise(steps)]
    touching = [value for value, step in zip(values, solved) if step.alpha.any()]
    lines = [
        f"seed {seed}: {seconds:.1f} s, {sum(step.iterations for step in solved)} iterations",
        "  " + ", ".join(f"{status} {count}" for status, count in statuses.most_common()),
    ]
    for name, chosen in (("steps", values), ("steps with a corner flagged", touching)):
        lines.append(
            f"  certificate, {len(chosen)} {name}: median {np.median(chosen):.3g} m/s, largest {max(chosen):.3g} m/s"
        )
    return "\n".join(lines)


def main() -> None:
    problem = Problem()
    OUTPUT.mkdir(exist_ok=True)
    for seed in SEEDS:
        began = time.perf_counter()
        steps = simulate(problem, seed)
        seconds = time.perf_counter() - began
        write(steps, OUTPUT / f"seed-{seed}.csv.gz")
        print(summary(problem, seed, steps, seconds), flush=True)


if __name__ == "__main__":
    main()
