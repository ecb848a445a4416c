"""Derivatives of rollouts compared with finite differences, and through torch and jax if they are
installed."""

from importlib.util import find_spec

import numpy as np
import pytest
import tumble
from tumble._autodiff import Differentiable

STEPS = 30


def thrown():
    box = {"box": [0.2, 0.3, 0.1], "mass": 2.0, "position": [0, 0, 0.06], "velocity": [1, 0.2, 0], "spin": [0.3, 1.0, 2.0]}
    return tumble.Scene(bodies=[box], ground={"friction": 0.3}, integrator="euler")


def arrays():
    scene, rng = thrown(), np.random.default_rng(3)
    states = np.repeat(scene.states[None], 2, axis=0)
    states[1, 0, 7] += 0.1
    controls = 0.2 * rng.normal(size=(1, STEPS, 1, 6))
    return {
        "initial_states": states,
        "controls": controls,
        "friction": np.array([0.3, 0.25]),
        "mass": np.array([[2.0], [2.2]]),
        "gravity": np.array([[0, 0, -9.81], [0.1, 0, -9.7]]),
    }


WEIGHTS = np.random.default_rng(7).normal(size=(2, STEPS, 1, 13))


def loss(given):
    return float((WEIGHTS * Differentiable(thrown(), None, 1).states(given)).sum())


def difference(given, name, direction):
    """Finite difference of fourth order along a direction. Attitudes stay unit quaternions."""

    def at(by):
        moved = {**given, name: given[name] + by * direction}
        if name == "initial_states":
            q = moved[name][..., 3:7]
            q /= np.linalg.norm(q, axis=-1, keepdims=True)
        return loss(moved)

    # Small compared with the distance to the next contact change, and large compared with the
    # rounding of solutions, 1e-9 of the loss.
    by = 1e-5 if name == "initial_states" else 1e-3
    return (8 * (at(by) - at(-by)) - (at(2 * by) - at(-2 * by))) / (12 * by)


def test_products_are_those_of_differences():
    given, scene = arrays(), thrown()
    of = Differentiable(scene, None, 1)
    found = of.pull(given, of.states(given), WEIGHTS)
    rng = np.random.default_rng(5)
    for name, array in given.items():
        assert found[name].shape == array.shape
        for _ in range(3):
            direction = rng.normal(size=array.shape)
            slope = (found[name] * direction).sum()
            assert np.isclose(slope, difference(given, name, direction), rtol=2e-6, atol=3e-5), name


def test_rollouts_with_gradients():
    given, scene = arrays(), thrown()
    parameters = {name: given[name] for name in ("friction", "mass")}
    ends = np.zeros((2, 1, 12))
    ends[:, 0, 0] = 1.0
    runs = tumble.rollout(scene, given["initial_states"], given["controls"], parameters=parameters, gradients=ends)
    plain = tumble.rollout(scene, given["initial_states"], given["controls"], parameters=parameters)
    assert plain.gradients is None and np.array_equal(runs.states, plain.states)
    found = runs.gradients
    assert sorted(found.by) == ["controls", "friction", "mass", "states"]
    assert found["controls"].shape == (2, STEPS, 1, 6) and found["mass"].shape == (2, 1)
    assert found.margin.shape == (2,) and found.at.shape == (2, 2)
    assert not (found.unsolved.any() or found.unknown.any() or found.limited.any())

    def made(states):
        assert states.shape == (2, STEPS, 1, 13)
        return ends

    again = tumble.rollout(
        scene, given["initial_states"], given["controls"], parameters=parameters, gradients=made, by=["friction"], threads=2
    )
    assert sorted(again.gradients.by) == ["controls", "friction", "states"]
    assert np.array_equal(again.gradients["states"], found["states"])
    # The gradient of a batch equals the vjp of a single run.
    alone = scene.vjp(ends[0], scene.states, given["controls"][0], by=["friction"])
    once = tumble.rollout(scene, None, given["controls"], gradients=ends[:1], by=["friction"]).gradients
    assert np.array_equal(once["states"][0], alone["states"]) and np.array_equal(once["friction"][0], alone["friction"])


def test_what_is_refused():
    scene = thrown()
    with pytest.raises(TypeError, match="by needs gradients"):
        tumble.rollout(scene, steps=3, by=["friction"])
    with pytest.raises(tumble.TumbleError, match="gradients has shape"):
        tumble.rollout(scene, steps=3, gradients=np.zeros(3))
    with pytest.raises(tumble.TumbleError, match="by: \"colour\" is unknown"):
        tumble.rollout(scene, steps=3, gradients=np.zeros((1, 1, 12)), by=["colour"])


def through_torch(given):
    import torch
    import tumble.torch

    tensors = {name: torch.tensor(array, requires_grad=True) for name, array in given.items()}
    own = dict(tensors)
    states = tumble.torch.rollout(thrown(), own.pop("initial_states"), own.pop("controls"), parameters=own)
    (torch.tensor(WEIGHTS) * states).sum().backward()
    return states.detach().numpy(), {name: tensor.grad.numpy() for name, tensor in tensors.items()}


def through_jax(given):
    import jax
    import tumble.jax

    jax.config.update("jax_enable_x64", True)

    def summed(arrays):
        own = dict(arrays)
        states = tumble.jax.rollout(thrown(), own.pop("initial_states"), own.pop("controls"), parameters=own)
        return (WEIGHTS * states).sum(), states

    found, states = jax.jit(jax.grad(summed, has_aux=True))({name: jax.numpy.asarray(a) for name, a in given.items()})
    return np.asarray(states), {name: np.asarray(by) for name, by in found.items()}


def test_torch_and_jax_have_the_same_numbers():
    given, scene = arrays(), thrown()
    of = Differentiable(scene, None, 1)
    states = of.states(given)
    own = of.pull(given, states, WEIGHTS)
    for name, through in (("torch", through_torch), ("jax", through_jax)):
        if find_spec(name) is None:
            with pytest.raises(ImportError, match=f"tumble.{name} needs {name}"):
                __import__(f"tumble.{name}")
            continue
        found_states, found = through(given)
        assert np.array_equal(found_states, states)
        for argument, by in own.items():
            assert np.allclose(found[argument], by, rtol=1e-14, atol=0), (name, argument)


def test_jax_maps_over_rollouts():
    jax = pytest.importorskip("jax")
    from tumble.jax import rollout

    jax.config.update("jax_enable_x64", True)
    scene = thrown()

    def far(friction):
        return rollout(scene, steps=STEPS, parameters={"friction": friction[None]})[0, -1, 0, 0]

    frictions = jax.numpy.array([0.2, 0.3, 0.4])
    for mapped in (far, jax.grad(far)):
        assert np.array_equal(jax.vmap(mapped)(frictions), [mapped(friction) for friction in frictions])
