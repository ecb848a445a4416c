"""Fits recover hidden constants and refuse invalid recordings."""

import gzip
import sys

import numpy as np
import pytest
import tumble

pytest.importorskip("scipy")
pytest.importorskip("matplotlib")
import tumble.fit  # noqa: E402
from tumble.fit._recordings import turn_between  # noqa: E402
from tumble.fit._simulations import Simulations, parameter  # noqa: E402

RATE = 100.0
SUBSTEPS = 4
CUBE = {"name": "cube", "box": 0.1, "mass": 0.4, "inertia": 7e-4, "position": [0, 0, 0.1]}
FREE = {"none": True, "friction": 0.5}


def recorded(scene, starts, frames, parameters=None, begin=0.0):
    """Recordings of ``scene`` with other constants, simulated from ``starts`` (B, N, 13)."""
    step = 1 / (RATE * SUBSTEPS)
    text, path, settings = scene._source
    index = round(begin / step)
    timed = tumble.Scene.from_text(text, path, **{**settings, "time_step": step, "start_index": index})
    count = len(starts)
    constants = {name: np.repeat(value, count, axis=0) for name, value in (parameters or {}).items()}
    runs = tumble.rollout(timed, starts, steps=(frames - 1) * SUBSTEPS, parameters=constants)
    states = np.concatenate([starts[:, None], runs.states[:, SUBSTEPS - 1 :: SUBSTEPS]], axis=1)
    return [tumble.fit.Recording(f"{k}", RATE, of, begin) for k, of in enumerate(states)]


def cube():
    # Every state of a run starts the rest of it with the same bits.
    return tumble.Scene([CUBE], {"friction": 0.4}, integrator="euler")


def thrown(count, seed=5):
    """Random starts slightly above the ground, for which the protocol uses the recorded velocities.
    """
    draws = np.random.default_rng(seed)
    states = np.zeros((count, 1, 13))
    states[:, 0, 2] = 0.0925
    quaternions = draws.normal(size=(count, 4))
    states[:, 0, 3:7] = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    states[:, 0, 7:10] = [1.0, 0.0, -0.8] + draws.uniform(-0.4, 0.4, (count, 3)) * [1, 1, 0]
    states[:, 0, 10:] = draws.uniform(-5, 5, (count, 3))
    return states


def tosses(count=8, frames=25, friction=0.27, restitution=0.2):
    hidden = {"friction": np.array([friction]), "restitution": np.array([restitution])}
    return recorded(cube(), thrown(count), frames, hidden)


def pendulum():
    """Two rods of 0.4 m on hinges about y. A growing force acts on the second one."""
    def rod(name, mass, x, **more):
        inertia = [1e-3 * mass, 0.014 * mass, 0.014 * mass]
        return {"name": name, "box": [0.4, 0.04, 0.04], "mass": mass, "inertia": inertia, "position": [x, 0, 1], **more}

    force = [[0.0, 0.0, 0.0, 0.0], [1.0, 2.0, 0.0, 0.0]]
    bodies = [rod("upper", 1.0, 0.2), rod("lower", 0.5, 0.6, load={"force": force})]
    hinge = {"type": "revolute", "axis": [0, 1, 0]}
    joints = [
        {**hinge, "name": "shoulder", "bodies": ["upper"], "anchor": [0, 0, 1], "damping": 0.02},
        {**hinge, "name": "elbow", "bodies": ["lower", "upper"], "anchor": [0.4, 0, 1], "damping": 0.01},
    ]
    return tumble.Scene(bodies, FREE, joints=joints, integrator="euler")


def hung(angles):
    """States of the resting rods at the given angles from the vertical: (1, 2, 13)."""
    states, anchor = np.zeros((1, 2, 13)), np.array([0.0, 0, 1])
    for k, angle in enumerate(angles):
        turn = np.pi / 2 - angle
        along = np.array([np.cos(turn), 0, -np.sin(turn)])
        states[0, k, :7] = [*(anchor + 0.2 * along), np.cos(turn / 2), 0, np.sin(turn / 2), 0]
        anchor = anchor + 0.4 * along
    return states


