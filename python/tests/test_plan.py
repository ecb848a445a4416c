"""Plans: a closed form, exact replay and refusals."""

import numpy as np
import pytest
import tumble


def box(**fields):
    one = {"box": [0.3, 0.3, 0.2], "mass": 1.0, "position": [0, 0, 0.1], **fields}
    return tumble.Scene(bodies=[one], ground={"friction": 0.4}, time_step=0.02, integrator="euler")


SPEED = {"kind": "start", "of": "velocity", "x": [0.5, 6]}
PUSH = {"kind": "push", "face": "-x", "at": [-0.15, 0, -0.05], "normal": [0, 20], "tangential": [-6, 6]}


def test_the_speed_that_stops_is_that_of_the_sum():
    target = {"x": 1.0, "tolerance": {"position": 1e-9}}
    plan = tumble.plan(box(), 70, [SPEED], target, stages=["shoot"])
    h, lost = 0.02, 0.02 * 0.4 * 9.81
    speeds = [(1 / h + lost * m * (m + 1) / 2) / m for m in range(1, 70)]
    [speed] = [v for m, v in enumerate(speeds, 1) if np.floor(v / lost) == m]
    assert plan.ok and plan.status == "replayed"
    assert plan.controls == pytest.approx([speed], abs=1e-9)
    assert len(plan.names) == 1 and plan.names[0].endswith(".velocity.x")
    assert abs(plan.run.positions[-1, 0, 0] - 1) < 1e-9
    assert plan.run.states[0] == pytest.approx(plan.starts)


def test_a_box_at_rest_is_pulled_to_its_place_by_ddp():
    force = {"kind": "force", "x": [-20, 20]}
    target = {"x": 0.5, "speed": 0, "tolerance": {"position": 1e-3, "speed": 1e-2}}
    plan = tumble.plan(box(), 40, [force], target, stages=["ddp"])
    assert plan.ok and [stage["name"] for stage in plan.stages] == ["ddp"]
    assert abs(plan.run.positions[-1, 0, 0] - 0.5) < 1e-3
    assert not tumble.plan(box(), 40, [force], target, stages=["shoot"]).ok


def test_a_plan_runs_again_to_the_bit():
    target = {"position": [0.3, 0.05], "speed": 0, "tolerance": {"position": 0.01, "speed": 0.05}}
    scene = box()
    plan = tumble.plan(scene, 30, [PUSH], target, runs=600)
    assert plan.wrenches.shape == (30, 1, 6)
    again = scene.simulate().run(30, plan.wrenches)
    np.testing.assert_array_equal(again.states, plan.run.states)
    assert len(plan.modes) == 30 and {mode for step in plan.modes for *_, mode in step} <= {"open", "stick", "slip"}
    assert [stage["name"] for stage in plan.stages] == ["ddp", "sample", "shoot"]
    # The result is independent of threads, and a plan can continue from its own controls.
    other = tumble.plan(scene, 30, [PUSH], target, runs=600, threads=1)
    np.testing.assert_array_equal(other.controls, plan.controls)
    on = tumble.plan(scene, 30, [PUSH], target, start=plan.controls, stages=[])
    np.testing.assert_array_equal(on.run.states, plan.run.states)


