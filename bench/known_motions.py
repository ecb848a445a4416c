"""Motions with known ends, as scenes of files and the exact place of their last body.

Closed forms, and integrations of smooth pieces from event to event by the classical Runge–Kutta method.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

G = 9.81
Vector = list[float]


class Known(NamedTuple):
    """A scene, its duration, s, and the place of its last body at the end, m."""

    text: str
    duration: float
    end: Vector
    time_step: float = 0.01


def sign(x: float) -> float:
    """Sign of a number; 0 for 0."""
    return math.copysign(1.0, x) if x else 0.0


def integrated(
    rates: Callable[[Vector], Sequence[float]],
    start: Vector,
    duration: float,
    event: Callable[[Vector], float] | None = None,
) -> tuple[float, Vector]:
    """Time and state at which ``event`` becomes negative, or at the end."""
    steps = max(1, math.ceil(duration / 2e-4))

    def moved(state: Vector, by: Sequence[float], h: float) -> Vector:
        return [x + h * v for x, v in zip(state, by, strict=True)]

    def advanced(state: Vector, h: float) -> Vector:
        a = rates(state)
        b = rates(moved(state, a, 0.5 * h))
        c = rates(moved(state, b, 0.5 * h))
        d = rates(moved(state, c, h))
        return [x + h / 6.0 * (k + 2.0 * (m + n) + o) for x, k, m, n, o in zip(state, a, b, c, d, strict=True)]

    state, h = start, duration / steps
    for step in range(steps):
        after = advanced(state, h)
        if event and event(after) < 0.0:
            low, high = 0.0, h
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if event(advanced(state, middle)) < 0.0 else (middle, high)
            return step * h + high, advanced(state, high)
        state = after
    return duration, state


def slipping(
    force: Callable[[float, Vector], float], friction: float, static: float, start: Vector, duration: float, belt: float = 0.0
) -> float:
    """Coordinate of a body of unit mass under a force and dry friction, from place and speed at the start.

    ``friction`` and ``static`` are accelerations. The floor moves with the speed ``belt``.
    """
    t, state, sticks = 0.0, [*start, 0.0], abs(start[1] - belt) < 1e-12
    while t < duration - 1e-12:
        if sticks:
            rates = lambda y: [belt, 0.0, 1.0]
            event = lambda y: static - abs(force(y[2], y)) + 1e-15
            side = 0.0
        else:
            before = state[1] - belt
            side = sign(before) if abs(before) > 1e-12 else sign(force(state[2], state))
            rates = lambda y: [y[1], force(y[2], y) - side * friction, 1.0]
            event = lambda y: side * (y[1] - belt) + 1e-15
        since, state = integrated(rates, state, duration - t, event)
        t += since
        if not sticks:
            state[1] = belt
            sticks = abs(force(state[2], state)) <= static
        else:
            sticks = False
    return state[0]


def ground(friction: float, more: str = "") -> str:
    """Table of the ground, and of the body that follows."""
    return f'[ground]\nfriction = {friction!r}\n{more}[[bodies]]\nname = "body"\nmass = 1.0\n'


def tilted(degrees: float) -> tuple[str, float, float]:
    """Gravity over a floor that falls towards x, and its parts along and into the floor, m/s²."""
    along, down = G * math.sin(math.radians(degrees)), G * math.cos(math.radians(degrees))
    return f"gravity = [{along!r}, 0.0, {-down!r}]\n", along, down


BLOCK = "box = [0.4, 0.4, 0.1]\nposition = [0, 0, 0.05]\n"
BALL = "sphere = 0.1\nposition = [0, 0, 0.1]\n"
CYLINDER = "cylinder = { radius = 0.1, length = 0.3 }\nposition = [0, 0, 0.1]\nattitude = { axis = [1, 0, 0], degrees = 90 }\n"
PLANE = "[ground]\nnone = true\nfriction = 0.3\n"


def slide(speed: float, duration: float, friction: float = 0.3, more: str = "", **rest: float) -> Known:
    """Block that slides, to rest if there is time."""
    time = min(duration, speed / (friction * G))
    text = ground(friction, more) + BLOCK + f"velocity = [{speed!r}, 0, 0]\n"
    return Known(text, duration, [speed * time - 0.5 * friction * G * time**2, 0.0, 0.05], **rest)


def slope(degrees: float, friction: float, speed: float, duration: float) -> Known:
    """Block up a slope and back."""
    gravity, along, down = tilted(degrees)
    up, back = along + friction * down, max(0.0, along - friction * down)
    left = max(0.0, duration - speed / up)
    end = -speed * (duration - left) + 0.5 * up * (duration - left) ** 2 + 0.5 * back * left**2
    return Known(gravity + ground(friction) + BLOCK + f"velocity = [{-speed!r}, 0, 0]\n", duration, [end, 0.0, 0.05])


def ramp(friction: float, static: float, rate: float, duration: float) -> Known:
    """Block under a force that grows, N/s."""
    since = max(0.0, duration - static * G / rate)
    begin = static * G - friction * G
    end = 0.5 * begin * since**2 + rate * since**3 / 6.0
    load = f"load = {{ force = [[0, 0, 0, 0], [20, {20 * rate!r}, 0, 0]], at = [0, 0, -0.05] }}\n"
    more = f"static_friction = {static!r}\n" if static > friction else ""
    return Known(ground(friction, more) + BLOCK + load, duration, [end, 0.0, 0.05])


def pushed(friction: float, static: float, force: float, begin: float, duration: float) -> Known:
    """Block under a force that begins at once, N."""
    end = 0.5 * (force - friction * G) * (duration - begin) ** 2
    rows = f"[[0, 0, 0, 0], [{begin!r}, 0, 0, 0], [{begin!r}, {force!r}, 0, 0]]"
    load = f"load = {{ force = {rows}, at = [0, 0, -0.05] }}\n"
    return Known(ground(friction, f"static_friction = {static!r}\n") + BLOCK + load, duration, [end, 0.0, 0.05])


def triangle(friction: float, static: float, size: float, period: float, duration: float) -> Known:
    """Block under a force that goes to and fro in straight pieces."""
    force = lambda t, _: size * (4.0 * abs((t / period + 0.25) % 1.0 - 0.5) - 1.0) * -1.0
    knots = [[k * period / 4.0, [0.0, size, 0.0, -size][k % 4]] for k in range(math.ceil(4.0 * duration / period) + 2)]
    rows = ", ".join(f"[{t!r}, {f!r}, 0, 0]" for t, f in knots)
    more = f"static_friction = {static!r}\n" if static > friction else ""
    text = ground(friction, more) + BLOCK + f"load = {{ force = [{rows}], at = [0, 0, -0.05] }}\n"
    end = slipping(force, friction * G, static * G, [0.0, 0.0], duration)
    return Known(text, duration, [end, 0.0, 0.05])


def spring(friction: float, static: float, stiffness: float, start: float, duration: float, belt: float = 0.0) -> Known:
    """Block on a spring over a floor, or over a belt."""
    more = f"static_friction = {static!r}\n" if static > friction else ""
    moving = f'[[surfaces]]\nof = "ground"\nvelocity = [{belt!r}, 0, 0]\n' if belt else ""
    own = f"velocity = [{belt!r}, 0, 0]\n" if belt else ""
    joint = (
        '[[joints]]\nname = "s"\ntype = "free"\nbodies = "body"\nanchor_a = [0, 0, 0]\nanchor_b = [0, 0, 0.05]\n'
        f"x = {{ stiffness = {stiffness!r} }}\n"
    )
    block = BLOCK.replace("[0, 0, 0.05]", f"[{start!r}, 0, 0.05]")
    end = slipping(lambda _, y: -stiffness * y[0], friction * G, static * G, [start, belt], duration, belt)
    return Known(ground(friction, more) + block + own + moving + joint, duration, [end, 0.0, 0.05])


def rolling_resistance(duration: float) -> Known:
    """Ball that rolls to rest."""
    brake = 0.01 * G / (1.4 * 0.1)
    time = min(duration, 1.0 / brake)
    text = ground(0.5, "rolling_friction = 0.01\n") + BALL + "velocity = [1, 0, 0]\nspin = [0, 10, 0]\n"
    return Known(text, duration, [time - 0.5 * brake * time**2, 0.0, 0.1])


def rolling_back(degrees: float, resistance: float, speed: float, duration: float) -> Known:
    """Ball that rolls up a slope and back, with rolling resistance."""
    gravity, along, down = tilted(degrees)
    moment = resistance / 0.1 * down
    up, back = (along + moment) / 1.4, (along - moment) / 1.4
    left = duration - speed / up
    end = -0.5 * speed * speed / up + 0.5 * back * left**2
    text = gravity + ground(0.9, f"rolling_friction = {resistance!r}\n") + BALL
    return Known(text + f"velocity = [{-speed!r}, 0, 0]\nspin = [0, {-10 * speed!r}, 0]\n", duration, [end, 0.0, 0.1])


def across(degrees: float, resistance: float, speed: float, duration: float) -> Known:
    """Ball that rolls across a slope with rolling resistance, which opposes the velocity."""
    gravity, along, down = tilted(degrees)

    def rates(y: Vector) -> Vector:
        size = math.hypot(y[2], y[3])
        brake = resistance / 0.1 * down / size
        return [y[2], y[3], (along - brake * y[2]) / 1.4, -brake * y[3] / 1.4]

    _, end = integrated(rates, [0.0, 0.0, 0.0, speed], duration)
    text = gravity + ground(0.9, f"rolling_friction = {resistance!r}\n") + BALL
    text += f"velocity = [0, {speed!r}, 0]\nspin = [{-10 * speed!r}, 0, 0]\n"
    return Known(text, duration, [end[0], end[1], 0.1])


def slip_to_roll() -> Known:
    """Ball whose slip has a constant direction until it rolls."""
    velocity, slip = [2.0, 0.0], [2.0 + 5.0 * 0.1, 3.0 * 0.1]
    size, brake, duration = math.hypot(*slip), 0.3 * G, 0.4
    until = size / (3.5 * brake)
    way = brake * until * (duration - 0.5 * until)
    text = ground(0.3) + BALL + "velocity = [2, 0, 0]\nspin = [3, -5, 2]\n"
    return Known(text, duration, [v * duration - s / size * way for v, s in zip(velocity, slip, strict=True)] + [0.1])


def roll_down(shape: str, share: float, duration: float) -> Known:
    """Cylinder or ball that rolls down a slope of 15 degrees from rest."""
    gravity, along, _ = tilted(15)
    return Known(gravity + ground(0.5) + shape, duration, [along / (1.0 + share) * 0.5 * duration**2, 0.0, 0.1])


def bounce(restitution: float, duration: float, velocity: float = 0.0, spin: float = 0.0, friction: float = 0.4) -> Known:
    """Ball that falls and bounces, with the impulse of friction up to the one that ends the slip."""
    text = ground(friction, f"restitution = {restitution!r}\n") + BALL.replace("0.1]", "0.6]")
    text += f"velocity = [{velocity!r}, 0, 0]\nspin = [0, {spin!r}, 0]\n"
    place, speed, t = [0.0, 0.6], [velocity, 0.0], 0.0
    while True:
        left = (speed[1] + math.sqrt(speed[1] ** 2 + 2.0 * G * (place[1] - 0.1))) / G
        if t + left > duration:
            break
        if left < 1e-9:
            return Known(text, duration, [place[0] + speed[0] * (duration - t), 0.0, 0.1])
        place = [place[0] + speed[0] * left, 0.1]
        fall = speed[1] - G * left
        normal, slip = -(1.0 + restitution) * fall, speed[0] - 0.1 * spin
        push = -sign(slip) * min(abs(slip) / 3.5, friction * normal)
        speed, spin, t = [speed[0] + push, -restitution * fall], spin - push * 0.1 / (0.4 * 0.01), t + left
    left = duration - t
    end = [place[0] + speed[0] * left, 0.0, place[1] + speed[1] * left - 0.5 * G * left**2]
    return Known(text, duration, end)


def drop(duration: float) -> Known:
    """Block that falls flat and rests."""
    return Known(ground(0.3) + BLOCK.replace("0.05]", "0.45]"), duration, [0.0, 0.0, 0.05])


def cradle() -> Known:
    """Three equal balls in a row with gaps of 0.1 m, without loss: the last one goes on with the speed of the first."""
    head = "gravity = 0\n" + PLANE + "restitution = 1.0\n"
    balls = "".join(
        f'[[bodies]]\nname = "{name}"\nmass = 1.0\nsphere = 0.1\nposition = [{x!r}, 0, 0.5]\nvelocity = [{v!r}, 0, 0]\n'
        for name, x, v in (("a", 0.0, 1.3), ("b", 0.3, 0.0), ("c", 0.6, 0.0))
    )
    return Known(head + balls, 0.4, [0.6 + 1.3 * (0.4 - 0.2 / 1.3), 0.0, 0.5])


def wall() -> Known:
    """Block that slides against a wall and back."""
    speed, brake = 2.0, 0.2 * G
    first = (speed - math.sqrt(speed**2 - 2.0 * brake * 0.5)) / brake
    after = 0.5 * (speed - brake * first)
    duration = 0.6
    left = min(duration - first, after / brake)
    text = ground(0.2, "restitution = 0.5\n") + BLOCK + f"velocity = [{speed!r}, 0, 0]\n"
    text += '[[fixed]]\nname = "wall"\nbox = [0.2, 2, 2]\nposition = [0.8, 0, 1.0]\nfriction = 0.0\n'
    return Known(text, duration, [0.5 - after * left + 0.5 * brake * left**2, 0.0, 0.05])


def pendulum(friction: float, duration: float) -> Known:
    """Ball on a rod, with dry friction of the hinge in N m."""
    inertia = 0.25 + 0.4 * 0.01
    force = lambda _, y: -G * 0.5 * math.sin(y[0]) / inertia
    angle = slipping(force, friction / inertia, friction / inertia, [1.0, 0.0], duration)
    text = (
        PLANE + f'[[bodies]]\nname = "ball"\nsphere = 0.1\nmass = 1.0\nposition = [{-0.5 * math.sin(1.0)!r}, 0, {-0.5 * math.cos(1.0)!r}]\n'
        '[[joints]]\nname = "hinge"\ntype = "revolute"\nbodies = "ball"\nanchor = [0, 0, 0]\naxis = [0, 1, 0]\n'
        + (f"friction = {friction!r}\n" if friction else "")
    )
    return Known(text, duration, [-0.5 * math.sin(angle), 0.0, -0.5 * math.cos(angle)])


def brick(duration: float) -> Known:
    """Box that turns freely about no principal axis; its end has the attitude too."""
    a, b, c = 0.4, 0.2, 0.1
    inertia = [(b * b + c * c) / 12, (a * a + c * c) / 12, (a * a + b * b) / 12]
    start = [0.0] * 3 + [1.0, 0.0, 0.0, 0.0, 3.0, 5.0, 2.0]

    def rates(y: Vector) -> Vector:
        w, x, yy, z, p, q, r = y[3:]
        return [
            0.0, 0.0, 0.0,
            0.5 * (-x * p - yy * q - z * r), 0.5 * (w * p + yy * r - z * q),
            0.5 * (w * q + z * p - x * r), 0.5 * (w * r + x * q - yy * p),
            (inertia[1] - inertia[2]) * q * r / inertia[0],
            (inertia[2] - inertia[0]) * r * p / inertia[1],
            (inertia[0] - inertia[1]) * p * q / inertia[2],
        ]  # fmt: skip

    _, end = integrated(rates, start, duration)
    text = "gravity = 0\n" + PLANE + '[[bodies]]\nname = "brick"\nmass = 1.0\nbox = [0.4, 0.2, 0.1]\nposition = [0, 0, 0]\nspin = [3, 5, 2]\n'
    return Known(text, duration, end[:7])


def vibration(duration: float) -> Known:
    """Mass on a spring."""
    text = (
        "gravity = 0\n" + PLANE + '[[bodies]]\nname = "body"\nmass = 1.0\nsphere = 0.1\nposition = [0.2, 0, 0]\n'
        '[[joints]]\nname = "s"\ntype = "prismatic"\nbodies = "body"\nanchor_a = [0, 0, 0]\nanchor_b = [0, 0, 0]\naxis = [1, 0, 0]\n'
        "stiffness = 100.0\n"
    )
    return Known(text, duration, [0.2 * math.cos(10.0 * duration), 0.0, 0.0])


def torsion(friction: float, static: float, rate: float, duration: float) -> Known:
    """Block under a torque about the normal that grows, N m/s; all corners are at one distance from the axis."""
    reach, inertia = 0.2 * math.sqrt(2.0), 0.32 / 12.0
    since = max(0.0, duration - static * G * reach / rate)
    angle = ((static - friction) * G * reach * since**2 / 2.0 + rate * since**3 / 6.0) / inertia
    more = f"static_friction = {static!r}\n" if static > friction else ""
    text = ground(friction, more) + BLOCK + f"load = {{ torque = [[0, 0, 0, 0], [10, 0, 0, {10 * rate!r}]] }}\n"
    return Known(text, duration, [0.0, 0.0, 0.05, math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])


def spin_down(friction: float, spin: float, duration: float) -> Known:
    """Block that turns on the floor to rest."""
    brake = friction * G * 0.2 * math.sqrt(2.0) / (0.32 / 12.0)
    time = min(duration, spin / brake)
    angle = spin * time - 0.5 * brake * time**2
    text = ground(friction) + BLOCK + f"spin = [0, 0, {spin!r}]\n"
    return Known(text, duration, [0.0, 0.0, 0.05, math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])


def pick_up(friction: float, static: float, belt: float, duration: float) -> Known:
    """Block at rest that a belt takes along."""
    time = min(duration, belt / (friction * G))
    more = f"static_friction = {static!r}\n" if static > friction else ""
    text = ground(friction, more) + BLOCK + f'[[surfaces]]\nof = "ground"\nvelocity = [{belt!r}, 0, 0]\n'
    return Known(text, duration, [0.5 * friction * G * time**2 + belt * (duration - time), 0.0, 0.05])


def stacked(below: float, between: float, speed: float, duration: float) -> Known:
    """Block that slides on a long plank of the same mass, which slides on the floor; then both, and they rest."""
    plank = max(0.0, between - 2.0 * below) * G
    time = speed / (between * G + plank)
    start, common = speed * time - 0.5 * between * G * time**2, plank * time
    left = min(duration - time, common / (below * G) if common else 0.0)
    end = start + common * left - 0.5 * below * G * left**2
    text = ground(below).replace('"body"', '"plank"') + "box = [4, 0.6, 0.1]\nposition = [0, 0, 0.05]\n"
    text += f'[[bodies]]\nname = "body"\nmass = 1.0\nbox = [0.2, 0.2, 0.02]\nposition = [0, 0, 0.11]\nvelocity = [{speed!r}, 0, 0]\n'
    text += f'[[friction]]\nbetween = ["plank", "body"]\ncoefficient = {between!r}\n'
    return Known(text, duration, [end, 0.0, 0.11])


def pushed_on(friction: float, restitution: float, speed: float, duration: float) -> Known:
    """Block at rest that another one of the same mass runs into."""
    time = (speed - math.sqrt(speed**2 - 2.0 * friction * G * 0.2)) / (friction * G)
    after = 0.5 * (1.0 + restitution) * (speed - friction * G * time)
    left = min(duration - time, after / (friction * G))
    text = ground(friction, f"restitution = {restitution!r}\n").replace('"body"', '"first"') + BLOCK
    text += f'velocity = [{speed!r}, 0, 0]\n[[bodies]]\nname = "body"\nmass = 1.0\n'
    text += BLOCK.replace("[0, 0, 0.05]", "[0.6, 0, 0.05]").replace("0.4, 0.4", "0.4, 0.2")
    text += '[[friction]]\nbetween = ["first", "body"]\ncoefficient = 0.0\n'
    return Known(text, duration, [0.6 + after * left - 0.5 * friction * G * left**2, 0.0, 0.05])


def loaded_axis(friction: float, static: float, rate: float, duration: float) -> Known:
    """Ball on a slider with dry friction in N under a force that grows, N/s."""
    since = max(0.0, duration - static / rate)
    end = 0.5 * (static - friction) * since**2 + rate * since**3 / 6.0
    more = f"static_friction = {static!r}\n" if static > friction else ""
    text = (
        "gravity = 0\n" + PLANE + '[[bodies]]\nname = "body"\nmass = 1.0\nsphere = 0.1\nposition = [0, 0, 0]\n'
        f"load = {{ force = [[0, 0, 0, 0], [20, {20 * rate!r}, 0, 0]] }}\n"
        '[[joints]]\nname = "s"\ntype = "prismatic"\nbodies = "body"\nanchor = [0, 0, 0]\naxis = [1, 0, 0]\n'
        f"friction = {friction!r}\n{more}"
    )
    return Known(text, duration, [end, 0.0, 0.0])


def carried(friction: float, size: float, period: float, duration: float) -> Known:
    """Block on a tray that moves to and fro with constant speeds: the tray's places are straight pieces."""
    speed = 4.0 * size / period
    count = math.ceil(duration * 4.0 / period) + 2
    places = [[0.0, size, 0.0, -size][k % 4] for k in range(count)]
    # The tray has its first speed at the start; the block rests on it and is as fast.
    t, x, v = 0.0, 0.0, speed
    turns = [period * (0.25 + 0.5 * k) for k in range(count)] + [math.inf]
    belt = speed
    for turn in turns:
        while t < min(turn, duration) - 1e-12:
            until = min(turn, duration) - t
            pull = sign(belt - v) * friction * G if abs(belt - v) > 1e-14 else 0.0
            step = min(until, (belt - v) / pull) if pull else until
            x, v, t = x + v * step + 0.5 * pull * step**2, v + pull * step, t + step
            if pull and step < until:
                v = belt
        belt = -belt
    text = ground(friction).replace('"body"', '"tray"') + "box = [2, 2, 0.1]\nposition = [0, 0, 1]\n"
    text += f"velocity = [{speed!r}, 0, 0]\n"
    text += '[[bodies]]\nname = "body"\nmass = 1.0\nbox = [0.4, 0.4, 0.1]\nposition = [0, 0, 1.1]\n'
    text += f'velocity = [{speed!r}, 0, 0]\n[[driven]]\nbody = "tray"\n'
    text += f"times = {[0.25 * period * k for k in range(count)]!r}\npositions = {[[place, 0, 1] for place in places]!r}\n"
    return Known(text, duration, [x, 0.0, 1.1])


