"""Audits of whole runs: exact runs are clean, and faults with known sizes are found."""

import copy
import subprocess
import sys

import numpy as np
import pytest
import tumble
from test_referee import BOX, GRAVITY, rotation
from tumble import referee

FLOOR = "<geom name='floor' type='plane' size='5 5 1' friction='{0}'/>"
CUBE = (
    "<body name='b{1}' pos='0 0 {2}'><freejoint/>"
    "<geom name='box{1}' type='box' size='.1 .1 .1' mass='2' friction='{0}'/></body>"
)


def slide(count, share=1.0, h=0.01):
    """Steps of a box that slides to rest under the share ``share`` of Coulomb's friction."""
    speed, steps = 1.0, []
    for _ in range(count):
        force = min(0.5 * share * GRAVITY, speed / h)
        end = speed - h * force
        state = {"velocities": [[speed, 0, 0]], "velocities_after": [[end, 0, 0]]}
        steps.append({**BOX, **state, "time_step": h, "forces": [[-2 * force, 0, 2 * GRAVITY]]})
        speed = end
    return steps


def thrown(count):
    """Steps of a thrown and tumbling box, taken by tumble."""
    box = {"box": [0.2, 0.3, 0.1], "mass": 2.0, "position": [0, 0, 0.3], "velocity": [1.5, 0, -1], "spin": [3, 2, 1]}
    scene = tumble.Scene([box], ground={"friction": 0.4}, time_step=0.002, integrator="euler")
    run, inertia = scene.run(count), scene.inertias[0]
    assert run.unsolved == []

    def momentum(spin, sign):
        return np.linalg.solve(inertia, referee.step_momentum(inertia, spin, sign * scene.time_step))

    contacts, steps = run.contacts, []
    for k in range(count):
        own = contacts["k"] == k
        start, end = run.states[k, 0], run.states[k + 1, 0]
        turn, turned = rotation(start[3:7]), rotation(end[3:7])
        points = contacts["point"][own]
        steps.append(
            {
                "masses": scene.masses,
                "inertias": scene.inertias,
                "positions": [start[:3]],
                "attitudes": [start[3:7]],
                "attitudes_after": [start[3:7]],
                "velocities": [start[7:10]],
                "velocities_after": [end[7:10]],
                "spins": [turn @ momentum(start[10:13], -1.0)],
                "spins_after": [turn @ momentum(end[10:13], 1.0)],
                "points": points,
                "normals": -contacts["normal"][own],
                "pairs": np.tile([0, -1], (own.sum(), 1)),
                "forces": contacts["force"][own],
                "slips": -contacts["slip"][own],
                "gaps": contacts["gap"][own],
                "gaps_after": (end[:3] + (points - start[:3]) @ turn @ turned.T)[:, 2],
                "friction": 0.4,
                "time_step": scene.time_step,
                "gravity": scene.gravity,
            }
        )
    return steps


def kinds(audit):
    return {finding.kind for finding in audit.findings}


def test_a_run_of_tumble_is_clean():
    audit = referee.audit(thrown(600))
    assert audit.is_clean and audit.findings == () and audit.look_at == ()
    assert audit.steps["residual_m_s"].max() < 1e-9 and audit.steps["overlap_m"].max() < 1e-11
    assert (audit.contacts["force_N"] > 0.0).sum() > 300
    # Contacts only take energy: their power is that of impacts and of sliding.
    assert audit.steps["energy_J"].max() < 1e-9
    assert str(audit).startswith("600 steps: all laws hold to ")


def test_a_box_that_slides_to_rest_is_clean():
    # It stops after v / μg = 0.2 s.
    audit = referee.audit(slide(40))
    assert audit.is_clean
    np.testing.assert_allclose(audit.steps["apart_m_s"], 0.0, atol=1e-12)
    np.testing.assert_allclose(audit.steps["time_s"][[0, -1]], [0.01, 0.4])
    # Friction takes all of the kinetic energy, 1 J, and the power of a step is that at its end.
    work = 0.01 * audit.contacts["power_W"].sum()
    assert work == pytest.approx(-1.0 + 0.5 * 2 * 0.01 * 0.5 * GRAVITY * 1.0, rel=0.01)


def test_weak_friction_is_slip_inside_the_cone():
    audit = referee.audit(slide(10, share=0.8))
    (finding,) = audit.findings
    assert (finding.kind, finding.row, finding.steps) == ("slip inside the cone", "contact box–world", 10)
    assert finding.first == finding.worst == 0 and audit.look_at == (0,)
    assert finding.value == pytest.approx(1 - 0.01 * 0.4 * GRAVITY)
    # The exact step has the full friction.
    np.testing.assert_allclose(audit.steps["apart_m_s"], 0.01 * 0.1 * GRAVITY, rtol=1e-9)
    assert audit.steps["exact_residual_m_s"].max() < 1e-12
    assert audit.velocity_names[0] == "box vx"
    assert "0.96076" in audit.beside(0) and "0.95095" in audit.beside(0)
    with pytest.raises(KeyError, match="no step 99"):
        audit.beside(99)


