"""FCLIB's HDF5 format of contact problems, through h5py."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._tumble import TumbleError
from ._types import Location

if TYPE_CHECKING:
    from ._problem import ContactProblem, ContactSolution


def _h5py(path: Location) -> Any:
    try:
        import h5py
    except ImportError:
        raise TumbleError(
            f"{os.fspath(path)}: FCLIB's HDF5 needs the package h5py; install it with pip install h5py"
        ) from None
    return h5py


def read(path: Location) -> tuple[dict[str, Any], list[Any], int]:
    """Matrices and vectors, the laws, and the dimension.

    Equality constraints (G and b; V, R and s) become locked rows after the contacts.
    """
    import numpy as np

    h5py = _h5py(path)
    try:
        with h5py.File(path, "r") as file:
            name = next((name for name in ("fclib_local", "fclib_global") if name in file), None)
            if name is None:
                raise TumbleError("it has neither a group fclib_local nor fclib_global")
            group = file[name]
            dimension = int(np.ravel(group["spacedim"][()])[0])

            def vector(key: str) -> Any:
                return np.ravel(group["vectors"][key][()]).astype(float)

            laws: list[Any] = [float(mu) for mu in vector("mu")]
            if name == "fclib_local":
                response, free = _sparse(group["W"]), vector("q")
                if "R" in group:
                    beside, own = _sparse(group["V"]), _sparse(group["R"])
                    rows = response.shape[0]
                    response = response.with_block(beside, (0, rows))
                    response = response.with_block(beside.turned(), (rows, 0))
                    response = response.with_block(own, (rows, rows))
                    free = np.concatenate([free, vector("s")])
                    laws += _locked(own.shape[0])
                return {"W": response, "q": free}, laws, dimension
            directions, offset = _sparse(group["H"]), vector("w")
            if "G" in group:
                held = _sparse(group["G"])
                directions = directions.with_block(held, (0, directions.shape[1]))
                offset = np.concatenate([offset, vector("b")])
                laws += _locked(held.shape[1])
            given = {"M": _sparse(group["M"]), "H": directions, "f": vector("f"), "w": offset}
            return given, laws, dimension
    except (KeyError, OSError, ValueError, IndexError, TypeError, AttributeError, TumbleError) as error:
        why = error.args[0] if isinstance(error, KeyError) and error.args else error
        raise TumbleError(f"{os.fspath(path)}: cannot be read as a contact problem of FCLIB: {why}") from None


def _locked(count: int) -> list[list[str]]:
    return [["locked"] * min(3, count - first) for first in range(0, count, 3)]


class _Sparse:
    """Sparse matrix with the interface of scipy's COO matrices."""

    def __init__(self, shape: tuple[int, int], row: Any, col: Any, data: Any) -> None:
        self.shape, self.row, self.col, self.data = shape, row, col, data

    def tocoo(self) -> _Sparse:
        return self

    def turned(self) -> _Sparse:
        """Transposed matrix."""
        return _Sparse((self.shape[1], self.shape[0]), self.col, self.row, self.data)

    def with_block(self, block: _Sparse, at: tuple[int, int]) -> _Sparse:
        """Adds a block at the row and column ``at``, and extends the shape if necessary."""
        import numpy as np

        rows, columns = (max(own, place + more) for own, place, more in zip(self.shape, at, block.shape))
        row = np.concatenate([self.row, block.row + at[0]])
        col = np.concatenate([self.col, block.col + at[1]])
        return _Sparse((rows, columns), row, col, np.concatenate([self.data, block.data]))


def _sparse(group: Any) -> _Sparse:
    """Reads a matrix. nz is the number of triplets, -1 for columns (CSC), -2 for rows (CSR)."""
    import numpy as np

    rows, columns, kind = (int(np.ravel(group[name][()])[0]) for name in ("m", "n", "nz"))
    if rows < 0 or columns < 0:
        raise TumbleError(f"m and n of a matrix are {rows} and {columns}; 0 or more are needed")
    starts, indices, values = (np.ravel(group[name][()]) for name in ("p", "i", "x"))
    if any(places.size and places.dtype.kind not in "iu" for places in (starts, indices)):
        raise TumbleError("p and i of a matrix are not whole numbers")
    if kind >= 0:
        if kind > min(len(starts), len(indices), len(values)):
            raise TumbleError(f"nz of a matrix is {kind}, but it has {len(values)} entries")
        return _Sparse((rows, columns), indices[:kind], starts[:kind], values[:kind])
    if kind not in (-1, -2):
        raise TumbleError(f"nz of a matrix is {kind}; a count, -1 or -2 is needed")
    ends, most = starts.astype(np.int64), min(len(indices), len(values))
    counts, lines = np.diff(ends), columns if kind == -1 else rows
    if len(ends) != lines + 1 or ends[0] != 0 or ends[-1] > most or (counts < 0).any():
        raise TumbleError(f"p of a matrix does not have the starts of {lines} lines, rising from 0 to at most {most}")
    along = np.repeat(np.arange(lines), counts)
    indices, values = indices[: len(along)], values[: len(along)]
    entries = (indices, along, values) if kind == -1 else (along, indices, values)
    return _Sparse((rows, columns), *entries)


def write(path: Location, problem: ContactProblem, solution: ContactSolution | None) -> None:
    """Writes a problem of contacts as triplets, and a solution in FCLIB's form."""
    import numpy as np

    h5py = _h5py(path)
    # Without contacts any dimension is valid.
    sizes = set(problem.sizes) or {3}
    if len(sizes) != 1 or np.isnan(problem.mu).any():
        raise TumbleError(f"{os.fspath(path)}: FCLIB supports only problems with contacts of one dimension")

    def content(temporary: str) -> None:
        with h5py.File(temporary, "w") as file:
            group = file.create_group("fclib_local" if problem.is_local else "fclib_global")
            group["spacedim"] = np.array(list(sizes), np.int32)
            for name in ("W",) if problem.is_local else ("M", "H"):
                rows, columns, at, along, values = problem.entries(name)
                counts = {"m": rows, "n": columns, "nz": len(values), "nzmax": len(values)}
                matrix = group.create_group(name)
                for key, count in counts.items():
                    matrix[key] = np.array([count], np.int32)
                matrix["i"], matrix["p"] = np.array(at, np.int32), np.array(along, np.int32)
                matrix["x"] = values
            vectors = group.create_group("vectors")
            vectors["mu"] = problem.mu
            for name in ("q",) if problem.is_local else ("f", "w"):
                vectors[name] = problem.vector(name)
            info = group.create_group("info")
            for key, text in (("title", "contact problem"), ("description", "written by tumble"), ("math_info", " ")):
                info[key] = np.bytes_(text)
            if solution is not None:
                beside = file.create_group("solution")
                beside["r"], beside["u"] = solution.impulses, solution.velocities
                beside["v"] = solution.body_velocities

    replaced(path, content)


def replaced(path: Location, write: Callable[[str], object]) -> None:
    """Has ``write`` create a temporary file and renames it to ``path``."""
    folder = Path(path).parent
    try:
        handle, temporary = tempfile.mkstemp(prefix=".tumble-", suffix=".tmp", dir=folder)
        os.close(handle)
        try:
            write(temporary)
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise TumbleError(f"{os.fspath(path)}: cannot be written: {error}") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
