"""Environments of robots from any file: declared actions, images, and many at once."""

import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import tumble
import tumble.locomotion
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from tumble.locomotion import RobotEnv, RobotVectorEnv, model

DATA = Path(__file__).resolve().parents[2] / "data" / "robots"
QUADRUPED = DATA / "quadruped.urdf"

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

CART = """<mujoco>
  <worldbody>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0" limited="true" range="-1 1"/>
      <geom type="box" size="0.1 0.1 0.05" mass="1"/>
      <body name="pole"><joint name="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.02" mass="0.1"/></body>
    </body>
  </worldbody>
  <actuator>ACTUATOR</actuator>
</mujoco>"""

DECLARED = {
    "torque": {"actions": "torque"},
    "pd": {"actions": "pd", "stiffness": 60.0, "damping": 2.0},
    "position": {"actions": "position"},
}


def cart(folder, actuator):
    path = folder / "cart.xml"
    path.write_text(CART.replace("ACTUATOR", actuator))
    return path


def test_only_environments_without_a_reward_warn(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gymnasium.make("tumble/Hopper-v0", disable_env_checker=True)
    with pytest.warns(UserWarning, match="every reward is 0: define judge"):
        RobotEnv(cart(tmp_path, '<motor joint="slider" ctrlrange="-1 1"/>'))


@pytest.mark.parametrize("name", DECLARED)
def test_a_urdf_has_the_declared_actions(name):
    env = RobotEnv(QUADRUPED, 5, 0.01, **DECLARED[name], render_mode="rgb_array")
    assert env.action_space.shape == (12,)
    joint = env.robot.slides_and_hinges[0]
    ends = (env.action_space.low[0], env.action_space.high[0])
    assert ends == pytest.approx((-joint.max_force, joint.max_force) if name == "torque" else joint.range)
    check_env(env)
    env.reset(seed=0)
    env.action_space.seed(0)
    still = np.zeros(12) if name == "torque" else env.robot.start[7:]
    unsolved = 0
    for _ in range(40):
        *_, info = env.step(still + 0.1 * (env.action_space.sample() - still))
        unsolved += info["unsolved"]
    # Targets that jump at a landing make single steps of the light feet wild.
    assert unsolved <= 0.03 * 40 * env.frame_skip


def test_a_torque_is_the_force_of_the_joint(tmp_path):
    """From rest, the cart is accelerated by F over the masses if the pole hangs through its centre."""
    env = RobotEnv(cart(tmp_path, ""), actions="torque", joints=["slider"], ranges={"slider": (-5, 5)})
    env.reset(seed=0)
    env.step([2.0])
    q, v = env.robot.start, np.zeros(2)
    rates = np.linalg.solve(env.robot.mass_matrix(q), np.array([2.0, 0.0]) - env.robot.bias_forces(q, v))
    assert env.robot.v[0] == pytest.approx(env.scene.time_step * rates[0], rel=1e-3)
    limited, largest = env.reset(seed=0), env.step([100.0])[0]
    env.reset(seed=0)
    assert np.array_equal(largest, env.step([5.0])[0]) and not np.array_equal(largest, limited[0])


def test_a_position_is_reached_at_the_end_of_the_action(tmp_path):
    env = RobotEnv(cart(tmp_path, ""), 25, actions="position", joints=["slider"], max_force=1e5)
    env.reset(seed=0)
    for target in (0.1, 0.25, -0.05):
        env.step([target])
        assert env.robot["slider"].coordinate == pytest.approx(target, abs=1e-9)


def test_targets_are_those_of_motors():
    env = RobotEnv(QUADRUPED, 5, **DECLARED["pd"])
    env.reset(seed=0)
    action = 0.5 * (env.action_space.low + env.action_space.high)
    env.step(action)
    simulation = tumble.load(QUADRUPED).simulate()
    robot = simulation.robot
    robot.set(env.reset(seed=0)[0][: robot.counts[0]])
    robot.set_gains(stiffness=60.0, damping=2.0)
    for joint, target in zip(robot.slides_and_hinges, action):
        joint.target = float(target)
    env.step(action)
    for _ in range(5):
        simulation.step()
    assert np.array_equal(simulation.states, env.simulation.states)


@pytest.mark.parametrize(
    ("actuator", "ends"),
    [
        ('<motor joint="slider" gear="2" forcelimited="true" forcerange="-3 3"/>', (-3, 3)),
        ('<motor joint="slider" gear="2" ctrllimited="true" ctrlrange="-4 5"/>', (-4, 5)),
        ('<position joint="slider" kp="50"/>', (-1, 1)),
        ('<position joint="slider" kp="50" gear="2"/>', (-2, 2)),
    ],
)
def test_a_control_without_a_range_takes_one_from_its_limits(tmp_path, actuator, ends):
    env = RobotEnv(cart(tmp_path, actuator))
    assert (env.action_space.low[0], env.action_space.high[0]) == pytest.approx(ends)
    check_env(env, skip_render_check=True)


def test_what_is_refused(tmp_path):
    plain = cart(tmp_path, "")
    refused = [
        ({}, r'has no actuators; declare its actions: actions="torque"'),
        ({"actions": "controls"}, "has no actuators"),
        ({"actions": "speed"}, "actions is 'speed'; one of controls, torque, pd, position"),
        ({"actions": "pd"}, "stiffness is needed"),
        ({"actions": "torque", "stiffness": 1.0}, 'actions="torque" does not use stiffness; .* use actions="pd"'),
        ({"actions": "torque"}, r"slider has no force limit; give ranges=\{'slider': \(low, high\)\}"),
        ({"actions": "position", "max_force": 5.0}, r"hinge has no limits; give ranges"),
        ({"actions": "position", "joints": ["slider"]}, "max_force of slider, the force limit of its motor"),
        ({"actions": "torque", "joints": ["slide"]}, "slide or hinge 'slide' is unknown; did you mean"),
        ({"render_mode": "ansi"}, '"rgb_array", "human" or None is needed'),
    ]
    for keywords, words in refused:
        with pytest.raises(tumble.TumbleError, match=words):
            RobotEnv(plain, **keywords)
    with pytest.raises(tumble.TumbleError, match="has no control range, and none follows from its limits"):
        RobotEnv(cart(tmp_path, '<motor joint="slider"/>'))


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"actions": "torque", "max_force": 1.0}, 'does not use max_force; leave it out, or use actions="pd" or "position"'),
        ({"actions": "torque", "damping": 1.0}, "does not use damping"),
        ({"actions": "position", "damping": 1.0}, "does not use damping"),
        ({"actions": "position", "max_force": {"fr_rol": 1.0}}, "name in max_force 'fr_rol' is unknown; did you mean `fr_roll"),
        ({"actions": "torque", "ranges": {"fr_rolls": (-1, 1)}}, "name in ranges 'fr_rolls' is unknown; did you mean"),
        ({"actions": "torque", "ranges": (-1, 1)}, r"ranges is \(-1, 1\); a dictionary is needed"),
        ({"actions": "pd", "stiffness": {"fr_roll": 1.0}}, "stiffness has no number for fl_roll; give one for each"),
        ({"actions": "pd", "stiffness": 1.0, "damping": {"fr_roll": 1.0}}, "damping has no number for fl_roll"),
        ({"actions": "pd", "stiffness": "60"}, "stiffness of fl_roll is '60'; a number is needed"),
        ({"actions": "torque", "joints": "fr_roll"}, r"joints is 'fr_roll'; a list of names is needed: \['fr_roll'\]"),
        ({"actions": "torque", "joints": 3}, "joints is 3; a list of names is needed"),
        ({"actions": "torque", "joints": [3]}, "joints has 3; a name is a string"),
        ({"actions": "torque", "joints": []}, "joints is empty; name a slide or hinge"),
        ({"actions": "torque", "joints": ["fr_roll", "fr_roll"]}, "joints has 'fr_roll' twice"),
        ({"actions": "torque", "leave_out": "transmission"}, r"leave_out is .* a list of names is needed: \['trans"),
    ],
)
def test_an_option_without_effect_is_refused(keywords, words):
    with pytest.raises(tumble.TumbleError, match=words):
        RobotEnv(QUADRUPED, **keywords)


