"""Status of a step."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Status of a step: its number in arrays, and its ``word`` in tables."""

    FREE = 0
    """Nothing can touch: no problem was solved."""
    CONVERGED = 1
    """The solver met its tolerance from its first initial point."""
    RETRIED = 2
    """The solver met its tolerance from a later initial point."""
    FALLBACK = 3
    """The result comes from another solver."""
    SUBSTEPPED = 4
    """A sequence of shorter steps replaced the step."""
    WILD = 5
    """Converged, but unphysical: docs/concepts/unphysical-steps.md."""
    FAILED = 6
    """Not converged."""
    END = 7
    """Last row of a trajectory: a state without a step."""

    @property
    def word(self) -> str:
        """Name in tables, for example "converged"."""
        return self.name.lower()

    @property
    def ok(self) -> bool:
        """True if the step converged to a physical solution."""
        return self not in (Status.FAILED, Status.WILD)

    def __str__(self) -> str:
        return self.word

    __hash__ = int.__hash__

    def __eq__(self, other: object) -> bool:
        return int.__eq__(self, _number(other))

    def __ne__(self, other: object) -> bool:
        return int.__ne__(self, _number(other))


def _number(other: object) -> object:
    """Refuses a word, which would never be equal."""
    if isinstance(other, str):
        raise TypeError(
            f"a status cannot be compared with {other!r}; use Status.{other.upper()}, or the word of the status"
        )
    return other


BY_WORD = {status.word: status for status in Status}