def test_wrenches_are_those_of_the_controls_alone():
    scene = tumble.Scene(
        [{"name": "a", "box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "load": {"force": [2, 0, 0]}}],
        {"friction": 0.4},
        time_step=0.01,
        integrator="euler",
    )
    force = {"kind": "force", "x": [-10, 10], "y": [-10, 10], "knots": 6}
    plan = tumble.plan(scene, 60, [force], {"position": [0.1, -0.2]}, runs=60, stages=["sample"])
    np.testing.assert_allclose(plan.wrenches[:, 0, 0], plan.columns["a.force.x"], atol=1e-14)
    again = scene.simulate().run(60, plan.wrenches)
    np.testing.assert_allclose(again.states, plan.run.states, atol=1e-12)


def test_a_plan_begins_where_the_bodies_are():
    scene = box()
    simulation = box(velocity=[1, 0, 0]).simulate()
    simulation.run(5)
    plan = tumble.plan(scene, 10, [PUSH], {"x": 0.2}, states=simulation.states, runs=50)
    np.testing.assert_array_equal(plan.starts, simulation.states)


def test_what_cannot_be_is_missed_and_what_is_none_is_refused():
    weak = {"kind": "force", "x": [-3, 3]}
    plan = tumble.plan(box(), 20, [weak], {"x": 1.0})
    assert not plan.ok and plan.status == "missed" and "missed by" in plan.reason
    assert not any(miss.ok for miss in plan.miss.values())
    for arguments, words in [
        (([weak], {}), "the target is empty"),
        (([{"kind": "kick"}], {"x": 1}), "kick"),
        (([weak], {"x": 1}, {"stages": ["walk"]}), "walk"),
        (([weak], {"x": 1}, {"stages": []}), "search.stages: the list is empty"),
        (([], {"x": 1}, {}), "controls: there are none"),
        (([weak], {"x": 1}, {"start": [1.0]}), "20 are needed"),
        (([weak], {"x": 1}, {"time": -1}), "time"),
        (([weak], {"x": 1}, {"time": "x"}), "time is 'x'"),
        (([weak], {"x": 1}, {"threads": 0}), "threads is 0"),
        (([weak], {"x": 1}, {"threads": 5000}), "from 1 to 1024"),
        (([weak], {"x": 1}, {"stages": "shoot"}), "stages is 'shoot'; a list"),
        (([weak], {"x": 1}, {"stages": 5}), "stages is 5; a list"),
        (([weak], {"turn": 720}), "less than a whole turn"),
        (([SPEED, {**SPEED, "name": "again"}], {"x": 1}), "set the same value"),
    ]:
        controls, target, *rest = arguments
        with pytest.raises(tumble.TumbleError, match=words):
            tumble.plan(box(), 20, controls, target, **(rest[0] if rest else {}))


POINT = """
time_step = 0.01
integrator = "euler"
[body]
point_mass = true
mass = 1.0
[ground]
friction = 0.5
[start]
position = [0, 0, 0]
"""


def test_one_body_in_its_own_notation_is_planned_for():
    scene = tumble.Scene.from_text(POINT)
    push = {"kind": "force", "x": [-30, 30], "z": [-20, 60]}
    target = {"position": [0.5, 0, 0], "tolerance": {"position": 1e-2}}
    plan = tumble.plan(scene, 30, [push], target, runs=1000)
    assert plan.ok, plan.reason
    np.testing.assert_array_equal(plan.run.states[-1], scene.simulate().run(30, plan.wrenches).states[-1])
    moved = [[0.1, 0, 0.2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]]
    plan = tumble.plan(scene, 5, [push], target, start=np.zeros(10), states=moved, stages=[])
    np.testing.assert_array_equal(plan.starts, moved)
    assert plan.run.states[0] == pytest.approx(plan.starts)


def test_motors_swing_a_rod():
    rod = {"box": [0.02, 0.02, 1.0], "mass": 1.0, "position": [0, 0, 1.5]}
    hinge = {"name": "hinge", "type": "revolute", "bodies": "body-1", "anchor": [0, 0, 2], "axis": [0, 1, 0]}
    scene = tumble.Scene(bodies=[{**rod, "name": "body-1"}], joints=[hinge], ground={"none": True, "friction": 0.5}, integrator="euler")
    motor = {"kind": "motor", "joint": "hinge", "force": [-9, 9], "knots": 2}
    plan = tumble.plan(scene, 200, [motor], {"turn": 20, "axis": [0, 1, 0]}, stages=["shoot"])
    assert plan.ok, plan.reason
    assert set(plan.columns) == {"hinge.motor.force"} and np.abs(plan.wrenches[:, 0, 4]).max() > 0
    with pytest.raises(tumble.TumbleError, match="unknown joint \"knee\""):
        tumble.plan(scene, 5, [{**motor, "joint": "knee"}], {"turn": 20})


def test_a_scene_with_middle_velocities_is_refused():
    scene = tumble.Scene([{"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1]}], {"friction": 0.4})
    with pytest.raises(tumble.TumbleError, match='needs integrator = "euler"'):
        tumble.plan(scene, 10, [{"kind": "force", "x": [-1, 1]}], {"x": 0.1})
