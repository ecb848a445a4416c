"""Rollouts as a differentiable function for jax: ``tumble.jax.rollout``. Needs jax.

    >>> import jax, tumble.jax
    >>> jax.config.update("jax_enable_x64", True)
    >>> def far(friction):
    ...     return tumble.jax.rollout(scene, steps=100, parameters={"friction": friction})[0, -1, 0, 0]
    >>> jax.grad(far)(jax.numpy.array([0.3]))

Only reverse mode is supported (``jax.grad``, ``jax.vjp``), also under ``jax.jit`` and ``jax.vmap``, which
takes the entries one after the other. A batch of states is faster. Derivatives are exact and valid up to the next kink: docs/gradients.md. Without ``jax_enable_x64`` jax rounds
all numbers to single precision.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._autodiff import Differentiable, given_arrays
from ._gradients import smoothing_of

try:
    import jax
except ImportError as error:
    raise ImportError("tumble.jax needs jax; install it with pip install jax") from error

if TYPE_CHECKING:
    from ._scene import Scene


def rollout(
    scene: Scene,
    initial_states: Any = None,
    controls: Any = None,
    *,
    motors: Any = None,
    joint_forces: Any = None,
    steps: int | None = None,
    parameters: Mapping[str, Any] | None = None,
    compliance: float | None = None,
    central_path: float | None = None,
    threads: int | None = None,
) -> Any:
    """States after each step, (B, T, N, 13), as a differentiable function of arrays.

    Arguments are those of ``tumble.rollout``. Derivatives with respect to attitudes are tangent to
    the unit quaternions. ``compliance`` and ``central_path`` smooth the derivatives as in
    ``Scene.jacobian``; the states are exact.

    :raises TumbleError: see ``tumble.rollout``. In a compiled function, jax converts errors about
        values to its own.
    """
    import numpy as np

    of = Differentiable(scene, steps, threads, smoothing_of(compliance, central_path))
    arrays = {"initial_states": initial_states, "controls": controls, "motors": motors, "joint_forces": joint_forces}
    given = given_arrays(arrays, parameters)
    operands = {name: jax.numpy.asarray(array, float) for name, array in given.items()}
    doubles = lambda arrays: {name: np.asarray(array, np.float64) for name, array in arrays.items()}

    def states(arrays: Any) -> Any:
        shape = of.shape({name: np.zeros(array.shape) for name, array in arrays.items()})
        found = jax.ShapeDtypeStruct(shape, jax.numpy.zeros(0).dtype)
        called = lambda a: of.states(doubles(a)).astype(found.dtype)
        return jax.pure_callback(called, found, arrays, vmap_method="sequential")

    def pull(arrays: Any, states: Any, by_states: Any) -> Any:
        found = of.pull(doubles(arrays), np.asarray(states, np.float64), np.asarray(by_states, np.float64))
        return {name: by.astype(arrays[name].dtype) for name, by in found.items()}

    def backward(kept: Any, by_states: Any) -> Any:
        arrays, ends = kept
        like = {name: jax.ShapeDtypeStruct(array.shape, array.dtype) for name, array in arrays.items()}
        return (jax.pure_callback(pull, like, arrays, ends, by_states, vmap_method="sequential"),)

    def forward(arrays: Any) -> Any:
        ends = states(arrays)
        return ends, (arrays, ends)

    differentiable = jax.custom_vjp(states)
    differentiable.defvjp(forward, backward)
    return differentiable(operands)
