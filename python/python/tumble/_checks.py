"""Checks of arguments other than arrays, with errors that name the argument."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from numbers import Real
from operator import index
from typing import Any, TypeVar

from ._tumble import TumbleError

Kind = TypeVar("Kind")

LARGEST_WHOLE = 2**63 - 1
"""Largest integer in a scene and largest count."""
_USUAL_MEMORY = 1 << 40
"""Assumed memory, bytes, if the system does not report its size."""


def shown(value: Any) -> str:
    """Text of ``value`` for an error message, shortened for large integers."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"a whole number of {value.bit_length()} bits"
    return repr(value)


def whole(name: str, value: Any, least: int, most: int = LARGEST_WHOLE) -> int:
    """``value`` as an integer from ``least`` to ``most``. Accepts numpy's integers, not bool."""
    try:
        number = least - 1 if isinstance(value, bool) else index(value)
    except TypeError:
        number = least - 1
    if not least <= number <= most:
        upwards = "" if most == LARGEST_WHOLE and number < most else f" to {most}"
        raise TumbleError(f"{name} is {shown(value)}; a whole number from {least}{upwards} is needed")
    return number


def made(name: str, value: Any, kind: type[Kind]) -> Kind:
    """``value``, if it is an instance of tumble's class ``kind``."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} is {type(value).__name__}; tumble.{kind.__name__} is needed")
    return value


def real(name: str, value: Any) -> float:
    """``value`` as a float. Accepts numpy's numbers."""
    try:
        number = float(value) if isinstance(value, Real) else None
    except OverflowError:
        number = None
    if number is None:
        raise TumbleError(f"{name} is {shown(value)}; a number is needed")
    return number


def name_list(name: str, value: Any) -> list[str]:
    """``value`` as a list of names. A string is refused, since its letters would be the names."""
    listed = None if isinstance(value, str) else value
    try:
        items = list(listed)  # type: ignore[arg-type]
    except TypeError:
        one = f": [{value!r}]" if isinstance(value, str) else ""
        raise TumbleError(f"{name} is {value!r}; a list of names is needed{one}") from None
    for item in items:
        if not isinstance(item, str):
            raise TumbleError(f"{name} has {item!r}; a name is a string")
    return items


def texts(name: str, value: Any) -> list[str]:
    """The texts of the items of ``value``. A string is refused, as in ``name_list``."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise TumbleError(f"{name} is {value!r}; a list of names is needed")
    return [str(item) for item in value]


def tables(name: str, value: Any, instead: str = "") -> list[Mapping[str, Any]]:
    """``value`` as a list of dictionaries. ``instead`` is a hint for the error message."""
    listed = None if isinstance(value, (Mapping, str)) else value
    try:
        items = list(listed)  # type: ignore[arg-type]
    except TypeError:
        raise TumbleError(f"{name} is {value!r}; a list of dictionaries is needed{instead}") from None
    for place, item in enumerate(items):
        if not isinstance(item, Mapping):
            raise TumbleError(f"{name}[{place}] is {item!r}; a dictionary is needed{instead}")
    return items


def pandas() -> Any:
    """The module pandas."""
    try:
        import pandas as module
    except ImportError as error:
        raise ImportError("tables need pandas; install it with pip install pandas") from error
    return module


def room(what: str, size: int) -> None:
    """Raises MemoryError if ``what`` needs more bytes than the process can have.

    The limit is the smaller of the machine's memory and the process limit.
    """
    try:
        most = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        most = _USUAL_MEMORY
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        with open("/proc/self/statm", encoding="ascii") as statm:
            used = int(statm.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        most = min(most, limit - used) if limit >= 0 else most
    except (ImportError, OSError, ValueError):
        # The system has no such limits, or does not report the memory in use.
        pass
    if size > most:
        raise MemoryError(
            f"{what} need at least {size / 1e9:.3g} GB of memory; this process can have {most / 1e9:.3g} GB"
        )
