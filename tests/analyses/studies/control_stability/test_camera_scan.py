"""The scan of the camera's targets: closed forms, the study's own rows, ranges, and judges."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.control_stability import camera_scan as scan
from cdpr_drake.analyses.studies.control_stability import camera_targets as aims
from cdpr_drake.analyses.studies.control_stability.all_targets import (
    SCAN_CHECKS,
    camera_targets_figure,
    target_of,
)
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import MET_FITTED, judged
from cdpr_drake.analyses.studies.framework.study import Form, Study
from cdpr_drake.analyses.studies.published.recipe_variants import RECIPES
from cdpr_drake.analyses.studies.published.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
)
from cdpr_drake.analyses.workspaces.stability_tasks import SampledTask
from cdpr_drake.stability.criterion import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.stability.criterion_closed_forms import planar_margin
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.workspaces.pose_grid import grid_by_count

A10 = scan.table_named("A.10")

ROUNDING = 1e-9
"""Products of six matrices of numbers of about one."""

FEW = grid_by_count([-0.3, -0.3, 0.2], [0.3, 0.3, 0.8], [2, 2, 2])


def _interaction(target):
    """(1.47) with the lever e_t, rows and columns (rotation, translation), for theta u = 0."""
    x, y, z = target.error()
    L = np.eye(6)
    L[3:, 3:] = -np.eye(3)
    L[3:, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    return L


def _margin(target, axis, angle):
    """Of an error of the camera's mounting alone, in plain NumPy."""
    case = scan.targeted_case(A10, target)
    error = RotationMatrix(AngleAxis(angle, np.array(axis, float)))
    X_WP, L = RigidTransform([0.1, -0.2, 0.4]), _interaction(target)
    X_PC = case.X_PC
    truth = ModelAtPose(X_WP, case.cables, X_PC, L)
    wrong = RigidTransform(X_PC.rotation() @ error, X_PC.translation())
    return stability_margin(stability_matrix(truth, ModelAtPose(X_WP, case.cables, wrong, L)))


