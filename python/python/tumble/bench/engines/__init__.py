"""Adapters of engines, one file each.

A file has a list ``ENGINES``. An adapter may import its package at the top: a package that is missing makes a line of
the table. Adapters outside the package have the same form: ``python -m tumble.bench --template`` prints one.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from ..._tumble import TumbleError
from .._scene import Scene
from ._base import Engine, Motion, Sensitivities, Stopwatch, Unsupported, no_restitution, rows, world_spin

__all__ = [
    "MODULES",
    "Engine",
    "Motion",
    "Scene",
    "Sensitivities",
    "Stopwatch",
    "Unsupported",
    "adapter_engines",
    "engine",
    "no_restitution",
    "rows",
    "world_spin",
]

MODULES: dict[str, str] = {
    "tumble": "native",
    "tumble-1e-6": "native",
    "tumble-ipopt": "native",
    "mujoco": "mujoco_c",
    "mujoco-noslip": "mujoco_c",
    "mujoco-default": "mujoco_c",
    "mujoco-stiff": "mujoco_c",
    "mujoco-discrete": "mujoco_c",
    "mujoco-warp": "mujoco_warp",
    "motrixsim": "motrixsim",
    "motrixsim-stiff": "motrixsim",
    "drake-sap": "drake",
    "drake-cenic": "drake",
    "genesis": "genesis",
    "genesis-default": "genesis",
    "newton-kamino": "newton",
    "newton-xpbd": "newton",
    "pybullet": "pybullet",
    "rapier": "rapier",
    "rapier-default": "rapier",
    "rapier-python": "rapier_python",
    "rapier-python-default": "rapier_python",
    "box3d": "box3d",
    "box3d-default": "box3d",
    "jolt": "jolt",
    "jolt-default": "jolt",
    "superdex": "superdex",
    "superdex-default": "superdex",
    "dart": "dart",
    "dart-exact": "dart",
    "tutorial": "tutorial",
    "brax": "brax",
    "nimble": "nimble",
}
"""File of each engine, by the name of the engine."""


def engine(name: str, adapter: Path | None = None) -> Engine:
    """Engine of a name, of the package or of the file ``adapter``.

    :raises ImportError: if its package is not installed, or does not load.
    """
    listed = import_module(f".{MODULES[name]}", __package__).ENGINES if adapter is None else adapter_engines(adapter)
    found: Engine = next(one for one in listed if one.name == name)
    return found


def adapter_engines(path: Path) -> list[Engine]:
    """Engines of an adapter outside the package. Its folder is searched for modules, as that of a script.

    :raises TumbleError: if the file has no list of engines.
    """
    name = f"_adapter_{path.stem}"
    if name not in sys.modules:
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None or not path.is_file():
            raise TumbleError(f"{path} is not a Python file; give the file of an adapter")
        sys.path.insert(0, str(path.parent))
        module = sys.modules[name] = module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
    found: Any = getattr(sys.modules[name], "ENGINES", None)
    if not isinstance(found, list) or not found or not all(isinstance(one, Engine) for one in found):
        raise TumbleError(f"{path} has no list of engines; end it with ENGINES = [MyEngine()]")
    for one in found:
        for field in ("name", "settings", "compliant"):
            if not hasattr(one, field):
                raise TumbleError(f"{path}: {type(one).__name__} has no {field}; add it to the class")
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", str(one.name)):
            raise TumbleError(f"{path}: the name {one.name!r} names a file; use letters, digits, '-', '_' and '.'")
    return found
