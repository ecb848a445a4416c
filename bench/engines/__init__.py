"""Engines, one module each."""

import importlib

from engines.base import Engine, Unavailable


def load(name: str) -> list[Engine]:
    """Loads the engine `name` with each of its settings; raises `Unavailable` if it cannot run."""
    try:
        return importlib.import_module(f"engines.{name}").engines()
    except ImportError as error:
        raise Unavailable(str(error)) from error
