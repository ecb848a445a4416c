"""Writes data/derivatives.jsonl.gz: values and exact derivatives of the step problem.

Each line is one point: its inputs, the objective, the objective's gradient, the rows, their
Jacobian and the Hessian of the Lagrangian. CasADi computes all derivatives.
"""

import gzip
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path

import casadi as cs
import numpy as np

import step_nlp as nlp

OUTPUT = Path(__file__).resolve().parents[1] / "derivatives.jsonl.gz"
SEED = 61062
ROW_COUNT = nlp.ROWS["friction_complementarity"].stop
TUTORIAL = nlp.Constants()
CORNERS = np.array(TUTORIAL.corners)
CONTACT_HEIGHT = 0.005  # m
# All constants except the corners. Every point uses the tutorial's corners.
CONSTANTS = [field.name for field in fields(nlp.Constants) if field.name != "corners"]


@dataclass(frozen=True)
class Point:
    """Point of differentiation: constants, X (13), α (8) and the variables (61)."""

    constants: nlp.Constants
    state: np.ndarray
    alpha: np.ndarray
    x: np.ndarray


# --- Differentiation ---


def differentiated() -> cs.Function:
    """Function of (x, p, σ, y, constants) with outputs f, ∇f, g, ∂g/∂x and the lower triangle of
    ∇²(σ f + yᵀg).

    The constants are symbols, so that the sparsity pattern of a general inertia fits all points.
    """
    shapes = {"inertia": (3, 3), "gravity": (3, 1)}
    symbols = {name: cs.SX.sym(name, *shapes.get(name, (1, 1))) for name in CONSTANTS}
    problem = nlp.step_nlp(nlp.Constants(**symbols))
    x, f, g = problem["x"], problem["f"], problem["g"]
    sigma, y = cs.SX.sym("sigma"), cs.SX.sym("y", ROW_COUNT)
    hessian, _ = cs.hessian(sigma * f + cs.dot(y, g), x)
    outputs = [f, cs.gradient(f, x), g, cs.jacobian(g, x), cs.tril(hessian)]
    return cs.Function("step", [x, problem["p"], sigma, y, *symbols.values()], outputs)


def triplets(matrix: cs.DM) -> dict:
    """Stored entries column by column with indices from 0."""
    rows, columns = matrix.sparsity().get_triplet()
    return {"rows": rows, "cols": columns, "values": matrix.nonzeros()}


def record(function: cs.Function, kind: str, index: int, point: Point, rng) -> dict:
    """Record of one line of the file. It contains only the constants that differ from the tutorial."""
    obj_factor = rng.choice((0.0, 1.0, rounded(rng.uniform(0.1, 10.0))))
    multipliers = rounded(rng.normal(size=ROW_COUNT))
    constants = {name: getattr(point.constants, name) for name in CONSTANTS}
    f, gradient, rows, jacobian, hessian = function(
        point.x, np.concatenate((point.state, point.alpha)), obj_factor, multipliers, *map(np.array, constants.values())
    )
    given = {
        "state": point.state.tolist(),
        "alpha": point.alpha.tolist(),
        "x": point.x.tolist(),
        "obj_factor": float(obj_factor),
        "multipliers": multipliers.tolist(),
    }
    changed = {k: value for k, value in constants.items() if value != getattr(TUTORIAL, k)}
    output = {
        "objective": float(f),
        "gradient": gradient.full().ravel().tolist(),
        "constraints": rows.full().ravel().tolist(),
        "jacobian": triplets(jacobian),
        "hessian": triplets(hessian),
    }
    name = f"{kind}-{index:02}"
    return {"name": name, "kind": kind, "input": given | changed, "output": output}


# --- Making points ---


def rounded(value):
    """Number, or each number of an array, rounded to six significant digits."""
    digits = np.vectorize(lambda number: float(f"{number:.6g}"), otypes=[float])
    return digits(value) if np.ndim(value) else float(f"{value:.6g}")


def unit(vector: np.ndarray) -> np.ndarray:
    """v / ‖v‖ along the last axis."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternion product p ⊗ q."""
    return cs.evalf(nlp.left(cs.SX(p)) @ cs.SX(q)).full().ravel()


def rotation(q: np.ndarray) -> np.ndarray:
    """Rotation matrix A(q)."""
    return cs.evalf(nlp.rotation(cs.SX(q))).full()


def face_down(rng) -> np.ndarray:
    """Attitude with one of the six faces flat on the ground and a random yaw."""
    half = np.sqrt(0.5)
    sides = [(half, sign * half, 0, 0) for sign in (1, -1)]
    sides += [(half, 0, sign * half, 0) for sign in (1, -1)]
    face = rng.choice([(1, 0, 0, 0), (0, 1, 0, 0), *sides])
    yaw = rng.uniform(-np.pi, np.pi) / 2
    return product(np.array((np.cos(yaw), 0, 0, np.sin(yaw))), face)