HIDDEN = {"joint_damping:shoulder": 0.05, "joint_damping:elbow": 0.03, "mass:lower": 0.65, "inertia:upper, yy": 0.017}
WIDE = {"inertia:upper, yy": (0.008, 0.03)}


def swings(noise=0.0, scene=None):
    scene = scene or pendulum()
    inertia = scene.inertias[None].copy()
    inertia[0, 0, 1, 1] = 0.017
    hidden = {"joint_damping": np.array([[0.05, 0.03]]), "mass": np.array([[1.0, 0.65]]), "inertia": inertia}
    draws = np.random.default_rng(2)
    found = []
    for begin, angles in ((0.1, [1.2, 0.4]), (0.5, [-0.9, 0.6]), (0.2, [0.5, -1.4])):
        (of,) = recorded(scene, hung(angles), 40, hidden, begin)
        states = of.states.copy()
        states[1:, :, :3] += noise * draws.uniform(-1, 1, states[1:, :, :3].shape)
        found.append(tumble.fit.Recording(f"{begin}", RATE, states, begin))
    return found


def test_tosses_give_their_constants_back():
    # Ten frames contain only the first impacts. Later impacts make the loss discontinuous.
    recordings = tosses(6, 10)
    found = tumble.fit.fit(cube(), recordings, loss="squares", substeps=SUBSTEPS, evaluations=120, polish=40)
    assert found.values == pytest.approx({"friction": 0.27, "restitution": 0.2}, abs=1e-7)
    assert found.errors.failed == 0 and found.errors.position.max() < 1e-6
    assert found.errors.loss.mean() < 1e-12 < found.errors_at_start.loss.mean()
    assert list(found.progress) == sorted(found.progress, reverse=True)
    # The result can be used in rollouts directly.
    again = recorded(cube(), thrown(6), 10, found.constants)
    assert np.abs(again[1].states - recordings[1].states).max() < 1e-5


def test_a_pendulum_gives_its_constants_back():
    how = {"bounds": WIDE, "loss": "squares", "substeps": SUBSTEPS, "evaluations": 40, "polish": 40}
    found = tumble.fit.fit(pendulum(), swings(), list(HIDDEN), **how)
    assert found.values == pytest.approx(HIDDEN, rel=1e-6)
    # Noise of 1 mm leaves a relative error below 3 % with 120 frames.
    noisy = tumble.fit.fit(pendulum(), swings(1e-3), list(HIDDEN), **how)
    assert noisy.values == pytest.approx(HIDDEN, rel=0.03) and noisy.values != pytest.approx(HIDDEN, rel=1e-5)


def test_a_sliding_stack_gives_both_frictions_back():
    boxes = [
        {"name": name, "box": [0.2, 0.2, 0.1], "mass": 0.5, "position": [0, 0, z], "velocity": [speed, 0, 0]}
        for name, z, speed in (("low", 0.05, 1.0), ("high", 0.15, 1.3))
    ]
    pairs = [{"between": ["low", "ground"], "coefficient": 0.3}, {"between": ["high", "low"], "coefficient": 0.3}]
    scene = tumble.Scene(boxes, {"friction": 0.5}, friction=pairs)
    starts = np.repeat(scene.states[None], 2, axis=0)
    starts[1, :, 7] += 0.3
    hidden = {"pair_friction:low and the ground": 0.2, "pair_friction:low and high": 0.4}
    slides = recorded(scene, starts, 40, {"pair_friction": np.array([list(hidden.values())])})
    found = tumble.fit.fit(scene, slides, list(hidden), loss="squares", substeps=SUBSTEPS, evaluations=48, polish=30)
    assert found.values == pytest.approx(hidden, abs=1e-6)


