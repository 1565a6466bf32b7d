"""Environments: Gymnasium's own checks, seeds, doors; many do what each does alone."""

import hashlib
import json
import subprocess
import sys
import warnings
from contextlib import redirect_stdout
from io import StringIO

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import cdpr_drake as cdpr
import cdpr_drake.gym
from cdpr_drake.analyses.learning.task_table import TASKS, make_task
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.vision.apriltags import TagTarget
from tests.messages import printed

NAMES = [f"cdpr/{name}-v0" for name in TASKS]
DOUBT = {"*.exit_point.*": 1e-3, "all.stiffness": 1e4, "mass": 0.1}
"""Standard deviations [m, N, kg]."""


def test_every_task_is_registered_with_its_steps():
    assert {name: kind.steps for name, kind in TASKS.items()} == cdpr_drake.gym.STEPS
    assert cdpr.environment_names() == NAMES
    for name in NAMES:
        assert gymnasium.spec(name).max_episode_steps == TASKS[name[5:-3]].steps


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("Reach", {"action": "rates"}),
        ("Track", {"action": "tensions"}),
        ("VisualServo", {"action": "twist"}),
        ("VisualServo", {"observation": "image"}),
        ("PickAndPlace", {"action": "rates"}),
        ("PickAndPlace", {"action": "tensions"}),
        ("PickAndPlace", {"action": "twist"}),
    ],
)
def test_gymnasium_finds_nothing_wrong(name, how):
    """With each task, with each action, and with each action beside that of a gripper."""
    env = gymnasium.make(f"cdpr/{name}-v0", **({"randomise": DOUBT} | how))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


@pytest.mark.parametrize("name", NAMES)
def test_many_robots_do_what_each_does_alone(name):
    """Whole episodes, their ends and new beginnings included, of which there must be some."""
    count, steps = 5, 30
    how = {"action": "tensions", "randomise": DOUBT}  # which loses the platform soon
    alone, many = (
        gymnasium.make_vec(name, count, vectorization_mode=mode, **how)
        for mode in ("sync", "vector_entry_point")
    )
    assert alone.single_observation_space == many.single_observation_space
    assert alone.action_space == many.action_space
    random, ends = np.random.default_rng(2), 0
    same(alone.reset(seed=7), many.reset(seed=7))
    for _ in range(steps):
        actions = random.uniform(-1, 1, alone.action_space.shape).astype(np.float32)
        one, other = alone.step(actions), many.step(actions)
        same(one, other)
        ends += int(np.sum(other[2]))
    assert ends > count


def same(one, other):
    for mine, its in zip(one, other, strict=True):
        if isinstance(mine, dict):
            assert mine.keys() == its.keys()
            for key in mine:
                assert mine[key].tobytes() == its[key].tobytes(), key
        else:
            assert mine.dtype == its.dtype
            assert mine.tobytes() == its.tobytes()


def test_40_robots_do_what_40_do_alone():
    count = 40
    many = gymnasium.make_vec("cdpr/Reach-v0", count, randomise=DOUBT)
    random = np.random.default_rng(0)
    actions = random.uniform(-1, 1, (3, *many.action_space.shape)).astype(np.float32)
    seen = [many.reset(seed=11)[0]] + [many.step(each)[0] for each in actions]
    alone = gymnasium.make("cdpr/Reach-v0", randomise=DOUBT)
    for k in range(count):
        own = [alone.reset(seed=11 + k)[0]] + [alone.step(each[k])[0] for each in actions]
        assert np.array(own).tobytes() == np.array([each[k] for each in seen]).tobytes()


def test_an_episode_ends_at_its_time():
    one = gymnasium.make("cdpr/Track-v0", max_episode_steps=4)
    many = gymnasium.make_vec("cdpr/Track-v0", 2, max_episode_steps=4)
    one.reset(seed=0)
    many.reset(seed=0)
    ends = [one.step(np.zeros(8, np.float32))[3] for _ in range(4)]
    assert ends == [False, False, False, True]
    for end in (*ends, False):
        *_, late, _ = many.step(np.zeros((2, 8), np.float32))
        assert late.tolist() == [end, end]


PROGRAM = """
import hashlib, gymnasium, numpy as np, cdpr_drake.gym
digest = hashlib.sha256()
for name in {names}:
    envs = gymnasium.make_vec(name, 3, randomise={doubt})
    digest.update(envs.reset(seed=5)[0].tobytes())
    actions = np.random.default_rng(1).uniform(-1, 1, (10, *envs.action_space.shape))
    for each in actions.astype(np.float32):
        seen, rewards, *_ = envs.step(each)
        digest.update(seen.tobytes() + rewards.tobytes())
print(digest.hexdigest())
"""


def test_the_same_seed_gives_the_same_bytes_in_another_process():
    program = PROGRAM.format(names=NAMES, doubt=DOUBT)
    here = StringIO()
    with redirect_stdout(here):
        exec(program, {})
    there = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert here.getvalue() == there
    assert len(there.strip()) == hashlib.sha256().digest_size * 2


def test_other_seeds_are_other_episodes():
    env = gymnasium.make("cdpr/Reach-v0")
    first, second, again = (env.reset(seed=seed)[0] for seed in (1, 2, 1))
    assert first.tobytes() == again.tobytes() != second.tobytes()


