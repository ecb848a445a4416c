"""Rays, distances and overlaps of scenes and simulations."""

import numpy as np
import pytest
import tumble

GROUND = {"friction": 0.5}


def room():
    """A cube of 1 m and a ball on the ground, and a fixed object of two walls."""
    walls = {
        "name": "walls",
        "pieces": [
            {"box": [0.2, 4, 2], "position": [5, 0, 1]},
            {"box": [0.2, 4, 2], "position": [-5, 0, 1]},
        ],
    }
    bodies = [
        {"name": "cube", "box": 1.0, "mass": 1.0, "position": [2, 0, 0.5]},
        {"name": "ball", "sphere": 0.5, "mass": 1.0, "position": [0, 2, 0.5]},
    ]
    return tumble.Scene(bodies, GROUND, fixed=[walls])


def test_a_ray_hits_what_it_meets_first():
    scene = room()
    hit = scene.cast_ray([0, 0, 0.5], [3, 0, 0])
    assert (hit.owner, hit.inside) == ("cube", False)
    assert hit.distance == pytest.approx(1.5, abs=1e-15)
    np.testing.assert_allclose(hit.point, [1.5, 0, 0.5], atol=1e-15)
    np.testing.assert_array_equal(hit.normal, [-1, 0, 0])
    assert scene.cast_ray([0, 0, 0.5], [1, 0, 0], max_distance=1.4) is None
    assert scene.cast_ray([0, 0, 0.5], [1, 0, 0], ignore=["cube"]).owner == "walls"
    assert scene.cast_ray([0, 0, 0.5], [1, 0, 0], ignore=["cube", "walls"]) is None
    assert scene.cast_ray([0, 0, 0.5], [0, 0, -1]).owner == "ground"
    owners = [hit.owner for hit in scene.cast_ray_all([0, 0, 0.5], [1, 0, -1e-6])]
    assert owners == ["cube", "walls", "ground"]
    # Both walls are one object.
    crossing = scene.cast_ray_all([-7, -1, 0.5], [1, 0, 0])
    assert [(hit.owner, hit.distance) for hit in crossing] == [("walls", pytest.approx(1.9, abs=1e-14))]
    inside = scene.cast_ray([2, 0, 0.5], [1, 0, 0])
    assert inside.inside and inside.distance == 0 and inside.owner == "cube"


def test_many_rays_are_those_of_single_calls():
    scene = room()
    draw = np.random.default_rng(1)
    origins, directions = draw.uniform(-3, 3, (200, 3)), draw.normal(size=(200, 3))
    origins[:, 2] += 4
    hits = scene.cast_rays(origins, directions)
    assert hits.distances.shape == hits.inside.shape == (200,)
    assert hits.points.shape == hits.normals.shape == (200, 3)
    assert len(set(hits.owners)) >= 4
    for ray in range(200):
        hit = scene.cast_ray(origins[ray], directions[ray])
        if hit is None:
            assert hits.owners[ray] is None and np.isinf(hits.distances[ray])
            assert np.isnan(hits.points[ray]).all() and np.isnan(hits.normals[ray]).all()
            continue
        assert (hit.owner, hit.distance) == (hits.owners[ray], hits.distances[ray])
        unit = directions[ray] / np.linalg.norm(directions[ray])
        np.testing.assert_allclose(hit.point, origins[ray] + unit * hit.distance, atol=1e-14)
    same = scene.cast_rays([0, 0, 4], directions)
    assert same.owners[7] == getattr(scene.cast_ray([0, 0, 4], directions[7]), "owner", None)
    assert scene.cast_rays(np.zeros((0, 3)), np.zeros((0, 3))).owners == ()


def test_distances_have_points_and_signs():
    scene = room()
    gap = scene.distance("cube", "walls")
    assert gap.distance == pytest.approx(2.4, abs=1e-14)
    np.testing.assert_allclose(gap.points[1] - gap.points[0], gap.normal * gap.distance, atol=1e-14)
    np.testing.assert_allclose(gap.normal, [1, 0, 0], atol=1e-15)
    assert scene.distance("ball", "ground").distance == pytest.approx(0, abs=1e-15)
    low = scene.states
    simulation = scene.simulate()
    for _ in range(5):
        simulation.step([[0, 0, 30, 0, 0, 0], [0, 0, 30, 0, 0, 0]])
    rise = simulation.states[1, 2] - low[1, 2]
    assert rise > 1e-4
    assert simulation.distance("ball", "ground").distance == pytest.approx(rise, abs=1e-15)
    pairs = simulation.pairs_within(1.0)
    assert [(pair.body, pair.partner) for pair in pairs] == [("cube", "ground"), ("ball", "ground")]
    assert pairs[1].distance == pytest.approx(rise, abs=1e-15)


