"""Rollouts as a differentiable function for torch: ``tumble.torch.rollout``. Needs torch.

    >>> import torch, tumble.torch
    >>> friction = torch.tensor([0.3], dtype=torch.float64, requires_grad=True)
    >>> states = tumble.torch.rollout(scene, steps=100, parameters={"friction": friction})
    >>> states[0, -1, 0, 0].backward()
    >>> friction.grad

Derivatives are exact and valid up to the next kink: docs/gradients.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._autodiff import Differentiable, given_arrays
from ._gradients import smoothing_of

try:
    import torch
except ImportError as error:
    raise ImportError("tumble.torch needs torch; install it with pip install torch") from error

if TYPE_CHECKING:
    from ._scene import Scene


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, of: Differentiable, names: Any, *tensors: Any) -> Any:
        arrays = {name: tensor.detach().cpu().numpy() for name, tensor in zip(names, tensors)}
        states = torch.from_numpy(of.states(arrays))
        ctx.of, ctx.names = of, names
        ctx.save_for_backward(states, *tensors)
        return states

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, by_states: Any) -> Any:
        states, *tensors = ctx.saved_tensors
        arrays = {name: tensor.detach().cpu().numpy() for name, tensor in zip(ctx.names, tensors)}
        found = ctx.of.pull(arrays, states.numpy(), by_states.detach().cpu().numpy())
        gradients = [
            torch.tensor(found[name], dtype=tensor.dtype, device=tensor.device)
            for name, tensor in zip(ctx.names, tensors)
        ]
        return (None, None, *gradients)


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
    """States after each step, (B, T, N, 13), as a differentiable function of tensors.

    The result is a float64 tensor on the CPU. Arguments are those of ``tumble.rollout``.
    Derivatives with respect to attitudes are tangent to the unit quaternions. ``compliance`` and
    ``central_path`` smooth the derivatives as in ``Scene.jacobian``; the states are exact.

    :raises TumbleError: see ``tumble.rollout``.
    """
    arrays = {"initial_states": initial_states, "controls": controls, "motors": motors, "joint_forces": joint_forces}
    given = given_arrays(arrays, parameters)
    tensors = [torch.as_tensor(array) for array in given.values()]
    of = Differentiable(scene, steps, threads, smoothing_of(compliance, central_path))
    return _Rollout.apply(of, list(given), *tensors)
