"""The engines, one module each."""

import importlib

from engines.base import Engine, Unavailable


def load(name: str) -> list[Engine]:
    """The engine of that name with each of its settings; `Unavailable` if it cannot be run."""
    try:
        return importlib.import_module(f"engines.{name}").engines()
    except ImportError as error:
        raise Unavailable(str(error)) from error
