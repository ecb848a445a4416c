"""Adapters of engines, one file each.

A file has a list ``ENGINES``. An adapter may import its package at the top: a package that is missing makes a line of
the table.
"""

from __future__ import annotations

from importlib import import_module

from ._base import Engine, Motion, Sensitivities, Unsupported

__all__ = ["MODULES", "Engine", "Motion", "Sensitivities", "Unsupported", "engine"]

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
    "drake-sap": "drake",
    "drake-cenic": "drake",
    "newton-kamino": "newton",
    "newton-xpbd": "newton",
    "pybullet": "pybullet",
    "rapier": "rapier",
    "rapier-default": "rapier",
    "rapier-python": "rapier_python",
    "rapier-python-default": "rapier_python",
    "dart": "dart",
    "dart-exact": "dart",
    "tutorial": "tutorial",
    "brax": "brax",
    "nimble": "nimble",
}
"""File of each engine, by the name of the engine."""


def engine(name: str) -> Engine:
    """Engine of a name.

    :raises ImportError: if its package is not installed, or does not load.
    """
    module = import_module(f".{MODULES[name]}", __package__)
    found: Engine = next(one for one in module.ENGINES if one.name == name)
    return found
