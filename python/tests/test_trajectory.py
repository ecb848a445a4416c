"""Trajectories: arrays, tables and pictures."""

import copy
import os
import pickle
import shutil
import subprocess
import sys

import numpy as np
import pytest
import tumble


@pytest.fixture(scope="module")
def run():
    return tumble.drop(42).run(300)


@pytest.fixture(scope="module")
def stack():
    boxes = [
        {"name": f"box-{i}", "box": 0.2, "mass": 1.0, "position": [0, 0, 0.1 + 0.2 * i]}
        for i in range(3)
    ]
    return tumble.Scene(boxes, {"friction": 0.5}, name="stack").run(20)


def test_arrays_are_named_views(run):
    assert len(run) == 301 and run.states.shape == (301, 1, 13)
    for name, width in [("positions", 3), ("attitudes", 4), ("velocities", 3), ("spins", 3)]:
        array = getattr(run, name)
        assert array.shape == (301, 1, width) and np.shares_memory(array, run.states)
    assert run.forces.shape == (300, 1, 3) and run.residuals.shape == run.status.shape == (300,)
    np.testing.assert_allclose(run.time, 0.002 * np.arange(301))
    np.testing.assert_allclose(np.linalg.norm(run.attitudes, axis=-1), 1.0, atol=1e-12)
    assert np.all(np.diff(run.energy) < 1e-9), "nothing makes energy"
    assert run.unsolved == [] and "300 steps" in repr(run)


def test_forces_explain_the_motion(run):
    """The forces satisfy the step's equation m (v⁺ − v) = h (F + m g)."""
    change = 10.0 * np.diff(run.velocities[:, 0], axis=0)
    impulse = 0.002 * (run.forces[:, 0] + [0, 0, -98.1])
    np.testing.assert_allclose(change, impulse, atol=1e-9)


def test_inner_forces_are_opposite(stack):
    g = 9.81
    np.testing.assert_allclose(stack.forces[:, :, 2], g, atol=1e-9)
    contacts = stack.contacts
    on_ground = np.array(contacts["partner"]) == "ground"
    first = contacts["k"] == 0
    assert contacts["force"][on_ground & first, 2].sum() == pytest.approx(3 * g)


def test_tables_read_back_to_the_same_doubles(stack, tmp_path):
    files = stack.to_csv(tmp_path / "out")
    assert [file.name for file in files] == ["states.csv", "contacts.csv", "steps.csv", "run.json"]
    read = tumble.Trajectory.from_csv(stack.scene, tmp_path / "out")
    np.testing.assert_array_equal(read.states, stack.states)
    np.testing.assert_array_equal(read.forces, stack.forces)
    np.testing.assert_array_equal(read.residuals, stack.residuals)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        file.name for file in files
    ), "no temporary file stays"
    with pytest.raises(tumble.TumbleError, match="states: column 3 of the header"):
        (tmp_path / "out" / "states.csv").write_text("k,time_s\n")
        tumble.Trajectory.from_csv(stack.scene, tmp_path / "out")
    with pytest.raises(FileNotFoundError):
        tumble.Trajectory.from_csv(stack.scene, tmp_path)


def test_another_scene_s_tables_are_refused(stack, tmp_path):
    stack.to_csv(tmp_path)
    with pytest.raises(tumble.TumbleError, match="to another scene: they have 3 bodies, this one has 1"):
        tumble.Trajectory.from_csv(tumble.drop(), tmp_path)


def test_tables_of_equally_many_other_bodies_are_refused(stack, tmp_path):
    stack.to_csv(tmp_path)
    boxes = [{"name": name, "box": 0.2, "mass": 9.0, "position": [0, 0, at]} for at, name in enumerate("abc", 1)]
    others = tumble.Scene(boxes, {"friction": 0.5}, time_step=stack.scene.time_step)
    with pytest.raises(tumble.TumbleError, match="the run is of another scene: its run.json has"):
        tumble.Trajectory.from_csv(others, tmp_path)


def test_tables_that_were_read_are_written_with_their_run_json(stack, tmp_path):
    stack.to_csv(tmp_path / "first")
    read = tumble.Trajectory.from_csv(stack.scene, tmp_path / "first")
    files = read.to_csv(tmp_path / "second")
    assert files[-1].name == "run.json"
    assert files[-1].read_text() == (tmp_path / "first" / "run.json").read_text()


