"""The study of the cycle of slack: its prediction beside theory, and its words on made-up runs."""

from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.analyses.studies.slack_cycle import (
    CABLES,
    MATCHED,
    STUDY,
    LinearLoop,
    loop_of,
    measure,
    swing,
)
from tests.analyses.studies.made_up_studies import made, verdicts

MASS, OMEGA, RATE = 150.0, 15.0, 25.0
"""A mode such as that of CAROCA [kg, rad/s, Hz]."""

FIRST_ORDER = 0.05
"""What the formula of one mode leaves out, of second order in its rates per frequency."""


@pytest.mark.parametrize(("gain", "damping"), [(0.5, 30.0), (1.5, 100.0), (1.5, 400.0)])
def test_a_mode_grows_at_the_rate_of_the_formula(gain, damping):
    """Six equal modes, of which turns are damped as places are, that follow their commands."""
    one, K = np.eye(6), MASS * OMEGA**2 * np.eye(6)
    loop = LinearLoop(
        M=MASS * one, K=K, C=damping * one, per_command=K, per_rate=0.0 * one,
        slowest_hz=OMEGA / (2.0 * np.pi),
    )  # fmt: skip
    expected = 0.5 * (gain * np.cos(0.5 * OMEGA / RATE) - damping / MASS)
    pole = loop.growth(0.0, gain, RATE)
    if expected > -0.5 * gain:  # else the servo's own slow pole is the one that decays last
        assert pole.real == pytest.approx(expected, abs=FIRST_ORDER)
        assert abs(pole.imag) == pytest.approx(OMEGA, rel=FIRST_ORDER)


def test_the_boundary_is_where_growth_ends():
    loop = loop_of("sagging")
    edge = loop.boundary(1.5, RATE)
    assert loop.growth(edge - 1.0, 1.5, RATE).real > 0.0 > loop.growth(edge + 1.0, 1.5, RATE).real


def test_a_controller_that_knows_the_cables_needs_no_damping():
    assert loop_of(MATCHED).boundary(2.25, RATE) == 0.0
    assert all(loop_of(name).boundary(1.5, RATE) > 50.0 for name in CABLES if name != MATCHED)


def test_swing_of_a_drifting_sine():
    times = np.arange(0.0, 15.0, 0.02)
    path = np.outer(times, [1e-3, 0.0, 2e-3])
    path[:, 1] += 4e-3 * np.sin(2.0 * np.pi * 2.4 * times)
    amplitude, frequency = swing(path, 0.02)
    assert amplitude == pytest.approx(4e-3, rel=0.02)
    assert frequency == pytest.approx(2.4, abs=1.0 / 15.0)


def test_a_run_with_little_damping_cycles_and_one_with_matching_cables_does_not():
    for name, expected in (("sagging", True), (MATCHED, False)):
        keys = {"cables": name, "damping": 40.0, "gain": 2.25}
        found = measure(Case(name=name, keys=keys), 0)
        assert (found["cycles"], found["predicted"]) == (expected, expected), name


def made_up(case, seed, wrong=False):
    """As if the formula were exact; with `wrong` runs do the contrary."""
    cycles = case.keys["cables"] != MATCHED and case.keys["damping"] < 140.0 * case.keys["gain"]
    return {
        "outcome": "timeout", "amplitude_m": 0.01 if cycles else 1e-4, "frequency_hz": 2.4,
        "slack": 0.5, "cycles": bool(cycles != wrong), "growth": 0.1 if cycles else -0.1,
        "pole_hz": 2.4, "slowest_hz": 2.4, "predicted": bool(cycles), "formula": bool(cycles),
    }  # fmt: skip


def test_statements_tell_right_predictions_from_wrong_ones_and_are_drawn(tmp_path):
    found = made(STUDY, made_up, quick=False)
    assert set(verdicts(found).values()) == {"confirmed"}
    wrong = verdicts(made(STUDY, partial(made_up, wrong=True), quick=False))
    assert wrong["boundary"] == wrong["matched"] == "not confirmed"
    assert len(found.tables()) > 0
    found.write(tmp_path)
    assert (tmp_path / "slack_cycle.png").is_file()
