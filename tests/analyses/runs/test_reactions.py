"""A cable breaks under several reactions: what is compared, shown, kept and refused."""

import json

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError, StoppedError
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
    left, right = compared.plot().axes
    assert left.get_xlabel() == "largest excursion [mm]"
    assert [bar.get_width() for bar in right.patches] == [
        row["largest_speed_m_s"] for row in compared.rows.values()
    ]


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
}


@pytest.mark.parametrize("words", REFUSALS)
def test_what_is_refused(words):
    with pytest.raises(ScenarioError, match=words):
        cdpr.compare_reactions(**REFUSALS[words])
