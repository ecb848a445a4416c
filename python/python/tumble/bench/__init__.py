"""Contact benchmark: cases with known answers, run by several engines.

    $ python -m tumble.bench --out results

A case is a TOML file with a scene and its answers. Every engine that is installed runs every case in its own
process. The result is a table of errors, times and failures (docs/benchmark.md).
"""

from ._case import Answer, Case, Gradient, all_cases, load_case
from ._scene import Body, Force, Scene

__all__ = ["Answer", "Body", "Case", "Force", "Gradient", "Scene", "all_cases", "load_case"]
