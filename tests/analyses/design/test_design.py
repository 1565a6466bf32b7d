"""Designs as robot files, their goals, the search that continues, and the proof."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

import cdpr_drake as cdpr
from cdpr_drake.analyses.design import search
from cdpr_drake.analyses.design.candidates import make_candidates
from cdpr_drake.analyses.design.confirmation import Confirmation, confirm
from cdpr_drake.analyses.design.goals import GOALS
from cdpr_drake.analyses.design.search import SLOPES, evaluate_design, goal_context, search_design
from cdpr_drake.analyses.design.settings import DesignSettings, GoalSettings, load_design_settings
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.frame.job import FinishedJob, ProcessDied
from cdpr_drake.errors import CdprError, DesignError, SweepError
from cdpr_drake.models.robot_loader import load_robot
from tests.cli.commands import refuse, told

ROBOT = "acrobot_large"


def small(*goals, winches=False, counts=(3.0, 3.0, 2.0), **changed):
    """Settings of a small search; `winches`: their torque and drums may change, too."""
    settings = DesignSettings(goals=[GoalSettings(name=name) for name in goals])
    settings.exit_points.reach = np.full(3, 0.1)
    settings.poses.counts = np.array(counts)
    settings.force, settings.generations, settings.population = 5.0, 3, 4
    if winches:
        settings.winch.motor_torque = np.array([0.2, 0.8])
        settings.winch.drum_radius = np.array([0.02, 0.08])
    return replace(settings, **changed)


def searched(settings):
    """A search that is not kept."""
    return search_design(make_candidates(ROBOT, settings), settings, goal_context(ROBOT, settings))


@pytest.fixture(scope="module")
def candidates():
    return make_candidates(ROBOT, small("static"))


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
    settings = small("power", "speed", winches=True, cables=sets)
    designs = make_candidates(ROBOT, settings)
    middle = np.full(designs.size, 0.5)
    robot = designs.robot(0, middle)
    assert [cable.name for cable in robot.cables] == ["C1", "C3", "C5", "C7"]
    assert robot.winch.motor_torque == pytest.approx(0.4)  # between, in ratios
    assert robot.winch.drum_radius == pytest.approx(0.04)
    assert robot.tension_bounds.upper == pytest.approx(0.4 * 10.0 / 0.04)
    judging, names = goal_context(ROBOT, settings), ("power", "speed")
    power, speed = evaluate_design(designs, judging, names, (0, middle))
    rate = 3000.0 * 2.0 * np.pi / 60.0
    assert power == pytest.approx(-4 * 0.4 * rate)  # less is better
    assert speed == pytest.approx(rate / 10.0 * 0.04)


@pytest.mark.parametrize("name", [name for name in GOALS if name != "power"])
def test_every_goal_is_a_number(name, candidates):
    judging = goal_context(ROBOT, small(name, counts=(2.0, 2.0, 2.0)))
    (value,) = evaluate_design(candidates, judging, (name,))
    assert np.isfinite(value)
    if name == "accuracy":  # an exit point that is off by 1 mm moves the platform by millimetres
        assert 1e-4 < -value < 3e-2


def kept(folder, settings, most=None):
    """A design that is kept in a folder, stopped after `most` designs."""
    calls = itertools.count()
    follow = Follow(stop=lambda: most is not None and next(calls) >= most)
    return cdpr.optimize_design(ROBOT, parameters=settings, boxes=50, folder=folder, follow=follow)


@pytest.mark.parametrize(
    ("settings", "designs"),
    [
        (small("wrench-feasible"), 12),
        (small("capacity-margin", search="slopes", generations=8, winches=True), 8),
    ],
    ids=["evolution", "slopes"],
)
def test_a_search_that_was_stopped_goes_on_as_if_it_had_not(tmp_path, settings, designs):
    pytest.importorskip("cmaes")
    whole, out = searched(settings), tmp_path / "out"
    assert len(whole.values) == designs
    part = kept(out, settings, 6)
    assert part.exit_code == 130
    assert not (out / "design").exists()
    with (out / "judged.jsonl").open("a") as file:
        file.write('["set0-gener')  # as a kill leaves it
    again = kept(out, settings)
    assert again.complete
    assert again.earlier == 6
    assert np.array_equal(again.values, whole.values)
    assert np.array_equal(again.coordinates, whole.coordinates)
    best = make_candidates(str(again.file), settings)
    goals = evaluate_design(best, again.judging, again.names)
    assert goals == pytest.approx(again.values[again.best])
    if settings.search == "evolution":
        more = kept(out, replace(settings, generations=4))
        assert len(more.values) == designs + 4
        assert more.earlier == designs


def test_a_process_that_dies_ends_the_search_and_is_no_bad_design(monkeypatch):
    died = FinishedJob(0, problem=ProcessDied("its process died"))
    monkeypatch.setattr(search, "finished_jobs", lambda *_, **__: [died])
    with pytest.raises(SweepError, match="its process died"):
        searched(small("capacity-margin", search="slopes"))


def test_slopes_find_a_better_design_than_evolution_with_more():
    pytest.importorskip("cmaes")
    settings = small("capacity-margin", search="slopes", generations=8)
    settings.winch.motor_torque = np.array([0.2, 0.8])
    climbed = searched(settings)
    evolved = searched(replace(settings, search="evolution", generations=10))
    assert len(evolved.scores) > 4 * len(climbed.scores)
    assert np.nanmax(climbed.values) > np.nanmax(evolved.values)


def test_slopes_of_a_design_are_those_of_differences():
    settings = small("capacity-margin", winches=True, counts=(2.0, 2.0, 1.0), force=1.0)
    settings.anchor_points.reach = np.full(3, 0.02)
    designs = make_candidates(ROBOT, settings)
    judging, size = goal_context(ROBOT, settings), designs.size
    x, step = np.random.default_rng(0).uniform(0.4, 0.6, size), 1e-5

    def values(x):
        return SLOPES["capacity-margin"](designs, 0, judging, x)[0]

    _, slopes = SLOPES["capacity-margin"](designs, 0, judging, x)
    for k in (0, 5, size // 2, size - 3, size - 2, size - 1):
        e = step * np.eye(size)[k]
        differences = (values(x + e) - values(x - e)) / (2.0 * step)
        np.testing.assert_allclose(slopes[:, k], differences, atol=1e-5 * np.max(np.abs(slopes)))


def test_several_goals_and_sets_of_cables_make_a_front(tmp_path):
    pytest.importorskip("cmaes")
    sets = ["C1,C2,C3,C4,C5,C6,C7", "C1,C3,C5,C7"]
    goals = ("static", "speed", "cables")
    design = kept(tmp_path / "out", small(*goals, winches=True, cables=sets, generations=1))
    assert set(design.sets.tolist()) == {0, 1}
    assert len(design.plot("pareto").axes) == 2
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert len(results["front"]) == len(design.front) >= 1
    rows = (tmp_path / "out" / "designs.csv").read_text().splitlines()
    assert len(rows) == 1 + len(design.values)


def test_confirmation_proves_less_than_the_grid_says():
    judging = goal_context(ROBOT, small("static"))
    proof = confirm("static", ROBOT, ROBOT, judging, boxes=300)
    assert proof.original == proof.design
    assert 0.0 <= proof.original <= np.prod([1.2, 1.2, 1.2])
    assert not proof.as_dict()["sure_whatever_is_open"]
    assert confirm("speed", ROBOT, ROBOT, judging) is None
    few = confirm("wrench-closure", "cogiro", "nist_robocrane", goal_context("cogiro", small()),
                  boxes=20)  # fmt: skip
    assert few.design == few.design_open == 0.0  # a set of too few cables closes nowhere


@pytest.mark.parametrize(("design", "sure"), [(1.4, True), (1.2, False), (0.9, False)])
def test_a_gain_is_sure_where_more_is_proven_than_the_robot_can_have(design, sure):
    proof = Confirmation("static", "boxes", "m^3", 1.0, design, 0.3).as_dict()
    assert proof["sure_whatever_is_open"] == sure
    assert proof["gain"] == pytest.approx(design - 1.0)


def test_the_command(capsys, tmp_path, monkeypatch):
    pytest.importorskip("cmaes")
    monkeypatch.chdir(tmp_path)
    content = {
        "exit_points": {"reach": [0.1, 0.1, 0.1]},
        "mirrors": [{"axis": "x", "pairs": ["C1-C8", "C2-C7", "C3-C6", "C4-C5"]}],
        "goals": [{"name": "static"}],
        "poses": {"counts": [3, 3, 2]},
        "population": 4,
    }
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(content))
    line = f"design {ROBOT} --parameters small.yaml --generations 2 --boxes 200 --out new"
    answer = told(capsys, *line.split())
    assert answer["coordinates"] == 12
    assert answer["designs_judged"] == 8
    assert answer["confirmed"][0]["goal"] == "static"
    assert load_robot("new/design/robot.yaml").title.startswith("acrobot_large, design of 8")


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


def test_poses_outside_the_frame_are_named():
    settings = small("static")
    settings.poses.upper = np.array([9.0, 0.0, 1.0])
    with pytest.raises(DesignError, match="leaves the frame"):
        goal_context(ROBOT, settings)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (ROBOT, "--goal: found none"),
        (f"{ROBOT} --goal beauty", "'beauty' is unknown"),
        (f"{ROBOT} --goal static=0", "a weight above 0"),
        (f"{ROBOT} --goal static --goal static", "each goal once"),
        (f"{ROBOT} --goal static --search slopes", "--search: found slopes for static"),
        (f"{ROBOT} --goal capacity-margin --goal stiffness --search slopes",
         "accepted with slopes: one goal of capacity-margin"),
        (f"{ROBOT} --goal static --force -1", "--force"),
        (f"{ROBOT} --goal static --parameters nowhere.yaml", "there is no such file"),
        (f"{ROBOT} --goal wrench-feasible", "--goal wrench-feasible: found no wrench to resist"),
        ("nist_robocrane --goal wrench-closure",
         "--goal wrench-closure: found 6 cables of nist_robocrane"),
        ("planar --goal payload", "--goal payload: found the planar planar, whose plane carries"),
    ],
)  # fmt: skip
def test_the_command_refuses(capsys, tmp_path, monkeypatch, line, words):
    monkeypatch.chdir(tmp_path)
    said = refuse(capsys, "design", *line.split(), "--out", "new")
    assert words in said
    assert len(said) <= 500
    assert not list(tmp_path.iterdir())


def test_goals_of_a_file_that_a_robot_cannot_be_asked_for_name_the_file(capsys, tmp_path):
    path, content = tmp_path / "goals.yaml", {"goals": [{"name": "payload"}]}
    path.write_text(yaml.safe_dump({**content, "exit_points": {"reach": [0.1, 0.1, 0.0]}}))
    said = refuse(capsys, "design", "planar", "--parameters", path, "--out", tmp_path / "new")
    assert f"cdpr: {path}: goals payload: found the planar planar" in said
    with pytest.raises(DesignError, match=r"^goals payload: found the planar planar"):
        cdpr.optimize_design("planar", goals="payload", generations=1)
