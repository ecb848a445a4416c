"""Writes data/several.jsonl.gz: values and exact derivatives of the step of several bodies.

Each line is one point of a scene of two or three bodies: the inputs, the objective, the
objective's gradient, the rows, their Jacobian and the Hessian of the Lagrangian. CasADi computes
all derivatives. Symbols are as in `step_nlp.py`. Contact i is a point a_i of body A, rounded by
ρ_i, against a plane n·x = d of body B or of the world. Its frame F = (t₁, t₂, n) is fixed in B.

    variables x   X⁺ of each body; f_t along t₁, along t₂; f_n; s1; s2; λ
    rows g        dynamics; dissipation, two a contact; gaps; cones; two complementarities

A contact without friction has only f_n, s1, its gap and its first complementarity.
"""

import gzip
import json
from pathlib import Path

import casadi as cs
import numpy as np
from derivatives import rounded, triplets, unit

import step_nlp as nlp

OUTPUT = Path(__file__).resolve().parents[1] / "several.jsonl.gz"
SEED = 13612
POINTS = 24


def end_of(before: dict, end: cs.SX, push: cs.SX, torque: cs.SX, scene: dict) -> cs.SX:
    """Prediction of the equations of motion for one body minus X⁺, 13 rows.

    `push` is the sum of its forces (world) and `torque` the sum of its torques (body).
    """
    h, inertia = scene["dt"], cs.SX(np.array(before["inertia"]))
    state = cs.SX(before["state"])
    q, v_end, spin_end = state[nlp.ATTITUDE], end[nlp.VELOCITY], end[nlp.SPIN]
    acceleration = push / before["mass"] + cs.SX(scene["gravity"])
    spin_rate = cs.inv(inertia) @ (torque - cs.cross(spin_end, inertia @ spin_end))
    turned = q + h / 2 * (nlp.left(q) @ nlp.H @ spin_end)
    predicted = cs.vertcat(
        state[nlp.POSITION] + h * v_end,
        turned / cs.sqrt(cs.sumsqr(turned)),
        state[nlp.VELOCITY] + h * acceleration,
        state[nlp.SPIN] + h * spin_rate,
    )
    return predicted - end


def problem(scene: dict) -> tuple[cs.SX, cs.SX, cs.SX]:
    """Variables x, objective f and rows g of a scene."""
    bodies, contacts, h = scene["bodies"], scene["contacts"], scene["dt"]
    rough = [i for i, contact in enumerate(contacts) if contact["friction"] > 0]
    ends = [cs.SX.sym(f"X{b}", nlp.STATE) for b in range(len(bodies))]
    t1, t2, s2, lam = ({i: cs.SX.sym(f"{n}{i}") for i in rough} for n in ("t1_", "t2_", "s2_", "l"))
    normal, s1 = ([cs.SX.sym(f"{n}{i}") for i in range(len(contacts))] for n in ("n", "s1_"))
    blocks = (t1.values(), t2.values(), normal, s1, s2.values(), lam.values())
    x = cs.vertcat(*ends, *(symbol for block in blocks for symbol in block))

    push = [cs.SX(body["wrench"][:3]) for body in bodies]
    torque = [cs.SX(body["wrench"][3:]) for body in bodies]
    dissipation, gaps, cones, first, second = [], [], [], [], []
    anchored = cs.SX(0)
    for i, contact in enumerate(contacts):
        a, b = contact["a"], contact["b"]
        old_a, frame = cs.SX(bodies[a]["state"]), cs.SX(np.array(contact["frame"]))
        point = cs.SX(contact["point"])
        turn_a = nlp.rotation(old_a[nlp.ATTITUDE])

        def seen(state_a: cs.SX, state_b: cs.SX | None, c: cs.SX) -> cs.SX:
            """Point c of A in the frame of B."""
            place = state_a[nlp.POSITION] + nlp.rotation(state_a[nlp.ATTITUDE]) @ c
            if state_b is None:
                return place
            return nlp.rotation(state_b[nlp.ATTITUDE]).T @ (place - state_b[nlp.POSITION])

        old_b = None if b is None else cs.SX(bodies[b]["state"])
        turn_b = cs.SX.eye(3) if b is None else nlp.rotation(old_b[nlp.ATTITUDE])
        end_b = None if b is None else ends[b]
        # Material point of A that touches at the start of the step, where the force acts.
        lever = point - contact["radius"] * (turn_a.T @ turn_b @ frame[:, 2])
        gap = cs.dot(frame[:, 2], seen(ends[a], end_b, point)) - contact["offset"]
        gap -= contact["radius"]
        # Slip of the feature's centre and of the relative spin about it.
        relative = turn_a @ ends[a][nlp.SPIN]
        if b is not None:
            relative -= turn_b @ ends[b][nlp.SPIN]
        rolling = turn_b.T @ cs.cross(relative, turn_b @ frame[:, 2]) * contact["radius"]
        moved = seen(ends[a], end_b, point) - seen(old_a, old_b, point)
        slip = frame[:, :2].T @ (moved / h - rolling)

        force = cs.vertcat(t1.get(i, 0), t2.get(i, 0), normal[i])
        in_world = turn_b @ frame @ force
        arm = turn_a @ lever
        push[a] += in_world
        torque[a] += turn_a.T @ cs.cross(arm, in_world)
        response = 1 / bodies[a]["mass"]
        if b is not None:
            place = old_a[nlp.POSITION] + arm - old_b[nlp.POSITION]
            push[b] -= in_world
            torque[b] -= turn_b.T @ cs.cross(place, in_world)
            response += 1 / bodies[b]["mass"]

        anchor = cs.SX(contact["anchor"])
        anchored += scene["stiffness"] * (normal[i] - anchor[2]) ** 2
        gaps.append(gap)
        first.append(s1[i] - normal[i] * gap)
        if i in rough:
            f_xy, eps = force[:2], scene["epsilon"]
            norm = nlp.smooth_norm(f_xy, eps)
            yields = scene["share"] * h * response * (f_xy - anchor[:2])
            cone = contact["friction"] * normal[i] - norm
            dissipation.append(slip + yields + lam[i] * f_xy / (norm + eps))
            cones.append(cone)
            second.append(s2[i] - lam[i] * cone)
    motion = [end_of(body, end, force, turning, scene) for body, end, force, turning in zip(bodies, ends, push, torque)]
    f = cs.sumsqr(cs.vertcat(*s1, *s2.values())) + anchored
    return x, f, cs.vertcat(*motion, *dissipation, *gaps, *cones, *first, *second)


