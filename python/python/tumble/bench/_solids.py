"""Uniform solids: centre of mass, principal axes and moments; quaternions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._tumble import TumbleError
from .._types import Floats


class Solid(NamedTuple):
    """Shape in the frame of its centre of mass and principal axes."""

    kind: str
    size: tuple[float, ...]
    points: Floats
    centre: Floats
    """Centre of mass in the shape's frame."""
    axes: Floats
    """Quaternion from the principal axes to the shape's frame."""
    inertia: Floats


def solid(shape: str, dimensions: Any, mass: float) -> Solid:
    """Uniform solid of a case file's shape."""
    here, upright = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    if shape == "box":
        half = 0.5 * np.asarray(dimensions)
        _positive(shape, half.min())
        signs = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
        squares = half**2
        return Solid("box", tuple(half), signs * half, here, upright, mass / 3.0 * (squares.sum() - squares))
    if shape == "sphere":
        _positive(shape, dimensions)
        return Solid("sphere", (dimensions,), np.zeros((1, 3)), here, upright, np.full(3, 0.4 * mass * dimensions**2))
    if shape == "capsule":
        length, radius = dimensions
        _positive(shape, min(length, radius))
        ends = np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])
        return Solid("capsule", (radius, 0.5 * length), ends, here, upright, _capsule(mass, length, radius))
    polygon, width = dimensions
    return _prism(polygon, width, mass)


def _positive(shape: str, size: float) -> None:
    if not size > 0.0:
        raise TumbleError(f"{shape} has the size {size:g}; positive sizes are needed")


def _capsule(mass: float, length: float, radius: float) -> Floats:
    """Moments of a cylinder with two half balls, across and along its axis."""
    cylinder, ball = length, 4.0 / 3.0 * radius  # volumes divided by π R²
    tube, ends = (mass * part / (cylinder + ball) for part in (cylinder, ball))
    along = 0.5 * tube * radius**2 + 0.4 * ends * radius**2
    # The centre of a half ball is ⅜ R from its flat side.
    across = tube * (length**2 / 12.0 + radius**2 / 4.0)
    across += ends * (0.4 * radius**2 + length**2 / 4.0 + 3.0 / 8.0 * length * radius)
    return np.array([across, across, along])


def _prism(polygon: Floats, width: float, mass: float) -> Solid:
    """Polygon in the plane x, z, extruded along y by ``width`` about y = 0."""
    if len(polygon) < 3:
        raise TumbleError(f"a prism has {len(polygon)} corners; at least 3 are needed")
    _positive("prism", width)
    x, z = polygon.T
    x_next, z_next = np.roll(polygon, -1, axis=0).T
    cross = x * z_next - x_next * z
    area = 0.5 * cross.sum()
    if not abs(area) > 0.0:
        raise TumbleError("a prism has the area 0; its corners must not be on a line")
    if area < 0.0:
        return _prism(polygon[::-1], width, mass)
    centre = np.array([((x + x_next) * cross).sum(), ((z + z_next) * cross).sum()]) / (6.0 * area)
    x, z, x_next, z_next = x - centre[0], z - centre[1], x_next - centre[0], z_next - centre[1]
    cross = x * z_next - x_next * z
    # Second moments of the area, by the area.
    xx = ((x * x + x * x_next + x_next * x_next) * cross).sum() / (12.0 * area)
    zz = ((z * z + z * z_next + z_next * z_next) * cross).sum() / (12.0 * area)
    xz = ((x * z_next + 2 * x * z + 2 * x_next * z_next + x_next * z) * cross).sum() / (24.0 * area)
    turn = 0.5 * np.arctan2(2.0 * xz, zz - xx) if abs(xz) > 1e-12 * (xx + zz) else 0.0
    # The principal axes are turned about y by ``turn``, x towards −z.
    axes = np.array([np.cos(0.5 * turn), 0.0, np.sin(0.5 * turn), 0.0])
    yy = width**2 / 12.0
    corners = np.array([[u, side * 0.5 * width, w] for u, w in zip(x, z) for side in (-1.0, 1.0)])
    back = matrix_of(conjugated(axes))
    moments = mass * np.array([[yy + zz, 0.0, -xz], [0.0, xx + zz, 0.0], [-xz, 0.0, yy + xx]])
    principal = back @ moments @ back.T
    if abs(principal[0, 2]) > 1e-9 * principal.trace():
        raise TumbleError("the principal axes of a prism were not found; give it another polygon")
    whole = np.array([centre[0], 0.0, centre[1]])
    return Solid("hull", (), corners @ back.T, whole, axes, np.diag(principal).copy())


def prism_triangles(count: int) -> npt.NDArray[np.int32]:
    """Triangles of a prism's ``count`` points, counter-clockwise from outside."""
    last = count // 2
    triangles = []
    for i in range(last):
        j = (i + 1) % last
        triangles += [[2 * i, 2 * j + 1, 2 * j], [2 * i, 2 * i + 1, 2 * j + 1]]
        if 0 < i < last - 1:
            triangles += [[0, 2 * i, 2 * j], [1, 2 * j + 1, 2 * i + 1]]
    return np.array(triangles, np.int32)


def quaternion_of(value: Floats) -> Floats:
    """Unit quaternion along ``value``."""
    length = float(np.linalg.norm(value))
    if not 1e-6 < length < 1e6:
        raise TumbleError(f"a quaternion has the length {length:g}; 1e-6 to 1e6 is needed")
    unit: Floats = value / length
    return unit


def conjugated(q: Floats) -> Floats:
    """Inverse of a unit quaternion."""
    inverse: Floats = q * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def product(a: Floats, b: Floats) -> Floats:
    """Product of quaternions: the rotation ``b``, then ``a``."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    whole: Floats = np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], vector])
    return whole


def matrix_of(q: Floats) -> Floats:
    """Rotation matrix (3, 3) of a unit quaternion, or (…, 3, 3) of (…, 4)."""
    w, x, y, z = np.moveaxis(np.asarray(q), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix: Floats = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    return matrix
