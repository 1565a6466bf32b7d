import numpy as np

from cdpr_drake.analyses.benchmarks.identification import calibration_works
from cdpr_drake.analyses.benchmarks.point_calibration import point_works

SAME = 1e-6
"""SciPy ends where its own differences let it, far below the deviations of 0.2 mm and more [m]."""

POINT_SAME = 2e-5
"""SciPy stops at a relative gain of 1e-8, within hundredths of deviations of 1 mm and more [m]."""


def test_both_ways_end_in_the_same_points():
    ours, scipy, unknowns = calibration_works(14)
    assert unknowns == 48 + 6 * 14
    np.testing.assert_allclose(ours(), scipy(), atol=SAME)


def test_the_two_ways_to_calibrate_a_point_mass_agree():
    ours, scipy, unknowns = point_works()
    assert unknowns == 12 + 1 + 3 * 35
    np.testing.assert_allclose(ours(), scipy(), atol=POINT_SAME)
