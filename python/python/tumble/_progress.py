"""Progress reports of long work."""

from __future__ import annotations

import sys
from collections.abc import Callable

from ._types import Progress


def callback(progress: Progress) -> Callable[[int, int], object] | None:
    if progress is True:
        return _written
    return progress or None


def _written(done: int, total: int) -> None:
    end = "\n" if done >= total else ""
    print(f"\r{done} of {total} steps", end=end, file=sys.stderr, flush=True)
