"""Classes around a compiled object."""

from __future__ import annotations

from operator import attrgetter
from typing import Any


def core_property(name: str, text: str) -> Any:
    """Read-only property that the compiled part ``_core`` has under the same name."""
    return property(attrgetter(f"_core.{name}"), doc=text)
