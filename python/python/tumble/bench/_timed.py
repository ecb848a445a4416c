"""Scenes of the section on speed: boxes on level ground, with steps of 2 ms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._scene import Scene, scene_of

STEP = 0.002
Entry = dict[str, Any]


@dataclass(frozen=True)
class Timed:
    """Scene with the steps before the timed ones."""

    name: str
    scene: Scene
    before: int = 0


def drop(seed: int) -> Timed:
    """Cube of the tutorial, thrown from 2.5 m in a random attitude. Its inertia is 667 times smaller than a solid cube's."""
    attitude = np.random.RandomState(seed).rand(4)
    cube = _box((2.0, 2.0, 2.0), 10.0, (0.0, 0.0, 2.5), attitude)
    cube |= {"inertia": [0.01, 0.01, 0.01], "velocity": [0.0, 4.0, 0.0], "spin": [0.0, -2.0, 1.0]}
    return _timed(f"drop {seed}", 999, [cube], 0.3)


def stack() -> Timed:
    """Ten cubes of 1 m and 1 kg on each other, at rest."""
    return _timed("stack", 500, [_cube((0.0, 0.0, 0.5 + k)) for k in range(10)], 0.5)


def pyramid(rows: int = 5, steps: int = 500) -> Timed:
    """Rows of cubes, 0.1 m apart, each on two of the row below."""
    cubes = [_cube((1.1 * k + 0.55 * row, 0.0, 0.5 + row)) for row in range(rows) for k in range(rows - row)]
    return _timed("pyramid", steps, cubes, 0.5)


def wall(rows: int = 6, across: int = 6, steps: int = 300) -> Timed:
    """Touching bricks, every second row shifted by half a brick."""
    places = [(k + 0.5 * (row % 2), 0.0, 0.25 + 0.5 * row) for row in range(rows) for k in range(across)]
    return _timed("wall", steps, [_box((1.0, 0.5, 0.5), 2.0, place) for place in places], 0.7)


def pile() -> Timed:
    """Thirty boxes of 0.3 to 0.5 m and 1 to 2 kg in random attitudes, dropped on one another."""
    draws = np.random.RandomState(12345)
    boxes = []
    for k in range(30):
        attitude = draws.normal(size=4)
        sides, mass = draws.uniform(0.3, 0.5, size=3), draws.uniform(1.0, 2.0)
        place = (0.9 * (k % 3) - 0.9, 0.9 * (k // 3 % 3) - 0.9, 1.0 + 0.9 * (k // 9))
        boxes.append(_box(sides, mass, place, attitude))
    return _timed("pile", 700, boxes, 0.5)


def stacks(count: int) -> Timed:
    """Stacks of ten cubes at rest, three metres apart, after their first 20 steps."""
    side = int(np.ceil(np.sqrt(count / 10)))
    places = [(3.0 * (k // 10 % side), 3.0 * (k // 10 // side), 0.5 + k % 10) for k in range(count)]
    steps = 20 + max(60, min(500, 20_000 // count))
    return _timed(f"{count} boxes", steps, [_cube(place) for place in places], 0.5, before=20)


def first_steps() -> list[Timed]:
    """First steps of structures at rest."""
    made = [wall(15, 20, 1), wall(25, 40, 1), pyramid(15, 1), pyramid(24, 1)]
    return [Timed(f"{one.name} of {len(one.scene.bodies)}", one.scene) for one in made]


def heaps(seeds: Sequence[int], count: int) -> list[Timed]:
    """Boxes of 0.2 to 0.31 m and 1 to 2 kg that fall above each other, onto open ground and into a bin of 2 m."""
    found = []
    half = 0.275 * (count // 9) + 1.5
    sides = [((0.2, 2.4, 2.0 * half), (x, 0.0, half)) for x in (1.1, -1.1)]
    sides += [((2.4, 0.2, 2.0 * half), (0.0, y, half)) for y in (1.1, -1.1)]
    walls = [{**_box(size, 1.0, place), "fixed": True} for size, place in sides]
    for seed in seeds:
        draws = np.random.RandomState(seed)
        boxes = []
        for k in range(count):
            attitude = draws.normal(size=4)
            size, mass = draws.uniform(0.2, 0.31, size=3), draws.uniform(1.0, 2.0)
            aside = draws.uniform(-0.02, 0.02, size=2)
            place = (0.62 * (k % 3 - 1) + aside[0], 0.62 * (k // 3 % 3 - 1) + aside[1], 0.5 + 0.55 * (k // 9))
            boxes.append(_box(size, mass, place, attitude))
        found.append(_timed(f"open {seed}", 1200, boxes, 0.5))
        found.append(_timed(f"bin {seed}", 1200, boxes + walls, 0.5))
    return found


def _timed(name: str, steps: int, boxes: Sequence[Entry], friction: float, before: int = 0) -> Timed:
    bodies = [{**box, "name": f"box-{k}"} for k, box in enumerate(boxes)]
    table = {"time_step": STEP, "duration": steps * STEP, "friction": friction, "bodies": bodies}
    return Timed(name, scene_of(table, {}), before)


def _cube(place: tuple[float, float, float]) -> Entry:
    return _box((1.0, 1.0, 1.0), 1.0, place)


def _box(sides: Any, mass: float, place: tuple[float, float, float], attitude: Any = (1.0, 0.0, 0.0, 0.0)) -> Entry:
    """Solid box at rest."""
    numbers = {"box": sides, "position": place, "attitude": attitude}
    return {"mass": float(mass), **{name: [float(value) for value in part] for name, part in numbers.items()}}