def test_pandas_has_the_same_numbers(stack, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = stack.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == 63
    top = frame[frame["body"] == "box-2"]
    np.testing.assert_array_equal(top["z_m"], stack.positions[:, 2, 2])
    last = frame[frame["k"] == 20][tumble.STATE_COLUMNS]
    np.testing.assert_array_equal(stack.scene.simulate(last).states, stack.states[-1])
    steps = stack.steps_to_pandas()
    assert len(steps) == 20 and set(steps["status"]) == {"converged"}
    stack.to_csv(tmp_path)
    table = pandas.read_csv(tmp_path / "steps.csv")[:-1]
    parts = ["dynamics_m_s", "penetration_m_s", "normal_law_m_s", "friction_law_m_s", "cone_m_s"]
    np.testing.assert_array_equal(steps[parts], table[parts])
    # Without joints the residual is the largest of these parts.
    np.testing.assert_array_equal(steps[parts].max(axis=1), steps["residual_m_s"])


def test_tables_without_pandas_say_what_to_install(stack, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    simulation = stack.scene.simulate()
    for table in (
        *(stack.to_pandas, stack.steps_to_pandas, stack.contacts_to_pandas, stack.joints_to_pandas),
        simulation.contacts_to_pandas,
    ):
        with pytest.raises(ImportError, match="pip install pandas"):
            table()


def test_plots_on_axes_have_the_numbers_of_the_run(stack):
    figure = pytest.importorskip("matplotlib.figure").Figure()
    position, energy = figure.subplots(2)
    assert stack.plot(ax=position, body="box-1") is position
    lines = position.get_lines()
    assert [line.get_label() for line in lines] == ["x", "y", "z"]
    assert np.array_equal(lines[2].get_ydata(), stack.positions[:, stack.scene.bodies.index("box-1"), 2])
    assert np.array_equal(stack.plot(ax=energy, sheet="energy").get_lines()[0].get_ydata(), stack.energy)
    with pytest.raises(tumble.TumbleError, match="ax and path are both given"):
        stack.plot("plot.svg", ax=position)


def test_pictures_are_pictures(run, stack, tmp_path):
    assert run.plot(tmp_path / "plot.svg").read_text().startswith("<svg")
    assert run.plot(tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
    assert run.plot(tmp_path / "energy.svg", sheet="energy").read_text().count("<path") > 2
    assert stack.plot(body="box-1").data != stack.plot(body=0).data
    assert run.gif(tmp_path / "a.gif", size=120, speed=4.0).read_bytes().startswith(b"GIF89a")
    for shown in (run.scene, run.scene.simulate()):
        assert "data:image/gif;base64,R0lGODlh" in shown._repr_html_()
    page = run.view(tmp_path / "view.html").read_text()
    assert page.startswith("<!DOCTYPE html>") or page.startswith("<!doctype html>")
    assert "<title>drop</title>" in page and '"name":"seed","value":"42"' in page
    assert len(run.page(stack)) > len(page)


def test_a_notebook_shows_the_page(run):
    shown = run._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "&lt;html" in shown
    assert shown.count('"') % 2 == 0 and '<script' not in shown
    assert set(run.plot()._repr_mimebundle_()) == {"image/svg+xml"}
    assert set(run.gif(size=100, speed=10)._repr_mimebundle_()) == {"image/gif"}


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda r: r.plot(body=1), "body is 1; a name, for example 'body', or an index"),
        (lambda r: r.plot(sheet="speed"), "motion or energy"),
        (lambda r: r.plot("plot.pdf"), "ends in .svg or .png"),
        (lambda r: r.gif(size=10), "size is 10; allowed: 100 to 2000"),
        (lambda r: r.gif(speed=0), "speed is 0"),
        (lambda r: r.gif(camera=(0, 100)), "an elevation from 0 to 90"),
        (lambda r: r.gif(camera=(0,)), r"camera has shape \(1,\); \(2,\) is needed"),
        (lambda r: r.gif(speed="fast"), "speed is 'fast'; a number"),
        (lambda r: r.view("run.gif"), "run.gif: a name that ends in .html"),
    ],
)
def test_odd_pictures_are_named(run, call, words):
    with pytest.raises(tumble.TumbleError, match=words):
        call(run)


def test_what_was_recorded_does_not_change(run):
    with pytest.raises(AttributeError, match="states: a trajectory cannot be changed"):
        run.states = 0


def test_a_file_that_cannot_be_written_is_named(run, tmp_path):
    with pytest.raises(FileNotFoundError, match="none/page.html"):
        run.view(tmp_path / "none" / "page.html")


