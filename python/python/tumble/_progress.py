"""Progress reports of long work."""

from __future__ import annotations

import sys
from typing import Callable, Optional, Union

Progress = Union[bool, Callable[[int, int], object]]
"""Callback for the steps done and all steps, about ten times per second. True writes them to stderr."""


def callback(progress: Progress) -> Optional[Callable[[int, int], object]]:
    if progress is True:
        return _written
    return progress or None


def _written(done: int, total: int) -> None:
    end = "\n" if done >= total else ""
    print(f"\r{done} of {total} steps", end=end, file=sys.stderr, flush=True)