def anything(rng, constants=TUTORIAL, *, force=100.0, spin=5.0, unit_attitudes=False) -> Point:
    """Unphysical random numbers, rounded. Attitudes have any norm unless `unit_attitudes` is set."""
    alpha = rng.choice((rng.integers(0, 2, 8), np.ones(8), rng.uniform(0, 1, 8))).astype(float)
    motions = [
        (rng.normal(0, 2, 3), rng.normal(size=4), rng.normal(0, 3, 3), rng.uniform(-spin, spin, 3)) for _ in range(2)
    ]
    if unit_attitudes:
        motions = [(r, unit(q), v, w) for r, q, v, w in motions]
    state, end = (np.concatenate(motion) for motion in motions)
    tangential, normal = rng.uniform(-force, force, 16), rng.uniform(0, force, 8)
    x = np.concatenate((end, tangential, normal, rng.uniform(0, 5, 24)))
    return Point(constants, rounded(state), rounded(alpha), rounded(x))


@dataclass(frozen=True)
class Arrival:
    """Corners at the end of a step: flags α, arms A(q) c_i at its start, mean slip c_xy."""

    constants: nlp.Constants
    alpha: np.ndarray
    arms: np.ndarray
    slip: np.ndarray


Load = Callable[[Arrival], tuple[np.ndarray, np.ndarray]]  # to f_i (8×3) and λ (8)


def consistent(
    rng,
    load: Load,
    q: np.ndarray,
    velocity: np.ndarray,
    spin: np.ndarray,
    constants: nlp.Constants = TUTORIAL,
    lift: float = 0.0,
) -> Point:
    """Step that satisfies the dynamics, built backwards from v⁺ = `velocity` and ω⁺ = `spin`.

    The attitude is q⁺ = d / ‖d‖ with d = q + ½ h q ⊗ (0, ω⁺). The corners' motion determines the
    forces. Then
        r = r⁺ − h v⁺,   v = v⁺ − h (Σ f_i / m + g),   ω = ω⁺ − h I⁻¹ (τ − ω⁺ × I ω⁺).
    The lowest corner ends at height `lift`. The slacks satisfy their rows with equality.
    """
    h, inertia = constants.dt, np.array(constants.inertia)
    q_end = unit(q + h / 2 * product(q, np.concatenate(([0.0], spin))))
    arms, arms_end = CORNERS @ rotation(q).T, CORNERS @ rotation(q_end).T
    heights = arms_end[:, 2] - arms_end[:, 2].min() + lift
    alpha = (heights <= CONTACT_HEIGHT).astype(float)
    slip = velocity[:2] + (arms_end - arms)[:, :2] / h
    forces, lam = load(Arrival(constants, alpha, arms, slip))
    forces = forces + 0.0  # turns −0 into 0

    r_end = np.array((*rng.normal(size=2), lift - arms_end[:, 2].min()))
    acceleration = forces.sum(axis=0) / constants.mass + np.array(constants.gravity)
    torque = np.cross(CORNERS, forces @ rotation(q)).sum(axis=0)
    spin_rate = np.linalg.solve(inertia, torque - np.cross(spin, inertia @ spin))
    start = (r_end - h * velocity, q, velocity - h * acceleration, spin - h * spin_rate)
    end = (r_end, q_end, velocity, spin)

    norms = np.sqrt((forces[:, :2] ** 2).sum(axis=1) + constants.epsilon**2) - constants.epsilon
    slacks = (forces[:, 2] * heights, lam * (constants.mu * forces[:, 2] - norms))
    x = np.concatenate((*end, *forces.T, *slacks, lam))
    return Point(constants, np.concatenate(start), alpha, x)


def standing(arrival: Arrival, twist: float = 0.0) -> np.ndarray:
    """Normal forces that carry the weight on a face. `twist` shifts them between its diagonals."""
    weight = arrival.constants.mass * abs(arrival.constants.gravity[2])
    return arrival.alpha * weight / 4 * (1 + twist * CORNERS.prod(axis=1))