def test_parts_and_rows(run):
    part = run[100:201]
    assert len(part) == 101 and part.forces.shape == (100, 1, 3)
    np.testing.assert_array_equal(part.states, run.states[100:201])
    np.testing.assert_array_equal(part.forces, run.forces[100:200])
    np.testing.assert_array_equal(part.residuals, run.residuals[100:200])
    np.testing.assert_array_equal(part.energy, run.energy[100:201])
    np.testing.assert_array_equal(part.time, run.time[100:201])
    last = run.contacts["k"]
    np.testing.assert_array_equal(part.contacts["k"], last[(last >= 100) & (last < 200)])
    np.testing.assert_array_equal(run[-1], run.states[-1])
    np.testing.assert_array_equal([state for state in part], part.states)
    assert len(run[:]) == len(run) and len(run[300:]) == 1
    for odd in (slice(5, 5), slice(None, None, 2), slice(400, 500)):
        with pytest.raises(tumble.TumbleError, match="is not a part of a trajectory"):
            run[odd]
    with pytest.raises(IndexError):
        run[301]


def test_trajectories_are_copied_and_go_to_other_processes(stack):
    bare = stack.scene.run(5, contacts=False)
    for one in (stack, stack[3:9], bare):
        for other in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
            assert other.scene.bodies == one.scene.bodies
            for name in ("states", "forces", "residuals", "time", "energy", "iterations"):
                np.testing.assert_array_equal(getattr(other, name), getattr(one, name))
            assert other._recording.has_contacts == one._recording.has_contacts


def test_a_run_that_went_on_reads_back(stack, tmp_path):
    simulation = stack.scene.simulate()
    simulation.run(7)
    later = simulation.run(5)
    later.to_csv(tmp_path)
    read = tumble.Trajectory.from_csv(stack.scene, tmp_path)
    np.testing.assert_array_equal(read.states, later.states)
    np.testing.assert_array_equal(read.time, later.time)
    assert read.time[0] == pytest.approx(7 * 0.002)


def test_what_is_kept_cannot_be_written_to(stack):
    arrays = [stack.states, stack.positions, stack.forces, stack.time, stack.energy, stack.status]
    arrays += [column for column in stack.contacts.values() if isinstance(column, np.ndarray)]
    for array in arrays:
        assert not array.flags.writeable
    with pytest.raises(AttributeError):
        stack.scene = None
    pytest.importorskip("pandas")
    frame = stack.to_pandas()
    frame.loc[0, "x_m"] = 7.0
    assert frame["x_m"][0] == 7.0 != stack.states[0, 0, 0]


def test_a_gif_is_not_written_under_another_name(stack, tmp_path):
    for name in ("a.mp4", "a"):
        with pytest.raises(tumble.TumbleError, match=r"a name that ends in \.gif"):
            stack.gif(tmp_path / name, size=100, speed=10)
    assert list(tmp_path.iterdir()) == []
    assert stack.gif(str(tmp_path / "a.gif"), size=np.int64(100), speed=10).is_file()


@pytest.fixture
def tumbled(tmp_path):
    """Runs the command line and returns its output directory."""
    program = os.environ.get("TUMBLE") or shutil.which("tumble")
    if program is None:
        pytest.skip("TUMBLE does not name the program of the command line")

    def run(name, *arguments, code=0):
        folder = tmp_path / name
        command = [program, *arguments, "--out", str(folder)]
        end = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert end.returncode == code, end.stderr
        return folder

    return run


def test_tables_of_the_command_line_read_as_the_run_that_they_are_of(tumbled, run, tmp_path):
    args = ("--steps", "301", "--seed", "42", "--solver", "native", "--exact")
    read = tumble.Trajectory.from_csv(run.scene, tumbled("drop", *args, "--all-contacts"))
    for name in ("states", "forces", "residuals", "status", "iterations", "time", "energy"):
        np.testing.assert_array_equal(getattr(read, name), getattr(run, name))
    assert len(read) == 301
    mine, its = run.contacts, read.contacts
    assert its["partner"] == mine["partner"] and len(its["k"]) > 100
    for name in ("k", "body", "point", "normal", "force", "normal_force", "gap", "slip"):
        np.testing.assert_array_equal(its[name], mine[name])
    # The result behaves like any other trajectory.
    part = read[100:201]
    np.testing.assert_array_equal(part.forces, run.forces[100:200])
    files = part.to_csv(tmp_path / "part")
    names = ["states.csv", "contacts.csv", "steps.csv", "run.json"]
    assert [file.name for file in files] == names
    again = tumble.Trajectory.from_csv(run.scene, tmp_path / "part")
    np.testing.assert_array_equal(again.states, part.states)
    assert read.page().startswith(("<!DOCTYPE", "<!doctype")) and len(read.contacts_to_pandas())
    # Without contacts that have no force the run is the same, also compressed.
    for name, more in [("loaded", []), ("compact", ["--compact"])]:
        loaded = tumble.Trajectory.from_csv(run.scene, tumbled(name, *args, *more))
        np.testing.assert_array_equal(loaded.states, run.states)
        np.testing.assert_array_equal(loaded.forces, run.forces)
        assert 0 < len(loaded.contacts["k"]) < len(mine["k"])
        loaded.to_csv(tmp_path / name)
        again = tumble.Trajectory.from_csv(run.scene, tmp_path / name)
        np.testing.assert_array_equal(again.contacts["force"], loaded.contacts["force"])


