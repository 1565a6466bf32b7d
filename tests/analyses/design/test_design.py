"""Designs as robot files, their goals, the search that continues, and the proof."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import Confirmation, confirm
from cdpr_drake.analyses.design.goals import GOALS, evaluate_goals
from cdpr_drake.analyses.design.optimization import Design, optimize_design, write_design
from cdpr_drake.analyses.design.search import (
    evaluate_original,
    goal_context,
    search_arguments,
    search_design,
)
from cdpr_drake.analyses.design.search_methods import SLOPES
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings, load_design_settings
from cdpr_drake.analyses.frame.folder import Folder
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, DesignError
from cdpr_drake.models.robot_loader import load_robot
from tests.messages import printed

ROBOT = "acrobot_large"


def wanted(*goals, winches=False, counts=(3.0, 3.0, 2.0), **changed):
    """A small search; `winches`: their torque and drums may change, too."""
    settings = DesignSettings(goals=[GoalSettings(name=name) for name in goals])
    settings.exit_points.reach = np.full(3, 0.1)
    settings.poses.counts = np.array(counts)
    settings.force, settings.generations, settings.population = 5.0, 3, 4
    if winches:
        settings.winch.motor_torque = np.array([0.2, 0.8])
        settings.winch.drum_radius = np.array([0.02, 0.08])
    return replace(settings, **changed)


@pytest.fixture(scope="module")
def candidates():
    return make_candidates(ROBOT, wanted("static"), "test")


def test_the_middle_of_the_box_is_the_robot_as_it_is_and_points_stay_within_reach(candidates):
    points = load_robot(ROBOT).cable_set().p_WA
    robot = candidates.robot(0, np.full(candidates.size, 0.5))
    assert candidates.size == 24
    assert robot.cable_set().p_WA == pytest.approx(points)
    x = np.random.default_rng(0).uniform(size=24)
    moved = candidates.robot(0, x).cable_set().p_WA - points
    assert 0.05 < np.max(np.abs(moved)) <= 0.1 + 1e-12


def test_cables_are_left_out_and_winches_change():
    sets = ["C1,C3,C5,C7", "C1,C2,C3,C4,C5,C6,C7,C8"]
    settings = wanted("power", "speed", winches=True, cables=sets)
    found = make_candidates(ROBOT, settings, "test")
    x = np.full(found.size, 0.5)
    robot = found.robot(0, x)
    assert [cable.name for cable in robot.cables] == ["C1", "C3", "C5", "C7"]
    assert robot.winch.motor_torque == pytest.approx(0.4)  # between, in ratios
    assert robot.winch.drum_radius == pytest.approx(0.04)
    assert robot.tension_bounds.upper == pytest.approx(0.4 * 10.0 / 0.04)
    judging = goal_context(ROBOT, settings.poses, settings)
    power, speed = evaluate_goals(robot, judging, ("power", "speed"))
    rate = 3000.0 * 2.0 * np.pi / 60.0
    assert power == pytest.approx(-4 * 0.4 * rate)  # less is better
    assert speed == pytest.approx(rate / 10.0 * 0.04)


@pytest.mark.parametrize("name", [n for n in GOALS if n not in ("power",)])
def test_every_goal_is_a_number(name, candidates):
    settings = wanted(name, counts=(2.0, 2.0, 2.0))
    judging = goal_context(ROBOT, settings.poses, settings)
    (value,) = evaluate_original(candidates, judging, (name,))
    assert np.isfinite(value)
    if name == "accuracy":  # an exit point that is off by 1 mm moves the platform by millimetres
        assert 1e-4 < -value < 3e-2


def searched(folder, found, settings, most=None):
    """A search that is kept in a folder, and stopped after some designs."""
    asked = itertools.count()
    follow = Follow(stop=lambda: most is not None and next(asked) >= most)
    arguments = search_arguments(found, settings, goal_context(ROBOT, settings.poses, settings))
    with Folder(folder, arguments, grows=True) as results:
        return search_design(ROBOT, found, settings, results, follow=follow)


def test_a_search_that_was_stopped_goes_on_as_if_it_had_not(tmp_path, candidates):
    pytest.importorskip("cmaes")
    settings = wanted("wrench-feasible")
    whole = search_design(ROBOT, candidates, settings)
    part = searched(tmp_path / "one", candidates, settings, 6)
    assert not part.complete
    assert 0 < len(part.values) < len(whole.values)
    with (tmp_path / "one" / "judged.jsonl").open("a") as file:
        file.write('["set0-gener')  # as a kill leaves it
    again = searched(tmp_path / "one", candidates, settings)
    assert again.complete
    assert again.earlier == 6
    assert np.array_equal(again.values, whole.values)
    assert np.array_equal(again.coordinates, whole.coordinates)
    more = searched(tmp_path / "one", candidates, replace(settings, generations=4))
    assert len(more.values) == len(whole.values) + 4
    assert more.earlier == len(whole.values)
    with Folder(tmp_path / "best", {}) as folder:
        file = write_design(again, ROBOT, folder)
    best = again.best
    assert evaluate_goals(load_robot(str(file)), again.judging, again.names) == pytest.approx(
        again.values[best]
    )


def test_confirmation_proves_less_than_the_grid_says(candidates):
    settings = wanted("static")
    judging = goal_context(ROBOT, settings.poses, settings)
    one = confirm("static", ROBOT, ROBOT, judging, boxes=300)
    assert one.original == one.design
    assert 0.0 <= one.original <= np.prod([1.2, 1.2, 1.2])
    assert not one.sure
    assert confirm("speed", ROBOT, ROBOT, judging) is None


def test_several_goals_make_a_front(tmp_path):
    pytest.importorskip("cmaes")
    sets = ["C1,C2,C3,C4,C5,C6,C7", "C1,C3,C5,C7"]
    settings = wanted("static", "speed", "cables", winches=True, cables=sets, generations=1)
    found = make_candidates(ROBOT, settings, "test")
    search = search_design(ROBOT, found, settings)
    assert set(search.sets.tolist()) == {0, 1}
    design = Design(ROBOT, search)
    assert design.plot("pareto").axes
    with Folder(tmp_path / "out", {}) as folder:
        design.write(folder)
    told = json.loads((tmp_path / "out" / "results.json").read_text())
    assert len(told["front"]) == len(search.front) >= 1
    rows = (tmp_path / "out" / "designs.csv").read_text().splitlines()
    assert len(rows) == 1 + len(search.values)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"goals": [{"name": "beauty"}]}, "goals"),
        ({"goals": [{"name": "static", "weight": -1.0}]}, "weight"),
        ({"exit_points": {"reach": [0.1, 0.1]}}, "reach"),
        ({"exit_points": {"reach": [0.1, 0.1, 0.1], "cables": ["C9"]}}, "C9"),
        ({"mirrors": [{"axis": "w", "pairs": []}]}, "axis"),
        ({"mirrors": [{"axis": "x", "pairs": ["C1C2"]}]}, "such as C1-C4"),
        ({"cables": ["C1,C2"]}, "4 to 8 different cables"),
        ({"winch": {"drum_radius": [0.1, 0.05]}}, "least < largest"),
        ({"winch": {"drum_radius": [0.03, 0.05]}}, "motor_torque"),
        ({"exit_points": {"reach": [0.0, 0.0, 0.0]}}, "nothing that may change"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_bad_files_are_named(tmp_path, change, words):
    path = tmp_path / "design.yaml"
    good = {"exit_points": {"reach": [0.1, 0.1, 0.1]}, "goals": [{"name": "static"}]}
    path.write_text(yaml.safe_dump({**good, **change}))
    with pytest.raises(CdprError, match=words) as refused:
        make_candidates(ROBOT, load_design_settings(path), str(path))
    assert "design.yaml" in str(refused.value)


def test_poses_outside_the_frame_are_named(candidates):
    settings = wanted("static")
    settings.poses.upper = np.array([9.0, 0.0, 1.0])
    with pytest.raises(DesignError, match="leaves the frame"):
        goal_context(ROBOT, settings.poses, settings)


def command(capsys, robot, *words):
    """Code, output and messages of a design in the folder `found`."""
    with pytest.raises(SystemExit) as ended:
        main(["design", robot, *words, "--out", "found"])
    return ended.value.code, *printed(capsys)


def test_the_command(capsys, tmp_path, monkeypatch):
    pytest.importorskip("cmaes")
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "small.yaml"
    content = {
        "exit_points": {"reach": [0.1, 0.1, 0.1]},
        "mirrors": [{"axis": "x", "pairs": ["C1-C8", "C2-C7", "C3-C6", "C4-C5"]}],
        "goals": [{"name": "static"}],
        "poses": {"counts": [3, 3, 2]},
        "population": 4,
    }
    path.write_text(yaml.safe_dump(content))
    asked = ("--parameters", str(path), "--generations", "2", "--boxes", "200", "--json")
    code, out, _ = command(capsys, ROBOT, *asked)
    assert code == 0
    told = json.loads(out)
    assert told["coordinates"] == 12
    assert told["designs_judged"] == 8
    assert told["confirmed"][0]["goal"] == "static"
    assert load_robot("found/design/robot.yaml").title.startswith("acrobot_large, design of 8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "--goal: found none"),
        (["--goal", "beauty"], "'beauty' is unknown"),
        (["--goal", "static=0"], "a weight above 0"),
        (["--goal", "static", "--goal", "static"], "each goal once"),
        (["--goal", "wrench-feasible"], "--goal wrench-feasible: found no wrench to resist"),
        (["--goal", "static", "--search", "slopes"], "--search: found slopes for static"),
        (["--goal", "static", "--force", "-1"], "--force"),
        (["--goal", "static", "--parameters", "nowhere.yaml"], "there is no such file"),
    ],
)
def test_the_command_refuses(capsys, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    code, _, err = command(capsys, ROBOT, *words)
    assert code == 2
    assert said in err
    assert len(err) <= 500
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("robot", "goal", "said"),
    [
        ("nist_robocrane", "wrench-closure", " wrench-closure: found 6 cables of nist_robocrane"),
        ("planar", "payload", " payload: found the planar planar, whose plane carries the weight"),
        ("planar", "wrench-feasible", " wrench-feasible: found no wrench to resist"),
    ],
)
def test_goals_that_a_robot_cannot_be_asked_for_are_named_at_once(
    capsys, tmp_path, monkeypatch, robot, goal, said
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DesignError, match=f"^goals{said}"):
        optimize_design(robot, goals=goal, generations=1)
    code, _, err = command(capsys, robot, "--goal", goal)
    assert code == 2
    assert f"cdpr: --goal{said}" in err
    content = {"goals": [{"name": goal}], "exit_points": {"reach": [0.1, 0.1, 0.0]}}
    Path("goals.yaml").write_text(yaml.safe_dump(content))
    code, _, err = command(capsys, robot, "--parameters", "goals.yaml")
    assert code == 2
    assert f"cdpr: goals.yaml: goals{said}" in err


def test_a_set_of_too_few_cables_closes_nowhere():
    judging = goal_context("cogiro", wanted().poses, wanted())
    found = confirm("wrench-closure", "cogiro", "nist_robocrane", judging, boxes=20)
    assert found.design == found.design_open == 0.0


def test_slopes_find_a_better_design_with_few_and_go_on_where_they_were_stopped(tmp_path):
    """The capacity margin by points and by the winch, against what evolution finds with more."""
    settings = wanted("capacity-margin", search="slopes", generations=8)
    settings.winch.motor_torque = np.array([0.2, 0.8])
    found = make_candidates(ROBOT, settings, "test")
    whole = search_design(ROBOT, found, settings)
    assert len(whole.scores) <= 8
    assert not searched(tmp_path / "one", found, settings, 5).complete
    again = searched(tmp_path / "one", found, settings)
    np.testing.assert_array_equal(again.values, whole.values)
    assert again.complete
    pytest.importorskip("cmaes")
    other = replace(settings, search="evolution", generations=10)
    evolved = search_design(ROBOT, found, other)
    assert len(evolved.scores) > 4 * len(whole.scores)
    assert np.nanmax(whole.values) > np.nanmax(evolved.values)


def test_slopes_are_refused_for_goals_that_have_none(candidates):
    for names in (("static",), ("capacity-margin", "stiffness")):
        with pytest.raises(DesignError, match="accepted with slopes: one goal of capacity-margin"):
            search_design(ROBOT, candidates, wanted(*names, search="slopes"))


def test_slopes_of_a_design_are_those_of_differences():
    settings = wanted("capacity-margin", winches=True, counts=(2.0, 2.0, 1.0), force=1.0)
    settings.anchor_points.reach = np.full(3, 0.02)
    found = make_candidates(ROBOT, settings, "test")
    judging = goal_context(ROBOT, settings.poses, settings)
    x, step = np.random.default_rng(0).uniform(0.4, 0.6, found.size), 1e-5

    def values(at):
        return SLOPES["capacity-margin"](found, 0, at, judging)[0]

    _, slopes = SLOPES["capacity-margin"](found, 0, x, judging)
    for k in (0, 5, found.size // 2, found.size - 3, found.size - 2, found.size - 1):
        e = step * np.eye(found.size)[k]
        differences = (values(x + e) - values(x - e)) / (2.0 * step)
        np.testing.assert_allclose(slopes[:, k], differences, atol=1e-5 * np.max(np.abs(slopes)))


@pytest.mark.parametrize(("design", "sure"), [(1.4, True), (1.2, False), (0.9, False)])
def test_a_gain_is_sure_where_more_is_proven_than_the_robot_can_have(design, sure):
    proof = Confirmation("static", "boxes", "m^3", 1.0, design, 0.3, 0.0, True).as_dict()
    assert proof["sure_whatever_is_open"] == sure
    assert proof["gain"] == pytest.approx(design - 1.0)
