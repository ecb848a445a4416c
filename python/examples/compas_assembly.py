"""Judges an assembly of COMPAS: blocks and interfaces in a JSON file of compas_assembly.

    python compas_assembly.py wall.json --friction 0.6 --density 2400

Every convex block becomes a body, and every support a fixed piece. The contacts are found by tumble; pairs
of the file's interfaces that are not among them are listed.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import tumble


def content(entry: Any) -> Any:
    """Data of a serialised object of COMPAS: newer files have it in "data", older ones in "value"."""
    while isinstance(entry, dict):
        inner = [entry[key] for key in ("data", "value") if isinstance(entry.get(key), dict)]
        if not inner:
            break
        entry = inner[0]
    return entry


def graph_of(path: Path) -> dict[str, Any]:
    """Nodes and edges of an assembly."""
    found = content(json.loads(path.read_text()))
    graph = content(found.get("graph", found)) if isinstance(found, dict) else None
    if not isinstance(graph, dict) or "node" not in graph:
        raise ValueError(f"{path}: no assembly of COMPAS, because it has no nodes")
    return graph


def corners(block: Any) -> list[list[float]]:
    """Corners of a block's mesh, in m."""
    vertices = content(block)["vertex"]
    return [[float(vertices[key][axis]) for axis in "xyz"] for key in sorted(vertices, key=int)]


def scene_of(graph: dict[str, Any], friction: float, density: float, supports: set[str]) -> tumble.Scene:
    """Scene of an assembly: blocks on supports, without a ground."""
    bodies, fixed = [], []
    for key, node in sorted(graph["node"].items(), key=lambda item: int(item[0])):
        piece = {"name": f"block-{key}", "hull": corners(node["block"]), "position": [0.0, 0.0, 0.0]}
        if node.get("is_support") or key in supports:
            fixed.append(piece)
        else:
            bodies.append({**piece, "density": density})
    ground = {"none": True, "friction": friction}
    return tumble.Scene(bodies, ground=ground, fixed=fixed, name="assembly")


def interfaces(graph: dict[str, Any]) -> set[frozenset[str]]:
    """Pairs of blocks that the file has an interface for."""
    pairs = set()
    for one, others in graph.get("edge", {}).items():
        for other, edge in others.items():
            if edge.get("interfaces") or edge.get("interface"):
                pairs.add(frozenset((f"block-{one}", f"block-{other}")))
    return pairs


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--friction", type=float, default=0.6)
    parser.add_argument("--density", type=float, default=2400.0, help="kg/m³")
    parser.add_argument("--supports", default="", help="nodes that are supports too, joined by commas")
    given = parser.parse_args(arguments)
    graph = graph_of(given.file)
    supports = {key for key in given.supports.split(",") if key}
    scene = scene_of(graph, given.friction, given.density, supports)
    answer = scene.stands(least_friction=True, base=[1.0, 0.0, 0.0])
    print(f"{len(scene.bodies)} blocks, {len(scene.fixed)} supports: {answer.verdict}")
    touching = {frozenset(contact["between"]) for contact in answer.report["contacts"]}
    for pair in sorted(interfaces(graph) - touching, key=sorted):
        if not pair <= set(scene.fixed):
            print("  no contact at the interface of", " and ".join(sorted(pair)))
    if answer.least_friction is not None:
        print(f"  smallest friction  {given.friction * answer.least_friction:.4f}")
    if answer.factor is not None:
        print(f"  largest acceleration along x  {answer.factor:.3f} m/s²")
        for weak in answer.report["limit"]["weak"][:4]:
            print("  weak ", " and ".join(weak["between"]))
    return 0 if answer.stands else 3


if __name__ == "__main__":
    sys.exit(main())