def test_regions_find_objects_by_name():
    scene = room()
    found = scene.overlaps({"sphere": 0.2, "position": [2, 0, 1.1]})
    assert list(found) == ["cube"] and found["cube"] == pytest.approx(-0.1, abs=1e-14)
    wide = {"box": [20, 20, 0.5], "position": [0, 0, 0.2]}
    assert sorted(scene.overlaps(wide)) == ["ball", "cube", "ground", "walls"]
    assert sorted(scene.overlaps(wide, ignore=["ground", "walls"])) == ["ball", "cube"]
    far = {"sphere": 0.1, "position": [0, 2, 2]}
    assert scene.overlaps(far) == {}
    assert scene.overlaps(far, within=1.0) == {"ball": pytest.approx(0.9, abs=1e-14)}


def test_excluded_pairs_are_left_out_unless_wanted():
    bodies = [
        {"name": name, "sphere": 0.1, "mass": 1.0, "position": [x, 0, 0.1]}
        for name, x in (("a", 0), ("b", 0.15))
    ]
    scene = tumble.Scene(bodies, GROUND, apart=[{"between": ["a", "b"]}])
    assert [pair.partner for pair in scene.pairs_within(0)] == ["ground", "ground"]
    pairs = scene.pairs_within(0, excluded=True)
    assert ("a", "b") in [(pair.body, pair.partner) for pair in pairs]
    assert scene.distance("a", "b").distance == pytest.approx(-0.05, abs=1e-15)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda scene: scene.cast_ray([0, 0, 0], [0, 0, 0]), "direction of the ray is 0.0"),
        (lambda scene: scene.cast_ray([0, 0], [0, 0, 1]), r"origin has shape \(2,\)"),
        (lambda scene: scene.cast_ray([0, np.nan, 0], [0, 0, 1]), r"origin\[1\] is nan"),
        (lambda scene: scene.cast_ray([0, 0, 0], [0, 0, 1], max_distance=-1), "length of the ray"),
        (lambda scene: scene.cast_ray([0, 0, 0], [0, 0, 1], max_distance="x"), "max_distance is 'x'"),
        (lambda scene: scene.cast_ray([0, 0, 0], [0, 0, 1], ignore="cube"), "a list of names"),
        (lambda scene: scene.cast_ray([0, 0, 0], [0, 0, 1], ignore=["cub"]), '"cub" is unknown'),
        (lambda scene: scene.cast_rays([[0, 0, 0]] * 2, [[1, 0, 0], [0, 0, 0]]), "ray 1: direction"),
        (lambda scene: scene.cast_rays([[0, 0], [0]], [[1, 0, 0]]), "origins"),
        (lambda scene: scene.cast_rays([[0, 0, 0]] * 2, [[1, 0, 0]]), r"origins has shape \(2, 3\)"),
        (lambda scene: scene.distance("cube", "cube"), "both objects are the same"),
        (lambda scene: scene.distance("cube", "box"), '"box" is unknown'),
        (lambda scene: scene.distance("cube", 3), "3 is not a name"),
        (lambda scene: scene.overlaps({"position": [0, 0, 0]}), "one shape is needed"),
        (lambda scene: scene.overlaps({"sphere": -1}), "sphere"),
        (lambda scene: scene.overlaps([1]), "a dictionary is needed"),
        (lambda scene: scene.overlaps({"sphere": 1.0}, within=-1), "distance"),
        (lambda scene: scene.overlaps({"sphere": 1.0}, within=None), "within is None"),
        (lambda scene: scene.pairs_within(-1), "distance"),
        (lambda scene: scene.pairs_within(float("nan")), "distance"),
    ],
)
def test_wrong_input_is_refused(call, message):
    for one in (room(), room().simulate()):
        with pytest.raises(tumble.TumbleError, match=message):
            call(one)