@pytest.mark.parametrize("loss", ["robust", "mean", "squares"])
def test_derivatives_are_those_of_differences(loss):
    names = ["friction", "restitution", "size", "radius", "inertia", "gravity", "ground"]
    at = np.array([0.3, 0.1, 0.98, 0.004, 1.1, 9.7, 1e-4])
    for scene, recordings, named, value, begin in (
        (cube(), tosses(3, 12), names, at, "touch"),
        (pendulum(), swings(), list(HIDDEN), 1.1 * np.array(list(HIDDEN.values())), "first"),
    ):
        of = [parameter(name, scene) for name in named]
        simulations = Simulations(scene, recordings, of, begin, SUBSTEPS, loss, None)
        places = range(len(recordings))
        losses, slopes = simulations.gradient(value, places)
        np.testing.assert_array_equal(losses, simulations.losses_or_worst(value[None], places)[0])
        steps = np.diag(1e-6 * np.maximum(np.abs(value), 0.01))
        up, down = (simulations.losses_or_worst(value + sign * steps, places).mean(axis=1) for sign in (1, -1))
        # Rounding of the losses divided by the step.
        np.testing.assert_allclose(slopes, (up - down) / (2 * np.diag(steps)), rtol=1e-5, atol=1e-6)


def test_the_same_seed_gives_the_same_numbers_within_the_bounds():
    how = {"bounds": {"friction": (0.3, 0.5)}, "substeps": 2, "evaluations": 48, "polish": 4}
    first, again, other = (
        tumble.fit.fit(cube(), tosses(6), seed=seed, threads=threads, folds=2, **how)
        for seed, threads in ((1, 1), (1, 2), (2, 2))
    )
    assert str(first) == str(again) and first.values == again.values and first.folds[0].kept == again.folds[0].kept
    assert first.values != other.values
    assert 0.3 <= first.values["friction"] <= 0.5 and 0 <= first.values["restitution"] <= 0.6
    assert sorted(place for fold in first.folds for place in fold.kept) == list(range(6))
    low, high = first.intervals["friction"]
    assert 0.3 <= low <= high <= 0.5


def test_values_are_scored_and_drawn(tmp_path):
    recordings = tosses(4)
    scored = tumble.fit.fit(cube(), recordings, [], values={"friction": 0.27, "restitution": 0.2}, substeps=SUBSTEPS)
    # The solver's errors of 1e-13 m/s, which impacts amplify.
    assert scored.errors.position.max() < 1e-10 and scored.errors.rotation.max() < 1e-6
    off = tumble.fit.fit(cube(), recordings, [], substeps=SUBSTEPS)
    assert off.errors.position.mean() > 0.01 and off.errors.end.max() > 1
    off.plot(tmp_path / "fit.svg")
    assert "errors of the recordings" in (tmp_path / "fit.svg").read_text()


def test_copies_of_a_recording_are_kept_back_together():
    recordings = tosses(5)
    moved = recordings[0].states + np.array([0.5, -0.2, *[0.0] * 11])
    recordings.append(tumble.fit.Recording("copy", RATE, moved))
    found = tumble.fit.fit(cube(), recordings, ["friction"], substeps=1, evaluations=16, polish=0, folds=2)
    assert any({0, 5} <= set(fold.kept) for fold in found.folds)


def test_a_toss_starts_by_the_protocol():
    # Free flight from a height without noise. The refit is exact except for the vertical speed of
    # the previous frame.
    start = thrown(1)
    start[0, 0, 2] = 0.3
    (toss,) = recorded(cube(), start, 25)
    simulations = Simulations(cube(), [toss], [], "touch", SUBSTEPS, "robust", None)
    frame, (state,) = simulations.starts[0]
    assert toss.states[frame + 3, 0, 2] <= 0.05 * np.sqrt(3) < toss.states[frame + 2, 0, 2] and frame >= 4
    np.testing.assert_allclose(state[:9], toss.states[frame, 0, :9], atol=1e-12)
    # The slope of a sampled parabola is off by half a time step of gravity.
    np.testing.assert_allclose(state[9], toss.states[frame - 1, 0, 9], atol=0.5 * 9.81 / (RATE * SUBSTEPS) + 1e-12)
    # A step rotates the body by its spin to second order in the angle of 0.015.
    np.testing.assert_allclose(state[10:], toss.states[frame, 0, 10:], rtol=1e-4)


def test_a_start_that_does_not_fit_is_brought_together():
    scene, (swing, *_) = pendulum(), swings()
    states = swing.states.copy()
    states[0, 1, 2] += 1e-3
    apart = tumble.fit.Recording("apart", RATE, states, swing.begin)
    values = {**HIDDEN}
    scored = tumble.fit.fit(scene, [apart], [], values=values, substeps=SUBSTEPS)
    assert 1e-5 < scored.errors.position[0] < 1e-2 and scored.errors.failed == 0


