"""What is a fit: residuals, outliers, systematic errors with their reason, and their figures.

`attack` has a whole table of systematic errors; here is a cheap part of it.
"""

import json
from dataclasses import fields, replace
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.fits import swings
from cdpr_drake.analyses.fits.figures import correlation_figure, fit_figure
from cdpr_drake.analyses.fits.fit import Fit as Fitted
from cdpr_drake.analyses.fits.fit import Unknown
from cdpr_drake.analyses.fits.identification import parameter_figure
from cdpr_drake.analyses.fits.robots import calibration_model
from cdpr_drake.analyses.fits.verdict import (
    bad_sensors,
    many_outliers,
    misfits,
    with_enlarged_deviations,
)
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.calibration.fit_groups import GroupFault
from cdpr_drake.calibration.result import CalibrationResult, Fit, Outlier
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from tests.analyses.fits.attack import attacks, clean, hangprinter, outcome, scene
from tests.analyses.fits.logs import numbers
from tests.figure_faults import figure_faults


def outlier(number, what="length of cable 2"):
    return Outlier(number, what, 0.05, -50.0, "lengths", "m")


def result(**values):
    """One of which nothing else is looked at."""
    nothing = dict.fromkeys(field.name for field in fields(CalibrationResult))
    usual = {"outliers": (), "largest": (outlier(7),), "residuals": {}}
    return CalibrationResult(**{**nothing, **usual, **values})


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
    what, other = "length of cable 2", "length of cable 1"
    off = (*(outlier(k) for k in range(dropped)), outlier(0, other))
    words = bad_sensors(result(outliers=off, readings={what: readings, other: 10}))
    said = f"{dropped} of {readings} readings of {what} do not fit: sign, unit or zero?"
    assert words == ((said,) if bad else ())


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


# Logs with systematic errors.

ROWS = 20
"""Of a log that is attacked."""

SAME = 2e-3
"""Distances of exit points by noise of a millimetre in 99 rows [m]."""


@pytest.fixture(scope="module")
def scenes():
    scenes = {name: scene(name, ROWS) for name in ("tracked8", "blind4")}
    return {**scenes, "hangprinter": hangprinter()}


@pytest.mark.parametrize(
    ("name", "attack", "words"),
    [
        ("blind4", "-roll", "all fits with the sign of roll turned"),
        ("blind4", "-swivel of cable 1", "the sign of the swivel angles of C1 turned"),
        ("blind4", "50 % of rows, mixed, x 1.05", "times what fits the other rows"),
        ("blind4", "30 % of rows, the first, x 1.05", "are 1.049 times what fits the other rows"),
        ("tracked8", "cables 1, 2 swapped", "length of C1 and length of C2 exchanged"),
        ("tracked8", "-pitch of tracker", "readings of tracker, turn y do not fit"),
        ("tracked8", "10 % of rows, mixed, x 1.05", "times what fits the other rows"),
        ("tracked8", "half of all lengths x 1.05", "do not fit"),
        ("tracked8", "cable 1 late by 1", "readings of length of C1 do not fit"),
        # Positions that are exact have no degree of freedom, and so no scatter of their own.
        ("hangprinter", "30 % of rows, the first, x 1.05", "motor angles from row "),
    ],
)
def test_a_systematic_error_is_a_misfit_with_its_reason(scenes, name, attack, words):
    one = scenes[name]
    said = outcome(one, dict(attacks(one.log))[attack])
    assert said.status == "misfit"
    assert words in said.words


def test_an_error_that_moves_poses_little_enlarges_their_deviations(scenes):
    """A cable's factor that offsets follow for the most part: a remark."""
    one = scenes["tracked8"]
    said = outcome(one, dict(attacks(one.log))["cable 3 x 0.97"])
    assert said.status == "converged", said.words
    assert "length of C3 is 0.97" in said.words
    assert said.is_met


@pytest.mark.parametrize("number", [0, 3, 4])
def test_a_clean_log_is_no_misfit_whatever_its_sigmas(number):
    """By `clean`: with 4, 6 and 8 cables, sigmas off by up to 4, and outliers."""
    said = outcome(clean(number)[1])
    assert said.status == "converged", said.words
    assert said.is_met


def test_all_that_is_said_is_in_the_numbers_and_the_figure(scenes):
    one, rows = scenes["tracked8"], [2, 8, 16]
    lengths = one.log.lengths.copy()
    lengths[rows] *= 1.05
    calibration = cdpr.calibrate(one.robot, replace(one.log, lengths=lengths), **one.options)
    said = json.loads(json.dumps(calibration.as_dict()))
    group = said["groups"][0]
    assert (group["test"], group["measurement"]) == ("row factors", "lengths")
    assert group["rows"] == [row + 1 for row in rows]
    assert group["size"] == pytest.approx(1.05, abs=0.01)
    assert group["misfit"]
    assert said["misfit"][0] == group["words"]
    assert "rows 3, 9, 17" in " ".join(calibration.plot().get_suptitle().split())


@pytest.mark.parametrize(("factor", "remarked"), [(1.05, True), (1.0, False)])
def test_offsets_of_some_per_cent_of_the_lengths_may_be_scales(scenes, factor, remarked):
    one = scenes["blind4"]
    log = replace(one.log, lengths=factor * one.log.lengths)
    remarks = " ".join(cdpr.calibrate(one.robot, log, **one.options).remarks)
    assert ("more likely scales" in remarks) == remarked