KINDS = ("acrobot_small", "fast", "grab_three", "planar", "planar_point", "spider_camera")
"""Robots of all motion types, with cables enough and with few."""

TAKE_PART = sorted(
    {(robot, NAMES[k % len(NAMES)]) for k, robot in enumerate(robot_names())}
    | {(robot, name) for robot in KINDS for name in NAMES}
)
"""Every robot with one of the tasks, and one of each kind with all of them."""


@pytest.mark.parametrize(("robot", "name"), TAKE_PART)
def test_any_robot_takes_part(robot, name):
    """Whatever its motion type; also with few cables, whose start is a pose of rest."""
    envs = gymnasium.make_vec(name, 2, robot=robot)
    seen, _ = envs.reset(seed=0)
    assert np.isfinite(seen).all()
    for _ in range(3):
        seen, rewards, lost, _, _ = envs.step(np.zeros(envs.action_space.shape, np.float32))
        assert np.isfinite(seen).all()
        assert np.isfinite(rewards).all()
        assert not lost.any()


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("Reech", {}, "Reach"),
        ("Reach", {"count": 0}, "count: found 0; accepted: 1 or more"),
        ("Reach", {"robot": "arm_on_platform"}, "arm_on_platform"),
        ("Reach", {"action": "torques"}, "action: found 'torques'"),
        ("Reach", {"speed": 1.0}, "found option 'speed'; accepted: robot, action"),
        ("Reach", {"randomise": {"weight": 1.0}}, "randomise: found 'weight'"),
        ("Reach", {"randomise": {"mass": -1.0}}, "randomise: mass: found -1.0"),
        ("Reach", {"period": 0.0}, "period: found 0.0"),
        ("Reach", {"turn_deg": 200.0}, "turn_deg: found 200.0"),
        ("Reach", {"winches": "motor", "action": "tensions"}, "winches: found motor"),
        ("Reach", {"render_mode": "human"}, "found 'human'; accepted: null, rgb_array"),
    ],
)
def test_what_is_not_accepted_is_said_in_one_line(name, options, words):
    with pytest.raises(CdprError) as problem:
        cdpr.make_environment(name, **({"count": 2} | options))
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


def test_actions_of_another_shape_or_not_finite_are_refused():
    task = make_task("Reach", 2)
    task.begin([0, 1], [np.random.default_rng(k) for k in range(2)])
    for actions in (np.zeros(8), np.full((2, 8), np.nan)):
        with pytest.raises(CdprError, match="actions: found shape"):
            task.step(actions)


def test_images_show_the_tag_where_the_features_are():
    """The detector of tags finds it in what is drawn, within a pixel of the projected corners."""
    task = make_task("VisualServo", 2, observation="image", image_width=400, pixel_noise=0.0)
    task.begin([0, 1], [np.random.default_rng(k) for k in range(2)])
    for row, image in enumerate(task.observations()):
        assert image.shape == task.image_shape()
        found = TagTarget(0, task.reach).find(image)
        assert found is not None
        camera, xy = task._picture.pinhole, task._own()[row, :8].reshape(2, 4)
        expected = camera.project(np.vstack([xy, np.ones(4)])).T.ravel()
        assert found == pytest.approx(expected, abs=1.0)


def run(capsys, *words):
    try:
        main(["environments", *words])
        code = 0
    except SystemExit as ended:
        code = ended.code or 0
    return code, printed(capsys)


def test_one_and_many_by_short_and_long_name():
    env = cdpr.make_environment("Reach", action="twist")
    envs = cdpr.make_environment("cdpr/Reach-v0", 3, action="twist")
    one, many = env.reset(seed=5)[0], envs.reset(seed=5)[0]
    assert many.shape == (3, *one.shape)
    np.testing.assert_array_equal(many[0], one)


def test_without_gymnasium_it_says_what_to_install(monkeypatch):
    monkeypatch.delitem(sys.modules, "cdpr_drake.gym", raising=False)
    monkeypatch.setitem(sys.modules, "gymnasium.envs.registration", None)
    with pytest.raises(CdprError, match="pip install"):
        cdpr.environment_names()


def test_the_command_lists_them_and_draws_one(capsys, tmp_path):
    code, (out, _) = run(capsys, "--json", "--robot", "planar")
    found = json.loads(out)
    assert (code, [one["name"] for one in found]) == (0, cdpr.environment_names())
    assert {one["robot"] for one in found} == {"planar"}
    picture = tmp_path / "reach.png"
    code, (out, _) = run(capsys, "Reach", "--picture", str(picture))
    assert code == 0
    assert "cdpr/Reach-v0" in out
    assert picture.stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("Reech",), "Reach"),
        (("--picture", "all.png"), "accepted: a .png of one"),
        (("Reach", "--picture", "reach.txt"), "accepted: a .png of one"),
        (("Reach", "--action", "pull"), "action: found 'pull'"),
        (("Reach", "--picture", "none/reach.png"), "none/reach.png: cannot be written"),
    ],
)
def test_bad_input_is_told_in_one_line(capsys, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    code, (out, err) = run(capsys, *words)
    assert (code, out) == (2, "")
    assert told in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
