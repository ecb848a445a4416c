"""Objects by name, and errors about unknown names."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, TypeVar, Union

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


ByJoint = Union[float, Mapping[str, float]]
"""One number for all joints, or numbers by the joints' names."""


def by_name(option: str, given: Any, names: List[str], *, each: bool = False) -> Dict[str, Any]:
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
