"""Simulations: physical checks and input checks."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import tumble

G = 9.81


def block(velocity=(0, 0, 0), friction=0.3, **keywords):
    body = {"box": 0.2, "mass": 2.0, "position": [0, 0, 0.1], "velocity": velocity}
    return tumble.Scene([body], {"friction": friction}, **keywords)


def test_a_slide_ends_where_coulomb_says():
    """v²/(2 μ g), and with the integrator euler v h / 2 less."""
    exact = 2.0**2 / (2 * 0.3 * G)
    for integrator, late in [("leapfrog", 0.0), ("euler", 2.0 * 0.001 / 2)]:
        run = block([2, 0, 0], time_step=0.001, integrator=integrator).run(1000)
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
        assert step.ok and isinstance(step.status, tumble.Status) and step.residual < 1e-9
        states.append(simulation.states)
    assert simulation.index == 300 and simulation.time == pytest.approx(0.6)
    np.testing.assert_array_equal(np.array(states), scene.run(300).states)


def test_wrenches_push():
    """A pulled block accelerates by F/m − μ g. The wrench stays until another is set."""
    pulled = block(friction=0.25)
    run = pulled.simulate().run(100, np.tile([10.0, 0, 0, 0, 0, 0], (100, 1, 1)))
    speed = (10.0 / 2.0 - 0.25 * G) * 100 * 0.002
    assert run.velocities[-1, 0, 0] == pytest.approx(speed, rel=1e-9)
    simulation = pulled.simulate()
    simulation.step([10.0, 0, 0, 0, 0, 0])
    for _ in range(99):
        simulation.step()
    np.testing.assert_array_equal(simulation.states, run.states[-1])


@pytest.mark.parametrize("given", [0, 5])
def test_a_held_wrench_gives_its_impulse(given):
    """100 N in one step of 10 ms are 1 N s."""
    ball = {"name": "b", "sphere": 0.1, "mass": 1.0, "position": [0, 0, 5]}
    scene = tumble.Scene([ball], {"none": True, "friction": 0}, time_step=0.01, gravity=[0, 0, 0])
    simulation = scene.simulate()
    for k in range(9):
        simulation.step([100.0 if k == given else 0.0, 0, 0, 0, 0, 0])
        speed = 0.0 if k < given else 1.0
        assert simulation.states[0, 7] == pytest.approx(speed, abs=1e-14)


def test_a_force_at_the_instant_is_of_second_order():
    """A spring that the program computes swings with its frequency; held, it would gain energy."""
    ball = {"name": "b", "sphere": 0.1, "mass": 1.0, "position": [1, 0, 5]}

    def end(time_step):
        scene = tumble.Scene(
            [ball], {"none": True, "friction": 0}, time_step=time_step, gravity=[0, 0, 0]
        )
        simulation = scene.simulate()
        for _ in range(round(1.0 / time_step)):
            simulation.step([-25.0 * simulation.states[0, 0], 0, 0, 0, 0, 0], at_instant=True)
        return abs(simulation.states[0, 0] - np.cos(5.0))

    assert np.log2(end(0.01) / end(0.005)) == pytest.approx(2.0, abs=0.1)


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
        (lambda s: s.step(np.ma.array(np.zeros(6), mask=[1, 0, 0, 0, 0, 0])), "wrenches has masked numbers"),
        (lambda s: s.step([0, 0, np.inf, 0, 0, 0]), r"wrenches\[2\] is inf"),
        (lambda s: s.step([1e10, 0, 0, 0, 0, 0]), r"force \(N\) is 10000000000.0; allowed"),
        (lambda s: s.step([0, 0, 0, 1e10, 0, 0]), r"torque \(N m\) is"),
        (lambda s: s.run(3, np.zeros((2, 6))), r"wrenches has shape \(2, 6\); \(3, 1, 6\)"),
        (lambda s: s.run(-1), "steps is -1"),
        (lambda s: s.run(1.5), "steps is 1.5"),
        (lambda s: s.run(True), "steps is True; a whole number"),
        (lambda s: s.run(10**5000), "steps is a whole number of 16610 bits"),
        (lambda s: s.remove_body(True), "body is True"),
        (lambda s: s.scene.simulate(np.zeros(12)), r"states has shape \(12,\)"),
        (lambda s: s.scene.simulate(np.zeros(13)), "norm of the attitude quaternion is 0.0"),
        (lambda s: s.scene.simulate([0, 0, 0.1, 1, *[0] * 6, 1e6, 0, 0]), r"spin \(rad/s\)"),
        (lambda s: s.scene.simulate([0, 0, -0.1, 1, 0, 0, 0, *[0] * 6]), "m below the ground"),
    ],
)
def test_odd_input_is_named(call, words):
    with pytest.raises(tumble.TumbleError, match=words):
        call(block().simulate())


def test_memory_that_the_process_may_not_have_is_refused():
    """Memory limit as in batch systems. An allocation that fails there would end the interpreter.
    """
    program = (
        "import resource, tumble\n"
        "scene = tumble.Scene([{'box': 0.2, 'mass': 1.0, 'position': [0, 0, 0.1]}], {'friction': 0.5})\n"
        "resource.setrlimit(resource.RLIMIT_AS, (1200 << 20, 1200 << 20))\n"
        "try:\n"
        "    scene.simulate().run(6_000_000)\n"
        "except MemoryError as error:\n"
        "    print(error)\n"
    )
    end = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=600)
    assert end.returncode == 0 and "6000000 recorded steps of 1 body, contacts not counted, need" in end.stdout, end.stderr


def test_mistyped_names_are_refused():
    with pytest.raises(AttributeError, match="indx"):
        block().simulate().indx = 5


@pytest.mark.parametrize(
    ("call", "raised", "words"),
    [
        (lambda s: tumble.Simulation("drop"), TypeError, "scene is str; tumble.Scene is needed"),
        (lambda s: tumble.rollout(3, steps=2), TypeError, "scene is int; tumble.Scene"),
        (lambda s: tumble.Trajectory.from_csv({}, "."), TypeError, "scene is dict; tumble.Scene"),
        (lambda s: s.run(2).page(s), TypeError, "other is Simulation; tumble.Trajectory"),
        (lambda s: s._core.record(3, np.zeros(0)), tumble.TumbleError, "wrenches: the array has the wrong size, 0"),
        (lambda s: s._core.advance(np.zeros(5)), tumble.TumbleError, "wrenches: the array has the wrong size, 5"),
    ],
)
def test_what_is_another_thing_is_named(call, raised, words):
    with pytest.raises(raised, match=words):
        call(block().simulate())


def test_ctrl_c_ends_a_run_at_once():
    simulation = block([1, 0, 0]).simulate()
    reports, seen, begun = [], [], threading.Event()

    def report(*both):
        reports.append(both)
        begun.set()

    def press():
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        seen.append(len(reports))

    threading.Thread(target=press, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        simulation.run(2_000_000, contacts=False, progress=report)
    # Each report follows a check for signals. One may be under way when the signal comes.
    assert len(reports) <= seen[0] + 1
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


def test_a_simulation_runs_in_one_thread_at_a_time():
    simulation = block([1, 0, 0]).simulate()
    began, ended, others = threading.Event(), threading.Event(), []

    def progress(done, total):
        began.set()
        ended.wait(600)

    thread = threading.Thread(target=lambda: simulation.run(20_000, contacts=False, progress=progress))
    thread.start()
    assert began.wait(600)
    for call in (simulation.step, lambda: simulation.states, lambda: simulation.run(1), lambda: copy.copy(simulation)):
        with pytest.raises(tumble.TumbleError, match="running in another thread.*copy") as raised:
            call()
        others.append(str(raised.value))
    ended.set()
    thread.join()
    assert simulation.index == 20_000 and len(set(others)) == 1
    ends = []
    copies = [copy.copy(simulation) for _ in range(3)]
    threads = [threading.Thread(target=lambda own=own: ends.append(own.run(50).states[-1])) for own in copies]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ends) == 3 and all((end == ends[0]).all() for end in ends)


def test_islands_are_the_same_on_any_number_of_threads():
    """Forty separate tumbling boxes, also from given states."""
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
    """10⁵ steps. docs/python.md has the figure for 10⁶."""
    resource = pytest.importorskip("resource")
    simulation = tumble.drop().simulate()
    push = np.zeros(6)

    def steps(count):
        for _ in range(count):
            simulation.step(push)
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = steps(20_000)
    # KiB, for the variation of the allocator.
    assert steps(100_000) - before <= 1024


def test_a_run_without_contacts_keeps_the_sums_of_forces():
    scene = tumble.drop(42)
    bare, whole = scene.run(300, contacts=False), scene.run(300)
    assert np.abs(whole.forces).max() > 1
    np.testing.assert_array_equal(bare.forces, whole.forces)
    np.testing.assert_array_equal(bare.states, whole.states)
    for ask in (
        lambda: bare.contacts,
        lambda: bare.to_csv("none"),
        lambda: bare.plot(),
        lambda: bare.page(),
    ):
        with pytest.raises(tumble.TumbleError, match="recorded without contacts"):
            ask()
    assert bare._repr_html_() is None
    assert bare.plot(sheet="energy").data.startswith(b"<svg")


def test_what_was_recorded_comes_with_what_ended_it():
    scene = block([1, 0, 0])
    simulation = scene.simulate()

    def fail(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as ended:
        simulation.run(5_000_000, contacts=False, progress=fail)
    kept = ended.value.trajectory
    assert len(kept) == simulation.index + 1 > 1
    np.testing.assert_array_equal(kept.states[-1], simulation.states)
    np.testing.assert_array_equal(kept[:50].states, scene.run(49).states)
    pushes = np.zeros((6, 6))
    pushes[4, 0] = 1e10
    with pytest.raises(tumble.TumbleError, match="force") as ended:
        scene.simulate().run(6, pushes)
    assert len(ended.value.trajectory) == 5


def test_whole_numbers_of_numpy_are_whole_numbers():
    scene = block(steps=np.int32(7), seed=None)
    assert scene.steps == 7
    run = scene.simulate(threads=np.int8(1)).run(np.int64(5))
    assert len(run) == 6 and run.plot(body=np.uint8(0)).data
    assert tumble.rollout(scene, steps=np.int64(3), threads=np.int64(1)).states.shape[1] == 3
    assert tumble.drop(np.uint32(3)).seed == 3


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: block(steps=2**63), "steps is 9223372036854775808; a whole number from 1"),
        (lambda: block(steps="7"), "steps is '7'; a whole number from 1"),
        (lambda: tumble.drop(-1), "seed is -1; a whole number from 0 to 4294967295"),
        (lambda: tumble.drop(2**40), "seed is 1099511627776; a whole number"),
        (lambda: block().run(2**63), "steps is 9223372036854775808; a whole number from 0"),
        (lambda: block().simulate(threads=2**64), "threads is 18446744073709551616"),
    ],
)
def test_numbers_that_are_too_large_or_too_small_are_named(call, words):
    with pytest.raises(tumble.TumbleError, match=words):
        call()


def test_what_does_not_fit_into_memory_is_refused_before():
    simulation = block().simulate()
    with pytest.raises(MemoryError, match=r"1000000000000 recorded steps .* need at least \d+"):
        simulation.run(10**12)
    with pytest.raises(MemoryError, match="recorded steps of 1 body, without contacts, need at least"):
        simulation.run(10**12, contacts=False)
    assert simulation.index == 0
    with pytest.raises(MemoryError, match="1 rollouts of 1000000000000 steps"):
        tumble.rollout(simulation.scene, steps=10**12)


def test_a_fork_goes_on_without_the_threads():
    """Runs in its own process without the threads of other tests' imports."""
    if not hasattr(os, "fork"):
        pytest.skip("no fork here")
    words = "import test_simulation; test_simulation.fork_goes_on()"
    done = subprocess.run([sys.executable, "-c", words], cwd=Path(__file__).parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def fork_goes_on():
    """Continues a simulation with threads in a forked process on one thread, with the same numbers,
    and ends."""
    boxes = [
        {"box": 0.2, "mass": 1.0, "position": [i, 0, 0.3], "attitude": "random", "spin": [3, 1, 0]}
        for i in range(40)
    ]
    simulation = tumble.Scene(boxes, {"friction": 0.5}).simulate(threads=2)
    simulation.run(200)
    idle = simulation.scene.simulate(threads=2)
    idle.run(200)
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            simulation.run(50)
            os.write(writer, simulation.states.tobytes())
            del idle, simulation
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    until = time.monotonic() + 600
    done = 0
    while not done and time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        time.sleep(0.01)
    if not done:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise AssertionError("it hangs")
    assert os.waitstatus_to_exitcode(status) == 0
    with os.fdopen(reader, "rb") as stream:
        found = np.frombuffer(stream.read()).reshape(40, 13)
    simulation.run(50)
    np.testing.assert_array_equal(found, simulation.states)


def test_contacts_are_a_mapping_of_columns_that_stay_those_of_their_step():
    place = {"position": [0, 0, 0.1], "velocity": [1, 0, 0]}
    simulation = tumble.Scene([{"box": 0.2, "mass": 1.0, **place}], {"friction": 0.3}).simulate()
    simulation.step()
    before, same = simulation.contacts, dict(simulation.contacts)
    simulation.run(50)
    assert list(before) == list(same) and len(before) == 10 and "force" in before
    for name in reversed(list(before)):
        np.testing.assert_array_equal(before[name], same[name])
        assert before[name] is before[name]
    assert not np.array_equal(before["point"], simulation.contacts["point"])
    assert before["force"].flags.c_contiguous and not before["force"].flags.writeable
    assert before.get("gap") is before["gap"] and before.get("speed", 7) == 7 and 3 not in before
    with pytest.raises(KeyError, match="speed"):
        before["speed"]


def test_contacts_are_no_dictionary_of_what_was_read_alone():
    simulation = block([1, 0, 0]).simulate()
    simulation.step()
    contacts = simulation.contacts
    names = ["body", "partner", "partner_body", "point", "normal", "force", "slip", "normal_force", "gap", "moment"]
    assert isinstance(contacts, tumble.Contacts)
    assert repr(contacts) == f"<tumble.Contacts: 4 contacts with {', '.join(names)}>"
    for whole in (
        dict(contacts),
        {**contacts},
        contacts.copy(),
        contacts | {},
        {} | contacts,
        copy.copy(contacts),
        pickle.loads(pickle.dumps(contacts)),
    ):
        assert type(whole) is dict and list(whole) == names
        np.testing.assert_array_equal(whole["force"], contacts["force"])
    assert list(reversed(contacts)) == names[::-1] and len(contacts) == 10
    for change in (
        lambda: contacts.update(force=0),
        lambda: contacts.pop("force"),
        lambda: contacts.clear(),
        lambda: contacts.setdefault("force", 0),
        lambda: contacts.__setitem__("force", 0),
        lambda: contacts.__delitem__("force"),
    ):
        with pytest.raises(TypeError, match="cannot be changed"):
            change()


def test_partners_of_contacts_are_indices_of_bodies_too():
    """A box on another one, which stands on a fixed plate beside a box on the ground."""
    box = {"box": 0.2, "mass": 1.0}
    bodies = [
        {**box, "name": "low", "position": [0, 0, 0.2]},
        {**box, "name": "high", "position": [0, 0, 0.4]},
        {**box, "name": "far", "position": [3, 0, 0.1]},
    ]
    plate = {"name": "plate", "box": [1, 1, 0.1], "position": [0, 0, 0.05]}
    scene = tumble.Scene(bodies, {"friction": 0.3}, fixed=[plate])
    run = scene.run(3)
    simulation = scene.simulate()
    simulation.run(3)
    for contacts in (simulation.contacts, run.contacts):
        partners = contacts["partner_body"]
        assert partners.dtype == np.int64 and not partners.flags.writeable
        names = [scene.bodies.index(name) if name in scene.bodies else -1 for name in contacts["partner"]]
        assert partners.tolist() == names and {-1} < set(names)
        assert {name for name, body in zip(contacts["partner"], partners) if body < 0} == {"plate", "ground"}


def test_contacts_at_rest_are_those_of_the_step_that_came_to_rest():
    simulation = block().simulate()
    simulation.run(50)
    objects, states = set(), simulation.states
    for _ in range(20):
        simulation.step()
        contacts = simulation.contacts
        objects.add(id(contacts))
        fresh = pickle.loads(pickle.dumps(simulation)).contacts
        for name, column in contacts.items():
            np.testing.assert_array_equal(column, fresh[name])
    np.testing.assert_array_equal(simulation.states, states)
    assert len(objects) == 1
    # A push has an effect at once.
    simulation.step([8, 0, 0, 0, 0, 0])
    pushed = simulation.contacts["force"].sum(axis=0)
    assert pushed[0] < -1 and contacts["force"].sum(axis=0)[0] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(pushed, simulation.forces[0], atol=1e-12)


def test_whatever_is_kept_of_contacts_stays_that_of_its_step():
    ways = [
        lambda contacts: contacts,
        lambda contacts: contacts["force"],
        lambda contacts: contacts["force"][:, 2],
        lambda contacts: contacts["slip"].T.ravel(),
        lambda contacts: memoryview(contacts["normal_force"]),
        lambda contacts: contacts.values()[3],
        lambda contacts: contacts["gap"].base,
    ]

    def numbers(kept):
        return np.array(kept["point"] if isinstance(kept, tumble.Contacts) else kept)

    simulation, all_kept, objects = block([1, 0, 0]).simulate(), [], set()
    for k in range(140):
        simulation.step([0.1 * k, 0, -0.1 * k, 0, 0, 0])
        contacts = simulation.contacts
        assert contacts is simulation.contacts and contacts["force"] is contacts["force"]
        objects.add(id(contacts))
        # Most steps keep no reference, so that buffers are reused between steps that do.
        if k % 4 == 0:
            kept = ways[k // 4 % len(ways)](contacts)
            all_kept.append((kept, numbers(kept)))
    for kept, expected in all_kept:
        np.testing.assert_array_equal(numbers(kept), expected)
    assert len(objects) < 70
    assert len({expected.tobytes() for _, expected in all_kept}) == 35


def test_the_contacts_of_the_last_step_are_there():
    simulation = block([1, 0, 0]).simulate()
    assert len(simulation.contacts["gap"]) == 0
    for _ in range(3):
        simulation.step()
    contacts = simulation.contacts
    run = block([1, 0, 0]).run(3)
    last = run.contacts["k"] == 2
    for name, column in contacts.items():
        np.testing.assert_array_equal(column, np.array(run.contacts[name])[last])
    np.testing.assert_allclose(contacts["force"].sum(axis=0), simulation.forces[0], atol=1e-12)
    assert contacts["normal_force"].sum() == pytest.approx(2 * G)
    np.testing.assert_allclose(
        np.linalg.norm(contacts["force"][:, :2], axis=1), 0.3 * contacts["normal_force"], rtol=1e-9
    )
    pytest.importorskip("pandas")
    frame = simulation.contacts_to_pandas()
    by_pair = frame.groupby(["body", "partner"])["normal_force_N"].sum()
    assert by_pair[simulation.scene.bodies[0], "ground"] == pytest.approx(2 * G)
    assert (run.contacts_to_pandas()["force_x_N"] <= 0).all()


def test_copies_that_nobody_follows_cannot_be_written_to():
    simulation = block().simulate()
    simulation.step()
    for array in (simulation.states, simulation.forces, simulation.scene.states):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0
    with pytest.raises(AttributeError):
        simulation.scene = simulation.scene


def test_reset_returns_to_the_start(scenarios):
    scene = tumble.load(scenarios / "stack.toml")
    simulation = scene.simulate(index=3)
    new = simulation.run(30).states
    bodies = simulation.bodies
    simulation.step(np.ones((len(bodies), 6)))
    simulation.hold(0)
    simulation.add_body({"box": 0.2, "mass": 1.0, "position": [5, 5, 3]})
    other = copy.copy(simulation)
    for one in (simulation, other):
        assert len(one.bodies) == len(bodies) + 1 and one.held == bodies[:1]
        one.reset()
        assert one.index == 3 and one.bodies == bodies and one.scene is scene and one.held == []
        np.testing.assert_array_equal(one.run(30).states, new)


def test_reset_keeps_the_robot_and_removes_its_motors(root):
    simulation = tumble.load(root / "data/robots/quadruped.urdf").simulate()
    robot, knee = simulation.robot, simulation.robot["fl_knee"]
    free = simulation.run(5).states
    limit = knee.max_force
    simulation.reset()
    robot.set_gains(stiffness=80.0, damping=2.0, max_force=25.0)
    knee.target = -1.5
    simulation.run(5)
    simulation.reset()
    assert simulation.robot is robot and robot["fl_knee"] is knee
    assert knee.target is None and knee.stiffness == 0.0 and knee.max_force == limit
    np.testing.assert_array_equal(simulation.run(5).states, free)


def test_a_status_is_a_number_and_a_word():
    assert [status.word for status in tumble.Status] == tumble._tumble.STATUSES
    run = tumble.drop().run(300)
    assert set(map(tumble.Status, run.status)) <= {tumble.Status.FREE, tumble.Status.CONVERGED, tumble.Status.RETRIED}
    assert (run.status == tumble.Status.CONVERGED).any()
    step = tumble.drop().simulate().step()
    assert step.status is tumble.Status.FREE and str(step.status) == "free" and step.ok
    assert not tumble.Status.WILD.ok and tumble.Status.WILD != tumble.Status.FAILED
    for compare in (lambda: step.status == "free", lambda: step.status != "failed"):
        with pytest.raises(TypeError, match="use Status.F"):
            compare()


def test_columns_of_indices_are_signed_and_their_names_are_checked(scenarios):
    simulation = tumble.load(scenarios / "stack.toml").simulate()
    run = simulation.run(3)
    for column in (run.contacts["k"], run.contacts["body"], simulation.contacts["body"], run.iterations):
        assert column.dtype == np.int64 and (column[:1] - 1 <= column[:1]).all()
    hinge = tumble.load(scenarios / "chain.toml").simulate()
    joint = hinge.scene.joints[0]
    for wrong in (
        lambda: run.contacts["forces"],
        lambda: simulation.contacts["forces"],
        lambda: hinge.joints["none"],
        lambda: hinge.joints[joint]["forces"],
        lambda: hinge.run(1).joints[joint]["forces"],
        lambda: hinge.run(1).gears["forces"],
        lambda: hinge.scene.jacobian()["state"],
    ):
        with pytest.raises(KeyError, match="is unknown.*known: ") as raised:
            wrong()
        assert isinstance(raised.value, tumble.TumbleError) and not str(raised.value).startswith(('"', "'"))
