"""Rollouts as a differentiable function of arrays, shared by the wrappers for torch and jax."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._rollout import batch_of, rollout
from ._tumble import PARAMETERS, TumbleError
from ._types import Floats

if TYPE_CHECKING:
    from ._scene import Scene


ARGUMENTS = ("initial_states", "controls", "motors", "joint_forces")
"""Arguments of a rollout with derivatives, besides the constants."""


def given_arrays(arrays: Mapping[str, Any], parameters: Mapping[str, Any] | None) -> dict[str, Any]:
    """Arrays that are not None by name, and then the constants."""
    for name in parameters or {}:
        if name not in PARAMETERS:
            raise TumbleError(f"parameters: {name!r} is unknown; use {', '.join(PARAMETERS)}")
    given = {name: array for name, array in arrays.items() if array is not None}
    return {**given, **(parameters or {})}


class Differentiable:
    """Rollouts of a scene as a function of named arrays."""

    def __init__(
        self, scene: Scene, steps: int | None, threads: int | None, smoothing: tuple[str, float] | None = None
    ):
        self.scene, self.steps, self.threads, self.smoothing = scene, steps, threads, smoothing

    def _arguments(self, arrays: Mapping[str, Any]) -> dict[str, Any]:
        own = dict(arrays)
        timed = {name: own.pop(name, None) for name in ARGUMENTS}
        return {**timed, "steps": self.steps, "parameters": own}

    def shape(self, arrays: Mapping[str, Any]) -> Any:
        """Shape of the states, (B, T, N, 13)."""
        batch = batch_of(self.scene, **self._arguments(arrays))
        return batch.rollouts, batch.steps, len(self.scene.bodies), 13

    def states(self, arrays: Mapping[str, Any]) -> Floats:
        """States after each step."""
        return rollout(self.scene, **self._arguments(arrays), threads=self.threads).states

    def pull(self, arrays: Mapping[str, Any], states: Floats, by_states: Floats) -> dict[str, Floats]:
        """Vector-Jacobian product: derivatives with respect to each array, in its shape.

        ``by_states`` are the derivatives with respect to ``states``.
        """
        import numpy as np

        batch = batch_of(self.scene, **self._arguments(arrays))
        duals = np.concatenate(
            [
                by_states[..., :3],
                0.5 * np.einsum("...ij,...i->...j", _turning(states[..., 3:7]), by_states[..., 3:7]),
                by_states[..., 7:],
            ],
            axis=-1,
        )
        found = batch.gradients(duals, None, self.threads, self.smoothing).by
        start = found.pop("states")
        turning = _turning(np.broadcast_to(batch.starts, (batch.rollouts, *batch.starts.shape[1:]))[..., 3:7])
        by_attitude = 2.0 * np.einsum("...ij,...j->...i", turning, start[..., 3:6])
        found["initial_states"] = np.concatenate([start[..., :3], by_attitude, start[..., 6:]], axis=-1)
        of_array = {}
        for name, array in arrays.items():
            by, shape = found[name], np.shape(array)
            # A start, control or other input shared by all rollouts sums their derivatives.
            by = by.sum(axis=0, keepdims=True) if shape[0] == 1 and len(by) > 1 else by
            of_array[name] = by.reshape(shape)
        return of_array


def _turning(attitudes: Floats) -> Floats:
    """L(q) H, (..., 4, 3). Half of it maps a rotation in body axes to a change of attitude."""
    import numpy as np

    w, x, y, z = np.moveaxis(attitudes, -1, 0)
    rows = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
