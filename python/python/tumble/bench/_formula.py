"""Formulas of case files: arithmetic on parameters and on measured curves."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from .._tumble import TumbleError

_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_CONSTANTS = {"pi": math.pi}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "acos": math.acos,
    "atan": math.atan,
    "ceil": math.ceil,
    "cos": math.cos,
    "exp": math.exp,
    "max": max,
    "min": min,
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}
_LONGEST = 1000
"""Longest formula, characters."""


def evaluate(formula: Any, names: Mapping[str, Any]) -> Any:
    """Value of a number or of a formula over ``names``.

    A formula has numbers, texts, names, ``+ - * / **``, and calls of functions. The functions are those
    of ``names`` and a few of the module math.

    :raises TumbleError: if the formula has another construct or an unknown name, or has no value.
    """
    if isinstance(formula, (int, float)) and not isinstance(formula, bool):
        return float(formula)
    if not isinstance(formula, str) or len(formula) > _LONGEST:
        raise TumbleError(f"{formula!r} is not a formula; a number or a text such as \"v**2 / (2*mu*g)\" is needed")
    try:
        return _value(ast.parse(formula, mode="eval").body, names)
    except TumbleError as error:
        raise TumbleError(f"the formula {formula!r}: {error}") from None
    except (SyntaxError, ArithmeticError, ValueError, TypeError, RecursionError) as error:
        raise TumbleError(f"the formula {formula!r} has no value: {error}") from None


def _value(node: ast.expr, names: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        # A float: a power of whole numbers could fill the memory.
        return float(node.value)
    if isinstance(node, ast.Name):
        known = {**_CONSTANTS, **names}
        if node.id not in known:
            raise TumbleError(f"{node.id} is unknown; known are {', '.join(sorted(known))}")
        return known[node.id]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        inner = _value(node.operand, names)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_value(node.left, names), _value(node.right, names))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        functions = {**_FUNCTIONS, **{name: value for name, value in names.items() if callable(value)}}
        if node.func.id not in functions:
            raise TumbleError(f"the function {node.func.id} is unknown; known are {', '.join(sorted(functions))}")
        return functions[node.func.id](*(_value(argument, names) for argument in node.args))
    raise TumbleError(f"{ast.unparse(node)} is not allowed; use numbers, names, + - * / ** and functions")
