"""The logger ``tumble``. Python prints its warnings unless a program configures ``logging``."""

from __future__ import annotations

import logging

_LOGGER = logging.getLogger("tumble")


def unsolved(count: int, total: int, where: str) -> None:
    """Warns of ``count`` unsolved steps of ``total``, if there are any. ``where`` lists them."""
    if count:
        steps = "step is" if count == 1 else "steps are"
        _LOGGER.warning("%d of %d %s failed or wild; %s lists them", count, total, steps, where)