def scene(rng, count: int) -> dict:
    """Unphysical random scene. States at the start have unit quaternions."""

    def state(attitude) -> list:
        parts = rng.normal(0, 2, 3), attitude, rng.normal(0, 3, 3), rng.uniform(-5, 5, 3)
        return np.concatenate(parts).tolist()

    def body() -> dict:
        basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        full = rounded(basis @ np.diag(rng.uniform(1.0, 1.9, 3)) @ basis.T)
        symmetric = np.tril(full) + np.tril(full, -1).T
        return {
            "mass": rounded(10 ** rng.uniform(-1, 2)),
            "inertia": symmetric.tolist(),
            "state": state(unit(rng.normal(size=4))),
            "wrench": rounded(rng.normal(0, 10, 6)).tolist(),
        }

    def contact(index: int) -> dict:
        a = int(rng.integers(count))
        # The first two contacts join the first two bodies, one in each order.
        b = (1, 0)[index] if index < 2 else rng.choice([*range(count), None])
        a = index if index < 2 else a
        w, x, y, z = unit(rng.normal(size=4))
        columns = [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
        return {
            "a": a,
            "b": None if b is None or b == a else int(b),
            "point": rounded(rng.normal(size=3)).tolist(),
            "radius": rounded(rng.uniform(0.05, 0.4)) if rng.integers(2) else 0.0,
            "frame": np.array(columns).tolist(),
            "offset": rounded(rng.normal()),
            "friction": rounded(rng.uniform(0.1, 1)) if rng.integers(4) else 0.0,
            "anchor": rounded(rng.normal(0, 5, 3)).tolist(),
        }

    return {
        "bodies": [body() for _ in range(count)],
        "contacts": [contact(i) for i in range(2 * count)],
        "gravity": rounded(rng.normal(0, 5, 3)).tolist(),
        "dt": rounded(10 ** rng.uniform(-3, -1.7)),
        "epsilon": rounded(10 ** rng.uniform(-6, -1)),
        "share": rounded(rng.uniform(0, 0.2)),
        "stiffness": rounded(rng.uniform(0, 0.2)),
    }


def record(index: int) -> dict:
    """Record of one line of the file."""
    rng = np.random.default_rng((SEED, index))
    given = scene(rng, 2 + index % 2)
    x, f, g = problem(given)
    sigma, y = cs.SX.sym("sigma"), cs.SX.sym("y", g.numel())
    hessian, _ = cs.hessian(sigma * f + cs.dot(y, g), x)
    outputs = [f, cs.gradient(f, x), g, cs.jacobian(g, x), cs.tril(hessian)]
    function = cs.Function("step", [x, sigma, y], outputs)
    bodies = len(given["bodies"])
    ends = [np.concatenate((rng.normal(0, 2, 3), rng.normal(size=4), rng.normal(0, 3, 6))) for _ in range(bodies)]
    rest = rng.uniform(-20, 20, x.numel() - nlp.STATE * bodies)
    point, multipliers = rounded(np.concatenate((*ends, rest))), rounded(rng.normal(size=g.numel()))
    factor = rounded(rng.uniform(0.1, 10))
    value, gradient, rows, jacobian, curvature = function(point, factor, multipliers)
    given |= {"x": point.tolist(), "obj_factor": factor, "multipliers": multipliers.tolist()}
    output = {
        "objective": float(value),
        "gradient": gradient.full().ravel().tolist(),
        "constraints": rows.full().ravel().tolist(),
        "jacobian": triplets(jacobian),
        "hessian": triplets(curvature),
    }
    return {"name": f"{bodies}-bodies-{index:02}", "input": given, "output": output}


def main() -> None:
    lines = [json.dumps(record(i), separators=(",", ":"), allow_nan=False) for i in range(POINTS)]
    OUTPUT.write_bytes(gzip.compress(("\n".join(lines) + "\n").encode(), 9, mtime=0))
    print(f"{OUTPUT.name}: {len(lines)} points, {OUTPUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