def test_controls_have_no_joints_and_gains():
    for option in ({"joints": ["thigh_joint"]}, {"damping": 1.0}, {"max_force": 1.0}):
        with pytest.raises(tumble.TumbleError, match='actions="controls" does not use'):
            RobotEnv(model("hopper.xml"), **option)


def test_gains_by_joint_reach_the_motors():
    names = RobotEnv(QUADRUPED, actions="torque").actions.names
    gains = {option: {name: 10.0 + place for place, name in enumerate(names)} for option in ("stiffness", "damping")}
    env = RobotEnv(QUADRUPED, actions="pd", max_force={"fr_roll": 3.0}, **gains)
    env.reset(seed=0)
    joints = env.robot.slides_and_hinges
    assert [joint.stiffness for joint in joints] == [joint.damping for joint in joints] == [10.0 + i for i in range(12)]
    limits = {joint.name: joint.max_force for joint in joints}
    assert limits["fr_roll"] == 3.0 and limits["fl_roll"] == tumble.load(QUADRUPED).simulate().robot["fl_roll"].max_force


def test_arguments_of_the_loader_reach_it(tmp_path):
    path = cart(tmp_path, '<motor joint="slider" ctrllimited="true" ctrlrange="-1 1"/>')
    path.write_text(path.read_text().replace('mass="0.1"', 'mass="0.1" condim="4"'))
    assert RobotEnv(path).action_space.shape == (1,)
    assert RobotEnv(path, point_contacts=True).action_space.shape == (1,)
    ranges = {"slider": (-1, 1), "hinge": (-1, 1)}
    env = RobotEnv(path, leave_out=["actuator", "@condim"], actions="torque", ranges=ranges)
    assert env.robot.actuators == [] and env.actions.names == ["slider", "hinge"]
    (tmp_path / "there" / "leg").mkdir(parents=True)
    (tmp_path / "there" / "leg" / "wedge.obj").write_bytes((DATA / "parts" / "wedge.obj").read_bytes())
    leg = tmp_path / "leg.urdf"
    text = QUADRUPED.read_text()
    box = re.search(r"<box [^>]*>", text)[0]
    leg.write_text(text.replace(box, '<mesh filename="package://leg/wedge.obj"/>', 1))
    with pytest.raises(tumble.TumbleError, match="packages"):
        RobotEnv(leg, actions="torque")
    assert RobotEnv(leg, actions="torque", packages=tmp_path / "there").action_space.shape == (12,)