def table(recordings, bodies=("cube",)):
    header = ["toss_id", "time_s", "body", *tumble.STATE_COLUMNS]
    lines = [",".join(header)]
    for of in recordings:
        for frame, states in enumerate(of.states):
            for body, state in zip(bodies, states):
                numbers = [repr(float(x)) for x in state]
                lines.append(",".join([of.name, f"{of.begin + frame / of.rate:.8f}", body, *numbers]))
    return "\n".join(lines) + "\n"


def test_tables_are_read(tmp_path):
    recordings = tosses(3)
    (tmp_path / "plain.csv").write_text(table(recordings[:2]))
    with gzip.open(tmp_path / "more.csv.gz", "wt") as stream:
        stream.write(table(recordings[2:]))
    read = sorted(tumble.fit.read(tmp_path, cube()), key=lambda of: of.name)
    for of, expected in zip(read, recordings):
        assert of.name == expected.name and of.rate == RATE
        np.testing.assert_allclose(of.states, expected.states, atol=1e-15)
    # Bodies in any order, and the table of a run.
    scene, (swing, *_) = pendulum(), swings()
    lines = table([swing], ("upper", "lower")).splitlines()
    lines[1], lines[2] = lines[2], lines[1]
    (tmp_path / "swing.csv").write_text("\n".join(lines))
    (of,) = tumble.fit.read(tmp_path / "swing.csv", scene)
    np.testing.assert_allclose(of.states, swing.states, atol=1e-15)
    assert of.begin == pytest.approx(0.1)
    scene.run(20).to_csv(tmp_path / "run")
    (of,) = tumble.fit.read(tmp_path / "run" / "states.csv", scene)
    assert of.name == "states" and of.states.shape == (21, 2, 13) and of.rate == 500


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda text: text.replace("qw", "q0"), "no column qw"),
        (lambda text: text.replace("0,0.01000000", "0,0.01500000"), "frame 1 is at time_s = 0.015; equal intervals"),
        (lambda text: text.replace("0,0.01000000", "0,nan"), "equal intervals"),
        (lambda text: text.replace("0,0.01000000", "0,soon"), "a field of its table is not a number"),
        (lambda text: "\n".join(text.splitlines()[:5]), "it has 4 rows; 5 frames or more"),
        (lambda text: text.splitlines()[0], "the table has no rows"),
        (lambda text: text + text.splitlines()[1] + "\n", "the rows of a recording are not contiguous"),
        (lambda text: text + "1,2\n", "got 2 columns instead of 16"),
    ],
)
def test_tables_that_are_none_are_refused(change, why, tmp_path):
    (tmp_path / "broken.csv").write_text(change(table(tosses(2))))
    with pytest.raises(tumble.TumbleError, match="broken.csv: ") as refused:
        tumble.fit.read(tmp_path / "broken.csv", cube())
    assert why in str(refused.value) and "\n" not in str(refused.value)


def test_bodies_and_files_that_are_not_there_are_refused(tmp_path):
    (tmp_path / "swing.csv").write_text(table(swings()[:1], ("upper", "other")))
    with pytest.raises(tumble.TumbleError, match="frame 0 does not have each of upper, lower once"):
        tumble.fit.read(tmp_path / "swing.csv", pendulum())
    with pytest.raises(tumble.TumbleError, match="there is no recording"):
        tumble.fit.read(tmp_path / "other", cube())
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(table(tosses(1)))
    (tmp_path / "swing.csv").unlink()
    with pytest.raises(tumble.TumbleError, match="recording 0 is also in another file"):
        tumble.fit.read(tmp_path, cube())