def test_a_floating_body_s_tables_are_read(tumbled):
    scene = tumble.floating()
    read = tumble.Trajectory.from_csv(scene, tumbled("floating", "--scene", "floating"))
    np.testing.assert_allclose(read.states, scene.run(len(read) - 1).states, rtol=0, atol=2e-12)
    assert len(read.contacts["k"]) == 0


ONE_BODY = ["", "[load]\nforce = [[0.0, 0, 0, 0], [0.05, 40, 0, 9]]\nat = [0.1, 0, 0.2]\n"]
if tumble.has_ipopt:
    ONE_BODY.append("[solver]\nname = 'ipopt'\n")


@pytest.mark.parametrize("text", ONE_BODY)
def test_the_command_line_takes_runs_of_one_body(tumbled, tmp_path, text):
    # Ipopt's program has no restitution.
    restitution = "" if "ipopt" in text else "restitution = 0.3\n"
    scene = tumble.Scene.from_text(
        "name = 'thrown'\nsteps = 151\ntime_step = 0.002\n[body]\nbox = 0.4\nmass = 2\n"
        f"[ground]\nnormal = [0.2, 0.1, 1]\nfriction = 0.4\n{restitution}"
        "[start]\nposition = [0, 0, 0.5]\nattitude = 'random'\nvelocity = [1, 0, -2]\n" + text
    )
    run = scene.run(150)
    scene.save(tmp_path / "scene.toml")
    expected = tumbled("line", str(tmp_path / "scene.toml"), "--exact")
    for name, part, start in [("all", run, 0), ("part", run[60:120], 60)]:
        folder = tmp_path / name
        assert [file.name for file in part.to_csv(folder, all_contacts=True)][-2:] == ["steps.csv", "run.json"]
        if name == "all":
            assert (folder / "states.csv").read_bytes() == (expected / "states.csv").read_bytes()
        program = os.environ.get("TUMBLE") or shutil.which("tumble")
        for command in ("verify", "view"):
            table = str(folder / "states.csv")
            end = subprocess.run([program, command, table], capture_output=True, text=True, timeout=600)
            assert end.returncode == 0, end.stdout + end.stderr
            assert "checksum" not in end.stdout
        read = tumble.Trajectory.from_csv(scene, folder)
        np.testing.assert_array_equal(read.states, part.states)
        for column, numbers in part.contacts.items():
            np.testing.assert_array_equal(read.contacts[column], numbers)
        assert part[0] is not None and part.time[0] == pytest.approx(0.002 * start)
    # Other pushes are recorded in run.json. The run can be viewed but not verified.
    simulation = scene.simulate()
    simulation.run(9, np.ones((9, 6))).to_csv(tmp_path / "all")
    for command, code in (("view", 0), ("plot", 0), ("gif", 0), ("verify", 2)):
        end = subprocess.run(
            [program, command, str(tmp_path / "all" / "states.csv")], capture_output=True, text=True, timeout=600
        )
        assert end.returncode == code, end.stdout + end.stderr
        assert code == 0 or "were set during the run (`pushed` in run.json)" in end.stderr


def test_a_copy_knows_whether_something_pushed_it(tmp_path):
    simulation = tumble.drop().simulate()
    for pushed in (False, True):
        if pushed:
            simulation.step(np.ones(6))
        copy.copy(simulation).run(5).to_csv(tmp_path)
        assert ('"pushed": true' in (tmp_path / "run.json").read_text()) is pushed
    read = tumble.Trajectory.from_csv(simulation.scene, tmp_path)
    read.to_csv(tmp_path)
    assert '"pushed": true' in (tmp_path / "run.json").read_text()
    # Tables do not contain this information.
    (tmp_path / "run.json").unlink()
    read = tumble.Trajectory.from_csv(simulation.scene, tmp_path)
    read.to_csv(tmp_path, overwrite=True)
    assert not (tmp_path / "run.json").exists()


