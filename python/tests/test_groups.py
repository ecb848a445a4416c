"""Collision groups in scenes and of bodies that are added between steps."""

import copy
import pickle

import numpy as np
import pytest
import tumble

GROUND = {"friction": 0.5}
SHELF = {"name": "shelf", "box": [1, 1, 0.1], "position": [0, 0, 0.95]}
"""Its upper side is 1 m high."""


def ball(name, height, **fields):
    return {"name": name, "sphere": 0.1, "mass": 1.0, "position": [0, 0, height], **fields}


def heights(simulation, steps=600):
    return simulation.run(steps).positions[-1, :, 2]


def test_bodies_fall_through_what_their_groups_exclude():
    ghost = {"groups": ["ghost"], "collides_with": ["ground"]}
    bodies = [ball("ghost", 1.2, **ghost), ball("usual", 1.5)]
    scene = tumble.Scene(bodies, GROUND, fixed=[SHELF])
    np.testing.assert_allclose(heights(scene.simulate()), [0.1, 1.1], atol=1e-9)
    # One side alone is enough: the shelf leaves out the ghost.
    bodies[0] = ball("ghost", 1.2, groups=["ghost"])
    shelf = {**SHELF, "collides_with": ["default"]}
    scene = tumble.Scene([bodies[0]], GROUND, fixed=[shelf])
    np.testing.assert_allclose(heights(scene.simulate()), [0.1], atol=1e-9)
    scene = tumble.Scene([ball("usual", 1.2)], GROUND, fixed=[shelf])
    np.testing.assert_allclose(heights(scene.simulate()), [1.1], atol=1e-9)
    # An empty list: nothing at all, as touches = false.
    nothing = tumble.Scene([ball("free", 1.2, collides_with=[])], GROUND, fixed=[SHELF])
    untouched = tumble.Scene([ball("free", 1.2, touches=False)], GROUND, fixed=[SHELF])
    np.testing.assert_array_equal(heights(nothing.simulate()), heights(untouched.simulate()))


def test_a_scene_whose_groups_exclude_nothing_moves_to_the_bit_as_one_without():
    plain = [ball(f"ball-{k}", 1.2 + 0.25 * k) for k in range(3)]
    grouped = [{**body, "groups": ["a", "b"], "collides_with": ["b", "ground", "default"]} for body in plain]
    runs = [tumble.Scene(bodies, GROUND, fixed=[SHELF]).run(400) for bodies in (plain, grouped)]
    np.testing.assert_array_equal(runs[0].states, runs[1].states)
    np.testing.assert_array_equal(runs[0].forces, runs[1].forces)


def test_a_body_added_between_steps_has_its_groups():
    ghost = {"groups": ["ghost"], "collides_with": ["ground"]}
    scene = tumble.Scene([ball("first", 1.1)], GROUND, fixed=[SHELF])
    simulation = scene.simulate()
    simulation.run(10)
    # It may start where another body is that it does not touch.
    simulation.add_body(ball("ghost", 1.15, **ghost))
    simulation.add_body({**ball("free", 3.0, touches=False), "position": [0.5, 0, 3]})
    others = [copy.copy(simulation), pickle.loads(pickle.dumps(simulation)), simulation.scene.simulate()]
    found = heights(simulation)
    assert abs(found[0] - 1.1) < 1e-9 and abs(found[1] - 0.1) < 1e-9 and found[2] < -1
    for other in others:
        np.testing.assert_allclose(heights(other), found, atol=1e-9)
    simulation.remove_body("first")
    simulation.add_body(ball("last", 1.5, groups=["ghost", "late"]))
    again = pickle.loads(pickle.dumps(simulation))
    np.testing.assert_array_equal(heights(again), heights(simulation))
    np.testing.assert_allclose(again.states[-1, 2], 1.1, atol=1e-9)


def test_groups_are_saved_with_a_run(tmp_path):
    ghost = {"groups": ["ghost"], "collides_with": ["ground", "ghost"]}
    scene = tumble.Scene([ball("ghost", 1.2, **ghost)], GROUND, fixed=[{**SHELF, "groups": ["wood"]}])
    run = scene.run(200)
    run.to_csv(tmp_path / "run")
    text = (tmp_path / "run" / "run.json").read_text()
    assert '"ghost"' in text and '"wood"' in text
    back = tumble.Trajectory.from_csv(scene, tmp_path / "run")
    np.testing.assert_array_equal(back.states, run.states)
    same = tumble.load(scene.save(tmp_path / "scene.toml"))
    np.testing.assert_array_equal(same.run(200).states, run.states)


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"collides_with": ["debri"]}, 'there is no group "debri"; did you mean "debris"?'),
        ({"collides_with": ["Ground"]}, 'did you mean "ground"?'),
        ({"collides_with": ["water"]}, 'the groups are "default", "ground", "debris"'),
        ({"groups": ["ground"]}, '"ground" belongs to the ground alone'),
        ({"groups": []}, "groups: a name is needed"),
        ({"groups": ["a b"]}, 'groups: "a b" is not allowed'),
        ({"groups": [f"g{k}" for k in range(62)]}, "the scene has 63; allowed: up to 62"),
        ({"groups": "debris"}, "groups"),
    ],
)
def test_wrong_groups_are_refused(fields, message):
    first = ball("first", 0.1, groups=["debris"])
    with pytest.raises(tumble.TumbleError) as raised:
        tumble.Scene([first, ball("second", 1.0, **fields)], GROUND)
    assert message in str(raised.value)
    simulation = tumble.Scene([first], GROUND).simulate()
    with pytest.raises(tumble.TumbleError) as raised:
        simulation.add_body(ball("second", 1.0, **fields))
    assert message in str(raised.value)
    assert simulation.bodies == ["first"]


def test_the_links_of_a_robot_have_its_groups(root):
    robot = {"file": str(root / "data/robots/quadruped.urdf"), "position": [0, 0, 0.6]}
    crate = {"name": "crate", "box": 0.3, "mass": 1.0, "position": [0, 0, 2.0]}
    far = {"groups": ["robot"], "collides_with": ["ground", "robot"]}
    through = tumble.Scene([crate], GROUND, robots=[{**robot, **far}]).run(700)
    assert abs(through.positions[-1, 0, 2] - 0.15) < 1e-6