def test_a_scene_is_an_environment_too():
    scene = tumble.Scene(
        [{"box": 0.1, "mass": 0.2, "position": [0.6, 0, 0.05]}],
        {"friction": 0.5},
        robots=[{"file": str(QUADRUPED), "position": [0, 0, 0.45], "prefix": "dog."}],
    )
    env = RobotEnv(scene, 4, substeps=2, robot="dog.", **DECLARED["pd"])
    assert env.dt == pytest.approx(4 * scene.time_step)
    with pytest.raises(tumble.TumbleError, match="leave_out: the scene is read already"):
        RobotEnv(scene, robot="dog.", leave_out=["x"], **DECLARED["pd"])
    check_env(env, skip_render_check=True)


def test_an_image_shows_the_robot():
    env = RobotEnv(QUADRUPED, 5, **DECLARED["pd"], render_mode="rgb_array")
    env.reset(seed=0)
    image = env.render()
    assert image.shape == (480, 480, 3) and image.dtype == np.uint8
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50
    assert env.metadata["render_fps"] == round(1 / env.dt)
    assert RobotEnv(QUADRUPED, 5, **DECLARED["pd"]).render() is None


def test_a_window_shows_every_action_until_it_is_closed(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame

    env = RobotEnv(QUADRUPED, 5, **DECLARED["pd"], render_mode="human")
    env.reset(seed=0)
    shown = pygame.surfarray.array3d(pygame.display.get_surface())
    assert shown.shape == (480, 480, 3) and np.array_equal(shown.swapaxes(0, 1), env.simulation.picture())
    env.step(env.action_space.sample())
    later = pygame.surfarray.array3d(pygame.display.get_surface())
    assert np.array_equal(later.swapaxes(0, 1), env.simulation.picture()) and not np.array_equal(later, shown)
    assert env.render() is None
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    env.step(env.action_space.sample())
    assert pygame.display.get_surface() is None
    env.step(env.action_space.sample())
    assert pygame.display.get_surface() is None
    env.close()


def test_a_window_needs_pygame(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(tumble.TumbleError, match="pip install pygame"):
        RobotEnv(QUADRUPED, 5, **DECLARED["pd"], render_mode="human")


def test_many_robots_have_no_windows():
    with pytest.raises(tumble.TumbleError, match="one window for each"):
        RobotVectorEnv(RobotEnv, 2, file=QUADRUPED, **DECLARED["pd"], render_mode="human")


class Short(RobotEnv):
    """Quadruped with episodes that end when it has sunk."""

    def __init__(self, **keywords):
        super().__init__(QUADRUPED, 10, 0.02, **DECLARED["pd"], **keywords)

    def judge(self, before, action):
        height = float(self.robot.q[2])
        return height - before[2], height < 0.3, {"height": height}


@pytest.mark.parametrize("threads", [1, 2])
def test_many_take_the_steps_of_single_ones(threads):
    count, length = 4, 7
    many = RobotVectorEnv(Short, count, threads=threads, max_episode_steps=length)
    single = [lambda: gymnasium.wrappers.TimeLimit(Short(), length)] * count
    single = SyncVectorEnv(single, autoreset_mode=AutoresetMode.NEXT_STEP)
    assert many.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert many.observation_space == single.observation_space and many.action_space == single.action_space
    (first, infos), (other, others) = many.reset(seed=3), single.reset(seed=3)
    assert np.array_equal(first, other) and infos.keys() == others.keys()
    assert infos["unsolved"].dtype == others["unsolved"].dtype and not infos["unsolved"].any()
    many.action_space.seed(0)
    ends = cuts = 0
    for _ in range(25):
        action = many.action_space.sample()
        one, other = many.step(action), single.step(action)
        for ours, theirs in zip(one[:4], other[:4]):
            assert ours.dtype == theirs.dtype and np.array_equal(ours, theirs)
        assert one[4].keys() == other[4].keys()
        assert all(np.array_equal(one[4][name], other[4][name]) for name in one[4])
        ends, cuts = ends + one[2].sum(), cuts + one[3].sum()
    assert ends > 0 and cuts > 0


@pytest.mark.parametrize("name", ["Hopper", "HalfCheetah", "Walker2d", "Ant"])
def test_gymnasium_makes_many_of_its_robots(name):
    many = gymnasium.make_vec(f"tumble/{name}-v0", num_envs=3, vectorization_mode="vector_entry_point", threads=2)
    assert isinstance(many.unwrapped, RobotVectorEnv)
    many.reset(seed=0)
    observed, rewards, *_ = many.step(many.action_space.sample())
    assert observed.shape == many.observation_space.shape and rewards.shape == (3,)
    assert gymnasium.spec(f"tumble/{name}-v0").to_json()


@pytest.mark.parametrize("action", [0.5, [0.5], [0.5, 0.1], [0.0, 0.0, np.nan]])
def test_an_action_of_another_shape_is_refused(action):
    ranges = {name: (-1.0, 1.0) for name in ("thigh_joint", "leg_joint", "foot_joint")}
    env = RobotEnv(model("hopper.xml"), 4, actions="torque", ranges=ranges)
    env.reset(seed=0)
    before = env.observe()
    with pytest.raises(tumble.TumbleError, match="action"):
        env.step(action)
    assert np.array_equal(env.observe(), before)


def test_actions_for_another_number_of_environments_are_refused():
    env = RobotVectorEnv(lambda: RobotEnv(model("hopper.xml"), 4), 2)
    env.reset(seed=0)
    for shape in [(1, 3), (3, 3), (2, 2), (3,)]:
        with pytest.raises(tumble.TumbleError, match=r"\(2, 3\) is needed"):
            env.step(np.zeros(shape))


@pytest.mark.parametrize("pair", [3.0, (1.0, -1.0), (0.0, 0.0), (0.0, np.nan), (0.0, np.inf), ()])
def test_a_range_that_is_none_is_refused(pair):
    with pytest.raises(tumble.TumbleError, match="range of thigh_joint"):
        RobotEnv(model("hopper.xml"), ranges={"thigh_joint": pair}, actions="torque")


@pytest.mark.parametrize("noise", [-0.1, np.nan, np.inf, "much"])
def test_noise_is_a_number_from_zero(noise):
    with pytest.raises(tumble.TumbleError, match="noise is"):
        RobotEnv(model("hopper.xml"), noise=noise)


def test_unsolved_steps_are_counted_when_all_start_again():
    env = RobotVectorEnv(RobotEnv, 3, file=model("hopper.xml"), max_episode_steps=1)
    env.reset(seed=0)
    for _ in range(3):
        infos = env.step(np.zeros((3, 3)))[-1]
        assert infos["unsolved"].tolist() == [0, 0, 0]


def test_many_environments_are_alike():
    hopper, walker = model("hopper.xml"), model("walker2d_v5.xml")
    ranges = dict.fromkeys(("thigh_joint", "leg_joint", "foot_joint"), (-1.0, 1.0))
    backwards = list(ranges)[::-1]

    class Blind(RobotEnv):
        def observe(self):
            return self.robot.v

    for first, other, words in [
        (lambda: RobotEnv(hopper, 4), lambda: RobotEnv(hopper, 2), "frame_skip of environment 1 is 2, and 4 of"),
        (lambda: RobotEnv(hopper), lambda: RobotEnv(tumble.load(hopper, time_step=0.001)), "dt of environment 1 is"),
        (lambda: RobotEnv(hopper), lambda: Blind(hopper), "observation_space of environment 1"),
        (lambda: RobotEnv(hopper), lambda: RobotEnv(hopper, ranges={"actuator-0": (0, 1)}), "action_space of"),
        (
            lambda: RobotEnv(hopper, actions="torque", ranges=ranges),
            lambda: RobotEnv(hopper, actions="torque", ranges=ranges, joints=backwards),
            r"list of actions of environment 1 is \['foot_joint",
        ),
        (lambda: RobotEnv(hopper), lambda: RobotEnv(hopper, render_mode="rgb_array"), "render_mode of environment 1"),
        (lambda: RobotEnv(hopper), lambda: RobotEnv(walker), "of environment 1"),
        (lambda: RobotEnv(hopper), lambda: gymnasium.make("tumble/Hopper-v0"), "RobotEnv is needed, without wrappers"),
    ]:
        makers = iter([first, other])
        with pytest.raises(tumble.TumbleError, match=words):
            RobotVectorEnv(lambda: next(makers)(), 2)
    with pytest.raises(tumble.TumbleError, match="make is 3; a function that creates a RobotEnv is needed"):
        RobotVectorEnv(3, 2)


@pytest.mark.parametrize(
    ("method", "returned", "words"),
    [
        ("judge", 1.0, "judge returned 1.0; 3 values are needed: reward, end"),
        ("judge", (1.0, False), "3 values are needed"),
        ("judge", (np.nan, False, {}), "judge returned nan and {}; a finite reward"),
        ("judge", ("much", False, {}), "a finite reward"),
        ("judge", (1.0, False, None), "judge returned 1.0 and None; .* a dictionary"),
        ("observe", 1.0, r"observe returned an array of shape \(\); \(12,\) is needed"),
        ("observe", np.zeros(3), r"shape \(3,\); \(12,\) is needed"),
        ("draw", np.zeros(3), "draw returned .* 2 values are needed: coordinates, rates"),
        ("draw", (np.zeros(5), np.zeros(6)), r"q of draw has shape \(5,\); \(6,\) is needed"),
        ("draw", (np.zeros(6), None), "v of draw"),
        ("draw", (np.full(6, np.nan), np.zeros(6)), r"q of draw\[0\] is nan"),
    ],
)
def test_what_a_subclass_returns_is_checked(method, returned, words):
    # The first observation, of the constructor, defines the space.
    own = {method: lambda self, *_: returned if hasattr(self, "observation_space") else np.zeros(12)}
    env = type("Own", (RobotEnv,), own)(model("hopper.xml"))
    with pytest.raises(tumble.TumbleError, match=words):
        env.reset(seed=0)
        env.step(np.zeros(3))


@pytest.mark.parametrize("returned", [1.0, None, {"q": 1.0}])
def test_an_observation_is_an_array(returned):
    kind = type("Own", (RobotEnv,), {"observe": lambda self: returned})
    with pytest.raises(tumble.TumbleError, match="^observe returned .* an array is needed"):
        kind(model("hopper.xml"))


@pytest.mark.parametrize("path", [None, 3, ["hopper.xml"]])
def test_a_file_is_a_path(path):
    for read in (tumble.load, RobotEnv):
        with pytest.raises(tumble.TumbleError, match="path is .*; the path of a scenario or a robot's file is needed"):
            read(path)


def dog_on(**surroundings):
    robots = [{"file": str(QUADRUPED), "position": [0, 0, 0.55]}]
    return tumble.Scene([], {"friction": 0.5}, robots=robots, **surroundings)


SURROUNDINGS = {
    "step": {"fixed": [{"name": "step", "box": [1, 1, 0.1], "position": [0.4, 0, 0]}]},
    "hills": {"terrain": [{"name": "hills", "heights": (0.1 * np.eye(9)).tolist(), "spacing": 0.2}]},
}


class Low(RobotEnv):
    """Quadruped whose starts are up to 0.3 m too low."""

    def draw(self, rng):
        q, v = super().draw(rng)
        q[2] -= rng.uniform(0.0, 0.3)
        return q, v


@pytest.mark.parametrize("name", SURROUNDINGS)
def test_a_start_is_lifted_out_of_fixed_pieces_and_terrain(name):
    env = Low(dog_on(**SURROUNDINGS[name]), **DECLARED["pd"])
    lifted = 0
    for seed in range(30):
        observed, _ = env.reset(seed=seed)
        rng = np.random.default_rng(0)
        rng.bit_generator.state = np.random.PCG64(np.random.SeedSequence(seed)).state
        drawn = env.draw(rng)[0]
        lift = observed[2] - drawn[2]
        overlap = max([-pair.distance for pair in env.simulation.pairs_within(0.0)], default=0.0)
        assert lift > -1e-9 and observed[:19] == pytest.approx(np.insert(np.delete(drawn, 2), 2, observed[2])) and overlap < 1e-4
        if lift > 1e-9:
            lifted += 1
            assert min(pair.distance for pair in env.simulation.pairs_within(0.01)) < 2e-4
    assert 5 < lifted < 30


def test_a_start_that_overlaps_itself_is_drawn_again():
    folded = np.array([0, 0, 0.6, 1, 0, 0, 0, *(-0.8, 0, -2.6), *(0.8, 0, -2.6), *(0, 0, -2.6), *(0, 0, -2.6)])

    class Folding(RobotEnv):
        drawn, worst = 0, 3

        def draw(self, rng):
            self.drawn += 1
            return (folded if self.drawn <= self.worst else self.robot.start), np.zeros(18)

    env = Folding(QUADRUPED, **DECLARED["pd"])
    env.reset(seed=0)
    assert env.drawn == 4 and np.array_equal(env.robot.q, env.robot.start)
    env.worst = 100
    with pytest.raises(tumble.TumbleError, match="10 drawn starts were refused, the last one for: fl_thigh and .* overlap"):
        env.reset(seed=0)


def test_scenes_of_many_environments_may_differ():
    """Each takes the steps of its own scene."""
    scenes = [tumble.load(QUADRUPED, friction=friction) for friction in (0.2, 1.0)]
    waiting = iter(scenes)
    many = RobotVectorEnv(lambda: RobotEnv(next(waiting), 10, **DECLARED["pd"]), 2)
    single = [RobotEnv(scene, 10, **DECLARED["pd"]) for scene in scenes]
    many.reset(seed=0)
    for index, env in enumerate(single):
        env.reset(seed=index)
    action = many.single_action_space.high
    for _ in range(20):
        observed = many.step(np.stack([action, action]))[0]
        assert all(np.array_equal(env.step(action)[0], own) for env, own in zip(single, observed))
    assert not np.array_equal(*observed)


def test_friction_and_time_step_are_keywords():
    env = gymnasium.make("tumble/Hopper-v0", time_step=0.001, frame_skip=8).unwrapped
    assert env.scene.time_step == 0.001 and env.dt == pytest.approx(0.008)
    env = RobotEnv(QUADRUPED, actions="torque", friction=0.6)
    assert env.scene.friction == 0.6