def test_tensors_are_read_by_torch(tmp_path, monkeypatch):
    (toss,) = tosses(1)
    rows = toss.states[:, 0, [3, 4, 5, 6, 0, 1, 2, 10, 11, 12, 7, 8, 9]]

    class Tensor:
        def double(self):
            return self

        def numpy(self):
            return rows

    class Torch:
        @staticmethod
        def load(file, weights_only):
            assert weights_only and file.name == "7.pt"
            return Tensor()

    (tmp_path / "7.pt").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "torch", Torch)
    (of,) = tumble.fit.read(tmp_path / "7.pt", cube(), rate=RATE)
    assert of.name == "7"
    np.testing.assert_allclose(of.states, toss.states, atol=1e-15)
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(tumble.TumbleError, match="tensors need torch, which is not installed"):
        tumble.fit.read(tmp_path / "7.pt", cube())


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda of: of[:4], "it has 4 frames; 5 or more"),
        (lambda of: of[..., :12], "has shape"),
        (lambda of: np.where(np.arange(13) == 2, np.nan, of), "finite numbers are needed"),
        (lambda of: of * np.where(np.arange(13) == 3, 1.5, 1.0), "has length"),
        (lambda of: of * np.where(np.arange(13) >= 7, 1000.0, 1.0), "velocities do not match its positions"),
        (lambda of: of * np.where(np.arange(13) >= 10, 57.3, 1.0), "spins do not match its attitudes"),
    ],
)
def test_states_that_cannot_be_are_refused(make, why):
    with pytest.raises(tumble.TumbleError, match="recording odd") as refused:
        tumble.fit.Recording("odd", RATE, make(tosses(1)[0].states))
    assert why in str(refused.value)


def test_a_rate_that_cannot_be_is_refused():
    with pytest.raises(tumble.TumbleError, match="its rate is 0.5 frames per second"):
        tumble.fit.Recording("odd", 0.5, tosses(1)[0].states)


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"parameters": ["slip"]}, "'slip' is not a parameter; use friction"),
        ({"parameters": ["time_step"]}, "'time_step' is not a parameter"),
        ({"parameters": ["joint_damping"]}, "the scene has no joint_damping to fit"),
        ({"parameters": ["mass:ball"]}, "mass:ball: one of cube is needed"),
        ({"parameters": ["inertia", "inertia:cube, xx"], "bounds": {"inertia:cube, xx": (1e-4, 1e-3)}}, "as a whole and by one"),
        ({"parameters": ["inertia:cube, xx"]}, "is 0.0007 in the scene; bounds are needed for it"),
        ({"parameters": ["friction", "friction"]}, "twice"),
        ({"bounds": {"radius": (0, 0.01)}}, "bounds has radius"),
        ({"bounds": {"friction": (0.5, 0.9)}}, "friction starts at 0.4"),
        ({"values": {"friction": float("nan")}}, "friction starts at nan"),
        ({"loss": "least"}, "loss is 'least'"),
        ({"begin": "last"}, "begin is 'last'"),
        ({"substeps": 0}, "substeps is 0"),
        ({"folds": 5}, "folds is 5 with 8 different recordings"),
    ],
)
def test_fits_that_cannot_be_are_refused(how, why):
    with pytest.raises(tumble.TumbleError) as refused:
        tumble.fit.fit(cube(), tosses(), **how)
    assert why in str(refused.value) and "\n" not in str(refused.value)


def test_recordings_of_another_scene_are_refused():
    with pytest.raises(tumble.TumbleError, match="recordings is empty"):
        tumble.fit.fit(cube(), [])
    with pytest.raises(tumble.TumbleError, match="recording 0.1 has 2 bodies; 1 are needed"):
        tumble.fit.fit(cube(), swings())
    with pytest.raises(tumble.TumbleError, match="begin is 'touch' without a single free body"):
        tumble.fit.fit(pendulum(), swings(), begin="touch")
    high = thrown(1)
    high[..., 2] = 3.0
    with pytest.raises(tumble.TumbleError, match="the lowest height of the centre is"):
        tumble.fit.fit(cube(), recorded(cube(), high, 10))


def test_turns_are_the_shorter_way():
    first = np.array([0.8, 0.6, 0.0, 0.0])
    half = np.array([np.cos(0.2), 0, 0, np.sin(0.2)])
    second = np.array([0.8 * half[0], 0.6 * half[0], -0.6 * half[3], 0.8 * half[3]])
    for sign in (1, -1):
        np.testing.assert_allclose(turn_between(first, sign * second), [0, 0, 0.4], atol=1e-15)
    assert not turn_between(first, first).any()
