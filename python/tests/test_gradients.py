"""Derivatives of steps compared with finite differences, and derivatives of runs compared with
those steps."""

import numpy as np
import pytest
import tumble


def sliding(friction=0.3):
    box = {"box": 0.2, "mass": 2.0, "position": [0, 0, 0.1], "velocity": [1, 0.2, 0]}
    return tumble.Scene(bodies=[box], ground={"friction": friction}, integrator="euler")


def test_a_slide_in_closed_form():
    scene = sliding()
    found = scene.jacobian(by=["friction", "mass"])
    along = np.array([1, 0.2, 0]) / np.hypot(1, 0.2)
    h, g = scene.time_step, 9.81
    # v+ = v - mu g h along, and r+ = r + h v+.
    assert np.allclose(found["friction"][0, 6:9], -g * h * along, rtol=1e-9, atol=1e-12)
    assert np.allclose(found["friction"][0, :3], -g * h * h * along, rtol=1e-9, atol=1e-14)
    assert np.abs(found["mass"]).max() < 1e-12
    # A push acts as without ground along the slide. It changes the friction only through its
    # direction.
    by_push = found["wrenches"][0, 6:9, 0, :3] @ along
    assert np.allclose(by_push, h / 2.0 * along, rtol=1e-6, atol=1e-12)
    assert found.margin > 0 and found.unsolved == found.unknown == found.kept == 0
    assert found.ends.shape == (1, 13)


def test_the_jacobian_by_velocity_is_that_of_differences():
    scene = sliding()
    found = scene.jacobian()
    slope = np.zeros((3, 3))
    for k in range(3):
        ends = []
        for by in (1e-5, -1e-5):
            states = scene.states.copy()
            states[0, 7 + k] += by
            simulation = scene.simulate(states)
            simulation.step()
            ends.append(simulation.states.copy())
        slope[:, k] = (ends[0] - ends[1])[0, 7:10] / 2e-5
    assert np.allclose(found["states"][0, 6:9, 0, 6:9], slope, atol=2e-6)
    # A faster fall is stopped too, and the larger normal force slows the slide.
    along = np.array([1, 0.2]) / np.hypot(1, 0.2)
    assert abs(slope[2, 2]) < 1e-6 and np.allclose(slope[:2, 2], 0.3 * along, atol=2e-6)


def test_a_run_backwards_is_that_of_its_steps():
    scene, steps = sliding(), 40
    cotangents = np.zeros((1, 12))
    cotangents[0, 0] = 1.0
    controls = np.zeros((steps, 1, 6))
    controls[:, 0, 0] = 0.5
    found = scene.vjp(cotangents, controls=controls, by=["friction"])
    simulation, states = scene.simulate(), scene.states
    forwards = np.zeros((12, 1))
    for k in range(steps):
        step = scene.jacobian(states, controls[k], by=["friction"])
        forwards = step["states"].reshape(12, 12) @ forwards + step["friction"].reshape(12, 1)
        simulation.step(controls[k])
        states = simulation.states
    assert np.array_equal(found.ends, states)
    assert np.isclose(found["friction"], forwards[0, 0], rtol=1e-7)
    assert found["controls"].shape == (steps, 1, 6)
    # The last push moves the end by h^2/m. The first push acts over all later steps.
    h = scene.time_step
    assert np.isclose(found["controls"][-1, 0, 0], h * h / 2, rtol=1e-6)
    assert found["controls"][0, 0, 0] > 30 * found["controls"][-1, 0, 0]


def test_with_compliance_what_sticks_creeps():
    resting = tumble.Scene(bodies=[{"box": 0.2, "mass": 2.0, "position": [0, 0, 0.1]}], ground={"friction": 0.5})
    exact, soft = resting.jacobian(), resting.jacobian(compliance=1e-2)
    assert np.abs(exact["wrenches"][0, 6:9, 0, :3]).max() < 1e-9
    # The compliance e causes motions of about e/4 of h/m along the ground and downwards.
    by_push = np.diag(soft["wrenches"][0, 6:9, 0, :3]) / (resting.time_step / 2.0)
    assert (by_push > 1e-3).all() and (by_push < 1e-2).all()
    along = np.zeros((1, 12))
    along[0, 0] = 1.0
    run = resting.vjp(along, steps=20, compliance=1e-2)
    assert (run["controls"][:, 0, 0] > 0).all() and np.array_equal(run.ends, resting.vjp(along, steps=20).ends)
    with pytest.raises(tumble.TumbleError, match="compliance of a derivative"):
        resting.jacobian(compliance=3.0)


