"""Identification of constants of a scene from recorded motions: docs/fit.md.

It needs scipy and, for ``Fit.plot``, matplotlib.
"""

from ._fit import Fit, Fold, fit
from ._recordings import Recording, read
from ._simulations import Errors

__all__ = ["Errors", "Fit", "Fold", "Recording", "fit", "read"]
