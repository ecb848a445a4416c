"""Hard steps and certificates for MuJoCo models. Needs mujoco, which stays optional.

    >>> import mujoco, tumble.mujoco
    >>> print(tumble.mujoco.certify(model, data))          # of MuJoCo's next step
    >>> tumble.mujoco.hard_step(model, data)               # instead of mujoco.mj_step(model, data)

How-to and limits: docs/referee.md.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from ._certificate import Certificate
from ._mujoco_certify import certify_step
from ._mujoco_compare import Comparison
from ._mujoco_compare import compare as _compare
from ._mujoco_step import HardStep, HardStepper, UnsolvedStep

__all__ = ["Comparison", "HardStep", "HardStepper", "UnsolvedStep", "certify", "compare", "hard_step"]

_MOST_STEPPERS = 8
"""Models of which ``hard_step`` keeps a stepper."""
_STEPPERS: OrderedDict[int, HardStepper] = OrderedDict()


def hard_step(model: Any, data: Any, *, restitution: float = 0.0, unsolved: str = "warn") -> HardStep:
    """Advances ``data`` by one step with hard contacts and Coulomb's exact law, instead of ``mujoco.mj_step``.

    :param restitution: Newton's coefficient of all contacts.
    :param unsolved: "warn", "raise" or "ignore", for a step that is not solved.
    :raises TumbleError: if the step is not solved and ``unsolved`` is "raise".
    """
    stepper = _stepper(model)
    stepper.configure(restitution=restitution, unsolved=unsolved)
    return stepper.step(data)


def certify(model: Any, data: Any) -> Certificate:
    """Certificate of the step that ``mujoco.mj_step(model, data)`` would take. ``data`` does not change.

    Contacts and joint limits that the step reaches without a force are rows too.
    """
    return certify_step(_stepper(model), data)[0]


def compare(model: Any, data: Any, steps: int, *, control: Callable[[Any], None] | None = None) -> Comparison:
    """MuJoCo's steps beside hard steps, from copies of ``data``.

    :param steps: number of steps of both kinds.
    :param control: function that sets ``ctrl`` of the data it is called with, before each of MuJoCo's steps. The hard
        steps have the same controls.
    """
    return _compare(HardStepper(model, unsolved="ignore"), data, steps, control)


def _stepper(model: Any) -> HardStepper:
    stepper = _STEPPERS.get(id(model))
    if stepper is None:
        stepper = _STEPPERS[id(model)] = HardStepper(model)
        if len(_STEPPERS) > _MOST_STEPPERS:
            _STEPPERS.popitem(last=False)
    return stepper
