"""Batches equal a loop of single runs on any number of threads, and can write to the caller's
memory."""

import os
import pickle
import signal
import threading
import tracemalloc

import numpy as np
import pytest
import tumble
from conftest import ROOT


@pytest.fixture
def scene():
    return tumble.drop(1)


def starts_of(count):
    states = np.concatenate([tumble.drop(seed).states for seed in range(count)])
    states[:, 2] = 1.75
    return states


def test_a_batch_has_the_numbers_of_a_loop(scene):
    """10⁴ rollouts with different starts and pushes, on one thread and on four."""
    count, steps = 10_000, 20
    rng = np.random.default_rng(0)
    states = np.tile(starts_of(20), (count // 20, 1))
    states[:, 7:10] = rng.normal(size=(count, 3))
    controls = rng.normal(scale=30.0, size=(count, steps, 6))
    one = tumble.rollout(scene, states, controls, threads=1)
    assert one.counts["converged"] > 1000 and one.unsolved == []
    four = tumble.rollout(scene, states, controls, threads=4)
    for name in ("states", "forces", "residuals", "status"):
        np.testing.assert_array_equal(getattr(one, name), getattr(four, name))
    for index in range(0, count, 97):
        run = scene.simulate(states[index]).run(steps, controls[index])
        np.testing.assert_array_equal(one.states[index], run.states[1:])
        np.testing.assert_array_equal(one.residuals[index], run.residuals)
        np.testing.assert_array_equal(one.status[index], run.status)


def test_parameters_are_those_of_scenes_of_their_own():
    body = {"box": [0.4, 0.3, 0.2], "mass": 2.0, "position": [0, 0, 0.11], "velocity": [1, 0, -1]}
    scene = tumble.Scene([body], {"friction": 0.3})
    friction, restitution, mass = [0.1, 0.7], [0.0, 0.5], [[1.0], [3.0]]
    gravity, time_step = [[0, 0, -9.81], [0, 1, -3.0]], [0.002, 0.004]
    batch = tumble.rollout(
        scene,
        steps=100,
        parameters={
            "friction": friction,
            "restitution": restitution,
            "mass": mass,
            "gravity": gravity,
            "time_step": time_step,
        },
    )
    for b in range(2):
        other = tumble.Scene(
            [{**body, "mass": mass[b][0]}],
            {"friction": friction[b], "restitution": restitution[b]},
            gravity=gravity[b],
            time_step=time_step[b],
        )
        # The inertia is computed with another order of factors, hence the tolerance.
        np.testing.assert_allclose(batch.states[b], other.run(100).states[1:], atol=1e-9)


def test_an_inertia_is_that_of_a_scene_of_its_own():
    body = {"box": 0.4, "mass": 2.0, "position": [0, 0, 1], "spin": [1, 2, 3]}
    inertia = [[0.1, 0.01, 0.0], [0.01, 0.08, 0.0], [0.0, 0.0, 0.09]]
    scene = tumble.Scene([body], {"friction": 0.3})
    batch = tumble.rollout(scene, steps=300, parameters={"inertia": [[inertia]]})
    other = tumble.Scene([{**body, "inertia": inertia}], {"friction": 0.3})
    np.testing.assert_array_equal(batch.states[0], other.run(300).states[1:])


def test_shapes_and_the_ground_vary_too():
    body = {"box": 0.4, "mass": 2.0, "position": [0, 0, 0.5]}
    scene = tumble.Scene([body], {"friction": 0.3})
    parameters = {"size": [[1.0], [0.5], [1.0]], "radius": [[0.0], [0.0], [0.05]], "ground": [0, 0, 0.1]}
    runs = tumble.rollout(scene, steps=400, parameters=parameters)
    np.testing.assert_allclose(runs.states[:, -1, 0, 2], [0.2, 0.1, 0.3], atol=1e-9)


def test_a_coefficient_that_pairs_have_of_their_own_is_refused():
    scene = tumble.load(ROOT / "scenarios" / "block-on-block.toml")
    with pytest.raises(tumble.TumbleError, match="friction: some pairs have their own coefficients"):
        tumble.rollout(scene, steps=4, parameters={"friction": [0.1, 0.9]})


def test_restitution_that_is_taken_in_part_is_counted():
    """Cubes fall on a corner with friction. Newton's restitution law alone would add energy in some
    impacts."""
    scene = tumble.load(ROOT / "scenarios" / "drop.toml", restitution=0.9, friction=1.0)
    states = starts_of(30)
    states[:, 7:] = [0, 8, -3, 0, -9, 4]
    result = tumble.rollout(scene, states, steps=200)
    runs = [scene.simulate(state).run(200) for state in states]
    assert result.tempered == [int((run.restitution_shares < 1).sum()) for run in runs]
    assert sum(result.tempered) > 0


def test_the_caller_s_memory_is_written_to(scene):
    out = {"states": np.zeros((3, 50, 1, 13)), "status": np.zeros((3, 50), np.uint8)}
    result = tumble.rollout(scene, starts_of(3), steps=50, out=out)
    assert result.states is out["states"] and result.status is out["status"]
    own = tumble.rollout(scene, starts_of(3), steps=50)
    np.testing.assert_array_equal(out["states"], own.states)
    np.testing.assert_array_equal(out["status"], own.status)
    assert out["states"].any(axis=(2, 3)).all() and out["status"].any()
    # The memory is owned by numpy, and other libraries use it without a copy.
    assert np.shares_memory(np.from_dlpack(result.states), result.states)
    assert memoryview(result.states).format == "d"


@pytest.mark.parametrize(
    "keywords, words",
    [
        ({"initial_states": np.zeros((3, 12))}, r"initial_states has shape \(3, 12\)"),
        ({"initial_states": np.zeros((3, 2, 13))}, r"\(B, 1, 13\) or \(B, 13\) is needed"),
        ({"initial_states": starts_of(2).astype("S8")}, "initial_states has dtype"),
        ({"controls": np.full((1, 4, 6), np.nan)}, r"controls\[0, 0, 0\] is nan"),
        (
            {"controls": np.zeros((2, 4, 6)), "initial_states": starts_of(3)},
            "controls has 2 rollouts",
        ),
        ({"controls": np.zeros((1, 4, 6)), "steps": 5}, "steps is 5, but controls has 4"),
        ({"steps": None}, "steps is None"),
        ({"parameters": {1: [0.3]}}, "parameters: 1 is not a name"),
        ({"parameters": {"mu": [0.3]}}, '"mu" is unknown; use friction'),
        ({"parameters": {"mass": [1.0, 2.0]}}, r"parameters\['mass'\] has shape \(2,\)"),
        ({"parameters": {"friction": [0.3, -0.5]}}, "rollout 1: coefficient of friction is -0.5"),
        (
            {"parameters": {"friction": [0.3, 0.4]}, "initial_states": starts_of(3)},
            r"parameters\['friction'\] has 2 values; 3",
        ),
        ({"threads": 0}, "threads is 0"),
        ({"out": {"states": np.zeros((1, 4, 1, 13), np.float32)}}, "dtype float32; float64"),
        ({"out": {"states": np.zeros((1, 4, 13))}}, r"out\['states'\] has shape \(1, 4, 13\)"),
        ({"out": {"states": np.zeros((13, 1, 4, 1)).T}}, "C order"),
        ({"out": {"positions": np.zeros(3)}}, "out: 'positions' is unknown"),
    ],
)
def test_odd_input_is_named(scene, keywords, words):
    keywords = {"steps": 4, **keywords}
    if "controls" in keywords and keywords["steps"] == 4:
        del keywords["steps"]
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.rollout(scene, **keywords)


def test_rollouts_say_what_they_contain(scene):
    result = tumble.rollout(scene, steps=4, parameters={"friction": [0.1, 0.2, 0.3]})
    assert repr(result) == (
        "<tumble.Rollouts: 3 rollouts of 4 steps of 1 bodies, 0 steps not solved; "
        "states (3, 4, 1, 13), forces (3, 4, 1, 3), residuals (3, 4), status (3, 4)>"
    )


def test_steps_that_fail_are_listed_by_index():
    """A body with the least allowed inertia hits the ground at 100 km/s. Two others fall."""
    body = {"box": 2.0, "mass": 1.0, "inertia": 1e-5, "position": [0, 0, 1.8]}
    scene = tumble.Scene([body], {"friction": 10.0})
    states = np.repeat(scene.states, 3, axis=0)
    states[1, 7:] = [1e5, 1e5, -1e5, 1e5, 1e5, 1e5]
    result = tumble.rollout(scene, states, steps=4)
    assert result.unsolved and {step.rollout for step in result.unsolved} == {1}
    for step in result.unsolved:
        assert result.status[1, step.step] == step.status
        assert step.residual == result.residuals[1, step.step]
    assert len(result.unsolved) == result.counts["failed"] + result.counts["wild"]


def test_ctrl_c_ends_a_batch_at_once(scene):
    reports, seen, begun = [], [], threading.Event()

    def report(*both):
        reports.append(both)
        begun.set()

    def press():
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        seen.append(len(reports))

    threading.Thread(target=press, daemon=True).start()
    tracemalloc.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            tumble.rollout(scene, np.repeat(scene.states, 100, axis=0), steps=100_000, progress=report)
        kept, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Each report follows a check for signals. One may be under way when the signal comes.
    assert len(reports) <= seen[0] + 1
    assert reports[-1][0] < reports[-1][1] == 10_000_000
    assert kept < 1e6 and most > 1e9, "the arrays of 1.4 GB are given back as well"


def test_progress_ends_with_all(scene):
    told = []
    tumble.rollout(scene, starts_of(4), steps=500, progress=lambda *both: told.append(both))
    assert told[-1] == (2000, 2000)


def test_what_is_no_dictionary_is_named(scene):
    for name in ("parameters", "out"):
        with pytest.raises(TypeError, match=f"{name} is list; a dictionary"):
            tumble.rollout(scene, steps=2, **{name: [1.0]})


def test_arrays_that_overlap_or_are_not_aligned_are_named(scene):
    memory = np.zeros((2, 4, 1, 13))
    for keywords, words in [
        ({"out": {"states": memory}, "initial_states": memory.reshape(8, 1, 13)[:2]}, r"out\['states'\] and initial"),
        (
            {"out": {"states": memory, "residuals": memory.reshape(-1)[:8].reshape(2, 4)}},
            r"out\['states'\] and out\['residuals'\] share memory",
        ),
    ]:
        starts = {"initial_states": starts_of(2), **keywords}
        with pytest.raises(tumble.TumbleError, match=words):
            tumble.rollout(scene, steps=4, **starts)

    def odd(shape):
        size = 8 * int(np.prod(shape))
        return np.zeros(size + 1, np.uint8)[1:].view(np.float64).reshape(shape)

    with pytest.raises(tumble.TumbleError, match=r"out\['states'\] is not aligned"):
        tumble.rollout(scene, starts_of(2), steps=4, out={"states": odd((2, 4, 1, 13))})
    starts = odd((2, 13))
    starts[:] = starts_of(2)
    one, other = (tumble.rollout(scene, states, steps=4) for states in (starts, starts_of(2)))
    np.testing.assert_array_equal(one.states, other.states)


def test_a_rollout_is_a_trajectory_with_the_same_numbers():
    scene = tumble.drop(seed=3)
    starts = np.repeat(scene.states[None], 3, axis=0)
    starts[:, 0, 2] = [1.8, 2.0, 2.2]
    pushes = np.zeros((1, 400, 1, 6))
    pushes[..., 0] = 20.0
    friction = np.array([0.1, 0.3, 0.6])
    batch = tumble.rollout(scene, starts, pushes, parameters={"friction": friction})
    for index in range(3):
        run = batch[index]
        assert run.scene.friction == friction[index]
        assert np.array_equal(run.states[1:], batch.states[index])
        assert np.array_equal(run.forces, batch.forces[index])
        assert np.array_equal(run.residuals, batch.residuals[index])
        assert len(run.contacts["k"]) > 0
    again = pickle.loads(pickle.dumps(batch))
    assert len(batch) == 3
    assert [len(run) for run in batch[1:]] == [len(batch[0])] * 2
    with pytest.raises(IndexError, match="rollout 3 does not exist; there are 3"):
        batch[3]
    assert np.array_equal(again[1].states, batch[-2].states)
    heavy = tumble.rollout(scene, starts, steps=5, parameters={"mass": np.full((3, 1), 20.0)})
    with pytest.raises(tumble.TumbleError, match="each rollout had its own mass"):
        heavy[0]
