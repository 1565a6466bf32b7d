"""Every command that has a pose has one geometry, `--no-pulleys`, and names it in its result."""

from dataclasses import replace

import pytest
import yaml

import cdpr_drake as cdpr
from cdpr_drake.models.robot_loader import load_robot, robot_text
from tests.cli.commands import answer, told

PLACE = "0.1,0.05,0.3"
GRID = ("--grid", "0.1:0.1:1,0.05:0.05:1,0.3:0.3:1", "--workers", "1")
COMMANDS = {
    "tension": (f"--pose={PLACE}",),
    "static": (f"--pose={PLACE}",),
    "equilibria": ("--lengths", "L0", "--cable-model", "elastic", "--searches", "1"),
    "workspace": (*GRID, "--out", "w"),
    "stability": (*GRID, "--out", "s", "--verdict", "sampled", "--draws", "1"),
    "plan": ("--waypoints", f"{PLACE};0.1,0.05,0.31", "--stations", "10", "--no-track",
             "--out", "p"),
}  # fmt: skip
"""Words that ask for a pose, by their commands."""


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """ACROBOT over pulleys of 20 mm: its file, and its lengths at rest."""
    text = yaml.safe_load(robot_text("acrobot_large"))
    text["name"], text["pulley"]["radius"] = "wide", 0.02
    path = tmp_path_factory.mktemp("robots") / "wide.yaml"
    path.write_text(yaml.safe_dump(text))
    return str(path), ",".join(map(str, cdpr.solve_static(path).l0))


@pytest.mark.usefixtures("without_pictures", "here")
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_with_a_pose_names_its_geometry(name, wide, capsys):
    robot, lengths = wide
    asked = [name, robot, *(lengths if word == "L0" else word for word in COMMANDS[name])]
    more = ["--overwrite"] if "--out" in asked else []
    for options, words in (([], "with pulleys of 20 mm"), (["--no-pulleys"], "pulleys ignored")):
        assert words in " ".join(answer(capsys, *asked, *more, *options).split())


@pytest.mark.parametrize("words", ["with pulleys of 4.5 mm", "no pulleys in the robot"])
def test_a_robot_without_pulleys_is_told_so(words, capsys):
    name = "planar" if "4.5" in words else "kntu_planar"
    assert told(capsys, "tension", name)["geometry"] == words


def test_pulleys_of_several_sizes_and_at_the_platform_are_named():
    cables = load_robot("acrobot_large").cable_set()
    radii = cables.pulley_radius.copy()
    radii[0], radii[1:4] = 0.05, 0.0
    some = replace(cables, pulley_radius=radii)
    assert some.geometry_words() == "with pulleys of 4.5 to 50 mm on 5 of 8 cables"
    both = cables.over_platform_pulleys(0.01, cables.anchor_swivel_axis)
    assert both.geometry_words() == "with pulleys of 4.5 mm and pulleys of 10 mm at the platform"
    assert both.geometry_words(False) == "pulleys ignored"
    assert both.without_pulleys().geometry_words() == "no pulleys in the robot"


def test_poses_that_are_enumerated_ignore_pulleys_and_say_why(capsys):
    home = load_robot("grab_three").home.position
    words = cdpr.find_equilibria("grab_three", position=home).as_dict()["geometry"]
    assert words.startswith("pulleys ignored: all poses are found for cables from fixed")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((), "pulleys ignored"),
        (("cables.pulleys=true",),
         "with pulleys of 4.5 mm; in the controller's model pulleys ignored"),
        (("cables.pulleys=true", "controller.pulleys=true"), "with pulleys of 4.5 mm"),
    ],
)  # fmt: skip
def test_a_run_names_the_geometry_of_robot_and_controller(given, words):
    run = cdpr.simulate("acrobot_pbvs", ["duration=0.05", "camera.kind=projected", *given])
    assert run.as_dict()["geometry"] == words


def test_a_wrench_is_given_moments_first_or_by_force_and_moment(capsys):
    six = cdpr.solve_tensions("acrobot_large", wrench=[0.1, 0.2, 0.0, 1.0, 2.0, 3.0])
    parts = cdpr.solve_tensions("acrobot_large", force=[1.0, 2.0, 3.0], moment=[0.1, 0.2, 0.0])
    assert six.as_dict() == parts.as_dict()
    assert six.as_dict()["rows"][0] == "moment about x"
    line = ("tension", "acrobot_large")
    by_six = told(capsys, *line, "--wrench", "0.1,0.2,0,1,2,3")
    assert by_six == told(capsys, *line, "--force", "1,2,3", "--moment", "0.1,0.2,0")
    assert by_six["wrench_n_m_n"] == six.as_dict()["wrench_n_m_n"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"wrench": [0.0] * 6, "force": [0.0] * 3}, "wrench, force: found both"),
        ({"force": [0.0] * 6}, "force: found 6 numbers; accepted: 3"),
        ({"moment": [0.0, 0.0, float("nan")]}, "moment: found .*nan.*; accepted: finite"),
        ({"wrench": [1.0, 2.0, 3.0]}, "wrench: found 3 numbers; accepted: 6"),
    ],
)
def test_a_wrench_that_is_none_is_refused(given, words):
    with pytest.raises(cdpr.CdprError, match=words):
        cdpr.solve_tensions("acrobot_large", **given)


def test_an_infeasible_answer_says_by_how_much(capsys):
    line = ("tension", "acrobot_large", "--force", "0,0,-600")
    text = " ".join(answer(capsys, *line).split())
    assert "infeasible" in text
    assert "bounds missed by: " in text
    assert "wrench missed by: " in text
    missed = told(capsys, *line)["infeasible_by"]
    assert missed["beyond_bounds_n"] > 0.0
    assert {one["bound"] for one in missed["cables"]} == {"upper"}
    assert missed["missing_wrench"][5] < -1.0  # more weight than the cables take
    caroca = load_robot("caroca")
    far = [caroca.frame.upper[0] - 0.05, caroca.home.position[1], caroca.frame.upper[2] - 0.05]
    with pytest.raises(cdpr.CdprError, match=r"bounds missed by .*C"):
        cdpr.solve_static("caroca", pose=far, model="elastic")