def test_each_fault_is_a_finding():
    step = {**BOX, "velocities": [[0, 0, 0]], "velocities_after": [[0, 0, 0]], "forces": [[0, 0, 2 * GRAVITY]]}
    creeps = {**step, "velocities_after": [[0.001, 0, 0]], "forces": [[0.2, 0, 2 * GRAVITY]]}
    inside = {**step, "gaps": [-1e-4]}
    beyond = {**step, "velocities": [[1, 0, 0]], "velocities_after": [[1 - 0.06 * GRAVITY * 0.1, 0, 0]]}
    beyond["forces"] = [[-0.6 * 2 * GRAVITY, 0, 2 * GRAVITY]]
    thrown_up = {**step, "velocities_after": [[0, 0, 1]], "forces": [[0, 0, 2 * GRAVITY + 200]]}
    wrong = {**step, "forces": [[0, 0, 0]], "velocities_after": [[0, 0, 0.0]], "gaps": [1.0]}
    expected = {
        "creeps": (creeps, {"slip inside the cone", "creep", "energy"}),
        "inside": (inside, {"penetration"}),
        "beyond": (beyond, {"beyond the cone"}),
        "thrown up": (thrown_up, {"normal law", "energy"}),
        "hovers": (wrong, {"dynamics"}),
    }
    for name, (fault, said) in expected.items():
        audit = referee.audit([step, fault])
        assert said <= kinds(audit), name
        assert {finding.first for finding in audit.findings} == {1}, name
    # 200 N over a step of 10 ms throw the box up at 1 m/s: ½ m v² comes from nowhere.
    audit = referee.audit([thrown_up])
    assert audit.steps["energy_J"][0] == pytest.approx(2 * 1 * 1 * 1.0 + 0.01 * 2 * GRAVITY - 1.0, rel=1e-9)


def test_generalised_coordinates_and_times_are_audited():
    step = {
        "M": np.diag([2.0, 3.0]), "J": np.eye(2), "laws": [["limit"], ["locked"]], "time_step": 0.1,
        "velocity_before": [-1.0, 0.0], "velocity_after": [0.0, 0.0], "force": [0.0, 0.0], "impulses": [2.0, 0.0],
    }  # fmt: skip
    audit = referee.audit([{**step, "time": 5.0}, {**step, "velocity_after": [0.0, 0.5]}], velocity_names=["x", "y"])
    np.testing.assert_allclose(audit.steps["time_s"], [5.0, 5.1])
    assert kinds(audit) == {"dynamics", "joint law"} and "y" in audit.beside(1)
    assert len(referee.audit([step] * 7, every=3).steps["k"]) == 3
    empty = referee.audit([])
    assert empty.is_clean and str(empty) == "0 steps: all laws hold to 0.0e+00 m/s"


