"""Checks of input arrays, with errors that name the argument."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ._tumble import TumbleError
from ._types import Floats

Dimension = int | str


def numbers(name: str, value: Any, *shapes: Sequence[Dimension]) -> Floats:
    """``value`` as an array of finite float64 in C order, of one of ``shapes``.

    A dimension is a number, or a letter for any length. An aligned array of this type is not
    copied. Raises TumbleError with ``name`` for any other input.
    """
    import numpy as np

    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise TumbleError(f"{name}: an array of numbers is needed: {error}") from None
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise TumbleError(f"{name} has masked numbers; fill them first, with value.filled(...)")
    if array.dtype.kind not in "fiu":
        raise TumbleError(f"{name} has dtype {array.dtype}; real numbers, preferably float64, are needed")
    if not any(_fits(array.shape, shape) for shape in shapes):
        wanted = " or ".join(_words(shape) for shape in shapes)
        raise TumbleError(f"{name} has shape {array.shape}; {wanted} is needed")
    array = np.require(array, np.float64, ["C", "ALIGNED"]).reshape(array.shape)
    if not np.isfinite(array).all():
        place = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        at = f"[{', '.join(map(str, place))}]" if place else ""
        raise TumbleError(f"{name}{at} is {array[place]}; finite numbers are needed")
    return array


def quaternion(value: Any) -> Any:
    """A rotation of SciPy as w, x, y, z. Other values stay."""
    if not hasattr(value, "as_quat"):
        return value
    import numpy as np

    return np.roll(value.as_quat(), 1, axis=-1)


def output(name: str, array: Any, shape: tuple[int, ...], dtype: str) -> Any:
    """Checks that the caller's array for a result has the right type and is writable."""
    import numpy as np

    if not isinstance(array, np.ndarray):
        raise TumbleError(f"out[{name!r}] is {type(array).__name__}; a numpy array is needed")
    if array.dtype != np.dtype(dtype):
        raise TumbleError(f"out[{name!r}] has dtype {array.dtype}; {dtype} is needed")
    if array.shape != shape:
        raise TumbleError(f"out[{name!r}] has shape {array.shape}; {shape} is needed")
    if not (array.flags.c_contiguous and array.flags.writeable):
        raise TumbleError(f"out[{name!r}]: a writable array in C order is needed")
    if not array.flags.aligned:
        raise TumbleError(f"out[{name!r}] is not aligned in memory; create it with numpy.empty")
    return array


def apart(outputs: dict[str, Any], inputs: dict[str, Any]) -> None:
    """Refuses outputs that share memory with each other or with inputs; all are in C order."""
    import numpy as np

    names = list(outputs)
    for place, name in enumerate(names):
        others = {f"out[{other!r}]": outputs[other] for other in names[place + 1 :]}
        for other, array in {**others, **inputs}.items():
            if np.may_share_memory(outputs[name], array):
                raise TumbleError(f"out[{name!r}] and {other} share memory; copy one of them")


def _fits(shape: tuple[int, ...], wanted: Sequence[Dimension]) -> bool:
    known: dict[str, int] = {}
    if len(shape) != len(wanted):
        return False
    for length, dimension in zip(shape, wanted):
        expected: int | None
        if isinstance(dimension, str):
            expected = known.setdefault(dimension, length)
        else:
            expected = dimension
        if length != expected:
            return False
    return True


def _words(shape: Sequence[Dimension]) -> str:
    inner = ", ".join(map(str, shape))
    return f"({inner},)" if len(shape) == 1 else f"({inner})"
