"""Writes data/plan.jsonl.gz: values and exact derivatives of the program of several steps.

Each line is one point of a problem of two bodies with contacts of any kind, with the ground and with each other: the
inputs, and the objective, its gradient, the rows, their Jacobian and the Hessian of the Lagrangian there, all
differentiated by CasADi. Symbols are those of `docs/planning.md`; lengths are in those of the scene's reach, a body of
mean mass weighs 1 and falls with 1.

    variables x   controls of the start, X_0 of each body, and of every step: X+ of each body; of each contact F along t1, t2
                  and n and lambda; controls that begin; slacks of keeps
    rows g        the start; of every step: motion of each body; of each contact the smoothed law; keeps
"""

import gzip
import json
from pathlib import Path

import casadi as cs
import numpy as np

import step_nlp as nlp
from derivatives import rounded, triplets, unit

OUTPUT = Path(__file__).resolve().parents[1] / "plan.jsonl.gz"
SEED = 271
POINTS = 12
STEPS = 2
GRAVITY = 9.81

SIZES = ((0.4, 0.3, 0.2), (0.2, 0.25, 0.15))
MASSES = (1.5, 0.6)
PLACES = ((0.0, 0.0, 1.0), (1.0, 0.2, 0.7))
STEP = 0.02

SCENE = f"""
name = "two boxes"
steps = {STEPS}
time_step = {STEP}

[ground]
friction = 0.5

[[bodies]]
name = "one"
box = {list(SIZES[0])}
mass = {MASSES[0]}
position = {list(PLACES[0])}

[[bodies]]
name = "two"
box = {list(SIZES[1])}
mass = {MASSES[1]}
position = {list(PLACES[1])}
"""

PROBLEM = f"""
steps = {STEPS}

[[controls]]
kind = "push"
body = "one"
face = "-x"
normal = [0.0, 3.0]
tangential = [-0.7, 0.7]
tangential_2 = [-0.5, 0.7]
offset = [-0.1, 0.1]
offset_2 = [-0.1, 0.05]
friction = 0.4
knots = {STEPS}

[[controls]]
kind = "torque"
body = "two"
knots = 1
x = [-1.0, 1.0]
y = [-0.5, 1.0]
z = [-1.0, 2.0]

[[controls]]
kind = "force"
body = "two"
x = [-1.0, 1.0]
y = [-0.5, 1.0]
z = [-1.0, 2.0]
knots = {STEPS}

[[controls]]
kind = "start"
body = "two"
of = "turn"
x = [-1.0, 1.0]
y = [-0.5, 1.0]
z = [-1.0, 2.0]

[[controls]]
kind = "start"
body = "one"
of = "velocity"
x = [-1.0, 1.0]
y = [-0.5, 1.0]
z = [-1.0, 2.0]

[[target]]
body = "one"
position = [0.5, 0.3]
velocity = [0.0, 0.1, 0.0]
turn = 40.0
weight = {{ position = 3.0, velocity = 0.4, turn = 0.7 }}

[[target]]
body = "two"
attitude = [0.8, 0.0, -0.6, 0.0]
after = 1
weight = {{ attitude = 1.3 }}

[[target]]
body = "two"
down = "+x"
weight = {{ down = 0.6 }}

[[keep]]
body = "one"
above = {{ x = 0.1, width = 0.2, height = 0.3 }}
weight = 2.0

[cost]
effort = 1e-2
"""

