"""Runs the examples. The Dask example also loses a worker."""

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tumble

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def run(name):
    end = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py")], capture_output=True, text=True, timeout=600
    )
    assert end.returncode == 0, end.stderr
    return end.stdout


def test_slides_end_where_coulomb_says():
    lines = run("slide").splitlines()
    rows = np.array([line.split() for line in lines[1:-1]], float)
    # Five digits are printed.
    np.testing.assert_allclose(rows[:, 1], rows[:, 2], atol=2e-5)
    assert lines[-1].endswith("not solved 0")


def test_the_friction_is_found():
    fit = runpy.run_path(str(EXAMPLES / "fit_friction.py"))
    true = fit["TRUE_FRICTION"]
    exact = fit["slides"](np.array([true]))[0]
    # The search ends within 10⁻⁵ of the minimum.
    assert fit["fit"](exact) == pytest.approx(true, abs=1e-5)
    # Standard deviation of least squares, noise / |∂x/∂μ|. The tolerance is four of them.
    by_friction = np.diff(fit["slides"](np.array([true - 1e-3, true + 1e-3])), axis=0) / 2e-3
    spread = fit["NOISE"] / np.linalg.norm(by_friction)
    assert fit["fit"](fit["measured"]()) == pytest.approx(true, abs=4 * spread + 1e-5)


