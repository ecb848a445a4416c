"""Simulations: what the physics says, and what goes in."""

import os
import signal
import threading
import time

import numpy as np
import pytest
import tumble

G = 9.81


def block(velocity=(0, 0, 0), friction=0.3, **keywords):
    body = {"box": 0.2, "mass": 2.0, "position": [0, 0, 0.1], "velocity": velocity}
    return tumble.Scene([body], {"friction": friction}, **keywords)


def test_a_slide_ends_where_coulomb_says():
    """v²/(2 μ g), less μ g h T / 2 of the implicit scheme: first order in h."""
    run = block([2, 0, 0], time_step=0.001).run(1000)
    exact = 2.0**2 / (2 * 0.3 * G)
    late = 2.0 * 0.001 / 2
    assert run.positions[-1, 0, 0] == pytest.approx(exact - late, abs=1e-5)
    assert np.all(run.velocities[-1] == pytest.approx(0, abs=1e-12))
    assert run.residuals.max() < 1e-10


def test_the_ground_carries_the_weight():
    run = block().run(10)
    np.testing.assert_allclose(run.forces[:, 0], np.tile([0, 0, 2 * G], (10, 1)), atol=1e-10)
    contacts = run.contacts
    assert contacts["force"].shape == (40, 3) and set(contacts["partner"]) == {"ground"}
    np.testing.assert_allclose(contacts["force"][:, 2], 2 * G / 4, atol=1e-10)


def test_steps_and_a_run_are_the_same():
    scene = tumble.drop(3)
    simulation = scene.simulate()
    states = [simulation.states]
    for _ in range(300):
        step = simulation.step()
        assert step.ok and step.status in tumble.STATUSES and step.residual < 1e-9
        states.append(simulation.states)
    assert simulation.index == 300 and simulation.time == pytest.approx(0.6)
    np.testing.assert_array_equal(np.array(states), scene.run(300).states)


def test_wrenches_push():
    """F/m − μ g of a block that is pulled; the wrench stays until another is given."""
    pulled = block(friction=0.25)
    run = pulled.simulate().run(100, np.tile([10.0, 0, 0, 0, 0, 0], (100, 1, 1)))
    speed = (10.0 / 2.0 - 0.25 * G) * 100 * 0.002
    assert run.velocities[-1, 0, 0] == pytest.approx(speed, rel=1e-9)
    simulation = pulled.simulate()
    simulation.step([10.0, 0, 0, 0, 0, 0])
    for _ in range(99):
        simulation.step()
    np.testing.assert_array_equal(simulation.states, run.states[-1])


def test_a_simulation_goes_on_from_states():
    first = block([1, 0, 0]).run(50)
    again = first.scene.simulate(first.states[-1]).run(50)
    whole = first.scene.run(100)
    np.testing.assert_allclose(again.states[-1], whole.states[-1], atol=1e-12)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda s: s.step(np.zeros(5)), r"wrenches has shape \(5,\); \(1, 6\) or \(6,\) is needed"),
        (lambda s: s.step(np.zeros(6, complex)), "wrenches has dtype complex128"),
        (lambda s: s.step(np.array(["a"] * 6)), "wrenches has dtype <U1"),
        (lambda s: s.step([0, 0, np.inf, 0, 0, 0]), r"wrenches\[2\] is inf"),
        (lambda s: s.step([1e10, 0, 0, 0, 0, 0]), r"force \(N\) is 10000000000.0; allowed"),
        (lambda s: s.step([0, 0, 0, 1e10, 0, 0]), r"torque \(N m\) is"),
        (lambda s: s.run(3, np.zeros((2, 6))), r"wrenches has shape \(2, 6\); \(3, 1, 6\)"),
        (lambda s: s.run(-1), "steps is -1"),
        (lambda s: s.run(1.5), "steps is 1.5"),
        (lambda s: s.scene.simulate(np.zeros(12)), r"states has shape \(12,\)"),
        (lambda s: s.scene.simulate(np.zeros(13)), "norm of the attitude quaternion is 0.0"),
        (lambda s: s.scene.simulate([0, 0, 0.1, 1, *[0] * 6, 1e6, 0, 0]), r"spin \(rad/s\)"),
        (lambda s: s.scene.simulate([0, 0, -0.1, 1, 0, 0, 0, *[0] * 6]), "m below the ground"),
    ],
)
def test_odd_input_is_named(call, words):
    with pytest.raises(tumble.TumbleError, match=words):
        call(block().simulate())


def test_ctrl_c_ends_a_run_at_once():
    simulation = block([1, 0, 0]).simulate()
    pressed = []

    def press():
        pressed.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.2, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(2_000_000, contacts=False)
    # 20 ms between two looks; the rest is room for a busy machine.
    assert time.perf_counter() - pressed[0] < 0.1
    assert 0 < simulation.index < 2_000_000
    assert simulation.step().ok, "it can go on"


def test_other_threads_run_and_progress_is_told():
    simulation = block([1, 0, 0]).simulate()
    ticks, told = [], []

    def tick():
        while not told or told[-1][0] < told[-1][1]:
            ticks.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    simulation.run(200_000, contacts=False, progress=lambda done, total: told.append((done, total)))
    thread.join()
    assert told[-1] == (200_000, 200_000) and len(ticks) > 10
    assert [done for done, _ in told] == sorted(done for done, _ in told)

    def fail(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        simulation.run(10, progress=fail)


def test_islands_are_the_same_on_any_number_of_threads():
    """Forty boxes that tumble apart from each other, and a start that is given."""
    boxes = [
        {"box": 0.2, "mass": 1.0, "position": [i, 0, 0.3], "attitude": "random", "spin": [3, 1, 0]}
        for i in range(40)
    ]
    scene = tumble.Scene(boxes, {"friction": 0.5})
    one = scene.run(300)
    assert (one.contacts["k"] == 250).sum() >= 64
    for threads in (2, 5):
        several = scene.run(300, threads=threads)
        np.testing.assert_array_equal(several.states, one.states)
        np.testing.assert_array_equal(several.forces, one.forces)
    simulation = scene.simulate(one.states[250], threads=3)
    alone = scene.simulate(one.states[250])
    assert simulation.step() == alone.step()
    np.testing.assert_array_equal(simulation.states, alone.states)
    for threads, words in [(0, "threads is 0"), (2.0, "threads is 2.0"), (1025, "1 to 1024")]:
        with pytest.raises(tumble.TumbleError, match=words):
            scene.simulate(threads=threads)


def test_memory_is_flat_over_steps():
    """10⁵ steps; docs/python.md has the figure for 10⁶."""
    resource = pytest.importorskip("resource")
    simulation = tumble.drop().simulate()
    push = np.zeros(6)

    def steps(count):
        for _ in range(count):
            simulation.step(push)
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = steps(20_000)
    # KiB; the allocator's own unevenness.
    assert steps(100_000) - before <= 1024
