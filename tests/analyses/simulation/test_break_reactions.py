"""One break of a cable under several reactions: what a call compares, shows and refuses."""

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError, StoppedError
from cdpr_drake.systems.diagrams.load import load_scenario

SHORT = ("integration.engine=compiled",)
CABLE, TIME, AFTER = 5, 0.3, 0.3


@pytest.fixture(scope="module")
def compared():
    return cdpr.compare_reactions(
        cable=CABLE, time=TIME, after=AFTER, reactions=("none", "stop"), overrides=SHORT
    )


def test_it_is_what_runs_of_the_scenario_say(compared):
    scenario = load_scenario("acrobot_broken_redistributed", [
        *SHORT, f"failures.events=[{{kind: cable_breaks, time: {TIME}, cable: {CABLE}}}]",
        "emergency={reaction: stop, delay: 0.03}", f"duration={TIME + AFTER}", "log_rate=500",
    ])  # fmt: skip
    log = run_scenario(scenario).log
    since = log["time"] > TIME - 1e-3
    way = np.linalg.norm(log["X_WP"][since, 4:] - log["X_WP"][since][0, 4:], axis=1)
    assert compared.rows["stop"]["excursion_m"] == pytest.approx(way.max(), rel=1e-9)
    assert compared.rows["stop"]["tension_n"] == np.max(log["tensions"][since])
    assert compared.rows["none"]["excursion_m"] != compared.rows["stop"]["excursion_m"]


def test_it_shows_itself(compared):
    assert compared.cable == "C6"
    assert "none" in repr(compared)
    assert compared.as_dict()["reactions"].keys() == {"none", "stop"}
    assert compared.columns()["reaction"] == ["none", "stop"]
    left, right = compared.plot().axes
    assert left.get_xlabel() == "largest excursion [mm]"
    assert [bar.get_width() for bar in right.patches] == [
        row["largest_speed_m_s"] for row in compared.rows.values()
    ]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"reactions": ("pray",)}, "reactions: found 'pray'; accepted: none, stop, redistribute"),
        ({"reactions": ()}, "reactions: found none"),
        ({"cable": 8}, "cable: found 8; accepted: 0 to 7"),
        ({"time": 0.0}, "time: found 0; accepted: a number > 0"),
        ({"after": float("nan")}, "after: found nan"),
        ({"scenario": "planar_computed_torque"}, "found kind .*; accepted: a visual servo"),
    ],
)
def test_what_is_refused(asked, words):
    with pytest.raises(ScenarioError, match=words):
        cdpr.compare_reactions(**asked)


def test_it_stops_when_it_is_asked_to():
    with pytest.raises(StoppedError, match="after 0 of 1 reactions"):
        cdpr.compare_reactions(
            reactions=("none",), overrides=SHORT, session=cdpr.Session(should_stop=lambda: True)
        )
