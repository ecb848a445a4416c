"""Writes meshes/bowl.obj: a bowl of 0.4 m with a flat foot, of 24 sectors. Lengths are in m."""

import math
from pathlib import Path

SECTORS = 24
# Radius and height along the wall, from the foot over the rim to the inside.
PROFILE = [(0.1, 0.0), (0.2, 0.1), (0.2, 0.16), (0.17, 0.16), (0.17, 0.11), (0.09, 0.03)]

corners, facets = [], []
for radius, height in PROFILE:
    for sector in range(SECTORS):
        angle = 2 * math.pi * sector / SECTORS
        corners.append((radius * math.cos(angle), radius * math.sin(angle), height))
corners += [(0, 0, PROFILE[0][1]), (0, 0, PROFILE[-1][1])]
foot, inside = len(corners) - 1, len(corners)
last = (len(PROFILE) - 1) * SECTORS
for sector in range(SECTORS):
    here, after = 1 + sector, 1 + (sector + 1) % SECTORS
    facets += [(foot, after, here), (inside, last + here, last + after)]
    for ring in range(0, last, SECTORS):
        a, b, c, d = ring + here, ring + after, ring + SECTORS + after, ring + SECTORS + here
        facets += [(a, b, c), (a, c, d)]

lines = ["# Made by generate/meshes.py."]
lines += [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in corners]
lines += [f"f {a} {b} {c}" for a, b, c in facets]
(Path(__file__).parents[1] / "meshes" / "bowl.obj").write_text("\n".join(lines) + "\n")
