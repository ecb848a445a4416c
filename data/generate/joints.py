"""Writes data/joints.jsonl.gz: values and exact derivatives of the step of bodies with joints and gears.

Each line is one point of a scene of two or three bodies: the inputs, and the objective, its gradient, the rows, their
Jacobian and the Hessian of the Lagrangian there, all differentiated by CasADi. Symbols are those of `several.py`.
Along every coordinate g of a joint, m (that of a turn times ℓ), forces f act, each with a law:

    u + c f − u* − a + b = 0,   s_a − a (f − low) ≥ 0,   s_b − b (high − f) ≥ 0,   u = Σ w (g⁺ − g_k)/h

    variables x    X⁺ of each body; of each force f; a, s_a where it is bounded below; b, s_b where above
    rows g         dynamics; of each force the equation and its products

Angles are those of rotation matrices here (atan2, asin, acos of entries), those of tumble arguments of quaternions.
"""

import gzip
import json
from pathlib import Path

import casadi as cs
import numpy as np

import step_nlp as nlp
from derivatives import rounded, triplets, unit
from several import end_of

OUTPUT = Path(__file__).resolve().parents[1] / "joints.jsonl.gz"
SEED = 2306
POINTS = 24
TAU = 2 * np.pi


def conjugate(q):
    return cs.vertcat(q[0], -q[1], -q[2], -q[3])


def times(p, q):
    return nlp.left(p) @ q


def wrapped(angle):
    """The angle within half a turn of zero; its derivative is that of the angle."""
    return angle - TAU * cs.floor(angle / TAU + 0.5)


class Seen:
    """A joint with its bodies at `states` (SX or numbers)."""

    def __init__(self, joint: dict, states: list) -> None:
        (anchor_a, turn_a), (anchor_b, turn_b) = joint["frames"]
        a = cs.SX(states[joint["a"]])
        q_b, in_b = cs.SX([1, 0, 0, 0]), cs.SX.eye(3)
        place = a[nlp.POSITION] + nlp.rotation(a[nlp.ATTITUDE]) @ cs.SX(anchor_a)
        if joint["b"] is not None:
            b = cs.SX(states[joint["b"]])
            q_b = b[nlp.ATTITUDE]
            place = nlp.rotation(q_b).T @ (place - b[nlp.POSITION])
        self.axes = in_b if joint["b"] is None else nlp.rotation(q_b)
        frame = nlp.rotation(cs.SX(turn_b))
        self.axes = self.axes @ frame
        self.place = frame.T @ (place - cs.SX(anchor_b))
        side = times(q_b, cs.SX(turn_b))
        self.turn = times(conjugate(side), times(a[nlp.ATTITUDE], cs.SX(turn_a)))
        self.matrix = nlp.rotation(self.turn)


def twist(turn):
    """Of a turn, the part about z."""
    about = cs.vertcat(turn[0], 0, 0, turn[3])
    return about / cs.norm_2(about)


def angle(kind: str, k: int, seen: Seen):
    """A free angle (rad) but for whole turns, of the first of both triples of a gimbal."""
    m = seen.matrix / cs.sumsqr(seen.turn)
    if kind == "ball" and k == 0:
        return cs.acos(m[2, 2])
    if kind in ("hinge", "ball"):
        t = twist(seen.turn)
        return cs.atan2(2 * t[0] * t[3], t[0] ** 2 - t[3] ** 2)
    return (cs.atan2(-m[1, 2], m[1, 1]), cs.atan2(-m[2, 0], m[0, 0]), cs.asin(m[1, 0]))[k]


def coordinate(joint: dict, states: list, ends: list, length: float, which: str, k: int):
    """What of a coordinate counts at the end, m: of what is locked itself, of others the change; and x_k."""
    start, end = Seen(joint, states), Seen(joint, ends)
    locked = joint[which][k] is None
    if which == "linear":
        return end.place[k] - (0 if locked else start.place[k]), start.place[k]
    kind = joint["kind"]
    if locked and kind == "universal":
        return length * end.matrix[1, 0], cs.SX(0)
    if locked:
        back = twist(start.turn) if kind == "hinge" else cs.sign(start.turn[0]) * cs.SX([1, 0, 0, 0])
        return length * 2 * times(conjugate(back), end.turn)[1 + k], cs.SX(0)
    x = joint["turns"][k]
    # Of (α + π, β + π, π − γ), the other triple, γ runs the other way.
    sign = -1 if joint["other"] and k == 2 else 1
    change = wrapped(angle(kind, k, end) - angle(kind, k, start))
    if kind == "gimbal" and k == 2 and joint["middle"]["backwards"]:
        sign = -sign
    return length * sign * change, cs.SX(x)


