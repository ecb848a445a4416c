"""Creates the scenes of several boxes in bench/scenes: python3 bench/make_scenes.py.

They are files, so that every engine and tumble's own benchmark (benches/several.rs) start from
the same numbers. The pile is drawn with a fixed seed.
"""

import json

import numpy as np
from scene import FILES, Box, Scene, at_rest, solid

SEED = 12345


def stack() -> Scene:
    """Stack of ten cubes of 1 m and 1 kg."""
    boxes = [cube((0.0, 0.0, 0.5 + k)) for k in range(10)]
    return scene("stack", 500, boxes, 0.5)


def pyramid() -> Scene:
    """Rows of 5, 4, 3, 2 and 1 cubes, 0.1 m apart, each cube on two of the row below."""
    places = [(1.1 * k + 0.55 * row, 0.0, 0.5 + row) for row in range(5) for k in range(5 - row)]
    return scene("pyramid", 500, [cube(place) for place in places], 0.5)


def wall() -> Scene:
    """Six rows of six touching bricks, every second row shifted by half a brick."""
    places = [
        (k + 0.5 * (row % 2), 0.0, 0.25 + 0.5 * row) for row in range(6) for k in range(6)
    ]
    bricks = [solid((1.0, 0.5, 0.5), 2.0, at_rest(place)) for place in places]
    return scene("wall", 300, bricks, 0.7)


def pile() -> Scene:
    """Thirty boxes of 0.3 to 0.5 m and 1 to 2 kg in random attitudes, dropped on one another."""
    draws = np.random.RandomState(SEED)
    boxes = []
    for k in range(30):
        attitude = draws.normal(size=4)
        sides, mass = draws.uniform(0.3, 0.5, size=3), draws.uniform(1.0, 2.0)
        place = (0.9 * (k % 3) - 0.9, 0.9 * (k // 3 % 3) - 0.9, 1.0 + 0.9 * (k // 9))
        start = at_rest(place, attitude / np.linalg.norm(attitude))
        boxes.append(solid(sides, float(mass), start))
    return scene("pile", 700, boxes, 0.5, moves=True)


def cube(place: tuple[float, float, float]) -> Box:
    return solid((1.0, 1.0, 1.0), 1.0, at_rest(place))


def scene(name: str, steps: int, boxes: list[Box], friction: float, moves: bool = False) -> Scene:
    return Scene(name, "several", steps, 0.002, tuple(boxes), friction, moves=moves)


def text(made: Scene) -> str:
    """JSON text of a scene with one line per box."""
    request = made.request()
    boxes = ",\n".join(f"    {json.dumps(box)}" for box in request.pop("boxes"))
    head = json.dumps({"name": made.name, "moves": made.moves, **request}, indent=2)
    return f'{head[:-2]},\n  "boxes": [\n{boxes}\n  ]\n}}\n'


if __name__ == "__main__":
    for made in (stack(), pyramid(), wall(), pile()):
        (FILES / f"{made.name}.json").write_text(text(made))