def test_on_the_central_path_what_is_near_is_felt():
    near = tumble.Scene(bodies=[{"box": 0.2, "mass": 2.0, "position": [0, 0, 0.1004]}], ground={"friction": 0.5}, integrator="euler")
    exact, central = near.jacobian(), near.jacobian(central_path=1e-2)
    # The height has no effect in exact free flight. On the central path a lower box is pushed more.
    assert exact["states"][0, 8, 0, 2] == 0.0 and central["states"][0, 8, 0, 2] < -1e-3
    # Velocities have a partial effect, equal forwards and backwards.
    assert 0.0 < central["states"][0, 8, 0, 8] < 1.0
    along = np.zeros((1, 12))
    along[0, 8] = 1.0
    back = near.vjp(along, steps=1, central_path=1e-2)
    assert np.allclose(back["states"][0], central["states"][0, 8, 0], rtol=1e-9, atol=1e-9)
    with pytest.raises(tumble.TumbleError, match="central path of a derivative"):
        near.jacobian(central_path=0.0)
    with pytest.raises(tumble.TumbleError, match="are both given; only one"):
        near.vjp(along, central_path=1e-2, compliance=1e-2)
    starts = near.states[None]
    found = tumble.rollout(near, starts, steps=1, gradients=along[None], central_path=1e-2)
    assert np.allclose(found.gradients["states"][0], back["states"], rtol=1e-12)


def pushed_block(force, smoothing):
    """Final x of a block after 50 steps of a constant push, and its derivative by the push."""
    block = {"box": [0.4, 0.4, 0.1], "mass": 2.0, "position": [0, 0, 0.05]}
    scene = tumble.Scene(bodies=[block], ground={"friction": 0.25})
    controls = np.zeros((50, 1, 6))
    controls[:, 0, 0] = force
    along = np.zeros((1, 12))
    along[0, 0] = 1.0
    found = scene.vjp(along, controls=controls, **smoothing)
    return found.ends[0, 0], found["controls"][:, 0, 0].sum()


def test_a_push_breaks_a_block_away():
    """The block sticks up to mu m g. Above that, x = (F/m - mu g) (n h)^2 / 2."""
    steps, h, g, mass, friction = 50, 0.002, 9.81, 2.0, 0.25
    travel = (steps * h) ** 2 / 2
    forces = np.linspace(0, 10, 21)
    exact = np.array([pushed_block(force, {}) for force in forces])
    sliding = forces > friction * mass * g
    assert np.allclose(exact[:, 0], np.where(sliding, travel * (forces / mass - friction * g), 0), rtol=0, atol=1e-9)
    assert np.allclose(exact[:, 1], np.where(sliding, travel / mass, 0), rtol=0, atol=1e-9)
    soft = np.array([pushed_block(force, {"compliance": 0.01}) for force in forces])
    central = np.array([pushed_block(force, {"central_path": 0.003}) for force in forces])
    # Smoothing changes the derivative but not the run.
    assert np.array_equal(soft[:, 0], exact[:, 0]) and np.array_equal(central[:, 0], exact[:, 0])
    assert (soft[:, 1] > 2e-7).all()
    # The derivative on the central path has no kink and rises towards the exact one.
    assert (central[:, 1] > 0).all() and (central[:, 1] < travel / mass).all()
    assert (np.diff(central[:, 1]) > 0).all()


def test_what_is_refused():
    scene = sliding()
    with pytest.raises(tumble.TumbleError, match="by: \"colour\" is unknown; use states, wrenches, friction"):
        scene.jacobian(by=["colour"])
    with pytest.raises(TypeError, match="by is the string 'friction'"):
        scene.jacobian(by="friction")
    with pytest.raises(tumble.TumbleError, match="cotangents has shape"):
        scene.vjp(np.zeros(3))
    halves = [{"sphere": 0.1, "position": [x, 0, 0]} for x in (-0.1, 0.1)]
    pair = tumble.Scene([{"name": "pair", "pieces": halves, "mass": 1.0, "position": [0, 0, 0.1]}], {"friction": 0.5})
    for size in ("size", "radius"):
        with pytest.raises(tumble.TumbleError, match="size and radius: a body cannot change its shape"):
            pair.jacobian(by=[size])
    wheel = {"name": "wheel", "cylinder": {"length": 0.1, "radius": 0.1}, "mass": 1.0, "position": [0, 0, 0.05]}
    with pytest.raises(tumble.TumbleError, match="radius: a cylinder, cone or ellipsoid has no radius"):
        tumble.rollout(tumble.Scene([wheel], {"friction": 0.5}), steps=1, parameters={"radius": [[0.01]]})
    with pytest.raises(tumble.TumbleError, match="controls have 3 steps; 4 are needed"):
        scene.vjp(np.zeros((1, 12)), controls=np.zeros((3, 1, 6)), steps=4)
    with pytest.raises(tumble.TumbleError, match="Runge-Kutta"):
        tumble.floating().jacobian()