@pytest.mark.parametrize("length", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("angle", [0.3, 1.0, 1.5])
def test_an_error_about_e_t_leaves_the_cosine_of_its_angle(length, angle):
    """exp(d) e_t = e_t, so that no offset is left and the length does not matter."""
    target = aims.CameraTarget(aims.SAME_ERROR, length, turn=aims.NO_TURN)
    assert _margin(target, (0, 0, 1), angle) == pytest.approx(math.cos(angle), abs=ROUNDING)


@pytest.mark.parametrize("length", [0.5, 1.5, 3.0])
def test_an_error_across_e_t_leaves_the_margin_of_the_plane(length):
    """The offset is |exp(d) e_t - e_t| = 2 sin(angle / 2) length, as in (3.17)."""
    target = aims.CameraTarget(aims.SAME_ERROR, length, turn=aims.NO_TURN)
    for angle in (0.2, 0.6, 0.9):
        expected = planar_margin(angle, 2.0 * math.sin(angle / 2.0) * length)
        assert _margin(target, (1, 0, 0), angle) == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("angle_deg", [30.0, 50.0])
def test_the_length_at_which_the_closed_form_ends_is_that_of_the_samples(angle_deg):
    """|e_t| < sqrt(cos) / sin(angle / 2) at every pose, whatever the direction."""
    angle = math.radians(angle_deg)
    limit = math.sqrt(math.cos(angle)) / math.sin(angle / 2.0)
    bounds = PerturbationBounds(d_theta_pc=angle)
    options = replace(recipe_options("acrobot_large"), draws=200, threads=1)
    for share, stable in ((0.99, True), (1.05, False)):
        target = aims.CameraTarget(aims.SAME_ERROR, share * limit, 90.0, 45.0, turn=aims.NO_TURN)
        task = scan.ScanTask(scan.targeted_case(A10, target), (bounds,), FEW, options)
        assert np.all(task(0, FEW.size)["stable"] == stable)


def test_the_scan_gives_the_row_of_the_recipe_in_use():
    grid, options = recipe_grid(A10.robot, True), recipe_options(A10.robot)
    case = next(
        one for one in scan.scan_cases(Form(quick=True))
        if one.keys["scan"] == scan.KEPT
        and one.keys["of_table"] == "A.10"
        and target_of(Run("", None, one.keys, {})) == aims.IN_USE_TARGET
    )  # fmt: skip
    shares = scan.scan_row(case, case.task(0, case.items))["share_percent"]
    for (bound, value), found in zip(scan.rows_asked(scan.KEPT, A10), shares, strict=True):
        original = recipe_case(A10.robot, A10.scheme)
        task = SampledTask(original, recipe_bounds(A10, bound, value), grid, options)
        assert found == scan.share_of(grid, task(0, grid.size)["stable"])
    assert min(shares) < 10.0 < 50.0 < max(shares)


def test_pairs_are_poses_with_a_target_for_both_rows():
    places = (aims.SAME_ERROR, 1.5), (aims.SAME_ERROR, 2.0, 90.0)
    targets = (*(aims.CameraTarget(*place) for place in places), aims.IN_USE_TARGET)
    grid = grid_by_count([-0.48, -0.48, 0.0], [0.48, 0.48, 1.1], [4, 4, 4])
    options = recipe_options(A10.robot)
    against = recipe_bounds(A10, scan.CHOOSING_BOUND, 50.0)
    rows = tuple(recipe_bounds(A10, *row) for row in (("d_theta_bp_deg", 20.0), ("r_bp", 0.3)))
    case = recipe_case(A10.robot, A10.scheme)
    found = scan.PairTask(case, A10.robot, targets, against, rows, grid, options)(5, 60)["stable"]

    def stable(target, bounds):
        return SampledTask(scan.targeted_case(A10, target), bounds, grid, options)(5, 60)["stable"]

    for row, bounds in enumerate(rows):
        both = [stable(target, bounds) & ~stable(target, against) for target in targets]
        np.testing.assert_array_equal(found[:, row], np.any(both, axis=0))
        assert 0 < np.sum(found[:, row]) < len(found)


def test_targets_are_what_they_are_called():
    for some in (scan.scan_targets(), scan.eleventh_targets(), scan.paired_targets()):
        assert len({target.name for target in some}) == len(some)
    assert {aims.IN_USE_TARGET, aims.CHOSEN_TARGET} <= set(scan.scan_targets())
    assert aims.CENTRE_TARGET in scan.eleventh_targets()
    np.testing.assert_allclose(aims.CameraTarget(aims.SAME_ERROR, 2.0).error(), [0.0, 0.0, 2.0])
    np.testing.assert_allclose(
        aims.CameraTarget(aims.SAME_ERROR, 2.0, 90.0, 90.0).error(), [0, 2, 0], atol=1e-15
    )
    for target in aims.same_errors():
        assert np.linalg.norm(target.error()) == pytest.approx(target.length)
    kinds = [target.kind for target in aims.goals()]
    assert (kinds.count(aims.GOAL), kinds.count(aims.FARTHEST)) == (8 + 6 + 1, 1)
    for target in (*aims.goals(), *aims.same_errors(), *aims.seen_turned()):
        assert target_of(Run("", None, target.keys(), {})) == target


def test_a_goal_in_the_world_is_the_same_for_a_camera_at_any_height():
    """With the mounting known, the point that is servoed does not depend on the camera's place."""
    bounds = replace(
        recipe_bounds(A10, scan.CHOOSING_BOUND, 3.0), d_theta_pc=0.0, r_pc=0.0, r_bp=0.3
    )
    margins = [
        SampledTask(scan.targeted_case(A10, target), bounds, FEW, recipe_options(A10.robot))(0, 8)
        for target in (aims.IN_USE_TARGET, replace(aims.IN_USE_TARGET, height=0.46))
    ]
    np.testing.assert_array_equal(margins[0]["stable"], margins[1]["stable"])


def test_what_is_seen_turns_over_where_theta_u_and_its_error_pass_half_a_turn():
    """At every pose: the estimate's axis is the opposite one there, and with it two signs."""
    options = replace(recipe_options(A10.robot), draws=400, threads=1)
    target = replace(aims.SEEN_TARGET, turn=aims.about_z(140.0))
    shares = {}
    for angle in (35.0, 50.0):  # 140 deg leave 40
        bounds = target.bounds(PerturbationBounds(d_theta_pc=math.radians(angle)))
        assert bounds.d_theta_s == bounds.d_theta_pc
        task = scan.ScanTask(scan.targeted_case(A10, target), (bounds,), FEW, options)
        shares[angle] = float(np.mean(task(0, FEW.size)["stable"]))
    assert shares == {35.0: 1.0, 50.0: 0.0}
    same = PerturbationBounds(d_theta_pc=1.0)
    assert aims.IN_USE_TARGET.bounds(same) == same


def test_the_recipe_with_what_is_seen_turned_is_the_target_that_is_kept():
    recipe = RECIPES["seen-turned"]
    for name in scan.CHOOSING_TABLES:
        table = scan.table_named(name)
        own = recipe_case(table.robot, table.scheme, recipe)
        scanned = scan.targeted_case(table, aims.SEEN_TARGET)
        np.testing.assert_array_equal(own.target.theta_u, scanned.target.theta_u)
        np.testing.assert_array_equal(own.target.place, scanned.target.place)
        assert own.X_PC.IsExactlyEqualTo(scanned.X_PC)
        for row in scan.rows_asked(scan.KEPT, table):
            assert recipe_bounds(table, *row, recipe) == aims.SEEN_TARGET.bounds(
                recipe_bounds(table, *row)
            )
    for name in ("A.11", "A.14", "A.16"):
        table = scan.table_named(name)
        assert recipe_bounds(table, "r_bp", 0.1, recipe) == recipe_bounds(table, "r_bp", 0.1)


def made_runs(change=lambda share: share):
    """Rows of the full form: printed shares by the chosen targets, 20 points less by others."""
    rows = []
    for case in scan.scan_cases(Form()):
        table = scan.table_named(case.keys["of_table"])
        printed = [table.rows[b][v] for b, v in scan.rows_asked(case.keys["scan"], table)]
        met = case.keys["scan"] == scan.PAIRS or target_of(Run("", None, case.keys, {})) in (
            aims.CHOSEN_TARGET, aims.CENTRE_TARGET, aims.SEEN_TARGET,
        )  # fmt: skip
        shares = [change(share) - (0.0 if met else 20.0) for share in printed]
        rows.append(Run(case.name, None, case.keys, {"share_percent": shares}))
    planned = Study(name="camera", title="", cases=scan.scan_cases).planned(Form())
    return Runs(rows, lambda: planned)


@pytest.fixture(scope="module")
def printed_runs():
    return made_runs()


def test_printed_rows_confirm_the_scan_and_are_drawn(printed_runs):
    said = {one.name: one for one in judged(SCAN_CHECKS, printed_runs)}
    assert len(said) == len(SCAN_CHECKS)
    fitted = {name for name, one in said.items() if one.verdict == MET_FITTED}
    assert fitted == {
        "camera_target_chosen", "camera_target_range", "rows_of_one_target", "seen_turned_chosen",
        "eleventh_rows", "eleventh_target",
    }  # fmt: skip
    assert said["camera_target_kept"].verdict == CONFIRMED
    assert said["seen_turned_kept"].verdict == CONFIRMED
    assert said["camera_target_range"].of == 2 * 7
    assert said["rows_of_one_target"].of == 2 * len(scan.PAIRED_ROWS)
    figure = camera_targets_figure(printed_runs)
    axes = figure.axes[0]
    assert axes.get_xlabel() == "length of e_t [m]"
    drawn = [line for line in axes.lines if line.get_marker() != "+"]
    assert len({line.get_linestyle() for line in drawn}) == 4  # told apart in grey


def test_other_rows_are_not_confirmed():
    """30 points more: the chosen one is off by 30, the one in use by 10."""
    said = {one.name: one for one in judged(SCAN_CHECKS, made_runs(lambda share: share + 30.0))}
    for name in (
        "camera_target_chosen", "camera_target_kept", "camera_target_range", "seen_turned_chosen",
        "seen_turned_kept",
    ):  # fmt: skip
        assert said[name].verdict == NOT_CONFIRMED
        assert said[name].cause in ("", "ours" if name.startswith("seen") else "source")
    assert said["eleventh_rows"].verdict == NOT_CONFIRMED
    assert said["eleventh_target"].cause == "ours"
    less = {one.name: one for one in judged(SCAN_CHECKS, made_runs(lambda share: 0.5 * share))}
    assert less["rows_of_one_target"].verdict == NOT_CONFIRMED
    some = {one.name: one for one in judged(SCAN_CHECKS, made_runs(lambda s: max(s, 50.0)))}
    assert some["camera_target_range"].verdict == IN_PART  # 0 % at 50 deg, and 20 points less


def test_cases_stand_apart_from_the_rows_of_recipes(printed_runs):
    quick = list(scan.scan_cases(Form(quick=True)))
    assert all("table" not in case.keys for case in quick)
    assert {case.keys["scan"] for case in quick} == {scan.TARGETS, scan.SEEN, scan.KEPT, scan.PAIRS}
    assert len({case.name for case in quick}) == len(quick)
    for name in scan.CHOOSING_TABLES:
        some = printed_runs(scan=scan.TARGETS, grid=scan.HALF, of_table=name)
        assert len(some) == len(scan.scan_targets())
    eleventh = printed_runs(scan=scan.TARGETS, grid=scan.HALF, of_table="A.11")
    assert len(eleventh) == len(scan.ARRANGEMENTS) * len(scan.eleventh_targets())
