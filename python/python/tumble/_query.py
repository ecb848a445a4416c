"""Rays, distances and overlaps of a scene or a simulation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ._arrays import numbers
from ._checks import name_list
from ._toml import document
from ._tumble import TumbleError
from ._types import Floats

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


class RayHit(NamedTuple):
    """First point of an object on a ray."""

    owner: str
    """Name of the body or fixed piece, or "ground"."""
    distance: float
    """Distance from the origin of the ray, m."""
    point: Floats
    """Point of the hit, m, world: (3,)."""
    normal: Floats
    """Outward unit normal of the surface, world: (3,). Opposite to a ray that starts inside."""
    inside: bool
    """True if the ray starts inside the object."""


class RayHits(NamedTuple):
    """Nearest hits of R rays."""

    owners: tuple[str | None, ...]
    """Names of the objects, "ground", or None for a ray that hits nothing: R."""
    distances: Floats
    """Distances from the origins, m: (R,). Infinite without a hit."""
    points: Floats
    """Points of the hits, m, world: (R, 3). NaN without a hit."""
    normals: Floats
    """Outward unit normals, world: (R, 3). NaN without a hit."""
    inside: npt.NDArray[np.bool_]
    """True for rays that start inside an object: (R,)."""


class Distance(NamedTuple):
    """Signed distance of two objects."""

    distance: float
    """Distance, m. Negative for an overlap: minus the shortest translation that separates it."""
    points: Floats
    """Closest points of the first and the second object, m, world: (2, 3)."""
    normal: Floats
    """Unit vector from the first to the second object, world: (3,)."""


class PairDistance(NamedTuple):
    """Distance of a body from another object."""

    body: str
    """Name of the body."""
    partner: str
    """Name of the other body or fixed piece, or "ground"."""
    distance: float
    """Signed distance, m."""


class Queries:
    """Queries of the geometry: of a scene at its start, of a simulation at its current states.

    They use the convex pieces that make contacts, and see every body, fixed piece and the ground,
    also if contacts are excluded. Objects have their names; the ground is "ground". Bodies of
    ``points`` have no volume.

    Each call sorts the bounding boxes of all pieces. Many rays in one call share this work.
    """

    __slots__ = ()

    _core: Any
    """The compiled part."""

    def cast_ray(
        self, origin: Any, direction: Any, *, max_distance: float = float("inf"), ignore: Iterable[str] = ()
    ) -> RayHit | None:
        """Nearest hit of a ray, or None.

        ``origin`` (3,) is in m, world. ``direction`` (3,) has any length except 0.
        ``max_distance`` is in m. ``ignore`` has names of objects that the ray passes.

        Objects are solid: a ray that starts inside one hits it at distance 0, with ``inside``
        True. Ignore this object to look out of it.
        """
        hits = self._hits(origin, direction, (3,), max_distance, ignore, False)
        return _rows(hits)[0] if hits.owners[0] is not None else None

    def cast_ray_all(
        self, origin: Any, direction: Any, *, max_distance: float = float("inf"), ignore: Iterable[str] = ()
    ) -> list[RayHit]:
        """Hits of a ray with all objects, one for each object, by distance: see cast_ray."""
        return _rows(self._hits(origin, direction, (3,), max_distance, ignore, True))

    def cast_rays(
        self, origins: Any, directions: Any, *, max_distance: float = float("inf"), ignore: Iterable[str] = ()
    ) -> RayHits:
        """Nearest hits of R rays: see cast_ray.

        ``origins`` and ``directions`` are (R, 3). An origin (3,) is that of all rays.
        """
        import numpy as np

        directions = numbers("directions", directions, ("R", 3))
        origins = numbers("origins", origins, (3,), ("R", 3))
        if origins.ndim == 1:
            origins = np.broadcast_to(origins, directions.shape)
        return self._hits(origins, directions, directions.shape, max_distance, ignore, False)

    def distance(self, first: str, second: str) -> Distance:
        """Signed distance and closest points of two objects, by name.

        Of several pieces, the nearest or deepest pair counts. Of several closest points, as between
        parallel faces, one is returned.
        """
        return Distance(*self._core.between(_name(first), _name(second)))

    def overlaps(
        self, piece: Mapping[str, Any], *, within: float = 0.0, ignore: Iterable[str] = ()
    ) -> dict[str, float]:
        """Objects that overlap or touch a piece: signed distances (m) by name.

        ``piece`` has the fields of a piece in a scenario file, in the world frame, for example
        ``{"sphere": 0.5, "position": [0, 0, 1]}``. ``within`` (m) also finds objects that are
        at most this far.
        """
        if not isinstance(piece, Mapping):
            raise TumbleError(f"piece is {piece!r}; a dictionary is needed")
        path = self._folder()
        near = self._core.near(document(piece), path, _metres("within", within), name_list("ignore", ignore))
        return dict(near)

    def pairs_within(self, distance: float, *, excluded: bool = False) -> list[PairDistance]:
        """Pairs of a body and another object that are at most ``distance`` (m) apart.

        Pairs that cannot touch, such as bodies that a joint connects, are left out unless
        ``excluded`` is True.
        """
        pairs = self._core.near_pairs(_metres("distance", distance), bool(excluded))
        return [PairDistance(*pair) for pair in pairs]

    def _hits(
        self, origins: Any, directions: Any, shape: Any, most: float, ignore: Iterable[str], all_: bool
    ) -> RayHits:
        names = ("origin", "direction") if len(shape) == 1 else ("origins", "directions")
        rays = [numbers(name, value, shape) for name, value in zip(names, (origins, directions))]
        most = _metres("max_distance", most)
        owners, *columns = self._core.hits(*rays, most, name_list("ignore", ignore), all_)
        return RayHits(tuple(owners), *columns)

    def _folder(self) -> Path:
        """Path that meshes are relative to."""
        raise NotImplementedError


def _rows(hits: RayHits) -> list[RayHit]:
    rows = zip(hits.owners, hits.distances, hits.points, hits.normals, hits.inside)
    return [
        RayHit(owner or "", float(distance), point, normal, bool(inside))
        for owner, distance, point, normal, inside in rows
    ]


def _metres(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TumbleError(f"{name} is {value!r}; a number of m is needed") from None


def _name(name: Any) -> str:
    if not isinstance(name, str):
        raise TumbleError(f"{name!r} is not a name; a string is needed")
    return name
