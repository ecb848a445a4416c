"""The contacts of a step by column."""

from __future__ import annotations

from typing import Any, Dict, Iterator, NoReturn

from ._tumble import Columns

_NAMES = ("body", "partner", "point", "normal", "force", "slip", "normal_force", "gap")


class Contacts(Dict[str, Any]):
    """The contacts of a step, C in all, as a mapping of columns, which cannot be changed: ``body`` (C,), ``partner``
    (their names), ``point``, ``normal``, ``force``, ``slip`` (C, 3), ``normal_force`` and ``gap`` (C,)."""

    # A dictionary, because nothing is read faster in Python; it has the columns that were read.
    __slots__ = ("_columns",)

    def __init__(self, columns: Columns) -> None:
        self._columns = columns

    def __missing__(self, name: str) -> Any:
        if name not in self:
            raise KeyError(name)
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
        """The column of this name, or else the default."""
        return self[name] if name in self else default

    def keys(self) -> Any:
        """The names of the columns."""
        return list(_NAMES)

    def values(self) -> Any:
        """The columns."""
        return [self[name] for name in _NAMES]

    def items(self) -> Any:
        """The columns and their names."""
        return [(name, self[name]) for name in _NAMES]

    def copy(self) -> Dict[str, Any]:
        """A dictionary of the columns."""
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
        """Elsewhere it is a dictionary."""
        return dict, (self.copy(),)

    def _fixed(self, *_: Any, **__: Any) -> NoReturn:
        """Refused: contacts cannot be changed."""
        raise TypeError("contacts cannot be changed; contacts.copy() is a dictionary that can")

    __setitem__ = __delitem__ = __ior__ = _fixed
    clear = pop = popitem = setdefault = update = _fixed

    def __repr__(self) -> str:
        return f"<tumble.Contacts: {len(self._columns)}>"
