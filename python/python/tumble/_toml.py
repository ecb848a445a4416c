"""Python values as a TOML document, for the parser of scenario files."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

from ._arrays import quaternion
from ._checks import LARGEST_WHOLE, shown
from ._tumble import TumbleError

_MOST_NESTED = 64
"""Largest depth of lists and dictionaries in a scene."""


def document(fields: Mapping[str, Any]) -> str:
    """TOML document of ``fields``, without those that are None."""
    given = {key: value for key, value in fields.items() if value is not None}
    return "".join(f"{_key(key)} = {toml_value(key, value)}\n" for key, value in given.items())


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise TumbleError(f"{key!r}: the names of fields are strings")
    return _string(key)


def _string(text: str) -> str:
    if any("\ud800" <= c <= "\udfff" for c in text):
        raise TumbleError(f"{text!r} is not valid text: it has half of a surrogate pair")
    inner = "".join(f"\\u{ord(c):04x}" if ord(c) < 32 or c in '"\\' or ord(c) == 127 else c for c in text)
    return f'"{inner}"'


def _packed(array: Any) -> str:
    """Rows of numbers as one text: little-endian bytes, compressed by deflate, in Base64."""
    data = array.astype("<f8", order="C").tobytes()
    text = base64.b64encode(zlib.compress(data)).decode("ascii")
    return f'{{ columns = {array.shape[1]}, packed = "{text}" }}'


def toml_value(name: str, value: Any, depth: int = 0) -> str:
    """TOML of ``value``. Errors call it ``name``."""
    if depth > _MOST_NESTED:
        raise TumbleError("a list or dictionary of the scene contains itself, or is nested too deeply")
    if name.endswith(".heights") and getattr(value, "ndim", 0) == 2 and value.dtype.kind in "fiu":
        return _packed(value)
    value = quaternion(value)
    if hasattr(value, "tolist"):
        # numpy arrays and scalars.
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, int) and not -LARGEST_WHOLE <= value <= LARGEST_WHOLE:
        raise TumbleError(
            f"{name} is {shown(value)}; a whole number below 2^63, or a real number such as 1e19, is needed"
        )
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        inner = ", ".join(
            f"{_key(key)} = {toml_value(f'{name}.{key}', item, depth + 1)}" for key, item in value.items() if item is not None
        )
        return f"{{ {inner} }}"
    try:
        items = list(value)
    except TypeError:
        raise TumbleError(
            f"{name}: {type(value).__name__} is not supported in a scene; a number, a string, a "
            "list or a dictionary is needed"
        ) from None
    inner = ", ".join(toml_value(f"{name}[{index}]", item, depth + 1) for index, item in enumerate(items))
    return f"[{inner}]"