def usual_length(joint: dict, bodies: list) -> float:
    """(J2)."""
    linear = angular = 0.0
    for body, (anchor, _) in zip((joint["a"], joint["b"]), joint["frames"]):
        if body is None:
            continue
        inverse = np.linalg.inv(bodies[body]["inertia"])
        x, y, z = anchor
        lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        linear += 1 / bodies[body]["mass"] + np.trace(lever.T @ inverse @ lever) / 3
        angular += np.trace(inverse) / 3
    return float(np.sqrt(linear / angular))


def number(value) -> float:
    return float(cs.DM(cs.evalf(cs.SX(value))))


def laws(drive: dict, x: float, rate: float, h: float, length: float) -> tuple:
    """The force at any speed, and (u*, c, low, high) of the others."""
    found = []
    stiffness, damping, armature = drive["stiffness"], drive["damping"], drive["armature"]
    slope = (stiffness * h + damping + armature / h) / length**2
    value = (stiffness * (drive["rest"] - x) + armature * rate / h) / length
    if slope > 0:
        found.append((value / slope, 1 / slope, None, None))
    if drive["friction"] > 0:
        found.append((0.0, 0.0, -drive["friction"] / length, drive["friction"] / length))
    motor = drive["motor"]
    if motor is not None:
        most = motor["most"] / length
        if "speed" in motor:
            found.append((motor["speed"] * length, 0.0, -most, most))
        else:
            slope = (motor["stiffness"] * h + motor["damping"]) / length**2
            value = motor["stiffness"] * (motor["position"] - x) / length
            found.append((value / slope, 1 / slope, -most, most))
    if drive["limits"] is not None:
        low, high = drive["limits"]
        found.append((length * (low - x) / h, 0.0, 0.0, None))
        found.append((length * (high - x) / h, 0.0, None, 0.0))
    return drive["force"] / length, found


def problem(scene: dict) -> tuple[cs.SX, cs.SX, cs.SX]:
    """Variables x, objective f and rows g of a scene."""
    bodies, joints, h = scene["bodies"], scene["joints"], scene["dt"]
    states = [body["state"] for body in bodies]
    ends = [cs.SX.sym(f"X{b}", nlp.STATE) for b in range(len(bodies))]
    push = [cs.SX(body["wrench"][:3]) for body in bodies]
    torque = [cs.SX(body["wrench"][3:]) for body in bodies]
    before = []
    for state in states:
        r, q = np.array(state[:3]), np.array(state[3:7])
        v, spin = np.array(state[7:10]), np.array(state[10:])
        back = q - h / 2 * np.array(cs.DM(cs.evalf(nlp.left(cs.SX(q)) @ nlp.H @ cs.SX(spin)))).ravel()
        before.append([*(r - h * v), *(back / np.linalg.norm(back)), *v, *spin])

    def act(joint: dict, which: str, k: int, length: float, force) -> None:
        """Puts a force along a coordinate on both bodies, as at the start."""
        a, b = joint["a"], joint["b"]
        state = cs.SX(states[a])
        turn_a = nlp.rotation(state[nlp.ATTITUDE])
        if which == "linear":
            in_world = Seen(joint, states).axes[:, k] * force
            arm = turn_a @ cs.SX(joint["frames"][0][0])
            push[a] += in_world
            torque[a] += turn_a.T @ cs.cross(arm, in_world)
            if b is not None:
                other = cs.SX(states[b])
                apart = state[nlp.POSITION] + arm - other[nlp.POSITION]
                push[b] -= in_world
                torque[b] -= nlp.rotation(other[nlp.ATTITUDE]).T @ cs.cross(apart, in_world)
            return
        spin = cs.SX.sym("spin", 3)
        moved = [cs.SX(s) for s in states]
        moved[a][nlp.ATTITUDE] += nlp.left(state[nlp.ATTITUDE]) @ nlp.H @ spin / 2
        g, _ = coordinate(joint, states, moved, length, which, k)
        # Not where it is measured from: an arc cosine has no slope to a side.
        about = cs.substitute(cs.gradient(g, spin), spin, cs.SX.zeros(3)) * force
        torque[a] += about
        if b is not None:
            torque[b] -= nlp.rotation(cs.SX(states[b][3:7])).T @ turn_a @ about

    blocks, rows, slacks = [], [], []

    def bond(along: list, law: tuple) -> None:
        """Adds a force along the coordinates ((joint, which, k, ℓ), weight)."""
        target, yields, low, high = law
        f = cs.SX.sym(f"f{len(blocks)}")
        blocks.append(f)
        u = cs.SX(0)
        for (joint, which, k, length), weight in along:
            g, _ = coordinate(joint, states, ends, length, which, k)
            u += weight * g / h
            act(joint, which, k, length, weight * f)
        missed, products = u + yields * f - target, []
        for sign, bound in ((1, low), (-1, high)):
            if bound is None:
                continue
            beside, slack = cs.SX.sym(f"a{len(blocks)}"), cs.SX.sym(f"s{len(blocks)}")
            blocks.extend((beside, slack))
            slacks.append(slack)
            missed -= sign * beside
            products.append(slack - beside * sign * (f - bound))
        rows.extend((missed, *products))

    known = {}
    for index, joint in enumerate(joints):
        length = joint["length"] or usual_length(joint, bodies)
        for which in ("linear", "angular"):
            for k in range(3):
                if which == "angular" and joint["kind"] == "free":
                    continue
                drive, of = joint[which][k], 1.0 if which == "linear" else length
                if which == "angular" and joint["kind"] == "ball" and k == 1:
                    continue
                along = (joint, which, k, of)
                if drive is None:
                    bond([(along, 1.0)], (0.0, 0.0, None, None))
                    continue
                _, x = coordinate(joint, states, states, of, which, k)
                x = number(x)
                _, came = coordinate(joint, before, states, of, which, k)
                if which == "linear":
                    rate = (x - number(came)) / h
                else:
                    back, _ = coordinate(joint, states, before, of, which, k)
                    rate = -number(back) / of / h
                constant, found = laws(drive, x, rate, h, of)
                if joint["kind"] == "ball" and k == 0:
                    found = found[1:]
                for law in found:
                    bond([(along, 1.0)], law)
                if constant:
                    act(joint, which, k, of, constant)
                known[index, which, k] = along, x
    for gear in scene["gears"]:
        (first, x), (second, y) = (known[tuple(gear[side])] for side in ("first", "second"))
        missed = x - gear["ratio"] * y - gear["offset"]
        weights = 1.0, -gear["ratio"] * first[3] / second[3]
        bond(list(zip((first, second), weights)), (-first[3] * missed / h, 0.0, None, None))
    motion = [
        end_of(body, end, force, turning, scene)
        for body, end, force, turning in zip(bodies, ends, push, torque)
    ]
    f = cs.sumsqr(cs.vertcat(*slacks)) if slacks else cs.SX(0)
    return cs.vertcat(*ends, *blocks), f, cs.vertcat(*motion, *rows)