def test_the_page_needs_no_network(tmp_path):
    audit = referee.audit(slide(10, share=0.8), title="weak <friction>")
    audit.save(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "weak &lt;friction&gt;" in page and "http" not in page and "src=" not in page
    assert page.count("<svg") == 6 and "Steps to look at" in page and "contact box–world" in page
    assert page.count("<polyline") == 7
    referee.audit(slide(3)).save(tmp_path / "page.html")
    assert "✓ no findings" in (tmp_path / "page.html").read_text(encoding="utf-8")
    referee.audit([]).save(tmp_path / "empty.html")
    (tmp_path / "mine.html").write_text("<html>mine</html>")
    with pytest.raises(tumble.TumbleError, match="mine.html was not written by tumble"):
        audit.save(tmp_path / "mine.html")


def test_certificates_are_audited_as_their_steps():
    steps = slide(10, share=0.8)
    audits = [referee.audit(steps), referee.audit(referee.certify_bodies(**step) for step in steps)]
    assert audits[0].findings == audits[1].findings
    assert audits[1].beside(3, most=1).endswith("and 5 velocities that are less far apart")


def test_data_frames_have_a_row_for_each_step_and_contact():
    pytest.importorskip("pandas")
    audit = referee.audit(slide(5))
    steps, contacts = audit.steps_to_pandas(), audit.contacts_to_pandas()
    assert len(steps) == len(contacts) == 5 and list(contacts["contact"].unique()) == ["box–world"]
    assert contacts["force_N"].iloc[0] == pytest.approx(2 * GRAVITY)
    assert steps["k"].dtype == np.int64


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: referee.audit(3), "recording is int; one dict for each step is needed, or the argument model"),
        (lambda: referee.audit({"qpos": []}), "recording is dict; one dict for each step is needed"),
        (lambda: referee.audit([BOX], every=0), "every is 0; a whole number from 1 is needed"),
        (lambda: referee.audit([], tolerance=0), "tolerance is 0; a positive number is needed"),
        (lambda: referee.audit([*slide(2), 3]), "step 2 of the recording: it is int; a dict with the arguments"),
        (lambda: referee.audit([{**slide(1)[0], "masses": [0.0]}]), "step 0 of the recording: masses has 0 kg"),
        (
            lambda: referee.audit([BOX]),
            "step 0 of the recording: velocities_after, forces must be given, as arguments of certify_bodies",
        ),
        (lambda: referee.audit([{}]), "step 0 of the recording: M, J, velocity_before, "),
        (
            lambda: referee.audit([{**slide(1)[0], "mu": 1}]),
            "step 0 of the recording: 'mu' is not an argument of certify_bodies",
        ),
        (lambda: referee.audit([{**slide(1)[0], 3: 1}]), "step 0 of the recording: 3 is not an argument"),
        *(
            (
                lambda time=time: referee.audit([{**slide(1)[0], "time": time}]),
                f"step 0 of the recording: time is {time}; a finite number is needed",
            )
            for time in (float("nan"), float("inf"))
        ),
        (lambda: referee.audit([{**slide(1)[0], "names": 3}]), "names is 3; a list of names is needed"),
        (lambda: referee.audit([{**slide(1)[0], "notes": 3}]), "notes is 3; a list of names is needed"),
        (
            lambda: referee.audit([{**slide(1)[0], "pairs": [[0], [0, 1]]}]),
            "step 0 of the recording: pairs has rows of different lengths; whole numbers (",
        ),
        (lambda: referee.audit(slide(1), velocity_names=3), "velocity_names is 3; a list of names is needed"),
        (lambda: referee.audit(slide(1), velocity_names="vx"), "velocity_names is 'vx'; a list of names is needed"),
        (lambda: referee.audit(slide(1), title=3), "title is 3; a string is needed"),
        (
            lambda: referee.audit(slide(1), velocity_names=["x"]),
            "velocity_names has 1 entries; step 0 has 6 velocities",
        ),
    ],
)
def test_what_is_wrong_is_named(call, said):
    with pytest.raises(tumble.TumbleError) as error:
        call()
    assert said in str(error.value) and "\n" not in str(error.value)