TRUE_CORNERS = [(-0.9, 2.2), (2.7, 2.6), (-1.1, 0.1), (2.6, -0.3)]
BELIEVED_CORNERS = [(0.0, 2.0), (2.0, 2.0), (0.0, 0.0), (2.0, 0.0)]
"""Top left, top right, bottom left, bottom right of a point mass in a plane, x and y [m]."""


def framed(corners):
    """Maslow 4 with other anchors and no arms at them; it hangs in their middle."""
    robot = load_robot("maslow_4")
    middle = np.append(np.mean(corners, axis=0), robot.home.position[2])
    cables = [
        replace(cable, exit_point=np.append(corner, cable.exit_point[2]))
        for cable, corner in zip(robot.cables, corners, strict=True)
    ]
    home, pulley = replace(robot.home, position=middle), replace(robot.pulley, arm=0.0)
    return replace(robot, cables=cables, pulley=pulley, home=home)


def test_a_frame_believed_far_too_small_ends_in_the_right_anchors():
    """Lengths that no pose of the believed frame has put poses on the lines between its anchors."""
    machine, random = framed(TRUE_CORNERS), np.random.default_rng(0)
    low, high = np.min(TRUE_CORNERS, axis=0), np.max(TRUE_CORNERS, axis=0)
    poses = []
    for _ in range(99):
        place = low + random.uniform(0.02, 0.98, 3)[:2] * (high - low)
        poses.append(pose_from_angles(np.append(place, machine.home.position[2]), np.zeros(3)))
    model = calibration_model(machine)
    lengths = numbers(model, poses)[:, :, 0]
    lengths = lengths + 1e-3 * random.standard_normal(lengths.shape)
    log = Measurements(Path("wide"), len(poses), lengths=lengths)
    calibrated = cdpr.calibrate(framed(BELIEVED_CORNERS), log).result
    assert calibrated.status == "converged"
    # Distances between exit points are what no motion of the frame changes.
    distances, true = (
        np.linalg.norm(p[:, :, None] - p[:, None], axis=0)
        for p in (calibrated.model.cables.p_WA, model.cables.p_WA)
    )
    np.testing.assert_allclose(distances, true, atol=SAME)


# Figures, of numbers that are made up.


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
    for words in ("does not fit", "residuals are 4 sigmas, root mean square; accepted: at most 3"):
        assert (words in title) == (spread > 3.0)


def test_names_beside_correlations_are_whole():
    names = [f"C{k}.anchor_point.{axis}" for k in range(1, 9) for axis in "xyz"] * 3
    fitted = Fitted(
        title="", model=None, status="", unknowns=tuple(Unknown(name, "m", 1.0) for name in names),
        spread=None, covariance=np.eye(len(names)),
    )  # fmt: skip
    assert figure_faults(correlation_figure(fitted)) == []


def stretch(begin):
    """One that swings, on which a hand pulls ever more."""
    time = np.linspace(0.0, 2.4, 121)
    turns = np.radians(np.exp(-time)[:, None] * np.sin(12.0 * time[:, None] + [0.0, 1.0, 2.0]))
    force = np.outer(20.0 * time, [0.0, 0.0, 1.0])
    rest = SimpleNamespace(time=time, force=force, means=lambda values: values[:96])
    return SimpleNamespace(
        stretch=SimpleNamespace(time=begin + time, covered=np.ones(121, bool)), lead=0.8,
        measured_turns=turns, predicted_turns=0.9 * turns, unexplained=rest,
    )  # fmt: skip


def motion(count):
    robot = load_robot("irma4u")
    return SimpleNamespace(
        task=SimpleNamespace(robot=robot), held_out=[stretch(6.78)], values=None,
        fitted=[stretch(float(k)) for k in range(count - 1)],
        model=SimpleNamespace(platform=lambda values: rigid_platform(robot)),
    )  # fmt: skip


def test_no_legend_lies_on_curves_and_titles_are_whole():
    for figure in (
        swings._turns_figure(motion(1), motion(1).held_out, "held out"),
        swings._unexplained_figure(motion(1)),
        swings._unexplained_figure(motion(2)),
    ):
        assert figure_faults(figure) == []
        assert all(axes.get_legend() is None for axes in figure.axes)
        assert "\n" not in figure.get_suptitle()


GROUPS = {"stiffness": "N", "length_offset": "m", "coulomb": "N m", "viscous": "N m s/rad",
          "static": "N m"}  # fmt: skip
UNITS = {"mass": "kg", **{f"C{k}.{what}": GROUPS[what] for what in GROUPS for k in range(1, 9)}}


@pytest.mark.parametrize("compared", [True, False])
def test_all_rows_say_what_they_are(compared):
    """Also those of which no truth is known; labels are whole, and no legend is in the way."""
    value = 1.162345e-4
    unknowns = [
        Unknown(name, unit, 0.011 * value, value, before=0.9 * value,
                true=None if "offset" in name or not compared else 1.16e-4)
        for name, unit in UNITS.items()
    ]  # fmt: skip
    figure = parameter_figure(unknowns, compared)
    shown = matplotlib.image.imread(BytesIO(figure._repr_png_()))
    assert np.all(shown[:, :2] == 1.0), "labels are cut on the left in a notebook"
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    assert axes.get_legend() is None
    unlabelled = [text.xy[1] for text in axes.texts if text.get_text() == "no true value"]
    rows = [
        place for place, name in zip(axes.get_yticks(), UNITS, strict=True) if "offset" not in name
    ]
    assert len(unlabelled) == (8 if compared else 0)
    assert not set(unlabelled) & set(rows)
