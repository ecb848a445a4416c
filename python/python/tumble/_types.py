"""Types of arguments and results."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

# Strings, because numpy is imported when the first array is created.
Floats: TypeAlias = "npt.NDArray[np.float64]"
Integers: TypeAlias = "npt.NDArray[np.int64]"
Bytes: TypeAlias = "npt.NDArray[np.uint8]"

Location = str | os.PathLike[str]
"""Path of a file or a folder."""

Fields = Mapping[str, Any]
"""Table of a scenario file; scenarios/README.md has its fields."""

ByJoint = float | Mapping[str, float]
"""One number for all joints, or numbers by the joints' names."""

Progress = bool | Callable[[int, int], object]
"""Callback for the steps done and all steps, about ten times per second. True writes them to stderr."""