@pytest.mark.parametrize("how", [[], ["--motors"]])
def test_robots_fall_certified(how):
    folder = EXAMPLES.parents[1] / "data" / "robots"
    end = subprocess.run(
        [sys.executable, str(EXAMPLES / "fall.py"), str(folder), *how],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert end.returncode == 0, end.stderr
    fallen = [line for line in end.stdout.splitlines() if "steps of" in line]
    # Random coordinates of another model overlap and are refused.
    certified = [float(line.split(" % certified")[0].split()[-1]) for line in fallen]
    shorter = [int(line.split(" in shorter steps")[0].split()[-1]) for line in fallen]
    # Under random targets a motor can make energy in a step, which is replaced by shorter ones. Where
    # these make energy too, the step is failed: 8 of 2500 steps of 4 ms of the hopper.
    assert len(fallen) == 8 and min(certified) >= (99.5 if how else 100), end.stdout
    assert max(shorter) <= 100, end.stdout


def test_a_planner_that_is_wrong_pushes_the_box_to_its_pose():
    lines = run("push_mpc").splitlines()
    arrived, count = (int(word) for word in lines[-1].split() if word.isdigit())
    # The planner cannot pull back a box that slides too far. The lowest of the five friction
    # coefficients may miss, and one more.
    assert count == 5 and arrived >= 3, lines
    assert any(line.startswith("friction 0.4,") and ": there" in line for line in lines)


def test_the_cubes_are_pushed_to_their_targets():
    ended, reached = (int(word) for word in run("push_cube").split() if word.isdigit())
    assert ended >= 64 and reached >= 0.95 * ended


@pytest.mark.parametrize(
    "robot, controls, start", [("hopper", 3, None), ("walker2d", 6, "hopper"), ("walker2d", 6, None)]
)
def test_a_robot_learns_and_its_policy_is_read(robot, controls, start, tmp_path, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import learn_locomotion

    out, written = tmp_path / "learning.svg", tmp_path / "policy.json"
    begin = ["--start", str(EXAMPLES / "policies" / f"{start}.json")] if start else []
    end = subprocess.run(
        [sys.executable, str(EXAMPLES / "learn_locomotion.py"), "--robot", robot, "--moves", "0", "--workers", "1"]
        + ["--out", str(out), "--policy", str(written), *begin],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert end.returncode == 0 and len(end.stdout.splitlines()) == 1, end.stdout + end.stderr
    policy = learn_locomotion.Policy.load(written)
    assert policy.robot == robot and policy.action(policy.mean + policy.deviation).shape == (controls,)
    assert out.read_text().startswith("<svg") and learn_locomotion.episode((policy, 0, 1.0))[1] > 10


def test_policies_are_audited_in_both_engines(tmp_path):
    for module in ("gymnasium", "mujoco"):
        pytest.importorskip(module)
    end = subprocess.run(
        [sys.executable, str(EXAMPLES / "audit_policies.py"), "--actions", "60", "--starts", "1"]
        + ["--out", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert end.returncode == 0, end.stderr
    rows = [line.split() for line in end.stdout.splitlines()[2:]]
    assert [row[:2] for row in rows] == [[robot, of] for robot in ("hopper", "walker2d") for of in ("MuJoCo", "tumble")]
    for _, engine, distance, inside, cone_slip, creep, energy, residual, broken, _, steps in rows:
        assert float(distance) > 0.0 and 150 <= int(steps) <= 240
        if engine == "tumble":
            # The joints of the robot are rows of the referee as well.
            assert float(residual) < 1e-9 and int(broken) == 0
            assert max(float(inside), float(cone_slip), float(creep), float(energy)) < 1e-9
        else:
            assert float(inside) > 1e-3 and int(broken) > 0
    assert len(list(tmp_path.glob("*.html"))) == 4


def test_a_trot_without_a_policy_goes_as_far_as_in_mujoco(root, monkeypatch):
    for module in ("gymnasium", "mujoco"):
        pytest.importorskip(module)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import walk_mujoco
    import walk_task

    starts, places = [], []
    for make in (walk_task.tumbling, walk_mujoco.soft):
        envs = make(str(root / "data/robots/quadruped.urdf"), 4)
        seen, _ = envs.reset(seed=3)
        starts.append(seen)
        fell = np.zeros(4, bool)
        for _ in range(100):
            seen, rewards, over, _, info = envs.step(walk_task.targets(seen, np.zeros((4, 12))))
            # The pace is worth at most 1.5. A fall costs 5.
            assert np.isfinite(seen).all() and (rewards <= 1.5).all()
            fell |= over
        assert not fell.any()
        places.append(info["x"])
    np.testing.assert_allclose(starts[0], starts[1], atol=1e-6)
    # The lifted feet push the robots 0.4 m back. Soft contact and another time step change that by a few percent.
    assert (places[0] < -0.3).all()
    np.testing.assert_allclose(places[0], places[1], rtol=0.1)


def test_a_crouching_robot_rises_by_gradients(root, capsys):
    rise = runpy.run_path(str(EXAMPLES / "stand_up.py"))
    scene, height = rise["scene_of"](str(root / "data/robots/quadruped.urdf"))
    loss, aimed = rise["Loss"](height), np.tile(rise["STAND"], (rise["STEPS"], 1))
    along = np.random.default_rng(0).normal(size=aimed.shape)
    runs = tumble.rollout(scene, motors=aimed[None], gradients=loss)
    slope, values = (runs.gradients["motors"][0] * along).sum(), []
    for sign in (1, -1):
        loss(tumble.rollout(scene, motors=aimed[None] + sign * 1e-6 * along).states)
        values.append(loss.value)
    # Rounding of the runs, 1e-12, over the step of the difference.
    assert (values[0] - values[1]) / 2e-6 == pytest.approx(slope, rel=1e-3)
    crouched = rise["report"]("crouch", scene, height, np.tile(rise["CROUCH"], (rise["STEPS"], 1)))
    risen = rise["report"]("risen", scene, height, rise["stand_up"](scene, height, 20))
    assert risen < 0.5 * crouched, capsys.readouterr().out


def test_dask_makes_the_bytes_of_one_process_though_a_worker_is_lost(monkeypatch):
    pytest.importorskip("distributed")
    from distributed import Client, LocalCluster

    # Workers import the functions by the example's name.
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLES))
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import dask_sweep

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            futures = client.map(dask_sweep.part, dask_sweep.parts(), pure=True)
            # One worker is killed while the other continues.
            os.kill(cluster.workers[0].pid, 9)
            ends = np.concatenate(client.gather(futures))
    alone = np.concatenate([dask_sweep.part(seeds) for seeds in dask_sweep.parts()])
    assert ends.tobytes() == alone.tobytes()


def test_the_command_line_verifies_and_shows_the_tables_of_a_run(root, tmp_path):
    program = os.environ.get("TUMBLE") or shutil.which("tumble")
    if program is None:
        pytest.skip("TUMBLE does not name the program of the command line")

    def tumbled(*arguments):
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=600)

    def files(name):
        return sorted(file.name for file in (tmp_path / name).iterdir())

    for name in ("arch", "four-bar", "card-house"):
        scene = tumble.load(root / "scenarios" / f"{name}.toml")
        scene.run(60).to_csv(tmp_path / name)
        states = str(tmp_path / name / "states.csv")
        done = tumbled("verify", states)
        assert done.returncode == 0, done.stdout + done.stderr
        assert tumbled("view", states, "--quiet").returncode == 0
        assert "view.html" in files(name)
    # The start differs from the file's.
    scene = tumble.load(root / "scenarios" / "stack.toml")
    starts = scene.states.copy()
    starts[:, 7] = np.linspace(0.0, 0.1, len(starts))
    scene.simulate(starts).run(40).to_csv(tmp_path / "stack")
    assert tumbled("verify", str(tmp_path / "stack" / "states.csv")).returncode == 0
    # Unknown pushes are recorded in run.json. The run can be viewed but not verified.
    simulation = scene.simulate()
    pushes = np.zeros((len(starts), 6))
    pushes[-1, 0] = 1.0
    simulation.step(pushes)
    scene.simulate().run(5, np.broadcast_to(pushes, (5, *pushes.shape))).to_csv(tmp_path / "stack")
    simulation.run(5).to_csv(tmp_path / "moved")
    for name in ("stack", "moved"):
        states = str(tmp_path / name / "states.csv")
        done = tumbled("verify", states)
        assert done.returncode == 2 and "were set during the run (`pushed` in run.json)" in done.stderr
        assert tumbled("view", states, "--quiet").returncode == 0
    # Later parts have the index of their first row, also for hinges after more than one turn.
    simulation = tumble.load(root / "scenarios" / "slider-crank.toml", start_index=70).simulate()
    first, later = simulation.run(1200), simulation.run(300)
    assert np.abs(first.joints["main"]["coordinate"]).max() > 7
    pile = tumble.load(root / "scenarios" / "pile.toml").run(120)[60:]
    for number, run in enumerate([first, later, later[100:200], pile]):
        run.to_csv(tmp_path / f"part-{number}")
        done = tumbled("verify", str(tmp_path / f"part-{number}" / "states.csv"))
        assert done.returncode == 0, done.stdout + done.stderr