@pytest.mark.parametrize(
    ("shape", "height"),
    [
        ({"sphere": 0.1}, 0.1),
        ({"capsule": {"length": 0.2, "radius": 0.1}}, 0.2),
        ({"cylinder": {"length": 0.3, "radius": 0.1}}, 0.15),
        ({"ellipsoid": [0.1, 0.1, 0.2]}, 0.2),
    ],
)
def test_a_standing_round_body_rises_with_its_size(shape, height):
    """A body of half height a, with its size s, ends each step at the height s a."""
    body = {"name": "body", "mass": 1.0, "position": [0, 0, height], **shape}
    scene = tumble.Scene([body], {"friction": 0.5})
    if "cylinder" not in shape:
        found = scene.jacobian(by=["size"])["size"]
        assert np.allclose(found[0, 2, 0], height, rtol=1e-9)
    larger = tumble.rollout(scene, steps=1, parameters={"size": [[1.0], [1.001]]})
    heights = larger.states[:, -1, 0, 2]
    assert np.isclose(heights[1] - heights[0], 0.001 * height, rtol=1e-9)


def test_coefficients_of_a_body_and_of_a_pair():
    """Two blocks slide side by side. One uses the friction of its pair with the ground, the other
    its own coefficient."""
    blocks = [
        {"name": "a", "box": 0.2, "mass": 2.0, "position": [0, 0, 0.1], "velocity": [1, 0, 0]},
        {"name": "b", "box": 0.2, "mass": 2.0, "position": [0, 3, 0.1], "velocity": [1, 0, 0], "friction": 0.1},
    ]
    scene = tumble.Scene(
        bodies=blocks, ground={"friction": 0.4}, friction=[{"between": ["a", "ground"], "coefficient": 0.2}]
    )
    found = scene.jacobian(by=["friction", "body_friction", "pair_friction", "pair_restitution"])
    pressed = -9.81 * scene.time_step
    assert found["pair_friction"].shape == (2, 12, 1) and found["pair_restitution"].shape == (2, 12, 0)
    assert np.allclose(found["pair_friction"][:, 6, 0], [pressed, 0], atol=1e-12)
    # Geometric mean of the body's and the ground's coefficient.
    assert np.allclose(found["body_friction"][:, 6, 0], [0, pressed * 0.5 * 2], atol=1e-12)
    assert np.allclose(found["friction"][:, 6], [0, pressed * 0.5 / 2], atol=1e-12)
    # A batch varies the coefficients and differentiates by them.
    given = {"pair_friction": np.array([[0.2], [0.25]]), "body_friction": np.array([[0.1], [0.3]])}
    duals = np.zeros((1, 2, 12))
    duals[0, :, 6] = 1.0
    runs = tumble.rollout(scene, steps=20, parameters=given, gradients=duals)
    assert np.allclose(runs.gradients["pair_friction"], [[20 * pressed]] * 2, rtol=1e-9)
    slopes = [0.5 * np.sqrt(0.4 / own) for own in (0.1, 0.3)]
    assert np.allclose(runs.gradients["body_friction"][:, 0], [20 * pressed * slope for slope in slopes], rtol=1e-9)


def test_anchors_of_a_joint():
    """A body fixed to the world follows a change of its anchor within one step."""
    plate = {"name": "plate", "box": 0.2, "mass": 2.0, "position": [0, 0, 1]}
    held = {"name": "weld", "type": "fixed", "bodies": ["plate"], "anchor": [0, 0, 1.1]}
    scene = tumble.Scene(bodies=[plate], ground={"none": True, "friction": 0.5}, joints=[held])
    found = scene.jacobian(by=["anchor"])["anchor"]
    assert found.shape == (1, 12, 1, 2, 3)
    assert np.allclose(found[0, :3, 0, 1], np.eye(3), atol=1e-9)
    assert np.allclose(found[0, :3, 0, 0], -np.eye(3), atol=1e-9)
    back = scene.vjp(np.eye(12)[:1], steps=1, by=["anchor"])
    assert np.allclose(back["anchor"][0, 1], [1, 0, 0], atol=1e-9)