KNOWN: dict[str, Callable[[], Known]] = {
    "slide": lambda: slide(3.0, 0.4),
    "slide to rest": lambda: slide(3.0, 1.4),
    "static: slide to rest": lambda: slide(0.15, 0.3, 0.1, "static_friction = 0.5\n", time_step=0.0005),
    "static: slow slide": lambda: slide(0.05, 0.3, 0.1, "static_friction = 0.5\n", time_step=0.002),
    "slope of 20° and back": lambda: slope(20, 0.2, 2.0, 1.0),
    "slope of 30° and back": lambda: slope(30, 0.3, 2.0, 0.8),
    "slope, stays": lambda: slope(20, 0.5, 2.0, 0.8),
    "ramp": lambda: ramp(0.3, 0.3, 4.0, 1.7),
    "static: ramp": lambda: ramp(0.3, 0.5, 4.0, 2.23),
    "static: steep ramp": lambda: ramp(0.3, 0.6, 10.0, 1.0),
    "to and fro": lambda: triangle(0.2, 0.2, 4.0, 0.4, 0.9),
    "static: to and fro": lambda: triangle(0.2, 0.3, 4.0, 0.4, 0.9),
    "block on a spring": lambda: spring(0.1, 0.1, 25.0, 0.5, 1.6),
    "static: stick-slip": lambda: spring(0.2, 0.3, 50.0, 0.0, 2.0, 0.1),
    "rolling resistance": lambda: rolling_resistance(1.6),
    "rolling back": lambda: rolling_back(10, 0.005, 1.0, 1.2),
    "rolling across": lambda: across(15, 0.01, 1.0, 0.4),
    "slip to roll": slip_to_roll,
    "cylinder rolls": lambda: roll_down(CYLINDER, 0.5, 1.0),
    "ball rolls": lambda: roll_down(BALL, 0.4, 1.0),
    "bounce": lambda: bounce(0.5, 1.2),
    "elastic bounce": lambda: bounce(1.0, 1.2),
    "thrown ball": lambda: bounce(0.7, 1.6, 2.0, 0.0),
    "drop": lambda: drop(0.6),
    "cradle": cradle,
    "wall": wall,
    "pendulum": lambda: pendulum(0.0, 2.0),
    "pendulum with friction": lambda: pendulum(0.3, 1.6),
    "brick": lambda: brick(0.6),
    "vibration": lambda: vibration(1.0),
    "slide, slippery": lambda: slide(1.37, 1.9, 0.083),
    "slide, rough": lambda: slide(4.21, 0.9, 0.71),
    "slope of 8° and back": lambda: slope(8, 0.11, 1.13, 1.7),
    "slope of 40° and back": lambda: slope(40, 0.62, 3.3, 1.1),
    "static: push": lambda: pushed(0.3, 0.5, 6.3, 0.1234, 0.7),
    "static: late ramp": lambda: ramp(0.21, 0.27, 1.7, 1.93),
    "ramp, rough": lambda: ramp(0.83, 0.83, 17.0, 0.71),
    "to and fro, strong": lambda: triangle(0.11, 0.11, 9.3, 0.31, 1.07),
    "static: to and fro, weak": lambda: triangle(0.23, 0.31, 3.37, 0.73, 1.61),
    "block on a stiff spring": lambda: spring(0.07, 0.07, 83.0, 0.31, 1.3),
    "static: fast stick-slip": lambda: spring(0.15, 0.4, 117.0, 0.0, 1.4, 0.37),
    "rolling back, slow": lambda: rolling_back(5, 0.003, 0.63, 1.9),
    "rolling across, fast": lambda: across(25, 0.02, 2.3, 0.7),
    "bounce and spin": lambda: bounce(0.63, 0.97, 1.1, 17.0, 0.23),
    "dead ball": lambda: bounce(0.0, 0.9, 1.3, 0.0, 0.31),
    "pendulum, little friction": lambda: pendulum(0.057, 1.83),
    "torsion": lambda: torsion(0.3, 0.3, 1.3, 1.1),
    "static: torsion": lambda: torsion(0.3, 0.5, 1.0, 1.8),
    "static: fast torsion": lambda: torsion(0.17, 0.23, 3.1, 0.61),
    "turns to rest": lambda: spin_down(0.37, 7.3, 0.9),
    "turns on": lambda: spin_down(0.13, 5.1, 0.31),
    "belt": lambda: pick_up(0.27, 0.27, 0.83, 0.9),
    "static: belt": lambda: pick_up(0.19, 0.33, 0.57, 1.1),
    "plank": lambda: stacked(0.1, 0.5, 2.1, 1.3),
    "plank stays": lambda: stacked(0.4, 0.3, 1.9, 1.1),
    "blocks": lambda: pushed_on(0.2, 0.0, 1.7, 0.9),
    "bouncing blocks": lambda: pushed_on(0.15, 0.6, 1.3, 0.7),
    "axis": lambda: loaded_axis(1.3, 1.3, 3.1, 1.3),
    "static: axis": lambda: loaded_axis(0.9, 2.1, 3.7, 1.7),
    "tray": lambda: carried(0.31, 0.3, 0.9, 1.3),
    "fast tray": lambda: carried(0.11, 0.13, 0.37, 0.83),
}
"""Motions by their names."""