def dragged(arrival: Arrival, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Friction on the cone against the slip: f_xy = −μ f_z c_xy / ‖c_xy‖ and λ = ‖c_xy‖."""
    friction = -arrival.constants.mu * normal[:, None] * unit(arrival.slip)
    speed = np.linalg.norm(arrival.slip, axis=1)
    return np.column_stack((friction, normal)), arrival.alpha * speed


# --- The kinds ---


def random_point(index: int, rng) -> Point:
    return anything(rng, unit_attitudes=index % 2 == 0)


def rest(index: int, rng) -> Point:
    """Cube at rest on a face. Half of the points have equal forces."""
    twist = rng.uniform(-1, 1) if index % 2 else 0.0

    def load(arrival: Arrival):
        return np.column_stack((np.zeros((8, 2)), standing(arrival, twist))), np.zeros(8)

    return consistent(rng, load, face_down(rng), np.zeros(3), np.zeros(3))


def slide_on_face(rng, constants: nlp.Constants) -> Point:
    """Straight slide on a face. The load moves forward so that friction does not tip the cube.

    All four corners carry load as long as μ √2 < 1.
    """
    heading = unit(rng.normal(size=2))

    def load(arrival: Arrival):
        forward = 1 + constants.mu * arrival.arms[:, :2] @ heading
        return dragged(arrival, standing(arrival) * forward)

    velocity = np.array((*(rng.uniform(0.01, 6) * heading), 0.0))
    return consistent(rng, load, face_down(rng), velocity, np.zeros(3), constants)


def slide_on_corner(rng, constants: nlp.Constants) -> Point:
    """One corner slides while the cube tumbles."""
    normal = rng.uniform(10, 2000)
    q, velocity, spin = unit(rng.normal(size=4)), rng.normal(0, 3, 3), rng.normal(0, 3, 3)
    return consistent(rng, lambda arrival: dragged(arrival, arrival.alpha * normal), q, velocity, spin, constants)


def slide(index: int, rng, constants=TUTORIAL) -> Point:
    return (slide_on_corner if index % 2 else slide_on_face)(rng, constants)


def stick(index: int, rng) -> Point:
    """Cube on a face without slip. f_xy is in turn exactly 0, tiny (1e-9 to 1e-3 N) or inside the
    cone."""
    sizes = (np.zeros(8), 10 ** rng.uniform(-9, -3, 8), rng.uniform(0, 5, 8))[index % 3]
    lam = rng.choice((0.0, 1e-8, 1e-3))

    def load(arrival: Arrival):
        friction = (arrival.alpha * sizes)[:, None] * unit(rng.normal(size=(8, 2)))
        return np.column_stack((friction, standing(arrival))), arrival.alpha * lam

    return consistent(rng, load, face_down(rng), np.zeros(3), np.zeros(3))


def airborne(index: int, rng, constants=TUTORIAL) -> Point:
    """Free flight without contact flags and forces."""
    q, velocity, spin = unit(rng.normal(size=4)), rng.normal(0, 3, 3), rng.normal(0, 5, 3)
    lift = rng.uniform(0.01, 3)
    nothing = np.zeros((8, 3)), np.zeros(8)
    return consistent(rng, lambda _: nothing, q, velocity, spin, constants, lift)


def large_force(index: int, rng) -> Point:
    """Unphysical point with up to 20 kN on each corner and 100 rad/s about each axis."""
    return anything(rng, force=2e4, spin=100.0, unit_attitudes=index % 2 == 0)


def mixed(index: int, rng, constants: nlp.Constants) -> Point:
    """Unphysical point, slide or free flight in turn, with the given constants."""
    if index % 4 == 3:
        return airborne(index, rng, constants)
    return slide(index // 2, rng, constants) if index % 2 else anything(rng, constants)


def inertia(index: int, rng) -> Point:
    """Full inertia matrix I = B diag(d) Bᵀ, exactly symmetric, d from 0.05 to 10 kg m²."""
    basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    full = rounded(basis @ np.diag(10 ** rng.uniform(-1.3, 1, 3)) @ basis.T)
    symmetric = np.tril(full) + np.tril(full, -1).T
    return mixed(index, rng, replace(TUTORIAL, inertia=symmetric.tolist()))


def parameters(index: int, rng) -> Point:
    """Other time steps, friction (zero in every fifth point), mass, smoothing and a tilted gravity."""
    constants = replace(
        TUTORIAL,
        dt=rounded(10 ** rng.uniform(-4, -1.7)),
        mu=rounded(rng.uniform(0.05, 0.7)) if index % 5 else 0.0,
        mass=rounded(10 ** rng.uniform(-1, 3)),
        gravity=rounded(np.array((*rng.normal(0, 2, 2), -rng.uniform(1, 12)))).tolist(),
        epsilon=rounded(10 ** rng.uniform(-8, -3)),
    )
    return mixed(index, rng, constants)


PLAN = (
    ("random", 60, random_point),
    ("rest", 20, rest),
    ("slide", 36, slide),
    ("stick", 36, stick),
    ("airborne", 20, airborne),
    ("large_force", 24, large_force),
    ("inertia", 24, inertia),
    ("parameters", 30, parameters),
)


def records() -> Iterator[dict]:
    """Every point of `PLAN`, each with its own random stream."""
    function = differentiated()
    for number, (kind, count, make) in enumerate(PLAN):
        for index in range(count):
            rng = np.random.default_rng((SEED, number, index))
            yield record(function, kind, index, make(index, rng), rng)


def main() -> None:
    lines = [json.dumps(entry, separators=(",", ":"), allow_nan=False) for entry in records()]
    OUTPUT.write_bytes(gzip.compress(("\n".join(lines) + "\n").encode(), 9, mtime=0))
    print(f"{OUTPUT.name}: {len(lines)} points, {OUTPUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
