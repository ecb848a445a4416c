"""Objects by name, and errors about unknown names."""

from __future__ import annotations

from typing import Any, Dict, Iterable, Mapping, TypeVar

from ._tumble import TumbleError, name_hint

Value = TypeVar("Value")

_MOST_LISTED = 6
"""Largest number of names in an error message."""


def unknown(what: str, name: Any, known: Iterable[str]) -> TumbleError:
    """Error about an unknown name of ``what``, with the nearest of the known names."""
    names = list(known)
    listed = ", ".join(names[:_MOST_LISTED]) + (", …" if len(names) > _MOST_LISTED else "")
    hint = name_hint(name, names) if isinstance(name, str) else ""
    return TumbleError(f"{what} {name!r} is unknown{hint} (known: {listed or 'none'})")


class ByName(Dict[str, Value]):
    """Dictionary of ``what`` by name. An unknown name raises TumbleError with the nearest one."""

    __slots__ = ("_what",)

    def __init__(self, what: str, entries: Mapping[str, Value]) -> None:
        super().__init__(entries)
        self._what = what

    def __missing__(self, name: str) -> Value:
        raise unknown(self._what, name, self)
