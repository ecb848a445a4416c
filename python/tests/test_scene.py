"""Scenes from files and from code, and refusals."""

import pickle
from pathlib import Path

import numpy as np
import pytest
import tumble

CUBE = {"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1]}


def test_a_scene_begins_at_an_index_of_its_own(tmp_path):
    load = {"force": [[0, 0, 0, 0], [1, 0, 0, 0], [2, 5, 0, 0]]}
    cube = {"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1], "load": load}
    scene = tumble.Scene([cube], {"friction": 0.1}, start_index=500)
    assert scene.start_index == 500 and "start_index" in scene._source[0]
    run = scene.run(300)
    assert run.time[0] == 1.0 and run.contacts["k"][0] == 500
    other = tumble.Scene([cube], {"friction": 0.1})
    assert other.start_index == 0
    np.testing.assert_array_equal(other.simulate(index=500).run(300).states, run.states)
    assert not np.array_equal(other.run(300).states, run.states)
    # Files, other processes and rollouts start at the same index.
    kept = [tumble.load(scene.save(tmp_path / "later.toml")), pickle.loads(pickle.dumps(scene))]
    kept.append(tumble.Scene.from_text(other._source[0], start_index=500))
    for one in kept:
        assert one.start_index == 500
        np.testing.assert_array_equal(one.run(300).states, run.states)
    rolled = tumble.rollout(scene, steps=300)
    np.testing.assert_array_equal(rolled.states[0], run.states[1:])
    np.testing.assert_array_equal(rolled[0].time, run.time)
    for odd in (-1, 1.5, 10**16):
        with pytest.raises(tumble.TumbleError, match="start_index is .*a whole number from 0"):
            tumble.Scene([cube], {"friction": 0.1}, start_index=odd)


def test_a_file_and_code_make_the_same_scene(tmp_path):
    text = """
gravity = 9.81
[ground]
friction = 0.3
[[bodies]]
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
velocity = [1.0, 0.0, 0.0]
"""
    (tmp_path / "cube.toml").write_text(text)
    read = tumble.load(tmp_path / "cube.toml", steps=300)
    built = tumble.Scene([{**CUBE, "velocity": np.array([1, 0, 0])}], {"friction": 0.3})
    assert read.name == "cube" and read.steps == 300 and read.solver == "native"
    assert read.states.shape == (1, 13) and read.inertias.shape == (1, 3, 3)
    np.testing.assert_array_equal(read.run(300).states, built.run(300).states)


def test_bodies_may_meet_without_a_ground():
    """Two balls of equal mass in a central plastic impact move on together."""
    balls = [
        {"sphere": 0.1, "mass": 1.0, "position": [x, 0, 0], "velocity": [v, 0, 0]}
        for x, v in [(-0.5, 2.0), (0.5, 0.0)]
    ]
    run = tumble.Scene(balls, {"none": True, "friction": 0.5}, gravity=0.0).run(400)
    np.testing.assert_allclose(run.velocities[-1, :, 0], 1.0, atol=1e-12)
    assert set(run.contacts["partner"]) == {"body-0"} or set(run.contacts["partner"]) == {"body-1"}
    assert "<!doctype html>" in run.page().lower()


def test_rolling_and_torsional_friction():
    ball = {"sphere": 0.1, "mass": 2.0, "position": [0, 0, 0.1], "velocity": [1, 0, 0], "spin": [0, 10, 0]}
    ground = {"friction": 0.6, "rolling_friction": 0.01}
    pair = [{"between": ["body-0", "ground"], "coefficient": 0.02}]
    scene = tumble.Scene([ball], ground, torsional_friction=pair, time_step=0.001, steps=1600)
    run = scene.run()
    slowing = 0.01 * 9.81 / 0.14
    assert run.positions[-1, 0, 0] == pytest.approx(0.5 / slowing, abs=2e-5)
    np.testing.assert_allclose(run.contacts["moment"][0], [0, -0.01 * 2 * 9.81, 0], atol=1e-9)
    assert run.contacts_to_pandas()["moment_y_N_m"].iloc[0] == pytest.approx(-0.1962)
    assert tumble.Scene([ball], ground, rolling_friction=pair).run(5).contacts["moment"][0, 1] == pytest.approx(-0.3924)
    frictions = np.array([[0.0], [0.01], [0.02]])
    speeds = tumble.rollout(scene, steps=500, parameters={"rolling_friction": frictions}).states[:, -1, 0, 7]
    np.testing.assert_allclose(1.0 - speeds, 0.5 * frictions[:, 0] * 9.81 / 0.14, atol=1e-5)


def test_friction_that_depends_on_the_direction():
    body = {"box": [0.5, 0.5, 0.004], "mass": 1.0, "position": [0, 0, 0.002], "velocity": [0, 1, 0]}
    surfaces = [{"of": "body-0", "axis": [0, 2, 0], "factor": 0.25}]
    scene = tumble.Scene([body], {"friction": 0.4}, surfaces=surfaces, time_step=0.001)
    assert scene.run(100).velocities[-1, 0, 1] == pytest.approx(1 - 0.25 * 0.4 * 9.81 * 0.1, abs=1e-9)
    factors = np.array([[0.1], [1.0], [2.0]])
    ends = tumble.rollout(scene, steps=100, parameters={"friction_factor": factors}).states[:, -1, 0, 8]
    np.testing.assert_allclose(ends, 1 - factors[:, 0] * 0.4 * 9.81 * 0.1, atol=1e-9)
    with pytest.raises(ValueError, match="factor"):
        tumble.Scene([body], {"friction": 0.4}, surfaces=[{"of": "body-0", "axis": [1, 0, 0]}])


def test_every_shipped_scenario_loads_and_runs(scenarios):
    files = sorted(scenarios.glob("*.toml"))
    assert len(files) >= 18
    for file in files:
        run = tumble.load(file).run(5)
        assert run.unsolved == [], file
        assert run.states.shape == (6, len(run.scene.bodies), 13)


def test_the_tutorial_s_scenes_are_the_shipped_ones(scenarios):
    for name, seed, built in [("drop", 5, tumble.drop(5)), ("floating", None, tumble.floating())]:
        read = tumble.load(scenarios / f"{name}.toml", seed=seed)
        assert (read.name, read.seed, read.time_step) == (name, seed, built.time_step)
        np.testing.assert_array_equal(read.run(260).states, built.run(260).states)


def test_a_scene_goes_to_another_process(scenarios):
    for scene in (tumble.drop(7), tumble.load(scenarios / "pile.toml", seed=3, friction=0.2)):
        other = pickle.loads(pickle.dumps(scene))
        assert (other.name, other.friction, other.seed) == (scene.name, scene.friction, scene.seed)
        np.testing.assert_array_equal(other.run(5).states, scene.run(5).states)


def test_keywords_go_before_the_file(scenarios):
    file = scenarios / "block-on-block.toml"
    scene = tumble.load(file, friction=0.125, restitution=0.5, time_step=0.001, steps=7)
    assert (scene.friction, scene.restitution, scene.time_step) == (0.125, 0.5, 0.001)
    assert scene.steps == 7


@pytest.mark.parametrize(
    "bodies, ground, words",
    [
        ([CUBE], {}, "ground.friction|missing field"),
        ([{**CUBE, "mass": -1.0}], {"friction": 0.3}, r"bodies\[0\].mass is -1.0 kg"),
        ([{**CUBE, "mass": "1 kg"}], {"friction": 0.3}, "mass: .*expected a number"),
        ([{**CUBE, "weight": 1.0}], {"friction": 0.3}, "unknown field `weight`"),
        ([{**CUBE, "position": [0, 0]}], {"friction": 0.3}, "length 3"),
        ([{**CUBE, "position": [0, 0, np.nan]}], {"friction": 0.3}, "position.*NaN"),
        ([{**CUBE, "position": [0, 0, 0]}], {"friction": 0.3}, "m below the ground"),
        ([{**CUBE, "mass": object()}], {"friction": 0.3}, "mass: object is not supported"),
        ([CUBE], {"friction": 30}, "friction.* is 30.0; allowed: 0 to 10"),
        ([], {"friction": 0.3}, "at least one table"),
    ],
)
def test_what_is_no_scene_is_named(bodies, ground, words):
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.Scene(bodies, ground)


def test_what_cannot_be_read_is_named(tmp_path, scenarios):
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(tumble.TumbleError, match=f"^{path} cannot be read: .*; give a scenario"):
            tumble.load(path)
    (tmp_path / "odd.toml").write_text("[ground\n")
    with pytest.raises(tumble.TumbleError, match="odd.toml: line 1"):
        tumble.load(tmp_path / "odd.toml")
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(tumble.TumbleError, match="it is not UTF-8"):
        tumble.load(tmp_path / "odd.toml")
    with pytest.raises(tumble.TumbleError, match="solver: unknown variant `newton`"):
        tumble.drop(solver="newton")
    with pytest.raises(tumble.TumbleError, match="seed: .*without random values"):
        tumble.load(scenarios / "stack.toml", seed=1)
    with pytest.raises(tumble.TumbleError, match="steps is 0"):
        tumble.load(scenarios / "stack.toml", steps=0)
    assert issubclass(tumble.TumbleError, ValueError)


def test_ipopt_is_there_or_says_that_it_is_not():
    if tumble.has_ipopt:
        native, ipopt = (tumble.drop(solver=name).run(240) for name in ("native", "ipopt"))
        assert ipopt.unsolved == [] and ipopt.scene.solver == "ipopt"
        # Ipopt's program is smoothed to 1e-6: see docs/ipopt-path.md.
        assert np.abs(ipopt.positions - native.positions).max() < 1e-3
    else:
        with pytest.raises(tumble.TumbleError, match="solver: it needs Ipopt"):
            tumble.drop(solver="ipopt")


@pytest.mark.parametrize(
    "keywords, words",
    [
        ({"friction": 0.3}, r"friction is 0.3; a list of dictionaries .*ground=\{\"friction\""),
        ({"restitution": 0.3}, r"restitution is 0.3; a list of dictionaries .*ground=\{\"restit"),
        ({"fixed": [0.3]}, r"fixed\[0\] is 0.3; a dictionary"),
        ({"bodies": CUBE}, "bodies is .* a list of dictionaries"),
        ({"ground": 0.3}, "ground is 0.3; a dictionary"),
        ({"bodies": [{**CUBE, "mass": 10**5000}]}, "mass is a whole number of 16610 bits"),
        ({"bodies": [{**CUBE, "name": "\ud800"}]}, "half of a surrogate pair"),
        ({"bodies": [{**CUBE, "mass": 2**63}]}, r"bodies\[0\].mass is 9223372036854775808; a whole"),
    ],
)
def test_tables_that_are_none_are_named(keywords, words):
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.Scene(**{"bodies": [CUBE], "ground": {"friction": 0.3}, **keywords})


def test_a_scene_is_saved_as_a_file(scenarios, tmp_path):
    built = tumble.Scene([{**CUBE, "attitude": "random", "position": [0, 0, 2]}], {"friction": 0.3}, seed=9)
    pile = tumble.load(scenarios / "pile.toml", seed=None)
    for name, scene in (("drop", tumble.drop(7)), ("built", built), ("pile", pile)):
        path = scene.save(tmp_path / f"{name}.toml")
        read = tumble.load(path)
        assert (read.name, read.seed, read.bodies) == (scene.name, scene.seed, scene.bodies)
        np.testing.assert_array_equal(read.run(30).states, scene.run(30).states)
    with pytest.raises(tumble.TumbleError, match="friction, steps of this scene|steps, friction of"):
        tumble.load(scenarios / "drop.toml", friction=0.5, steps=9).save(str(tmp_path / "none.toml"))
    assert not (tmp_path / "none.toml").exists()


def test_probable_mistakes_are_warnings(tmp_path):
    (tmp_path / "up.toml").write_text("gravity = [0, 0, 9.81]\n[ground]\nfriction = 0.5\n[[bodies]]\nbox = 1\nmass = 1\nposition = [0, 0, 2]\n")
    with pytest.warns(UserWarning, match="^gravity points away from the ground") as warned:
        tumble.load(tmp_path / "up.toml")
    assert [Path(one.filename).name for one in warned] == ["test_scene.py"]
    for fields, note in [
        ({"velocity": [0, 0, -1e3]}, "the motion of cube in a step exceeds"),
        ({"inertia": [1, 1, 3]}, "inertia of cube"),
        ({"attitude": [0, 0, 0, 1]}, "quaternions are w, x, y, z"),
    ]:
        with pytest.warns(UserWarning, match=note):
            tumble.Scene([{**CUBE, "name": "cube", "position": [0, 0, 2], **fields}], {"friction": 0.3})


def test_files_of_other_programs_stay(tmp_path):
    scene = tumble.Scene([CUBE], {"friction": 0.3})
    run, simulation = scene.run(3), scene.simulate()
    for name, write in [
        ("a.html", run.view),
        ("a.svg", run.plot),
        ("a.png", run.plot),
        ("a.gif", run.gif),
        ("a.toml", scene.save),
        ("a.state", simulation.save),
    ]:
        path = tmp_path / name
        path.write_text('name = "mine"')
        with pytest.raises(tumble.TumbleError, match=f"{name} was not written by tumble; move it"):
            write(path)
        assert path.read_text() == 'name = "mine"'
        path.write_text("")
        for _ in range(2):
            assert write(path) == path and path.stat().st_size > 50
    part = tmp_path / "part.step"
    part.write_bytes(b"\xff")
    with pytest.raises(tumble.TumbleError, match="export the part as .stl"):
        tumble.load(part)


def test_lists_that_contain_themselves_are_refused():
    circular = []
    circular.append(circular)
    deep = [1.0]
    for _ in range(5000):
        deep = [deep]
    for value in (circular, deep):
        with pytest.raises(tumble.TumbleError, match="contains itself, or is nested too deeply"):
            tumble.Scene([{**CUBE, "position": value}], {"friction": 0.3})


def test_a_mesh_is_decomposed_once(root):
    """Two scenes with the same mesh move alike. Wrong fields are named."""
    mesh = str(root / "data" / "meshes" / "bowl.obj")
    bowl = {"mesh": mesh, "decompose": {"pieces": 16}, "density": 700.0, "position": [0, 0, 0]}
    ball = {"sphere": 0.04, "density": 500.0, "position": [0.08, 0, 0.2]}
    scene = tumble.Scene([bowl, ball], {"friction": 0.5})
    run = scene.run(400)
    assert run.unsolved == [] and run.positions[-1, 1, 2] < 0.12
    np.testing.assert_array_equal(tumble.Scene([bowl, ball], {"friction": 0.5}).run(400).states, run.states)
    # A body that is added later is decomposed too.
    late = tumble.Scene([ball], {"friction": 0.5}).simulate()
    late.add_body({**bowl, "name": "bowl"})
    assert late.bodies == ["body-0", "bowl"]
    with pytest.raises(tumble.TumbleError, match="decompose.*pieces: 0 given; allowed: 1 to 32"):
        tumble.Scene([{**bowl, "decompose": {"pieces": 0}}], {"friction": 0.5})
    with pytest.raises(tumble.TumbleError, match="decompose it into convex pieces"):
        tumble.Scene([{"mesh": mesh, "mass": 1.0, "position": [0, 0, 0]}], {"friction": 0.5})


def test_an_attitude_can_be_a_rotation_of_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    turned = Rotation.from_euler("xyz", [0.3, -0.2, 0.5])
    box = {"box": 0.2, "mass": 1.0, "position": [0, 0, 3], "attitude": turned}
    scene = tumble.Scene([box], {"friction": 0.5})
    x, y, z, w = turned.as_quat()
    np.testing.assert_allclose(scene.states[0, 3:7], [w, x, y, z], atol=1e-15)


def test_unknown_keywords_name_the_known_one(scenarios):
    for keyword, known in (("dt", "time_step"), ("h", "time_step"), ("sed", "seed")):
        with pytest.raises(TypeError, match=f"keyword '{keyword}' is unknown; did you mean `{known}`"):
            tumble.load(scenarios / "drop.toml", **{keyword: 1})


@pytest.mark.parametrize(("keyword", "meant"), [("dt", "time_step"), ("timestep", "time_step"), ("gravty", "gravity")])
def test_an_unknown_keyword_has_a_hint(keyword, meant):
    with pytest.raises(TypeError, match=f"keyword '{keyword}' is unknown; did you mean `{meant}`"):
        tumble.Scene([], {"friction": 0.3}, **{keyword: 0.1})
