"""A cable breaks under several reactions: what is compared, shown, kept and refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.breaks import after_break
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError, StoppedError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.cli.commands import told

SHORT = ("integration.engine=compiled",)
BREAK = {"cable": 5, "time": 0.3, "after": 0.3}


@pytest.fixture(scope="module")
def compared():
    return cdpr.compare_reactions(overrides=SHORT, reactions=("none", "stop"), **BREAK)


def test_it_says_what_runs_of_the_scenario_say(compared):
    scenario = load_scenario("acrobot_broken_redistributed", [
        *SHORT, "failures.events=[{kind: cable_breaks, time: 0.3, cable: 5}]",
        "emergency={reaction: stop, delay: 0.03}", "duration=0.6", "log_rate=500",
    ])  # fmt: skip
    log = ServoRun(scenario).simulate().log
    since = log["time"] > 0.3 - 1e-3
    way = np.linalg.norm(log["X_WP"][since, 4:] - log["X_WP"][since][0, 4:], axis=1)
    assert compared.rows["stop"]["excursion_m"] == pytest.approx(way.max(), rel=1e-9)
    assert compared.rows["stop"]["tension_n"] == np.max(log["tensions"][since])
    assert compared.rows["none"]["excursion_m"] != compared.rows["stop"]["excursion_m"]


def test_it_shows_itself(compared):
    assert compared.cable == "C6"
    assert compared.as_dict()["reactions"].keys() == {"none", "stop"}
    (table,) = compared.tables()
    assert table.title == "acrobot_broken_redistributed: C6 breaks at 0.3 s, pulleys ignored"
    assert [row[0] for row in table.rows] == compared.columns()["reaction"] == ["none", "stop"]
    for panel, label, name, factor in zip(
        compared.plot().axes, ("largest excursion [mm]", "largest speed [m/s]"),
        ("excursion_m", "largest_speed_m_s"), (1e3, 1.0), strict=True,
    ):  # fmt: skip
        assert panel.get_xlabel() == label
        widths = [factor * row[name] for row in compared.rows.values()]
        assert [bar.get_width() for bar in panel.patches] == pytest.approx(widths)
    ends = [row[-1] for row in table.rows]
    assert ends == ["timeout", "timeout"]
    gone = replace(compared, rows={"none": {**compared.rows["none"], "leaves": True}})
    assert gone.tables()[0].rows[0][-1].startswith("timeout, leaves the frame at")


def test_numbers_after_a_break_are_those_of_the_log():
    """It breaks at 0.2 s; from 0.3 s on the platform slides 2 cm in 0.2 s, and stands then."""
    robot = load_robot("acrobot_small")
    times, home = 0.1 * np.arange(8), robot.home.transform()
    x = 0.01 * np.array([0, 0, 0, 0, 1, 2, 2, 2.0])
    slack, tensions = np.zeros((8, 8)), np.full((8, 8), 10.0)
    slack[:, 5], slack[2:4, 1] = 1.0, 1.0  # one broke; another hangs for 0.2 s
    tensions[1, 0], tensions[4, 0] = 90.0, 30.0  # the larger one was before
    rows = np.tile(pose_row(home), (8, 1))
    rows[:, 4] += x
    log = {"time": times, "X_WP": rows, "slack": slack, "tensions": tensions}
    numbers = after_break(log, robot, 5, 0.2)
    expected = {
        "speed_m_s": 0.0, "excursion_m": 0.02, "turn_rad": 0.0, "largest_speed_m_s": 0.1,
        "impact_m_s": 0.0, "tension_n": 30.0, "slack_s": 0.2, "rest_s": 0.4,
    }  # fmt: skip
    assert {key: numbers[key] for key in expected} == pytest.approx(expected, abs=1e-9)
    assert not numbers["leaves"]
    rows[5:, 4] += 5.0
    assert after_break(log, robot, 5, 0.2)["leaves"]
    assert [after_break(log, robot, cable, 0.2)["holds"] for cable in (0, 5)] == [False, True]


def test_the_command_goes_on_where_it_was_stopped_and_says_the_same(compared, capsys, here):
    done = []
    follow = Follow(done.append, stop=lambda: bool(done) and done[-1].done >= 1)
    words = {"overrides": SHORT, "reactions": ("none", "stop"), "folder": here / "out", **BREAK}
    with pytest.raises(StoppedError, match="stopped after 1 of 2 reactions"):
        cdpr.compare_reactions(follow=follow, **words)
    command = ("reactions", "--cable", "5", "--time", "0.3", "--after", "0.3", "--reactions",
               "none,stop", "--set", *SHORT, "--out", "out")  # fmt: skip
    numbers = told(capsys, *command)
    assert numbers == compared.as_dict()
    assert told(capsys, *command) == numbers  # of a folder that is complete
    assert json.loads((here / "out" / "results.json").read_text()) == numbers
    assert (here / "out" / "reactions.png").is_file()


REFUSALS = {
    "reactions: found 'pray'; accepted: none, stop, redistribute": {"reactions": ("pray",)},
    "reactions: found none": {"reactions": ()},
    "cable: found 8; accepted: 0 to 7": {"cable": 8},
    "time: found 0; accepted: a number > 0": {"time": 0.0},
    "after: found nan": {"after": np.nan},
    "found kind .*; accepted: a visual servo": {"scenario": "planar_computed_torque"},
    "time: found 5; accepted: before the run of .* ends, 0.1": {
        "time": 5.0, "reactions": ("none",),
        "overrides": (*SHORT, "target.pose.position=[9, 9, 0]", "stop.target_lost=0.05"),
    },
}  # fmt: skip


@pytest.mark.parametrize("words", REFUSALS)
def test_what_is_refused(words):
    with pytest.raises(ScenarioError, match=words):
        cdpr.compare_reactions(**REFUSALS[words])
