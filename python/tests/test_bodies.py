"""Bodies that are added and removed between steps. The motion of all others continues unchanged."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import tumble

MODELS = Path(__file__).parents[2] / "data" / "robots"
CUBE = {"box": 0.2, "mass": 1.0}
FREE = {"none": True, "friction": 0.5}


def cube(name, position, **fields):
    return {**CUBE, "name": name, "position": position, **fields}


def tower(height, at=0.0):
    return [cube(f"cube-{at:g}-{k}", [at, 0, 0.1 + 0.2 * k]) for k in range(height)]


def scene(bodies, **keywords):
    return tumble.Scene(bodies, {"friction": 0.5}, **keywords)


def test_a_body_that_comes_moves_as_one_that_was_there():
    """A body that is added at step k far from the others moves like the same body alone in a scene.
    """
    late = scene(tower(3)).simulate()
    late.run(50)
    ball = {"sphere": 0.1, "mass": 2.0, "position": [3, 0, 0.4], "velocity": [1, 0, -2], "spin": [0, 3, 0]}
    assert late.add_body({**ball, "name": "ball"}) == "ball"
    assert late.bodies[-1] == "ball" and late.states.shape == (4, 13)
    run = late.run(200)
    alone = scene([ball]).run(200)
    np.testing.assert_array_equal(run.states[:, 3], alone.states[:, 0])
    np.testing.assert_array_equal(run.forces[:, 3], alone.forces[:, 0])
    assert run.scene.bodies == late.bodies
    np.testing.assert_array_equal(run.scene.masses, [1, 1, 1, 2])


def test_what_a_body_that_went_never_touched_goes_on_to_the_bit():
    two = [*tower(3), *tower(4, at=2.0)]
    simulation, other = scene(two).simulate(), scene(tower(3)).simulate()
    for one in (simulation, other):
        one.run(30)
    for name in ("cube-2-3", "cube-2-0", 4, 3):
        simulation.remove_body(name)
    assert simulation.bodies == other.bodies == ["cube-0-0", "cube-0-1", "cube-0-2"]
    np.testing.assert_array_equal(simulation.forces, other.forces)
    mine, its = simulation.contacts, other.contacts
    np.testing.assert_array_equal(mine["force"], its["force"])
    assert mine["partner"] == its["partner"]
    np.testing.assert_array_equal(simulation.run(60).states, other.run(60).states)


def test_the_cube_under_another_is_taken_away():
    """The upper cube falls by g h² k (k + 1) / 2 after k steps of the scheme."""
    simulation = scene(tower(2)).simulate()
    simulation.run(20)
    simulation.remove_body("cube-0-0")
    fallen = simulation.run(40)
    k = np.arange(41)
    np.testing.assert_allclose(
        fallen.positions[:, 0, 2], 0.3 - 9.81 * 0.002**2 * k * (k + 1) / 2, atol=1e-12
    )
    landed = simulation.run(300)
    assert abs(landed.positions[-1, 0, 2] - 0.1) < 1e-9
    assert set(landed.contacts["partner"]) == {"ground"}


def test_a_body_put_on_a_stack_weighs_on_it():
    simulation = scene(tower(2)).simulate()
    simulation.run(20)
    simulation.add_body(cube("top", [0, 0, 0.5], mass=3.0))
    simulation.run(50)
    contacts = simulation.contacts
    pairs = zip(contacts["partner"], contacts["normal_force"])
    ground = [force for partner, force in pairs if partner == "ground"]
    assert sum(ground) == pytest.approx(5 * 9.81, rel=1e-9)
    named = {simulation.bodies[body] for body in contacts["body"]} | set(contacts["partner"])
    assert named == {*simulation.bodies, "ground"}
    # The lowest cube carries all others, and the forces on each body cancel its weight.
    np.testing.assert_allclose(simulation.forces[:, 2], [9.81, 9.81, 3 * 9.81], rtol=1e-9)


def test_an_unknown_name_is_answered_with_the_nearest_one():
    pin = {"name": "hinge", "type": "revolute", "bodies": ["arm"], "anchor": [0, 0, 2], "axis": [0, 1, 0]}
    arm = {"name": "arm", "box": 0.2, "mass": 1.0, "position": [0.5, 0, 2.0]}
    crate = {"name": "crate", "box": 0.2, "mass": 1.0, "position": [3, 0, 0.1]}
    robot = {"prefix": "dog.", "file": "quadruped.urdf", "position": [8, 0, 0.6]}
    scene = tumble.Scene(
        [arm, crate], {"friction": 0.5}, joints=[pin], robots=[robot], folder=MODELS
    )
    simulation = scene.simulate()
    run = simulation.run(2)
    dog = simulation.robots["dog."]
    for ask, words in (
        (lambda: simulation.robots["dgo."], "robot 'dgo.' is unknown; did you mean `dog.`?"),
        (lambda: simulation.joints["hing"], "joint 'hing' is unknown; did you mean `hinge`?"),
        (lambda: run.joints["hing"], "joint 'hing' is unknown; did you mean `hinge`?"),
        (lambda: simulation.set_motor("hing", speed=1.0, max_force=1.0), "did you mean `hinge`?"),
        (lambda: simulation.set_state("crat", scene.states[1]), "body 'crat' is unknown; did you mean `crate`?"),
        (lambda: run.plot(body="crat"), "body 'crat' is unknown; did you mean `crate`?"),
        (lambda: dog["fl_kne"], "joint 'fl_kne' is unknown; did you mean `fl_knee`?"),
        (lambda: dog.touch("trnk"), "link 'trnk' is unknown; did you mean `trunk`?"),
    ):
        with pytest.raises(tumble.TumbleError) as raised:
            ask()
        assert words in str(raised.value) and "(known: " in str(raised.value)
    with pytest.raises(tumble.TumbleError) as raised:
        simulation.joints["xyzzy"]
    assert "did you mean" not in str(raised.value)
    # Otherwise they are dictionaries.
    assert simulation.joints.get("hing") is None and "hing" not in run.joints
    assert list(pickle.loads(pickle.dumps(run.joints))) == scene.joints


def test_momentum_is_kept_by_what_comes_and_meets():
    """A ball is added without gravity and hits another one. The sum of m v stays constant, with
    restitution too."""
    ball = {"sphere": 0.1, "mass": 1.0}
    still = {**ball, "name": "still", "position": [0, 0, 0]}
    free = {"none": True, "friction": 0.3, "restitution": 0.7}
    simulation = tumble.Scene([still], free, gravity=0.0).simulate()
    simulation.run(10)
    simulation.add_body({**ball, "mass": 2.0, "name": "fast", "position": [-0.5, 0.05, 0], "velocity": [4, 0, 0]})
    run = simulation.run(200)
    masses = run.scene.masses[:, None]
    momentum = (masses * run.velocities).sum(axis=1)
    np.testing.assert_allclose(momentum, np.broadcast_to([8, 0, 0], momentum.shape), atol=1e-9)
    assert len(run.contacts["k"]) and abs(run.velocities[-1, 0, 0]) > 1


def test_names_are_free_ones_and_follow():
    simulation = scene([{**CUBE, "position": [k, 0, 0.1]} for k in range(3)]).simulate()
    assert simulation.bodies == ["body-0", "body-1", "body-2"]
    simulation.remove_body("body-0")
    assert simulation.add_body({**CUBE, "position": [0, 0, 0.1]}) == "body-3"
    simulation.remove_body("body-1")
    assert simulation.bodies == ["body-2", "body-3"]
    simulation.set_state("body-3", [0, 0, 0.1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0])
    assert simulation.states[1, 7] == 1 and simulation.scene.bodies == simulation.bodies
    names = simulation.run(5).to_pandas()["body"]
    assert list(names[:2]) == ["body-2", "body-3"]


def test_what_changed_is_copied_and_pickled(tmp_path):
    simulation = scene([*tower(3), *tower(2, at=1.0)]).simulate()
    simulation.run(20)
    simulation.hold("cube-1-1")
    simulation.remove_body("cube-1-0")
    simulation.release("cube-1-1")
    simulation.add_body(cube("late", [0.02, 0, 0.71], load={"force": [0, 1, 0]}))
    simulation.run(7)
    others = [copy.copy(simulation), pickle.loads(pickle.dumps(simulation))]
    simulation.save(tmp_path / "state.bin")
    others.append(tumble.Simulation.restore(simulation.scene, tmp_path / "state.bin"))
    with pytest.raises(tumble.TumbleError, match="state.bin: the saved state has 5 bodies; the world has 4"):
        tumble.Simulation.restore(scene(tower(4)), tmp_path / "state.bin")
    run = simulation.run(80)
    for other in others:
        assert other.bodies == simulation.bodies
        np.testing.assert_array_equal(other.run(80).states, run.states)
    kept = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(kept.states, run.states)
    # Tables can be written and read. run.json records that something else moved the bodies.
    tables = run.to_csv(tmp_path / "run")
    assert [file.name for file in tables] == ["states.csv", "contacts.csv", "steps.csv", "run.json"]
    assert '"pushed": true' in tables[-1].read_text()
    read = tumble.Trajectory.from_csv(simulation.scene, tmp_path / "run")
    np.testing.assert_array_equal(read.states, run.states)
    assert len(run.page()) > 1000
    with pytest.raises(tumble.TumbleError, match="a file cannot describe; use pickle"):
        simulation.scene.save(tmp_path / "scene.toml")


def test_what_lies_within_a_held_body_is_copied_and_pickled(tmp_path):
    lower, upper = cube("lower", [0, 0, 0.1]), cube("upper", [0, 0, 0.5])
    simulation = scene([lower, upper]).simulate()
    simulation.hold("lower")
    # Held bodies have no contacts.
    simulation.run(150)
    simulation.add_body(cube("late", [3, 0, 1]))
    simulation.run(10)
    others = [copy.copy(simulation), pickle.loads(pickle.dumps(simulation))]
    simulation.save(tmp_path / "state.bin")
    others.append(tumble.Simulation.restore(simulation.scene, tmp_path / "state.bin"))
    run = simulation.run(20)
    for other in others:
        np.testing.assert_array_equal(other.run(20).states, run.states)
        with pytest.raises(tumble.TumbleError, match="lower"):
            other.release("lower")


def test_joints_go_with_their_body_where_that_is_said():
    rod = {"box": [0.1, 0.1, 0.4], "mass": 1.0}
    rods = [{**rod, "name": f"rod-{k}", "position": [0, 0, 2 - 0.4 * k]} for k in range(3)]
    pins = [
        {"name": f"pin-{k}", "type": "spherical", "bodies": [f"rod-{k}", f"rod-{k - 1}"][: 1 + (k > 0)],
         "anchor": [0, 0, 2.2 - 0.4 * k]}
        for k in range(3)
    ]
    simulation = tumble.Scene(rods, FREE, joints=pins).simulate()
    simulation.run(10)
    with pytest.raises(tumble.TumbleError, match="rod-1 is attached to pin-1; joints=True"):
        simulation.remove_body("rod-1")
    assert simulation.bodies == ["rod-0", "rod-1", "rod-2"] and len(simulation.joints) == 3
    simulation.remove_body("rod-1", joints=True)
    assert list(simulation.joints) == ["pin-0"] and simulation.bodies == ["rod-0", "rod-2"]
    run = simulation.run(100)
    # The first rod still hangs and carries its own weight. The last one falls.
    np.testing.assert_allclose(run.joints["pin-0"]["force"][:, 2], 9.81, rtol=1e-9)
    assert np.ptp(run.positions[:, 0, 2]) < 1e-9 and run.positions[-1, 1, 2] < 1.2 - 0.19


def test_gears_go_with_the_joints_of_a_body():
    """The first of three geared wheels is removed. The other two stay geared."""
    wheels = [{"box": [0.2, 0.2, 0.1], "mass": 1.0, "name": f"wheel-{k}", "position": [k, 0, 1],
               "spin": [0, 0, [4.0, 2.0, -2.0][k]]} for k in range(3)]
    axles = [{"name": f"axle-{k}", "type": "revolute", "bodies": [f"wheel-{k}"], "anchor": [k, 0, 1],
              "axis": [0, 0, 1]} for k in range(3)]
    gears = [{"joints": ["axle-0", "axle-1"], "ratio": 2.0}, {"joints": ["axle-2", "axle-1"], "ratio": -1.0}]
    simulation = tumble.Scene(wheels, FREE, joints=axles, gears=gears).simulate()
    simulation.run(50)
    simulation.remove_body("wheel-0", joints=True)
    simulation.set_force("axle-1", 0.3)
    run = simulation.run(50)
    first, second = np.moveaxis(run.gears["coordinates"][:, 0], -1, 0)
    assert run.gears["coordinates"].shape == (51, 1, 2)
    np.testing.assert_allclose(first, -second, atol=1e-12)
    assert second[-1] - second[0] > 0.2
    # The drive turns two wheels, so the gear transmits half of its torque.
    np.testing.assert_allclose(np.abs(run.gears["force"][1:-1, 0]), 0.15, rtol=1e-6)
    assert run.scene.gears == simulation.scene.gears


@pytest.mark.parametrize(
    "body, words",
    [
        ([1, 2], "body is .*a dictionary is needed"),
        ({**CUBE}, "missing field `position`"),
        (cube("x", [0, 0, 0.1], weight=3), "unknown field `weight`"),
        (cube("x", [0, 0, 0.15]), "overlap"),
        (cube("x", [3, 0, 0.0]), "below the ground|above the ground|ground"),
        (cube("cube-0-0", [3, 0, 0.1]), 'name: "cube-0-0" is used twice'),
        (cube("ground", [3, 0, 0.1]), "name"),
        (cube("x", [3, 0, 0.1], mass=-1), "mass"),
        (cube("x", [3, 0, 0.3], attitude="random"), "random starts are not supported here"),
        (cube("x", [3, 0, 0.3], copies={"count": [2, 1, 1], "step": [1, 0, 0]}), "add one body at a time"),
        (cube("x", [3, 0, 0.3], load={"force": [1e9, 0, 0]}), "load of x"),
    ],
)
def test_a_body_that_cannot_come_leaves_all_as_it_was(body, words):
    simulation, other = scene(tower(2)).simulate(), scene(tower(2)).simulate()
    for one in (simulation, other):
        one.run(5)
    with pytest.raises(tumble.TumbleError, match=words):
        simulation.add_body(body)
    assert simulation.bodies == other.bodies
    np.testing.assert_array_equal(simulation.run(10).states, other.run(10).states)


def test_bodies_that_cannot_go_are_named():
    simulation = scene(tower(1)).simulate()
    with pytest.raises(tumble.TumbleError, match="1 or more"):
        simulation.remove_body(0)
    with pytest.raises(tumble.TumbleError, match="body 'none' is unknown"):
        simulation.remove_body("none")
    with pytest.raises(tumble.TumbleError, match="1 or more"):
        tumble.drop().simulate().remove_body(0)


def test_the_thrown_cube_gets_company():
    simulation = tumble.drop().simulate()
    simulation.add_body(cube("x", [5, 0, 5]))
    run = simulation.run(4)
    assert run.states.shape == (5, 2, 13)
    np.testing.assert_array_equal(run.positions[1:, 1, 2] < run.positions[:-1, 1, 2], True)
