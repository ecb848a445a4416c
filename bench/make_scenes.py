"""Writes the scenes of several boxes of tumble.bench.speed to bench/scenes: python bench/make_scenes.py.

The Rust programs of bench/measure and benches/several.rs read them.
"""

import json
from pathlib import Path

from tumble.bench import _timed
from tumble.bench.engines._program import boxes


def text(timed: _timed.Timed) -> str:
    """JSON text of a scene with one line per box."""
    scene = timed.scene
    request = {"name": timed.name, "steps": scene.steps, "step_seconds": scene.time_step, **boxes(scene)}
    del request["walls"]
    lines = ",\n".join(f"    {json.dumps(box)}" for box in request.pop("boxes"))
    return f'{json.dumps(request, indent=2)[:-2]},\n  "boxes": [\n{lines}\n  ]\n}}\n'


if __name__ == "__main__":
    for timed in (_timed.stack(), _timed.pyramid(), _timed.wall(), _timed.pile()):
        (Path(__file__).resolve().parent / "scenes" / f"{timed.name}.json").write_text(text(timed))
