"""The baseline of the benchmark computes the same as what it is compared with."""

import numpy as np

from cdpr_drake.analyses.benchmarks.servo import (
    CORRECTIONS,
    SCENARIOS,
    Correction,
    Step,
    correction_row,
    numpy_step,
    texture_rows,
)
from cdpr_drake.systems.controllers.schemes import SCHEMES
from cdpr_drake.systems.diagrams.load import load_scenario

ROUND_OFF = 1e-10
"""Of cable velocities below 1 m/s, after two pseudo-inverses."""


def test_numpy_baseline_agrees_with_the_step():
    scenario = load_scenario(SCENARIOS["ibvs"], ["controller.sigma=null"])
    step = Step(scenario)
    expected = numpy_step(step, scenario)()
    assert np.max(np.abs(expected)) > 1e-2
    np.testing.assert_allclose(step(), expected, rtol=0.0, atol=ROUND_OFF)


def test_every_scheme_is_timed():
    assert list(SCENARIOS) == list(SCHEMES)
    for scheme, name in SCENARIOS.items():
        scenario = load_scenario(name)
        assert scenario.controller.scheme == scheme
        assert np.all(np.isfinite(Step(scenario)()))


def test_every_kind_of_correction_is_timed_and_corrects():
    for section in CORRECTIONS.values():
        changes = [f"tension_management={section}", "camera.kind=projected"]
        added = Correction(load_scenario("acrobot_slack_start", changes))()
        assert added.shape == (8,)
        assert np.min(added) < 0.0
    row = correction_row("constant", repeats=1, calls=3)
    assert row.value > 0.0
    assert row.ratio == row.value / row.baseline_value


def test_textures_are_timed_beside_a_tag():
    followed, anywhere = texture_rows(repeats=1, calls=1)
    for row in (followed, anywhere):
        assert row.value > 0.0
        assert row.ratio == row.value / row.baseline_value
