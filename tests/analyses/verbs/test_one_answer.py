"""One robot, one answer: can it be held here? Every call, all robots that ship, ten poses each."""

import pytest

import cdpr_drake as cdpr
from cdpr_drake.models.robot_loader import load_robot, robot_names
from tests.analyses.verbs.one_answer import SAGGING, agreement, answers_at, poses_of


@pytest.mark.parametrize("name", robot_names())
def test_every_call_gives_the_same_answer_or_its_reason(name):
    counts, silent = agreement(name)
    assert not silent
    both = counts["solve_tensions"]
    assert both["held"] > 0, "no pose is inside: the poses say nothing"
    assert both["not held"] > 0, "no pose is outside: the poses say nothing"


def flipped(robot):
    """A pose of the robot's poses whose answer depends on its pulleys; None: there is none."""
    for X_WP in poses_of(robot, count=20):
        told = [cdpr.solve_tensions(robot, X_WP, pulleys=p).status for p in (True, False)]
        if told[0] != told[1]:
            return X_WP
    return None


@pytest.mark.parametrize("name", ["caroca", "ipanema_1"])
def test_where_pulleys_decide_every_call_decides_with_them_and_without(name):
    robot = load_robot(name)
    X_WP = flipped(robot)
    assert X_WP is not None
    told = {}
    for pulleys in (True, False):
        answers = answers_at(robot, X_WP, pulleys)
        straight = [one for one in answers.values() if one.reason() != SAGGING]
        held = {one.held for one in straight if one.held is not None}
        assert len(held) == 1, answers
        told[pulleys] = held.pop()
        words = robot.geometry_words(pulleys)
        assert "pulleys of" in words if pulleys else words == "pulleys ignored"
        for one in answers.values():
            assert not one.geometry or one.geometry.startswith(words)
    assert told[True] != told[False]