NONE = {
    "limits": None,
    "friction": 0.0,
    "stiffness": 0.0,
    "rest": 0.0,
    "damping": 0.0,
    "force": 0.0,
    "armature": 0.0,
    "motor": None,
}


def scene(rng, count: int, index: int) -> dict:
    """A scene without physical sense; states are those of unit quaternions at step k."""
    h = rounded(rng.uniform(0.02, 0.05))

    def body() -> dict:
        basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        full = rounded(basis @ np.diag(rng.uniform(1.0, 1.9, 3)) @ basis.T)
        symmetric = np.tril(full) + np.tril(full, -1).T
        parts = rng.normal(0, 2, 3), unit(rng.normal(size=4)), rng.normal(0, 3, 3), rng.uniform(-2, 2, 3)
        return {
            "mass": rounded(10 ** rng.uniform(-0.5, 1)),
            "inertia": symmetric.tolist(),
            "state": np.concatenate(parts).tolist(),
            "wrench": rounded(rng.normal(0, 10, 6)).tolist(),
        }

    def drive(x: float) -> dict:
        """Some of what may act, about the coordinate x."""
        made = dict(NONE)
        if rng.integers(2):
            made["limits"] = rounded(np.sort(x + rng.uniform(-1, 1, 2))).tolist()
        if rng.integers(2):
            made |= {"friction": rounded(rng.uniform(1, 20))}
        if rng.integers(2):
            made |= {"stiffness": rounded(rng.uniform(1, 50)), "rest": rounded(rng.normal())}
        if rng.integers(2):
            made |= {"damping": rounded(rng.uniform(0.1, 5)), "force": rounded(rng.normal(0, 5))}
        if rng.integers(2):
            made |= {"armature": rounded(rng.uniform(0.1, 2))}
        motor = rng.integers(3)
        most = rounded(rng.uniform(1, 30))
        if motor == 1:
            made["motor"] = {"speed": rounded(rng.normal()), "most": most}
        if motor == 2:
            numbers = rng.normal(), rng.uniform(1, 50), rng.uniform(0, 5)
            position, stiffness, damping = (rounded(value) for value in numbers)
            made["motor"] = {
                "position": position,
                "stiffness": stiffness,
                "damping": damping,
                "most": most,
            }
        return made

    bodies = [body() for _ in range(count)]
    states = [body["state"] for body in bodies]
    kinds = ("hinge", "gimbal", "ball", "universal", "fixed", "free")

    def joint(number: int) -> dict:
        a = int(rng.integers(count))
        b = int((a + rng.integers(1, count)) % count) if rng.integers(4) else None
        kind = kinds[(number + index) % len(kinds)]
        frames = [
            [rounded(rng.normal(size=3)).tolist(), unit(rng.normal(size=4)).tolist()] for _ in range(2)
        ]
        made = {
            "a": a,
            "b": b,
            "kind": kind,
            "frames": frames,
            "length": rounded(rng.uniform(0.3, 2)) if rng.integers(2) else None,
            "middle": {"backwards": bool(rng.integers(2)), "zero": 0.0},
            "other": False,
            "turns": [0.0, 0.0, 0.0],
        }
        seen = Seen(made, states)
        slide = kind in ("free", "fixed") or rng.integers(3) == 0
        linear = [None, None, drive(number_at(seen.place[2])) if slide else None]
        angular = [None, None, None]
        turns = [0.0, 0.0, 0.0]
        if kind not in ("fixed", "free"):
            free = {"hinge": (2,), "ball": (0, 2), "gimbal": (0, 1, 2), "universal": (0, 1)}[kind]
            for k in free:
                turns[k] = number_at(angle(kind, k, seen))
            if kind == "gimbal":
                # Sometimes the other triple, which is the same turn.
                made["other"] = bool(rng.integers(2))
                if made["other"]:
                    turns = [turns[0] + np.pi, turns[1] + np.pi, np.pi - turns[2]]
                if made["middle"]["backwards"]:
                    turns[2] = -turns[2]
            # Whole turns that it has made before.
            counted = [k for k in free if not (kind == "ball" and k == 0)]
            for k in counted:
                turns[k] += TAU * int(rng.integers(-2, 3)) if kind != "gimbal" or k != 2 else 0.0
            for k in free:
                angular[k] = drive(turns[k])
            if kind == "ball":
                most = rounded(min(3.0, turns[0] + rng.uniform(-0.2, 0.5)))
                angular = [dict(NONE) | {"limits": [0.0, max(0.1, most)]}, dict(NONE), angular[2]]
        if kind == "free":
            angular = [dict(NONE), dict(NONE), dict(NONE)]
        return made | {"linear": linear, "angular": angular, "turns": turns}

    joints = [joint(i) for i in range(3)]
    borne = [
        [i, which, k]
        for i, of in enumerate(joints)
        for which in ("linear", "angular")
        for k in range(3)
        if of[which][k] is not None
        and not (which == "angular" and (of["kind"] == "free" or of["kind"] == "ball" and k < 2))
    ]
    gears = []
    if len(borne) > 1:
        first, second = rng.choice(len(borne), 2, replace=False)
        gears.append(
            {
                "first": borne[first],
                "second": borne[second],
                "ratio": rounded(rng.normal()),
                "offset": rounded(rng.normal()),
            }
        )
    return {
        "bodies": bodies,
        "joints": joints,
        "gears": gears,
        "gravity": rounded(rng.normal(0, 5, 3)).tolist(),
        "dt": h,
    }


