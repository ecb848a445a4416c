"""Objects by name, and errors about unknown names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from ._tumble import TumbleError, name_hint

Value = TypeVar("Value")

_MOST_LISTED = 6
"""Largest number of names in an error message."""


class UnknownName(TumbleError, KeyError):
    """Error about an unknown name: a TumbleError, and a KeyError for ``except`` and mappings."""

    # A KeyError would quote its message.
    __str__ = Exception.__str__


def unknown(what: str, name: Any, known: Iterable[str]) -> UnknownName:
    """Error about an unknown name of ``what``, with the nearest of the known names."""
    names = list(known)
    listed = ", ".join(names[:_MOST_LISTED]) + (", …" if len(names) > _MOST_LISTED else "")
    hint = name_hint(name, names) if isinstance(name, str) else ""
    return UnknownName(f"{what} {name!r} is unknown{hint} (known: {listed or 'none'})")


class ByName(dict[str, Value]):
    """Dictionary of ``what`` by name. An unknown name raises an error with the nearest one."""

    __slots__ = ("_what",)

    def __init__(self, what: str, entries: Mapping[str, Value]) -> None:
        super().__init__(entries)
        self._what = what

    def __missing__(self, name: str) -> Value:
        raise unknown(self._what, name, self)


def by_name(option: str, given: Any, names: list[str], *, each: bool = False) -> dict[str, Any]:
    """Values of an option by name. ``given`` has values by name, or is the value of all.

    :param each: True if each name needs a value.
    :raises TumbleError: for an unknown name, and for a missing one.
    """
    found = dict(given) if isinstance(given, Mapping) else dict.fromkeys(names, given)
    for name in found:
        if name not in names:
            raise unknown(f"name in {option}", name, names)
    missing = [name for name in names if name not in found]
    if each and missing:
        raise TumbleError(f"{option} has no number for {missing[0]}; give one for each driven joint")
    return found
