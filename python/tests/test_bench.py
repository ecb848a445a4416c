"""Contact benchmark: tumble on its cases, verdicts, case files and the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tumble
import tumble.bench
from tumble.bench import _timed, all_cases, load_case, speed
from tumble.bench.__main__ import main
from tumble.bench._differences import derivative
from tumble.bench._formula import evaluate
from tumble.bench._measures import Measures
from tumble.bench._report import cell
from tumble.bench._solids import solid
from tumble.bench._verdict import RIGHT, WRONG, YIELDS, judged
from tumble.bench._worker import measure
from tumble.bench.engines import MODULES, Engine, Motion, engine, native
from tumble.bench.engines._program import boxes
from tumble.bench.speed import deepest_overlap

CASES = {case.name: case for case in all_cases()}
KNOWN_WRONG = {"falling-planks": "states of an island with an abrupt change have velocities of half a step before (37)"}
"""Cases in which tumble is wrong, and why."""


class Fake(Engine):
    """Engine that leaves all bodies where they are, or one whose contacts push them 0.1 mm away."""

    name, settings = "fake", ""

    def __init__(self, compliant: bool, moved: float = 0.0) -> None:
        self.compliant, self.moved = compliant, moved

    def version(self) -> str:
        return "0"

    def run(self, scene):
        states = np.repeat(scene.states[None], scene.steps + 1, axis=0)
        states[1:, :, 0] += self.moved
        return Motion(states, 0.0)


def outcome(found: Engine, name: str):
    case = CASES[name]
    facts = {"version": "", "settings": "", "compliant": found.compliant, "process_seconds": 0.0}
    return judged(found.name, case, {**facts, **measure(found, case)})


@pytest.mark.parametrize("name", sorted(CASES))
def test_tumble_is_right(name):
    found = outcome(engine("tumble"), name)
    assert found.verdict == (WRONG if name in KNOWN_WRONG else RIGHT), found
    assert not found.reason


def test_an_engine_that_does_not_move_is_flagged():
    for name in ("slide-to-rest", "rolling-down", "swap", "arch-falls", "grad-slide"):
        assert outcome(Fake(False), name).verdict == WRONG
    assert outcome(Fake(False), "stack").verdict == RIGHT


def test_an_allowance_is_for_compliant_contacts_alone():
    assert outcome(Fake(True, 1e-4), "heavy-on-light").verdict == YIELDS
    assert outcome(Fake(False, 1e-4), "heavy-on-light").verdict == WRONG
    assert outcome(Fake(True, 1.0), "heavy-on-light").verdict == WRONG
    assert cell(outcome(Fake(False, 1e-4), "heavy-on-light")) == "✗ 10"


def test_own_derivatives_equal_differences():
    found, case = engine("tumble"), CASES["grad-slide"]
    for gradient in case.gradients:
        own, method, _ = derivative(found, case, gradient)
        assert method == "own"
        found.sensitivities, restored = (lambda *_: None), found.sensitivities
        differences, method, _ = derivative(found, case, gradient)
        found.sensitivities = restored
        assert method == "differences"
        # The differences of the scheme's exact distances are of second order in the step of 1e-3.
        assert own == pytest.approx(differences, rel=1e-5)


def test_every_adapter_is_listed():
    files = {path.stem for path in (Path(tumble.bench.__file__).parent / "engines").glob("[a-z]*.py")}
    assert files == set(MODULES.values())
    assert len(CASES) >= 239


@pytest.mark.engines
@pytest.mark.parametrize("name", ["newton-kamino", "newton-xpbd", "pybullet", "rapier-python", "rapier-python-default"])
def test_adapters_of_installed_engines(name):
    try:
        found = engine(name)
    except ImportError:
        pytest.skip(f"{name} is not installed")
    # A box that comes to rest, and one that slides down a slope.
    for case in ("stop-slow", "ramp-40-slides"):
        assert outcome(found, case).verdict in (RIGHT, YIELDS), case


def test_cases_say_where_their_answers_come_from():
    for case in CASES.values():
        for quantity in case.quantities:
            assert len(quantity.source) > 5 and len(quantity.reason) > 5, case.name


def test_a_validation_problem_that_is_cited_exists(root):
    text = (root / "docs" / "validation.md").read_text()
    for case in CASES.values():
        for quantity in case.quantities:
            if "validation problem " in quantity.source:
                cited = quantity.source.partition("validation problem ")[2].split()[0].strip(",;")
                assert cited in text, (case.name, cited)


def test_solids():
    # A right triangle with a hypotenuse along no axis: moments from integration over 10⁶ points.
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.5]])
    made = solid("prism", (corners, 0.3), 2.0)
    u, v = np.random.default_rng(1).random((2, 1_000_000))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    points = np.stack([u - u.mean(), 0.5 * (v - v.mean())])
    area = np.cov(points, bias=True)
    exact = np.sort(2.0 * (np.linalg.eigvalsh(area) + 0.3**2 / 12))
    assert np.allclose(np.sort(np.delete(made.inertia, 1)), exact, rtol=5e-3)
    assert np.allclose(made.centre, [1 / 3, 0, 1 / 6])
    assert np.isclose(made.inertia[1], 2.0 * area.trace(), rtol=5e-3)
    # A capsule tends to a cylinder and to a ball.
    assert np.allclose(solid("capsule", (1.0, 1e-4), 3.0).inertia[0], 3.0 / 12, rtol=1e-3)
    assert np.allclose(solid("capsule", (1e-6, 0.2), 3.0).inertia, 0.4 * 3.0 * 0.04, rtol=1e-4)


def test_measures():
    case = CASES["slide-to-rest"]
    scene = case.scene()
    states = np.repeat(scene.states[None], 5, axis=0)
    states[:, 0, 0] = [0.0, 1.0, 0.5, 2.0, 1.5]
    names = Measures(scene, states).names()
    h = scene.time_step
    for formula, value in {
        "change(x('cube'))": 1.5,
        "rise(x('cube'))": 2.0,
        "peak(x('cube'), 2)": 2.0,
        f"at(x('cube'), {0.5 * h})": 0.5,
        f"rate(x('cube'), 0, {4 * h})": 1.5 / (4 * h),
        "largest(moved('c*'))": 2.0,
        "last(depth('cube'))": 0.0,
        "first(energy())": 0.5 * 2.0**2 + 9.81 * 0.1,
    }.items():
        assert evaluate(formula, names) == pytest.approx(value), formula


@pytest.mark.parametrize(
    "formula, said",
    [
        ("nowhere + 1", "nowhere is unknown"),
        ("__import__('os')", "the function __import__ is unknown"),
        ("(1).real", "is not allowed"),
        ("1 +", "has no value"),
        ("1/0", "has no value"),
        ("9**9**9**9", "has no value"),
        (None, "is not a formula"),
    ],
)
def test_formulas_that_are_refused(formula, said):
    with pytest.raises(tumble.TumbleError, match=said.replace("(", "\\(")):
        evaluate(formula, {})


GOOD = """
description = "A cube at rest."
group = "statics"
[scene]
time_step = 0.002
duration = 0.1
[[scene.bodies]]
name = "cube"
box = 0.2
mass = 1.0
position = [0, 0, 0.1]
[[answers]]
name = "motion"
unit = "m"
measured = "largest(moved('cube'))"
value = 0.0
tolerance = 1e-6
reason = "rounding"
source = "statics"
"""


@pytest.mark.parametrize(
    "old, new, said",
    [
        ('group = "statics"', 'group = "magic"', "group is 'magic'"),
        ("box = 0.2", "cube = 0.2", "unknown field cube"),
        ("box = 0.2", "", "has 0 shapes"),
        ("mass = 1.0", "", "has no mass"),
        ("mass = 1.0", "fixed = true", "no body that moves"),
        ("tolerance = 1e-6", "tolerance = 0", "a positive number is needed"),
        ("moved('cube')", "moved('ball')", "there is no body 'ball'"),
        ("largest(moved('cube'))", "moved('cube')", "a number is needed"),
        ('source = "statics"', "", "has no source"),
        ("duration = 0.1", "duration = 0", "is not 1 to"),
        ("name = \"cube\"", "name = [", "Invalid"),
    ],
)
def test_case_files_that_are_refused(tmp_path, old, new, said):
    path = tmp_path / "case.toml"
    path.write_text(GOOD)
    load_case(path)
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(tumble.TumbleError, match=said) as error:
        load_case(path)
    assert str(path) in str(error.value)


def bench(*arguments, cwd=None):
    command = [sys.executable, "-m", "tumble.bench", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def test_the_command_line(tmp_path):
    folder = tmp_path / "cases"
    folder.mkdir()
    (folder / "my-cube.toml").write_text(GOOD)
    command = ["--engines", "tumble", "--cases", "my-cube,incline-holds", "--folder", "cases", "--quiet"]
    done = bench(*command, "--out", "one", "--strict", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    again = bench(*command, "--out", "two", cwd=tmp_path)
    one, two = (json.loads((tmp_path / name / "bench.json").read_text()) for name in ("one", "two"))
    assert again.returncode == 0 and one["accuracy"] == two["accuracy"]
    assert one["accuracy"]["tumble"]["my-cube"]["verdict"] == RIGHT
    assert "| incline-holds | ✓ |" in (tmp_path / "one" / "bench.md").read_text()
    page = (tmp_path / "one" / "bench.html").read_text()
    assert "my-cube" in page and "http" not in page


def test_a_missing_engine_and_a_time_limit_are_lines(tmp_path):
    nowhere = f"pybullet={tmp_path / 'python'}"
    command = ["--engines", "tumble,pybullet", "--cases", "incline-holds", "--limit", "0.01"]
    done = bench(*command, "--python", nowhere, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "bench.json").read_text())
    assert found["accuracy"]["tumble"]["incline-holds"]["verdict"] == "time limit"
    assert "does not start" in found["engines"]["pybullet"]["missing"]
    assert "pybullet: not installed: " in done.stdout and "does not start" in done.stdout


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--engines", "nothing"], "there is no engine 'nothing'"),
        (["--cases", "nothing"], "there is no case 'nothing'"),
        (["--python", "tumble"], "ENGINE=PATH is needed"),
        (["--jobs", "0"], "positive numbers"),
        (["--folder", "/nowhere"], "/nowhere is not a folder"),
    ],
)
def test_errors_of_the_command_line(arguments, said, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("tumble.bench: ") and said in error


def test_lists(capsys):
    assert main(["--list", "--cases", "grad-*"]) == 0
    printed = capsys.readouterr().out
    assert "grad-swap" in printed and "mujoco" in printed and "incline-holds" not in printed


def test_the_section_on_speed_times_and_measures(tmp_path, capsys):
    options = ["--scenes", "one", "--seeds", "42", "--rounds", "2", "--engines", "tumble,tumble-1e-6,dart", "--out", str(tmp_path)]
    assert speed.main(options) == 0
    data = json.loads((tmp_path / "speed.json").read_text())
    seconds, figures = data["seconds"]["drop 42"], data["figures"]["drop 42"]
    for name in ("tumble", "tumble-1e-6"):
        assert len(seconds[name]) == 2 and min(seconds[name]) > 0.0
        assert figures[name]["not converged"] == 0 and figures[name]["deepest overlap, m"] < 1e-8
    assert figures["tumble"]["largest residual, m/s"] < 1e-9
    assert len((tmp_path / "rounds.jsonl").read_text().splitlines()) == 4
    assert "| drop 42 | tumble |" in (tmp_path / "speed.md").read_text()
    capsys.readouterr()
    assert speed.main(["--engines", "none"]) == 2
    assert "no engine 'none'" in capsys.readouterr().err


def test_tumble_is_timed_without_calls_from_python(monkeypatch):
    """MuJoCo's time is that of a loop in C, so steps from Python are not comparable."""
    monkeypatch.setattr(native, "LOOP", "")
    monkeypatch.setattr(tumble.Simulation, "step", None)
    timed = _timed.stacks(2)
    assert timed.before > 0
    assert 0.0 < engine("tumble").time(timed.scene, timed.before)
    assert 0 < engine("tumble").memory(timed.scene, timed.before)