def number_at(value) -> float:
    return number(value)


def record(index: int) -> dict:
    """One line of the file."""
    rng = np.random.default_rng((SEED, index))
    given = scene(rng, 2 + index % 2, index)
    x, f, g = problem(given)
    sigma, y = cs.SX.sym("sigma"), cs.SX.sym("y", g.numel())
    hessian, _ = cs.hessian(sigma * f + cs.dot(y, g), x)
    outputs = [f, cs.gradient(f, x), g, cs.jacobian(g, x), cs.tril(hessian)]
    function = cs.Function("step", [x, sigma, y], outputs)
    # Near the start, where no angle is about to jump.
    ends = [
        np.array(body["state"]) + 0.1 * rng.normal(size=nlp.STATE) for body in given["bodies"]
    ]
    rest = rng.uniform(-20, 20, x.numel() - nlp.STATE * len(ends))
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
    return {"name": f"joints-{index:02}", "input": given, "output": output}


def main() -> None:
    lines = [json.dumps(record(i), separators=(",", ":"), allow_nan=False) for i in range(POINTS)]
    OUTPUT.write_bytes(gzip.compress(("\n".join(lines) + "\n").encode(), 9, mtime=0))
    print(f"{OUTPUT.name}: {len(lines)} points, {OUTPUT.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
