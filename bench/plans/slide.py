"""The program of `scenarios/plans/slide.toml` in CasADi, solved by the Ipopt and MUMPS of its wheel.

    python bench/plans/slide.py

with the packages of `data/generate/requirements.txt`. Rows, path, start and options are those of
`docs/planning.md`; what `cargo run --release --example plan_legs -- program slide` takes on the same
machine is to be compared with the sum that it prints.
"""

import sys
import time
from pathlib import Path

import casadi as cs
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "data" / "generate"))
import step_nlp as nlp  # noqa: E402
from plan import motion, smoothed  # noqa: E402

STEPS, STEP, FRICTION, GRAVITY = 50, 0.02, 0.4, 9.81
SIZE, MASS, TARGET = np.array([0.3, 0.3, 0.2]), 1.0, 1.0
PATH = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
COMPLIANCE, RANGE = 1e-3, 40.0


def main() -> None:
    length = SIZE.max() / 2
    duration = np.sqrt(length / GRAVITY)
    speed, h = length / duration, STEP / duration
    a, b, c = SIZE / length
    inertia = cs.SX(cs.diag(cs.DM([b * b + c * c, a * a + c * c, a * a + b * b]) / 12))
    corners = [cs.DM([x * a / 2, y * b / 2, -c / 2]) for y in (-1, 1) for x in (-1, 1)]
    delta = cs.SX.sym("delta")
    state = cs.SX([0, 0, c / 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    rest = np.array([0, 0, c / 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    x, start, low, high, rows, cost = [], [], [], [], [], cs.SX(0)
    for step in range(STEPS):
        end, force = cs.SX.sym(f"X{step}", 13), cs.SX.sym(f"F{step}", 4, 4)
        u = cs.SX.sym(f"u{step}")
        x += [end, cs.vec(force), u]
        # On the path of the first δ: sticking at rest.
        own = [0.0, 0.0, 0.25, PATH[0] / (FRICTION * 0.25)] * 4
        start += [rest, own, [0.0]]
        low += [[-np.inf] * 29, [-0.5]]
        high += [[np.inf] * 29, [0.5]]
        turn, turned = nlp.rotation(state[3:7]), nlp.rotation(end[3:7])
        push = cs.vertcat(u * RANGE / (MASS * GRAVITY), 0, 0)
        torque, laws = cs.SX.zeros(3), []
        for i, corner in enumerate(corners):
            f, lam = force[:3, i], force[3, i]
            push += f
            torque += cs.cross(corner, turn.T @ f)
            before, after = state[:3] + turn @ corner, end[:3] + turned @ corner
            gap = after[2] / h + COMPLIANCE * h * f[2]
            slip = (after - before)[:2] / h + COMPLIANCE * h * f[:2]
            room = FRICTION * f[2] - nlp.smooth_norm(f[:2], 0.1 * cs.sqrt(delta))
            laws += [smoothed(f[2], gap, delta), FRICTION * f[2] * slip + lam * f[:2]]
            laws.append(smoothed(lam, room, delta))
        rows += [motion(h, 1.0, inertia, state, end, push, torque), *laws]
        cost += 1e-4 * (u * RANGE) ** 2
        state = end
    cost += 100 * (state[0] * length - TARGET) ** 2 + 10 * cs.sumsqr(state[7:10] * speed)
    x, g = cs.vertcat(*x), cs.vertcat(*rows)
    start = np.concatenate([np.ravel(part) for part in start])
    bounds = {"lbx": np.concatenate(low), "ubx": np.concatenate(high), "lbg": 0, "ubg": 0}
    problem = {"x": x, "p": delta, "f": cost / 100, "g": g}
    at, iterations, seconds = {"x0": start}, 0, 0.0
    for stage, value in enumerate(PATH):
        options = {"tol": 1e-8, "mu_strategy": "adaptive", "print_level": 0, "sb": "yes", "max_iter": 500}
        options |= {"mu_init": 0.1} if stage == 0 else {
            "mu_init": 1e-4,
            "warm_start_init_point": "yes",
            "warm_start_bound_push": 1e-8,
            "warm_start_bound_frac": 1e-8,
            "warm_start_mult_bound_push": 1e-8,
        }
        solver = cs.nlpsol("slide", "ipopt", problem, {"ipopt": options, "print_time": False})
        before = time.process_time()
        found = solver(**at, **bounds, p=value)
        seconds += time.process_time() - before
        stats = solver.stats()
        iterations += stats["iter_count"]
        at = {"x0": found["x"], "lam_x0": found["lam_x"], "lam_g0": found["lam_g"]}
        print(f"{value:.0e}: {stats['return_status']}, J {float(found['f']) * 100:.7f}")
    print(f"{iterations} iterations, {seconds:.2f} s of processor, building the graphs apart")


if __name__ == "__main__":
    main()
