"""Contacts of a step as columns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NoReturn

from ._names import unknown
from ._tumble import Columns

_NAMES = (*("body", "partner", "partner_body"), *("point", "normal", "force", "slip", "normal_force", "gap", "moment"))


class Contacts(dict[str, Any]):
    """Contacts of a step, C in all, as a read-only mapping of columns.

    - ``body`` (C,), ``partner`` (tuple of C names);
    - ``partner_body`` (C,): index of the partner among the bodies, -1 for the ground and fixed
      pieces;
    - ``point``, ``normal``, ``force``, ``slip``, ``moment`` (C, 3);
    - ``normal_force``, ``gap`` (C,).
    """

    # A dict subclass is the fastest mapping. It holds the columns that have been read.
    __slots__ = ("_columns",)

    def __init__(self, columns: Columns) -> None:
        self._columns = columns

    def __missing__(self, name: str) -> Any:
        if name not in self:
            raise unknown("column", name, _NAMES)
        column = self._columns.column(name)
        super().__setitem__(name, column)
        return column

    def __len__(self) -> int:
        return len(_NAMES)

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __reversed__(self) -> Iterator[str]:
        return reversed(_NAMES)

    def __contains__(self, name: object) -> bool:
        return name in _NAMES

    def get(self, name: Any, default: Any = None) -> Any:
        """Column of this name, or the default."""
        return self[name] if name in self else default

    def keys(self) -> Any:
        """Names of the columns."""
        return list(_NAMES)

    def values(self) -> Any:
        """Columns in the order of their names."""
        return [self[name] for name in _NAMES]

    def items(self) -> Any:
        """Pairs of name and column."""
        return [(name, self[name]) for name in _NAMES]

    def copy(self) -> dict[str, Any]:
        """Copies the columns to a dictionary."""
        return {name: self[name] for name in _NAMES}

    def __or__(self, other: Any) -> Any:
        return {**self.copy(), **other}

    def __ror__(self, other: Any) -> Any:
        return {**other, **self.copy()}

    def __eq__(self, other: object) -> bool:
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other

    def __reduce__(self) -> Any:
        """Pickles the contacts as a plain dictionary."""
        return dict, (self.copy(),)

    def _fixed(self, *_: Any, **__: Any) -> NoReturn:
        """Refuses changes."""
        raise TypeError("contacts cannot be changed; change the dictionary contacts.copy() instead")

    __setitem__ = __delitem__ = __ior__ = _fixed
    clear = pop = popitem = setdefault = update = _fixed

    def __repr__(self) -> str:
        return f"<tumble.Contacts: {len(self._columns)} contacts with {', '.join(_NAMES)}>"
