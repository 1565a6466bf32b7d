"""Metrics and verdicts of case study IX by torque, on made-up runs."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.tension_cases.case_9_torque import (
    CHECKS,
    FRICTIONS,
    SLACKS_CM,
    below_after_taut,
    lowest_after_taut,
    slack_after_taut,
)
from tests.analyses.studies.made_runs import made_run, made_runs


def traces(*rows):
    return {"time": 0.1 * np.arange(len(rows)), "tensions": np.array(rows, float)}


def test_slack_counts_from_when_all_cables_pull():
    found = traces([0, 5], [0, 5], [2, 5], [0, 0], [1.5, 4], [1.2, 3])
    assert slack_after_taut(found) == pytest.approx(0.2)  # two cables for a tenth of a second
    assert lowest_after_taut(found) == 0.0
    assert below_after_taut(found) == pytest.approx(0.1)
    assert below_after_taut(traces([0, 5], [2, 5], [3, 4])) == 0.0
    assert np.isnan(below_after_taut(traces([0, 5], [2, 0])))
    assert slack_after_taut(traces([0, 5], [2, 5], [3, 4])) == 0.0
    assert np.isnan(slack_after_taut(traces([0, 5], [2, 0])))
    assert np.isnan(lowest_after_taut(traces([0, 5], [2, 0])))


GOOD = {
    "largest_excess_n": 0.0, "within_limits": True, "rates_within_limit": True,
    "lowest_tension_n": 1.1, "highest_tension_n": 12.0, "largest_rate_n_per_s": 200.0,
    "relaxed_share": 0.0,
}  # fmt: skip


def made(worst, **metrics):
    """All configurations with good ends, but one, which gets `worst` in its summary."""
    runs = []
    for slack in SLACKS_CM:
        for name in (f"velocity_{slack}cm", *(f"torque_{slack}cm_{f}" for f in FRICTIONS)):
            numbers = {
                "position_error_m": 2e-4, "rotation_error_rad": 1e-3, "slack_after_s": 0.0,
                "time_to_taut_s": 0.2 * slack, "below_after_s": 0.0,
            }  # fmt: skip
            torque = dict(GOOD)
            if name == "torque_8cm_more_30":
                numbers |= metrics
                torque |= worst
            runs.append(made_run(name, "timeout", summary={"torque_control": torque}, **numbers))
    return [check.judge(made_runs(runs)).verdict for check in CHECKS]


def test_what_is_good_is_confirmed_and_one_bad_run_of_all_is_not():
    assert made({}) == ["confirmed"] * 7
    assert made({}, position_error_m=6e-4)[2] == "not confirmed"
    assert made({"within_limits": False, "largest_excess_n": 0.2})[3] != "confirmed"
    assert made({"rates_within_limit": False})[3] != "confirmed"
    assert made({}, slack_after_s=0.01)[4] == "not confirmed"
    assert made({"relaxed_share": 0.06})[6] == "not confirmed"
