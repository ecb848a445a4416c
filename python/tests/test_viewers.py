"""Runs in other viewers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tumble
from conftest import ROOT

SCENE = """
[ground]
friction = 0.5
[[bodies]]
box = 0.2
mass = 1.0
position = [0.0, 0.0, 0.1]
[[bodies]]
name = "arm"
capsule = { length = 0.4, radius = 0.1 }
mass = 1.0
position = [0.0, 1.0, 0.1]
attitude = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0]
[[fixed]]
name = "wall"
box = [0.1, 1.0, 1.0]
position = [2.0, 0.0, 0.5]
"""


@pytest.fixture
def run() -> tumble.Trajectory:
    return tumble.Scene.from_text(SCENE).run(50)


def extent(vertices: Any) -> list[float]:
    return list(np.round(vertices.max(axis=0) - vertices.min(axis=0), 2))


def test_surfaces_have_the_extents_of_their_shapes(run: tumble.Trajectory) -> None:
    bodies, fixed, names = run._recording.surfaces()
    assert names == ["wall"] and [len(meshes) for meshes in (*bodies, *fixed)] == [1, 1, 1]
    sizes: list[tuple[Any, list[float]]] = [
        (bodies[0], [0.2, 0.2, 0.2]),
        (bodies[1], [0.2, 0.2, 0.6]),
        (fixed[0], [0.1, 1.0, 1.0]),
    ]
    for meshes, size in sizes:
        vertices, triangles, colour = meshes[0]
        assert extent(vertices) == pytest.approx(size, abs=0.01)
        assert triangles.max() < len(vertices) and max(colour) < 256


@pytest.mark.viewers
def test_a_run_in_rerun_has_its_poses_and_residuals(
    run: tumble.Trajectory, tmp_path: Path
) -> None:
    rr = pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    import tumble.rerun

    recording = rr.RecordingStream("tumble-test")
    path = tmp_path / "run.rrd"
    recording.save(path)
    tumble.rerun.log(run, recording=recording)
    recording.flush()
    recording.disconnect()
    content = path.read_bytes()
    for name in (b"arm", b"wall", b"residual", b"contacts"):
        assert name in content, name


@pytest.mark.viewers
def test_a_run_in_viser_shows_its_states(run: tumble.Trajectory) -> None:
    viser = pytest.importorskip("viser", reason="viser is not installed")
    import tumble.viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        player = tumble.viser.show(run, server=server)
        player.set(20)
        frame = player._frames[1]
        np.testing.assert_allclose(frame.position, run.positions[20, 1])
        np.testing.assert_allclose(frame.wxyz, run.attitudes[20, 1])
        # The box rests on four corners, each with a quarter of the weight of a body.
        ends = player._arrows.points
        ends = ends[np.abs(ends[:, 0, 1]) < 0.2]
        length = 1.5 * run.scene.extents.mean() / 3.0
        np.testing.assert_allclose(ends[:, 1] - ends[:, 0], [[0.0, 0.0, length]] * 4, atol=1e-2 * length)
        assert player._arrows.visible
        player.set(50)
        assert not player._arrows.visible, "no step follows"
        player.set(0)
        player._is_playing.value = True
        deadline = 200
        while player._slider.value == 0 and deadline > 0:
            player._ended.wait(0.02)
            deadline -= 1
        assert player._slider.value > 0, "it plays"
        with pytest.raises(tumble.TumbleError, match="index"):
            player.set(51)
        player.stop()
    finally:
        server.stop()


@pytest.mark.viewers
@pytest.mark.parametrize("normal", [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, -1.0]])
def test_the_grid_of_viser_lies_in_the_ground(normal: list[float]) -> None:
    viser = pytest.importorskip("viser", reason="viser is not installed")
    import tumble.viser

    ground = f"[ground]\nfriction = 0.5\nnormal = {normal}\noffset = -1.0\n"
    run = tumble.Scene.from_text(SCENE.replace("[ground]\nfriction = 0.5\n", ground)).run(1, contacts=False)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    added: list[Any] = []
    add_grid = server.scene.add_grid
    server.scene.add_grid = lambda *arguments, **named: added.append(add_grid(*arguments, **named))
    try:
        tumble.viser.show(run, server=server).stop()
    finally:
        server.stop()
    grid = added[0]
    assert np.dot(normal, grid.position) == pytest.approx(-1.0)
    w, x, y, z = grid.wxyz
    image = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
    np.testing.assert_allclose(image, normal, atol=1e-12)


@pytest.mark.viewers
def test_the_code_of_the_document_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    pytest.importorskip("viser", reason="viser is not installed")
    text = (ROOT / "docs/howto/export.md").read_text()
    blocks = re.findall(r"^```py\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 2
    monkeypatch.chdir(tmp_path)
    names = {"tumble": tumble, "run": tumble.load(ROOT / "scenarios/door.toml").run(20)}
    for block in blocks:
        exec(block, names)
    assert (tmp_path / "door.rrd").stat().st_size > 0
