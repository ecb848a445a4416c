"""Standalone contact problems from any source: docs/contact-problem.md."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

from . import _fclib
from ._arrays import numbers
from ._checks import real, whole
from ._core import core_property
from ._tumble import CoreProblem, TumbleError
from ._types import Floats, Location

RowLaw = str | tuple[str, float, float]
Moment = tuple[str, int, float, float]
Law = float | Sequence[RowLaw] | Moment


@dataclass(frozen=True)
class ContactSolution:
    """Solution of a ``ContactProblem``, or the best point found."""

    impulses: Floats
    """Impulse p of every row, N s. The first row of a contact is the normal one."""
    velocities: Floats
    """Velocity u of every row, m/s."""
    body_velocities: Floats
    """Velocities v of the global form; empty for the local form."""
    solved: bool
    """True if the residual is at most the requested one."""
    residual: float
    """Largest violation of a law, m/s, each contact in its own scale, computed from the impulses alone."""
    relative_error: float
    """Error in the definition of Siconos and FCLIB, dimensionless."""
    iterations: int
    """Iterations of all starts in all parts."""
    parts: int
    """Number of independent parts of the problem."""
    start: str
    """Name of the start that led to the solution."""
    selected: bool
    """True if the selection rule determined the solution."""


class ContactProblem:
    """Contact problem with Coulomb's exact law on coupled rows.

    The local form is ``u = W p + q``. The global form is ``M v = H p + f`` and ``u = H^T v +
    w``. Matrices are dense numpy arrays or scipy's sparse matrices; vectors are numpy arrays.

    ``mu`` has one coefficient per contact. A contact has ``dimension`` rows: its normal, then
    its tangents. Instead of ``mu``, ``laws`` has one entry per group of rows. An entry is a
    coefficient; ``("moment", contact, rolling, torsional)`` for three rows that turn about the tangents
    and the normal of an earlier group, within these limits over its normal impulse; or a list of one
    to three row laws:

    - ``"free"``;
    - ``"locked"``;
    - ``"limit"`` (0 <= u, p >= 0, one of them zero);
    - ``("box", least, most)`` (u = 0 by an impulse between these bounds).
    """

    _core: CoreProblem
    _source: ContactProblem | tuple[Any, ...]
    """The problem that was made local, or the name and the arguments of a constructor of the core."""

    def __init__(
        self,
        *,
        W: Any = None,
        q: Any = None,
        M: Any = None,
        H: Any = None,
        f: Any = None,
        w: Any = None,
        mu: Any = None,
        laws: Sequence[Law] | None = None,
        dimension: int = 3,
    ) -> None:
        given = {"W": W, "q": q, "M": M, "H": H, "f": f, "w": w}
        names = tuple(name for name, value in given.items() if value is not None)
        if names not in (("W", "q"), ("M", "H", "f", "w")):
            raise TumbleError(f"{', '.join(names) or 'nothing'} given; W and q, or M, H, f and w are needed")
        if (mu is None) == (laws is None):
            raise TumbleError("either mu or laws is needed, not both")
        dimension = whole("dimension", dimension, 2, 3)
        groups = _contacts(mu) if laws is None else _groups(laws)
        rows = sum(len(own) if friction is None else dimension for friction, own in groups)
        vectors = {name: numbers(name, given[name], ("n",)) for name in names if name in "qfw"}
        vectors = {name: vector.copy() for name, vector in vectors.items()}
        if W is not None:
            response = _entries("W", W, (rows, rows))
            self._make("local", response, vectors["q"], dimension, groups)
        else:
            momentum, offset = vectors["f"], vectors["w"]
            mass = _entries("M", M, (len(momentum), len(momentum)))
            directions = _entries("H", H, (len(momentum), rows))
            self._make("from_bodies", mass, directions, momentum, offset, dimension, groups)

    def _make(self, form: str, *arguments: Any) -> None:
        self._core = getattr(CoreProblem, form)(*arguments)
        self._source = form, *arguments

    @classmethod
    def _of(cls, form: str, *arguments: Any) -> ContactProblem:
        problem = cls.__new__(cls)
        problem._make(form, *arguments)
        return problem

    def __reduce__(self) -> Any:
        """Pickles a problem as its numbers."""
        source = self._source
        return (type(self).to_local, (source,)) if isinstance(source, ContactProblem) else (self._of, source)

    @classmethod
    def read(cls, path: Location) -> ContactProblem:
        """Reads a file in FCLIB's HDF5 (with h5py) or in Siconos' text format."""
        try:
            content = Path(path).read_bytes()
        except OSError as error:
            raise TumbleError(f"{os.fspath(path)}: cannot be read: {error}") from None
        found = _fclib.read(path) if content.startswith(b"\x89HDF") else None
        try:
            if found is not None:
                given, laws, dimension = found
                return cls(**given, laws=laws, dimension=dimension)
            return cls._of("from_dat", content.decode())
        except (TumbleError, UnicodeDecodeError) as error:
            raise TumbleError(f"{os.fspath(path)}: cannot be read as a contact problem: {error}") from None

    def write(self, path: Location, solution: ContactSolution | None = None) -> None:
        """Writes a file in FCLIB's HDF5 or in Siconos' text format.

        HDF5 is used if the name ends in .hdf5 or .h5. It can include a ``solution`` of this
        problem.
        """
        if solution is not None and not self._is_own(solution):
            raise TumbleError("the solution belongs to another problem; a solution of this problem is needed")
        if Path(path).suffix in (".hdf5", ".h5"):
            _fclib.write(path, self, solution)
            return
        if solution is not None:
            raise TumbleError("Siconos' text format cannot hold a solution; a name that ends in .hdf5 is needed")
        try:
            text = self._core.to_dat()
        except TumbleError as error:
            raise TumbleError(f"{os.fspath(path)}: {error}") from None
        _fclib.replaced(path, lambda temporary: Path(temporary).write_text(text))

    def _is_own(self, solution: ContactSolution) -> bool:
        """True if u and v of a solution result from its impulses in this problem."""
        import numpy as np

        rows = (sum(self.sizes),)
        if np.shape(solution.impulses) != rows:
            return False
        u, v, *_ = self.evaluate(solution.impulses)
        pairs = ((u, solution.velocities), (v, solution.body_velocities))
        return all(
            own.shape == np.shape(other) and np.allclose(own, other, rtol=0, atol=1e-6 * np.abs(own).max(initial=1))
            for own, other in pairs
        )

    def solve(self, *, residual: float = 1e-9, start: Any = None, rule: str = "any") -> ContactSolution:
        """Solves the problem to ``residual`` (m/s), from the impulses ``start`` if not None.

        ``rule`` selects among several solutions. "any" takes the first one found. "compliance"
        takes the limit of an equal, vanishing compliance, which has the least norm for sticking
        contacts.
        """
        first = None if start is None else numbers("start", start, (sum(self.sizes),))
        residual = real("residual", residual)
        if not isinstance(rule, str):
            raise TumbleError(f'rule is {rule!r}; "any" or "compliance" is needed')
        arrays, errors, counts, name, selected = self._core.solve(residual, first, rule)
        impulses, velocities, body_velocities = arrays
        return ContactSolution(
            impulses=impulses,
            velocities=velocities,
            body_velocities=body_velocities,
            solved=errors[0] <= residual,
            residual=errors[0],
            relative_error=errors[1],
            iterations=counts[0],
            parts=counts[1],
            start=name,
            selected=selected,
        )

    def evaluate(self, impulses: Any) -> tuple[Floats, Floats, float, float]:
        """u, v, the residual (m/s) and the relative error of impulses, as for a solution."""
        arrays, errors = self._core.evaluate(numbers("impulses", impulses, (sum(self.sizes),)))
        return arrays[0], arrays[1], errors[0], errors[1]

    def to_local(self) -> ContactProblem:
        """Equivalent problem in the local form: W = H^T M^-1 H, q = H^T M^-1 f + w."""
        local = self._of("to_local", self._core)
        local._source = self
        return local

    is_local: bool = core_property("is_local", "True for the form W, q; False for M, H, f, w.")
    sizes: list[int] = core_property("sizes", "Number of rows of every group.")

    @property
    def mu(self) -> Floats:
        """Coefficient of every contact; NaN for other groups."""
        import numpy as np

        return np.array([np.nan if mu is None else mu for mu in self._core.friction])

    def entries(self, name: str) -> tuple[int, int, list[int], list[int], Floats]:
        """Numbers of rows and columns of W, M or H, then row, column and value of each entry."""
        return self._core.entries(name)

    def matrix(self, name: str) -> Floats:
        """W, M or H as a dense array."""
        import numpy as np

        rows, columns, at, along, values = self._core.entries(name)
        dense = np.zeros((rows, columns))
        dense[at, along] = values
        return dense

    def vector(self, name: str) -> Floats:
        """Vector q, f or w."""
        return self._core.vector(name)

    def __repr__(self) -> str:
        form = "local" if self.is_local else "global"
        return f"<tumble.ContactProblem: {form}, {len(self.sizes)} groups, {sum(self.sizes)} rows>"


def _contacts(mu: Any) -> list[tuple[float | None, list[tuple[str, float, float]]]]:
    return [(float(value), []) for value in numbers("mu", mu, ("n",))]


def _groups(laws: Any) -> list[tuple[float | None, list[tuple[str, float, float]]]]:
    try:
        groups = [_group(law) for law in laws]
    except TypeError:
        raise TumbleError(f"laws is {laws!r}; a list is needed, with coefficients or lists of rows") from None
    for group, contact in moments_of(groups).items():
        if contact >= group or groups[contact][0] is None:
            raise TumbleError(f"laws: group {group} is a moment of group {contact}; an earlier contact is needed")
    return groups


def moments_of(groups: list[tuple[float | None, list[tuple[str, float, float]]]]) -> dict[int, int]:
    """Group of the contact of every group that is a moment."""
    return {group: int(own[0][1]) for group, (_, own) in enumerate(groups) if own and own[0][0] == "rolling"}


def _group(law: Any) -> tuple[float | None, list[tuple[str, float, float]]]:
    if isinstance(law, Real):
        return float(law), []
    if isinstance(law, tuple) and law and law[0] == "moment":
        if len(law) != 4:
            raise TumbleError(f'laws: {law!r} is not a moment; ("moment", contact, rolling, torsional) is needed')
        contact = float(whole("laws: the contact of a moment", law[1], 0))
        rolling, torsional = (real("laws: a limit of a moment", limit) for limit in law[2:])
        return None, [("rolling", contact, rolling)] * 2 + [("torsional", contact, torsional)]
    if isinstance(law, str):
        raise TumbleError(f"laws: {law!r} is not a group; a list of rows is needed, for example [{law!r}]")
    rows: list[tuple[str, float, float]] = []
    for row in law:
        if isinstance(row, str):
            if row == "box":
                raise TumbleError('laws: "box" without bounds; ("box", least, most) is needed')
            if row in ("rolling", "torsional"):
                raise TumbleError(f'laws: {row!r} is no law of a row; ("moment", contact, rolling, torsional) is needed')
            rows.append((row, 0.0, 0.0))
            continue
        if not isinstance(row, (list, tuple)) or len(row) != 3 or row[0] != "box":
            raise TumbleError(f'laws: {row!r} is not a law; a name or ("box", least, most) is needed')
        rows.append(("box", real("laws: a bound of a box", row[1]), real("laws: a bound of a box", row[2])))
    return None, rows


def _entries(name: str, value: Any, wanted: tuple[int, int]) -> tuple[int, int, list[int], list[int], Floats]:
    """Rows, columns and entries of a dense or sparse matrix of the shape ``wanted``."""
    import numpy as np

    if hasattr(value, "tocoo"):
        sparse = value.tocoo()
        values = numbers(name, sparse.data, ("n",)).copy()
        rows, columns = (whole(f"{name}: a size of its shape", size, 0) for size in sparse.shape)
        at, along = (np.asarray(places) for places in (sparse.row, sparse.col))
        for places in (at, along):
            if places.shape != values.shape or (places.size and places.dtype.kind not in "iu"):
                raise TumbleError(
                    f"{name}: a row and a column, whole numbers, are needed for each of its {values.size} entries"
                )
            if places.size and places.min() < 0:
                raise TumbleError(f"{name}: an entry is at {places.min()}; 0 or more is needed")
    else:
        dense = numbers(name, value, ("n", "m"))
        rows, columns = dense.shape
        at, along = np.nonzero(dense)
        values = np.ascontiguousarray(dense[at, along])
    if (rows, columns) != wanted:
        raise TumbleError(f"{name} is {rows} x {columns}; {wanted[0]} x {wanted[1]} is needed")
    return rows, columns, at.tolist(), along.tolist(), values