class TestMujoco:
    @pytest.fixture(autouse=True)
    def modules(self):
        self.mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
        self.tm = pytest.importorskip("tumble.mujoco")

    def stack(self, count, friction=0.5, option=""):
        cubes = "".join(CUBE.format(friction, place, 0.1 + 0.2 * place) for place in range(count))
        text = (
            f"<mujoco><option cone='elliptic' {option}/><worldbody>{FLOOR.format(friction)}{cubes}</worldbody></mujoco>"
        )
        model = self.mujoco.MjModel.from_xml_string(text)
        return model, self.mujoco.MjData(model)

    def recorded(self, model, data, count):
        states = []
        for _ in range(count):
            states.append(copy.copy(data))
            self.mujoco.mj_step(model, data)
        return states

    def test_a_soft_box_that_slides_to_rest_creeps_and_sinks(self):
        # On a slope, the deceleration is that of friction less 1 m/s².
        model, data = self.stack(1, option=f"gravity='1 0 {-GRAVITY}'")
        data.qvel[0] = 0.5
        states = self.recorded(model, data, 300)
        audit = referee.audit(states, model=model)
        found = {finding.kind: finding for finding in audit.findings}
        # It comes to rest after v / (μg - 1) = 0.128 s, step 64. From then on its slip is creep.
        assert 55 < found["creep"].first < 75 and found["creep"].row == "contact floor–box0"
        creep = np.linalg.norm(data.qpos[:2] - states[-1].qpos[:2]) / 0.002
        last = audit.contacts["k"] == 299
        assert creep > 1e-4 and audit.contacts["slip_m_s"][last].max() == pytest.approx(creep, rel=1e-3)
        deepest = max(-state.contact.dist.min(initial=0.0) for state in states[1:])
        assert found["penetration"].value == pytest.approx(deepest, rel=1e-3)
        assert audit.steps["exact_residual_m_s"].max() < 1e-9
        assert audit.velocity_names[:2] == ("b0 vx", "b0 vy") and "b0 wz" in audit.beside(found["creep"].worst)

    def test_states_as_arrays_have_the_same_audit(self):
        model, data = self.stack(2)
        states = self.recorded(model, data, 30)
        names = ("qpos", "qvel", "ctrl", "qacc_warmstart", "time")
        arrays = {name: np.array([getattr(state, name) for state in states]) for name in names}
        audits = [referee.audit(recording, model=model, every=2) for recording in (states, arrays)]
        assert len(audits[0].steps["k"]) == 15 and audits[0].notes == audits[1].notes == ()
        for name, values in audits[0].steps.items():
            np.testing.assert_array_equal(values, audits[1].steps[name], err_msg=name)
        # Velocities that are not those of mj_step are noted.
        arrays["qvel"][7, 0] += 0.1
        assert "differ from those of mj_step by up to 1.0e-01" in referee.audit(arrays, model=model).notes[0]

    def test_positions_that_no_step_made_are_noted(self):
        model, data = self.stack(1)
        states = self.recorded(model, data, 20)
        arrays = {name: np.array([getattr(state, name) for state in states]) for name in ("qpos", "qvel", "time")}
        arrays["qpos"][10:, 0] += 5.0
        assert "differ from those of mj_step by up to 2.5e+03" in referee.audit(arrays, model=model).notes[0]

    def test_an_overlap_that_springs_back_makes_energy(self):
        model, data = self.stack(1, option="timestep='0.001'")
        data.qpos[2] = 0.095
        states = self.recorded(model, data, 300)
        audit = referee.audit(states, model=model)
        assert "energy" in kinds(audit)
        # Its potential energy at rest is higher than at the start, by the height of the overlap.
        gained = 2 * GRAVITY * (data.qpos[2] - 0.095)
        assert gained > 0.08 and audit.steps["energy_J"].sum() == pytest.approx(gained, rel=0.02)

    def test_hard_steps_are_clean(self):
        model, data = self.stack(3)
        data.qvel[[0, 6, 12]] = 1.0
        audit = referee.audit(self.tm.hard_step(model, data, unsolved="raise") for _ in range(200))
        assert audit.is_clean and audit.steps["apart_m_s"].max() < 1e-9
        assert audit.contacts["force_N"].max() > 6 * GRAVITY / 4

    def test_wrong_recordings_are_named(self):
        model, data = self.stack(1)
        for recording, said in (
            ({"qpos": data.qpos[None]}, "recording lacks qvel"),
            ({"qpos": 3, "qvel": data.qvel[None]}, "recording['qpos'] has shape (); (K, 7) is needed"),
            (
                {"qpos": data.qpos[None], "qvel": data.qvel[None], "speed": 1},
                "recording has 'speed'; the names are time",
            ),
            ({"qpos": data.qpos[None], "qvel": data.qvel}, "recording['qvel'] has shape (6,); (1, 6) is needed"),
            (3, "recording is int; a list of mujoco.MjData, or a dict with qpos and qvel, is needed"),
            ([3], "data is int; a mujoco.MjData is needed"),
        ):
            with pytest.raises(tumble.TumbleError) as error:
                referee.audit(recording, model=model)
            assert said in str(error.value)
        with pytest.raises(tumble.TumbleError, match="model is int; a mujoco.MjModel is needed"):
            referee.audit([data], model=3)


def audited(tmp_path, *arguments):
    """The command ``tumble audit`` in the folder ``tmp_path``."""
    words = [sys.executable, "-m", "tumble", "audit", *arguments]
    return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8")


def test_the_command_judges_a_run_of_mujoco(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    # A box in the air meets all laws. On the floor, MuJoCo's friction creeps.
    for height, clean in ((1.0, True), (0.1, False)):
        bodies = FLOOR.format(0.5) + CUBE.format(0.5, 1, height)
        text = f"<mujoco><option cone='elliptic' gravity='1 0 -9.81'/><worldbody>{bodies}</worldbody></mujoco>"
        (tmp_path / "model.xml").write_text(text, encoding="utf-8")
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        qpos, qvel = [], []
        for _ in range(20):
            qpos.append(data.qpos.copy())
            qvel.append(data.qvel.copy())
            mujoco.mj_step(model, data)
        np.savez(tmp_path / "run.npz", qpos=qpos, qvel=qvel)
        done = audited(tmp_path, "run.npz", "--model", "model.xml", "--page", "audit.html")
        assert done.returncode == (0 if clean else 1), done.stderr
        assert ("all laws hold" in done.stdout) == clean
        assert (tmp_path / "audit.html").read_text(encoding="utf-8").startswith("<!doctype html>")


def test_the_command_judges_certificates_and_refuses_what_it_cannot_read(tmp_path):
    (tmp_path / "steps.jsonl").write_text('{"format": "step-certificate 1", "engine": "none"}\n', encoding="utf-8")
    assert audited(tmp_path, "steps.jsonl").returncode == 0
    for arguments, said in (
        (["run.npz"], "belong together"),
        (["none.jsonl"], "none.jsonl: "),
        (["none.npz", "--model", "none.xml"], "none.npz: "),
        (["steps.jsonl", "--page", "p.html"], "for runs of MuJoCo"),
    ):
        done = audited(tmp_path, *arguments)
        assert done.returncode == 2 and said in done.stderr, done.stderr
