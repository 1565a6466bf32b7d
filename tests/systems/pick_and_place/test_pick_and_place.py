"""Picking and placing in the plant: a short run by projected cameras, and what is refused."""

import json
import re

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus

from cdpr_drake.analyses.runs.pick_and_place import PickAndPlaceRun, shown_things
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Phase

NAME = "acrobot_pick_and_place"

SHORT = (
    "camera.kind=projected", "initial_pose={position: [-0.12, -0.05, 0.23]}",
    "goal.pose={position: [-0.09, 0.09, 0.11]}", "scatter={distance: 0.005, angle_deg: 2.0}",
    "handling={hover: 0.02, hold: 0.1, pause: 0.1, lambda_0: 4.0, lambda_infinity: 3.0}",
)  # fmt: skip
"""The scenario from a start near the box, with a goal near by."""

WEIGHT = 0.3 * 9.81

ACCEPTED_DISTANCE, ACCEPTED_ANGLE = 2e-3, float(np.radians(1.0))
"""What a box is set down within, by the study [m, rad]."""


@pytest.fixture(scope="module")
def run():
    cover = "cover={phase: carry, delay: 0.1, duration: 0.8}"
    return PickAndPlaceRun(load_scenario(NAME, [*SHORT, cover])).simulate()


def test_the_box_is_set_down_at_the_goal_with_its_tag_hidden_on_the_way(run):
    summary = run.as_dict()
    assert run.outcome == Outcome.COMPLETED, run.message
    assert summary["set_down_error_m"] < ACCEPTED_DISTANCE
    assert summary["set_down_error_rad"] < ACCEPTED_ANGLE
    assert summary["views"]["hidden_s"] == pytest.approx(0.8, abs=0.05)
    assert 0.7 < summary["views"]["unseen_s"] < 1.2
    assert summary["grip"]["mean_load_n"] == pytest.approx(WEIGHT, rel=0.15)
    carried = run.spans()[Phase.CARRY]
    hidden = run.log["time"][run.log["hidden"][:, 0] > 0.0]
    assert carried[0] < hidden[0] < hidden[-1] < carried[1]
    seen = run.log["found_goal"][run.log["hidden"][:, 0] > 0.0]
    assert np.mean(seen) < 0.1  # one image may be on its way


def test_the_weight_is_on_the_table_then_on_the_platform_then_on_the_table(run):
    log, spans = run.log, run.spans()
    load, times = log["load"][:, 0], log["time"]
    assert np.all(load[times < spans[Phase.GRASP][0]] == 0.0)
    carried = load[(times > spans[Phase.CARRY][0]) & (times < spans[Phase.CARRY][1])]
    assert np.mean(carried) == pytest.approx(WEIGHT, rel=0.02)
    assert load[-1] == 0.0
    # The box rests on four corners, which its weight presses 0.1 mm deep into two alike sides.
    assert log["X_WB"][-1, 6] == pytest.approx(0.11, abs=2e-4)
    still = log["X_WB"][times > times[-1] - 0.3, 4:]
    assert np.max(np.ptp(still, axis=0)) < 1e-4
    summary = run.as_dict()
    assert list(summary["phases"]) == [phase.word for phase in Phase if phase < Phase.DONE]
    whole = sum(span["duration_s"] for span in summary["phases"].values())
    assert whole == pytest.approx(run.sim_time, abs=0.15)
    facts = dict(run.facts(summary))
    assert "mm" in facts["set down"]
    assert "a tag was hidden" in facts["view"]


def test_its_replay_shows_box_tags_gripper_plate_and_both_cameras(run, tmp_path):
    assert list(run.figures()) == ["phases", "way", "tensions"]
    run.replay(tmp_path / "replay.html")
    page = (tmp_path / "replay.html").read_text(encoding="utf-8")
    assert "acrobot" in page.lower()
    assert len(page) > 1_000_000  # with a recording in it
    (notes,) = re.findall(r'id="cdpr-data">(.*?)</script>', page, re.DOTALL)
    assert [words for words, _ in json.loads(notes)["lines"]][-2:] == [
        "view of the camera for the box", "view of the camera for the goal",
    ]  # fmt: skip
    things = {thing.name: thing for thing in shown_things(run.scenario)}
    assert things["gripper"].quantity == things["goal_camera"].quantity == "X_WP"
    tip = things["gripper"].X_FG.translation() - [0.0, 0.0, 0.5 * things["gripper"].shape.length()]
    np.testing.assert_allclose(tip, run.scenario.gripper.tip, atol=1e-12)
    assert things["cover"].while_positive == "hidden"
    above = things["cover"].X_FG.translation() - things["goal_tag"].X_FG.translation()
    assert 0.0 < above[2] < 0.01
    assert np.linalg.norm(above[:2]) < 1e-6
    run.plot("phases")


def test_a_live_view_shows_a_plate_that_lies_over_a_tag_at_times(run):
    """It has moved the box, and looked whether the plate is there, at the end of a step."""
    meshcat, built = open_meshcat(), run.built
    simulator = Simulator(built.diagram, built.make_context())
    run.live(meshcat)(simulator, built.diagram)
    status = simulator.get_monitor()(simulator.get_context())
    assert status.severity() == EventStatus.Succeeded().severity()
    assert meshcat.HasPath("/drake/things/cover")


def test_a_box_out_of_reach_is_missed_and_said_so():
    ended = PickAndPlaceRun(load_scenario(NAME, [*SHORT, "gripper.reach=1e-6"])).simulate()
    assert ended.outcome == Outcome.FAILED
    assert "grasp: the box was out of the gripper's reach" in ended.message
    assert "; found " in ended.message
    assert "accepted: at most 0.001 mm" in ended.message
    assert np.allclose(ended.log["X_WB"][0], ended.log["X_WB"][-1], atol=2e-3)


REFUSALS = {
    "world.contact: found null": "world.contact=null",
    "goal.tag.tag_id: found 0, that of the box": "goal.tag.tag_id=0",
    "workpiece.mass": "workpiece.mass=-1",
    "is not on the box's upper face": "workpiece.tag.position=[0.09, 0.0]",
    "the box lies on the tag": "goal.tag.position=[0.0, 0.0]",
    "goal.pose.position: found [2.0, 0.0, 0.11]": "goal.pose={position: [2.0, 0.0, 0.11]}",
    "workpiece.pose.angles_deg": "workpiece.pose.angles_deg=[5.0, 0.0, 0.0]",
    "cover.phase: found retreat": "cover={phase: retreat}",
    "cover.duration: found 30 s": "cover={phase: carry, duration: 30.0}",
    "camera.mount": "camera.mount=elsewhere",
    "accepted: one that moves freely": "robot=planar",
    "integration.engine": "integration.engine=compiled",
}


@pytest.mark.parametrize("words", REFUSALS)
def test_what_cannot_be_is_refused_by_its_name(words):
    with pytest.raises(ScenarioError, match=re.escape(words)) as caught:
        load_scenario(NAME, [REFUSALS[words]])
    assert "accepted" in str(caught.value) or "known" in str(caught.value)