def test_files_that_no_run_json_lists_stay(tmp_path):
    mine = tmp_path / "states.csv"
    mine.write_text("mine")
    with pytest.raises(tumble.TumbleError, match="states.csv was not written by an earlier run.* overwrite=True"):
        tumble.drop().run(5).to_csv(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["states.csv"]
    assert mine.read_text() == "mine"
    tumble.drop().run(5).to_csv(tmp_path, overwrite=True)
    assert mine.read_text() != "mine"


def test_a_folder_has_the_files_of_one_run(tmp_path):
    tumble.drop().run(5).to_csv(tmp_path)
    (tmp_path / "notes.txt").touch()
    (tmp_path / "plot.png").touch()
    block = tumble.Scene([{"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1]}], {"friction": 0.5})
    written = block.run(5).to_csv(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        *("notes.txt", "plot.png"),
        *(path.name for path in written),
    }
    tumble.Trajectory.from_csv(block, tmp_path)
    with pytest.raises(tumble.TumbleError, match=r"time_s = 0.002, but the scene's time step is 0.001 s"):
        slower = tumble.Scene(
            [{"box": 0.2, "mass": 1.0, "position": [0, 0, 0.1]}], {"friction": 0.5}, time_step=0.001
        )
        tumble.Trajectory.from_csv(slower, tmp_path)


def test_a_run_of_the_tutorial_s_settings_reads(tumbled):
    """Ipopt keeps attitudes at unit length only to its tolerance with these settings."""
    folder = tumbled("tutorial", "--preset", "tutorial", "--steps", "300", code=3)
    read = tumble.Trajectory.from_csv(tumble.drop(), folder)
    assert 1e-5 < np.abs(np.linalg.norm(read.attitudes, axis=-1) - 1).max() < 1e-2



def test_a_run_with_an_accuracy_has_tables(tmp_path):
    """The bounce is right to the accuracy, and the tables read as the run."""
    ball = {"name": "ball", "sphere": 0.1, "mass": 1.0, "position": [0, 0, 1.1]}
    ground = {"friction": 0.3, "restitution": 0.5}
    scene = tumble.Scene([ball], ground, time_step=0.01, accuracy=1e-6)
    assert scene.accuracy == 1e-6 and tumble.Scene([ball], ground).accuracy is None
    run = scene.run(60)
    # Impact after √(2 h/g), with half of the speed afterwards.
    fall = np.sqrt(2 / 9.81)
    left = 0.6 - fall
    height = 0.1 + 0.5 * 9.81 * fall * left - 0.5 * 9.81 * left**2
    assert abs(run.states[-1, 0, 2] - height) <= 1e-6
    run.to_csv(tmp_path / "run")
    again = tumble.Trajectory.from_csv(scene, tmp_path / "run")
    np.testing.assert_array_equal(again.states, run.states)
    with pytest.raises(tumble.TumbleError, match="ask for the gradient of the run"):
        scene.jacobian()


def test_impacts_can_be_located():
    """The gradient of the height after a bounce is that of the closed form."""
    ground = {"friction": 0.3, "restitution": 0.5}

    def scene(height):
        ball = {"name": "ball", "sphere": 0.1, "mass": 1.0, "position": [0, 0, 0.1 + height]}
        return tumble.Scene([ball], ground, time_step=0.01, impacts="located")

    def height(drop, time=0.8):
        fall = np.sqrt(2 * drop / 9.81)
        return 0.5 * 9.81 * fall * (time - fall) - 0.5 * 9.81 * (time - fall) ** 2

    dropped = scene(1.0)
    ball = {"name": "ball", "sphere": 0.1, "mass": 1.0, "position": [0, 0, 1.1]}
    assert dropped.impacts == "located" and tumble.Scene([ball], ground).impacts == "stepped"
    run = dropped.run(80)
    assert abs(run.states[-1, 0, 2] - 0.1 - height(1.0)) <= 1e-6
    weights = np.eye(12)[[2]]
    slope = (height(1.0 + 1e-6) - height(1.0 - 1e-6)) / 2e-6
    assert dropped.vjp(weights, steps=80)["states"][0, 2] == pytest.approx(slope, abs=1e-4)
    text = "[ground]\nfriction = 0.3\n[[bodies]]\nsphere = 0.1\nmass = 1.0\nposition = [0, 0, 1]\n"
    with pytest.raises(tumble.TumbleError, match="impacts: unknown variant `never`, expected `stepped` or `located`"):
        tumble.Scene.from_text(text, impacts="never")
