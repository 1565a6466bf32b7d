"""From where on a result is no fit, a sensor is bad, and outliers are many."""

from dataclasses import fields

import numpy as np
import pytest

from cdpr_drake.analyses.fits.figures import fit_figure
from cdpr_drake.analyses.fits.fit import Fit as Fitted
from cdpr_drake.analyses.fits.verdict import (
    bad_sensors,
    many_outliers,
    misfits,
    with_enlarged_deviations,
)
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.result import CalibrationResult, Fit, Outlier
from tests.figure_faults import figure_faults


def outlier(number, what="length of cable 2"):
    return Outlier(number, what, 0.05, -50.0, "lengths", "m")


def result(**given):
    """One of which nothing else is looked at."""
    nothing = dict.fromkeys(field.name for field in fields(CalibrationResult))
    known = {"outliers": (), "largest": (outlier(7),), "residuals": {}}
    return CalibrationResult(**{**nothing, **known, **given})


@pytest.mark.parametrize(
    ("spread", "degrees", "fits"),
    [(3.0, 4, True), (3.1, 4, False), (3.1, 1, False), (30.0, 0, True)],
)
def test_residuals_of_three_sigmas_are_a_fit_and_more_are_none(spread, degrees, fits):
    """Without a degree of freedom there is nothing to tell it by."""
    why = (
        f"residuals are {spread:g} sigmas, root mean square; accepted: at most 3",
        "largest: row 8, length of cable 2, off by 0.05 m, 50 sigmas",
    )
    of = result(chi_square=spread**2 * degrees, degrees=degrees)
    assert misfits(of) == (() if fits else why)


@pytest.mark.parametrize(
    ("count", "dropped", "fits"),
    [(1, 2, True), (6, 3, True), (5, 3, False), (20, 10, True), (19, 10, False), (0, 3, False)],
)
def test_more_than_a_third_and_three_at_least_are_another_thing(count, dropped, fits):
    kinds = {"lengths": Fit(count, 1.0, 2.0, dropped), "swivel angles": Fit(9, 1.0, 2.0)}
    why = misfits(result(chi_square=1.0, degrees=1, residuals=kinds))
    said = f"{dropped} of {count + dropped} lengths do not fit: sign, unit or zero?"
    assert why[:-1] == (() if fits else (said,))


@pytest.mark.parametrize(
    ("readings", "dropped", "bad"),
    [(3, 3, False), (4, 2, False), (4, 3, True), (10, 5, False), (10, 6, True)],
)
def test_a_sensor_that_is_off_half_of_the_time_is_named(readings, dropped, bad):
    what = "length of cable 2"
    off = [outlier(k) for k in range(dropped)] + [outlier(0, "length of cable 1")]
    found = bad_sensors(
        result(outliers=tuple(off), readings={what: readings, "length of cable 1": 10})
    )
    said = f"{dropped} of {readings} readings of {what} do not fit: sign, unit or zero?"
    assert found == ((said,) if bad else ())


@pytest.mark.parametrize(
    ("outliers", "degrees", "many"), [(2, 20, False), (3, 20, True), (1, 9, True), (3, 0, False)]
)
def test_outliers_beyond_a_tenth_are_many(outliers, degrees, many):
    of = result(outliers=tuple(outlier(k) for k in range(outliers)), degrees=degrees)
    alone, several = many_outliers(of, 1), many_outliers(of, 2)
    assert len(alone) == len(several) == many
    if many:
        assert alone[0].startswith(f"{outliers} outliers beside {degrees} degrees of freedom")
        assert "minima" not in alone[0]
        assert several[0].endswith("; starts ended in 2 minima, of which this is the best")


def fit(chi_square, outliers=()):
    """A fit of 100 degrees of freedom and two poses, whose deviations are all 1."""
    return result(
        chi_square=chi_square, robust_cost=chi_square + 16.0 * len(outliers), degrees=100,
        outliers=outliers, std=np.ones(1), covariance=np.eye(1), information=np.eye(1),
        pose_std=np.ones((2, 2)),
    )  # fmt: skip


def fault(test, moves, rows=()):
    words = f"a {test}"
    return GroupFault(test, "lengths", "lengths", rows, 1.0, 0.1, 1e-9, moves, words, counts=False)


def test_deviations_are_as_large_as_residuals_say():
    """Three standard deviations of chi-square, 42.4, are beyond chance; outliers count as 16."""
    same, words = with_enlarged_deviations(fit(120.0), ())
    assert words == ()
    assert same.std[0] == same.pose_std[0, 0] == 1.0
    larger, words = with_enlarged_deviations(fit(116.0, (outlier(0),) * 4), ())
    scale = np.sqrt(180.0 / 104.0)
    assert larger.std[0] == larger.pose_std[0, 0] == pytest.approx(scale)
    assert larger.covariance[0, 0] == 1.0 / larger.information[0, 0] == pytest.approx(scale**2)
    assert words[0].startswith(f"residuals are {scale:.3g} times what sigmas say")


def test_deviations_of_poses_hold_errors_that_are_no_misfit():
    larger, words = with_enlarged_deviations(fit(90.0), (fault("factor", 2.0), fault("jump", 1.0)))
    assert larger.std[0] == 1.0
    assert larger.pose_std[1, 1] == pytest.approx(np.sqrt(5.0))
    assert words == ("standard deviations of poses are 2.24 times larger for these errors",)


def test_a_row_that_contradicts_itself_is_as_unsure_as_what_was_thrown_out():
    of = fit(60.0, (outlier(1),))
    larger, _ = with_enlarged_deviations(of, (fault("rows", np.inf, (1,)),))
    np.testing.assert_allclose(larger.pose_std, [[1.0, 1.0], [50.0, 50.0]])


@pytest.mark.parametrize("spread", [1.0, 4.0])
def test_the_figure_says_why_it_is_no_fit(spread):
    of = result(chi_square=spread**2 * 40, degrees=40)
    kind = {"count": 40, "rms_sigmas": spread, "largest_sigmas": 9.0, "dropped": 0}
    fitted = Fitted(
        title="Calibration of planar", model=None, status="", unknowns=(), spread=spread,
        misfit=misfits(of), residuals={"lengths": kind, "tag corners": kind | {"dropped": 2}},
    )  # fmt: skip
    figure = fit_figure(fitted, [("exit_points", "m", np.array([0.01]), np.array([0.001]))])
    assert figure_faults(figure) == []
    title = " ".join(figure.get_suptitle().split())
    fits = spread < 3.0
    assert ("does not fit" in title) is not fits
    assert ("residuals are 4 sigmas, root mean square; accepted: at most 3" in title) is not fits