def test_an_engine_that_fails_is_left_out(tmp_path):
    class Broken(Fake):
        name = "broken"

        def run(self, scene):
            raise RuntimeError("out of order")

    comparison = speed.Comparison([Broken(False), Fake(False)], tmp_path)
    scenes = [_timed.stack()]
    comparison.each(scenes, comparison.time)
    comparison.each(scenes, comparison.record)
    assert comparison.left_out == {"broken": "stack: out of order"}
    assert list(comparison.figures) == [("stack", "fake")]
    assert comparison.figures["stack", "fake"]["moved, m"] == 0.0


def test_overlaps_of_boxes():
    scene = _timed.stack().scene
    states = scene.states
    assert deepest_overlap(scene, states) < 1e-12
    # The upper cube of each pair sinks by 0.1 m more than the lower one.
    states[:, 2] -= 0.1 * np.arange(10)
    assert np.isclose(deepest_overlap(scene, states), 0.1)
    # A cube on its edge above a face: its half diagonal reaches down.
    states = scene.states
    states[9, 2], states[9, 3:7] = 9.0 + 0.5 * np.sqrt(2.0) - 0.2, [np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0, 0.0]
    assert np.isclose(deepest_overlap(scene, states), 0.2)


def test_scenes_of_the_rust_programs_are_those_of_the_section_on_speed(root):
    for timed in (_timed.stack(), _timed.pyramid(), _timed.wall(), _timed.pile()):
        data = json.loads((root / "bench" / "scenes" / f"{timed.name}.json").read_text())
        assert data["steps"] == timed.scene.steps and data["friction"] == timed.scene.friction
        # The last digit depends on the processor.
        for box, ours in zip(data["boxes"], boxes(timed.scene)["boxes"], strict=True):
            assert box.keys() == ours.keys()
            for field, value in box.items():
                np.testing.assert_allclose(value, ours[field], rtol=1e-14, atol=1e-15)