# The ranges of the push's components, and of all others.
PUSH = ((0.0, 3.0), (-0.7, 0.7), (-0.5, 0.7), (-0.1, 0.1), (-0.1, 0.05))
WIDE = ((-1.0, 1.0), (-0.5, 1.0), (-1.0, 2.0))
# The push's frame at the face -x, body axes.
NORMAL, FIRST, SECOND = (cs.DM(v) for v in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def motion(h: float, mass: float, inertia: cs.SX, start: cs.SX, end: cs.SX, force, torque):
    """Eq. 8 with positions over h, 13 rows, in the momentum form of the gyroscopic term."""
    q, spin, after = start[nlp.ATTITUDE], start[nlp.SPIN], end[nlp.SPIN]
    turned = q + h / 2 * (nlp.left(q) @ nlp.H @ after)
    momentum, before = inertia @ after, inertia @ spin
    gyroscopic = (cs.cross(after, momentum) + cs.cross(spin, before)) / 2
    gyroscopic += h / 4 * (cs.dot(after, momentum) * after - cs.dot(spin, before) * spin)
    down = cs.vertcat(0, 0, -1)
    return cs.vertcat(
        (start[nlp.POSITION] - end[nlp.POSITION]) / h + end[nlp.VELOCITY],
        turned / cs.sqrt(cs.sumsqr(turned)) - end[nlp.ATTITUDE],
        start[nlp.VELOCITY] + h * (down + force / mass) - end[nlp.VELOCITY],
        spin + h * cs.inv(inertia) @ (torque - gyroscopic) - after,
    )


def smoothed(a, b, delta: float):
    """The smoothed function of Fischer and Burmeister."""
    return a + b - cs.sqrt(a * a + b * b + 2 * delta)


def exponential(theta: cs.SX) -> cs.SX:
    """The unit quaternion of a rotation vector."""
    angle = cs.sqrt(cs.sumsqr(theta))
    return cs.vertcat(cs.cos(angle / 2), cs.sin(angle / 2) / angle * theta)


def conjugated(q) -> cs.SX:
    return cs.vertcat(q[0], -q[1], -q[2], -q[3])


def problem(given: dict) -> tuple[cs.SX, cs.SX, cs.SX]:
    """Variables x, objective f and rows g of a point's problem."""
    length = max(max(size) for size in SIZES) / 2
    mass = float(np.sqrt(MASSES[0] * MASSES[1]))
    time = float(np.sqrt(length / GRAVITY))
    speed, weight = length / time, mass * GRAVITY
    h = STEP / time
    delta, compliance = given["delta"], given["compliance"] * h
    epsilon = 0.1 * float(np.sqrt(delta))
    masses = [own / mass for own in MASSES]
    inertias = []
    for own, (a, b, c) in zip(masses, SIZES):
        moments = np.array([b * b + c * c, a * a + c * c, a * a + b * b]) * own / 12 / length**2
        inertias.append(cs.SX(cs.diag(cs.DM(moments))))

    columns: list[cs.SX] = []
    f, rows = cs.SX(0), []

    def chosen(name: str, ranges) -> cs.SX:
        """Controls in SI units; x has them over the length of their range."""
        scaled = cs.SX.sym(name, len(ranges))
        columns.append(scaled)
        return scaled * cs.DM([high - low for low, high in ranges])

    turn, fast = chosen("turn", WIDE), chosen("fast", WIDE)
    starts = [cs.SX.sym(f"X0_{body}", nlp.STATE) for body in range(2)]
    columns += starts
    rows.append(starts[1][nlp.ATTITUDE] - exponential(turn))
    rows.append(starts[0][nlp.VELOCITY] - fast / speed)
    states, slacks = [starts], []
    torque_of_run = None
    for step in range(STEPS):
        ends = [cs.SX.sym(f"X{step + 1}_{body}", nlp.STATE) for body in range(2)]
        columns += ends
        forces = []
        for i, contact in enumerate(given["contacts"][step]):
            count = 4 if contact["friction"] > 0 else 1
            own = cs.SX.sym(f"F{step}_{i}", count)
            columns.append(own)
            forces.append(own)
        push = chosen(f"push{step}", PUSH)
        if step == 0:
            torque_of_run = chosen("torque", WIDE)
            f += 1e-2 * STEPS * cs.sumsqr(torque_of_run)
        pull = chosen(f"pull{step}", WIDE)
        f += 1e-2 * (cs.sumsqr(push[:3]) + cs.sumsqr(pull))
        slack = cs.SX.sym(f"s{step}")
        columns.append(slack)
        f += 2.0 * (length * slack) ** 2

        old = states[-1]
        turned = [nlp.rotation(state[nlp.ATTITUDE]) for state in old]
        along = push[0] * (NORMAL + 0.4 * push[1] * FIRST + 0.4 * push[2] * SECOND)
        place = cs.DM([-SIZES[0][0] / 2, 0, 0]) + push[3] * FIRST + push[4] * SECOND
        loads = [turned[0] @ along / weight, pull / weight]
        torques = [
            cs.cross(place, along) / (weight * length),
            turned[1].T @ torque_of_run / (weight * length),
        ]
        laws = []
        for contact, own in zip(given["contacts"][step], forces):
            a, b = contact["a"], contact["b"]
            point = cs.DM(contact["point"]) / length
            radius, offset = contact["radius"] / length, contact["offset"] / length
            frame, mu = cs.DM(np.array(contact["frame"])), contact["friction"]
            rubs = own.numel() == 4
            force = own[:3] if rubs else cs.vertcat(0, 0, own[0])
            g = frame @ force
            n = frame[:, 2]

            def seen(at: list[cs.SX]) -> cs.SX:
                state = at[a]
                s = state[nlp.POSITION] + nlp.rotation(state[nlp.ATTITUDE]) @ point
                if b is None:
                    return s
                return nlp.rotation(at[b][nlp.ATTITUDE]).T @ (s - at[b][nlp.POSITION])

            turned_b = cs.SX.eye(3) if b is None else turned[b]
            loads[a] += turned_b @ g
            torques[a] += cs.cross(point, turned[a].T @ turned_b @ g)
            torques[a] -= radius * (turned[a].T @ turned_b @ cs.cross(n, g))
            if b is not None:
                loads[b] -= turned_b @ g
                torques[b] -= cs.cross(seen(old) - radius * n, g)
            gap = (cs.dot(n, seen(ends)) - offset - radius) / h
            normal = force[2]
            if not rubs:
                laws.append(smoothed(normal, gap + compliance * normal, delta))
                continue
            slip = frame[:, :2].T @ (seen(ends) - seen(old)) / h
            for axis in range(2):
                w = cs.cross(n, frame[:, axis])
                rolling = cs.dot(turned_b @ w, turned[a] @ ends[a][nlp.SPIN])
                if b is not None:
                    rolling -= cs.dot(w, ends[b][nlp.SPIN])
                slip[axis] -= radius * rolling
            slip += compliance * force[:2]
            laws.append(smoothed(normal, gap + compliance * normal, delta))
            laws.append(mu * normal * slip + own[3] * force[:2])
            room = mu * normal - nlp.smooth_norm(force[:2], epsilon)
            laws.append(smoothed(own[3], room, delta))
        for body in range(2):
            rows.append(
                motion(h, masses[body], inertias[body], old[body], ends[body], loads[body], torques[body])
            )
        rows += laws
        r = ends[0][nlp.POSITION] * length
        bell = 0.3 * cs.exp(-(((r[0] - 0.1) / 0.2) ** 2))
        rows.append((r[2] - bell) / length + slack)
        states.append(ends)
    one, two = states[-1]
    f += 3.0 * cs.sumsqr(one[nlp.POSITION][:2] * length - cs.DM([0.5, 0.3]))
    f += 0.4 * cs.sumsqr(one[nlp.VELOCITY] * speed - cs.DM([0.0, 0.1, 0.0]))
    q = one[nlp.ATTITUDE]
    # From the attitude (1, 0, 0, 0), about z.
    apart = 2 * cs.atan2(q[3], q[0]) - np.radians(40.0)
    whole = 2 * np.pi
    f += 0.7 * (apart - whole * cs.floor(apart / whole + 0.5)) ** 2
    p = nlp.left(conjugated(cs.SX([0.8, 0.0, -0.6, 0.0]))) @ states[1][1][nlp.ATTITUDE]
    p = cs.if_else(p[0] < 0, -p, p)
    f += 1.3 * 4 * cs.atan2(cs.sqrt(cs.sumsqr(p[1:])), p[0]) ** 2
    down = nlp.rotation(two[nlp.ATTITUDE])[:, 0] - cs.DM([0.0, 0.0, -1.0])
    f += 0.6 * cs.sumsqr(down)
    return cs.vertcat(*columns), f, cs.vertcat(*rows)


def contact(rng, pair) -> dict:
    a, b = pair
    w, x, y, z = unit(rng.normal(size=4))
    columns = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return {
        "a": a,
        "b": b,
        "point": rounded(rng.normal(0, 0.3, 3)).tolist(),
        "radius": rounded(rng.uniform(0.05, 0.1)) if rng.integers(2) else 0.0,
        "frame": np.array(columns).tolist(),
        "offset": rounded(rng.normal(0, 0.3)),
        "friction": rounded(rng.uniform(0.1, 1)) if rng.integers(4) else 0.0,
    }


def record(index: int) -> dict:
    """One line of the file."""
    rng = np.random.default_rng((SEED, index))
    pairs = ((0, None), (1, 0), (0, 1), (1, None), (1, 0))
    given = {
        "contacts": [[contact(rng, pair) for pair in pairs] for _ in range(STEPS)],
        "delta": rounded(10 ** rng.uniform(-4, 0)),
        "compliance": rounded(10 ** rng.uniform(-3, 0)),
    }
    x, f, g = problem(given)
    sigma, y = cs.SX.sym("sigma"), cs.SX.sym("y", g.numel())
    hessian, _ = cs.hessian(sigma * f + cs.dot(y, g), x)
    outputs = [f, cs.gradient(f, x), g, cs.jacobian(g, x), cs.tril(hessian)]
    function = cs.Function("plan", [x, sigma, y], outputs)
    point = rounded(rng.normal(size=x.numel()))
    multipliers = rounded(rng.normal(size=g.numel()))
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
    return {"name": f"plan-{index:02}", "input": given, "output": output}


def main() -> None:
    head = json.dumps({"scene": SCENE, "problem": PROBLEM}, separators=(",", ":"))
    lines = [json.dumps(record(i), separators=(",", ":"), allow_nan=False) for i in range(POINTS)]
    text = "\n".join([head, *lines]) + "\n"
    OUTPUT.write_bytes(gzip.compress(text.encode(), 9, mtime=0))
    print(f"{OUTPUT.name}: {len(lines)} points, {OUTPUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
