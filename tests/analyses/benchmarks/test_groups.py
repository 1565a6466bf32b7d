"""Rows of every group of benchmarks: each says what its ratio is; no time is asserted."""

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS
from cdpr_drake.analyses.benchmarks.planning import station_programs
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
)
from cdpr_drake.analyses.reporting.timing import interleaved, seconds_per_call
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from tests.analyses.benchmarks.once import without_repeats

FASTER = ("times faster", "times as fast", "real-time factor", "in the time of one")
"""Words by which a ratio is how much faster what is timed is than what it is compared with."""

RATES = ("/s", "per s of processor time", "per second of processor time")
"""Ends of units of what is larger where it is faster."""

PHYSICS = 19 + 7 + 3
"""Rows of statics, of closed loops with physical effects, and of what cables do besides."""


@pytest.fixture(scope="module", params=sorted(BENCH_GROUPS))
def rows(request):
    with pytest.MonkeyPatch.context() as patch:
        without_repeats(patch)
        found = BENCH_GROUPS[request.param](True)
    assert found or request.param == "learning", "there are none without Gymnasium only"
    assert request.param != "physics" or len(found) == PHYSICS
    return found


def test_every_row_of_a_group_says_what_its_ratio_is(rows):
    for row in rows:
        assert row.value > 0.0, row
        assert row.baseline_value > 0.0, row
        assert row.as_dict()["ratio_means"], row
        expected = row.baseline_value / row.value
        if row.unit.endswith(RATES) or not any(words in row.ratio_means for words in FASTER):
            expected = row.value / row.baseline_value
        if "two cores" in row.ratio_means:
            expected *= 2.0
        assert row.ratio == pytest.approx(expected), row


def test_rows_of_a_group_have_names_of_their_own(rows):
    assert len({(row.name, row.baseline) for row in rows}) == len(rows)


def test_interleaved_takes_turns_and_drops_the_first():
    calls = []

    def work(name, values):
        def call():
            calls.append(name)
            return next(values)

        return call

    medians = interleaved([work("a", iter([99.0, 1, 2, 3])), work("b", iter([99.0, 7, 5, 6]))], 3)
    assert medians == [2, 6]
    assert "".join(calls) == "abababab"


def test_seconds_per_call_calls():
    calls = []
    assert seconds_per_call(lambda: calls.append(1), 7) >= 0.0
    assert len(calls) == 7


def test_the_baseline_of_planning_asks_the_same_limits():
    """Without limits of speeds the largest (ds/dt)^2 of a station is that of HiGHS."""
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(tensions=(1.0, 60.0), cable_speed=1e3, reserve=RESERVE))
    poses = [
        pose_from_angles(np.array(p), np.zeros(3))
        for p in ([0, 0, 0.2], [0.15, -0.1, 0.4], [-0.1, 0.1, 0.3])
    ]
    path = make_path(robot, poses, "smooth")
    plan = plan_along_path(task, path, 20)
    programs = station_programs(task, path, plan.trajectory.stations[4:-4:4])
    highs = [linprog(**program, method="highs").x[1] for program in programs]
    np.testing.assert_allclose(np.minimum(plan.largest[4:-4:4], 100.0), highs, rtol=1e-6)
