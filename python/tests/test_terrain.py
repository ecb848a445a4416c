"""Terrain from arrays."""

import numpy as np
import pytest
import tumble

GROUND = {"none": True, "friction": 0.5}


def field(x, y):
    """Heights with rows along y."""
    return 0.1 * np.sin(2 * x[None, :]) * np.cos(y[:, None])


def scene_on(heights, position=(0.0, 0.0, 1.0), **others):
    ball = {"name": "ball", "sphere": 0.1, "mass": 1.0, "position": list(position)}
    hills = {"name": "hills", "heights": heights, "spacing": [0.1, 0.2], **others}
    return tumble.Scene([ball], GROUND, terrain=[hills])


def test_an_array_and_its_rows_are_one_terrain():
    x, y = np.linspace(-2, 2, 41), np.linspace(-2, 2, 21)
    heights = field(x, y)
    scenes = [scene_on(h) for h in (heights, heights.tolist(), np.asfortranarray(heights))]
    runs = [scene.run(200) for scene in scenes]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.states, runs[0].states)
    # Rows are along y, and the middle is at the origin.
    for row, column in [(0, 0), (3, 30), (20, 40)]:
        hit = scenes[0].cast_ray([x[column], y[row], 5], [0, 0, -1])
        assert hit.owner == "hills"
        assert hit.point[2] == pytest.approx(heights[row, column], abs=1e-12)


def test_a_ball_rests_in_a_hollow():
    at = np.linspace(-2, 2, 41)
    bowl = 0.2 * (at[None, :] ** 2 + (0.5 * at[:21, None] + 1.0) ** 2)
    run = scene_on(bowl, (0.0, 0.0, 1.5)).run(600)
    assert run.residuals.max() < 1e-9


def test_faults_are_sentences():
    heights = np.zeros((3, 3))
    heights[1, 2] = np.nan
    with pytest.raises(tumble.TumbleError, match="row 2, column 3 is NaN; finite numbers"):
        scene_on(heights)
    with pytest.raises(tumble.TumbleError, match="2 × 2 or more"):
        scene_on(np.zeros((1, 5)))
