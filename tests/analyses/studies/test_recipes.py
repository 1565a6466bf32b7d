"""The recipe of the stability tables: what variants change, rows it meets, rows in sight."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.recipe_variants import (
    EXCHANGE,
    IN_USE,
    PRESENT,
    RECIPES,
    exchanged_anchors,
)
from cdpr_drake.analyses.studies.stability_recipe import (
    recipe_bounds,
    recipe_case,
    recipe_grid,
    recipe_options,
    single_bounds,
)
from cdpr_drake.analyses.studies.stability_tables import BY_NAME
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import cross_matrix, rotation_from_vector
from cdpr_drake.servoing.pose_features import theta_u_interaction
from cdpr_drake.stability.criterion import ModelAtPose, stability_matrix
from cdpr_drake.stability.desired_view import OppositeCorner
from cdpr_drake.stability.perturbation_bounds import BASELINE, PerturbationBounds
from cdpr_drake.stability.perturbation_samples_kernel import draw_perturbations
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from cdpr_drake.workspaces.volume import VolumeRule, workspace_volume

FULLY = "acrobot_fully_constrained"

POINTS = 4.0
"""Difference of a single row to the published one that the recipe keeps here [points of per cent];
the means over whole tables are smaller."""


def test_arrangements_of_cables_are_what_they_are_called():
    before, upper, other, kept = (
        RECIPES[name].cables(FULLY)
        for name in ("present", "upper-on-upper", "other-corners-independent", "kept-cables")
    )
    assert {*map(tuple, upper.p_PB.T)} == {*map(tuple, before.p_PB.T)}
    above = upper.p_WA[2] > 1.0
    np.testing.assert_array_equal(above, upper.p_PB[2] > 0.05)
    assert not np.any(above == (before.p_PB[2] > 0.05))  # by the numbers it is the other way round
    np.testing.assert_array_equal(np.sign(upper.p_PB[0]), np.sign(upper.p_WA[0]))
    np.testing.assert_array_equal(np.sign(upper.p_PB[1]), -np.sign(upper.p_WA[1]))
    np.testing.assert_array_equal(upper.p_WA, before.p_WA)
    np.testing.assert_array_equal(upper.p_PB * [[-1], [-1], [1]], other.p_PB)  # opposite corners
    large = PRESENT.cables("acrobot_large")
    assert {(*a[:2], *b) for a, b in zip(kept.p_WA.T, kept.p_PB.T, strict=True)} == {
        (*a[:2], *b) for a, b in zip(large.p_WA.T, large.p_PB.T, strict=True)
    }


def test_an_exchange_moves_two_cables_from_above_and_nothing_else():
    before, after = PRESENT.cables(FULLY), IN_USE.cables(FULLY)
    np.testing.assert_array_equal(after.p_WA, before.p_WA)
    moved = np.flatnonzero(np.any(after.p_PB != before.p_PB, axis=0))
    assert tuple(moved) == EXCHANGE
    assert np.all(before.p_WA[2, moved] > 1.0)
    np.testing.assert_array_equal(after.p_PB[:, moved], before.p_PB[:, moved[::-1]])
    # As if the two exit points were printed in each other's place.
    exits = exchanged_anchors(after, *EXCHANGE)
    np.testing.assert_array_equal(exits.p_PB, before.p_PB)
    same = exchanged_anchors(before, 3, 3)
    np.testing.assert_array_equal(same.p_PB, before.p_PB)


def test_the_fully_constrained_robot_alone_goes_to_the_centre():
    case = recipe_case(FULLY, "pbvs")
    np.testing.assert_allclose(case.target.place, [0.0, 0.0, 0.55], atol=1e-12)
    corner = recipe_case("acrobot_large", "pbvs").target
    np.testing.assert_allclose(corner.place, [-0.48, -0.48, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "table", "exits", "anchors"),
    [
        ("present", "A.11", "corners", None),
        ("upper-on-upper-independent", "A.11", "independent", None),
        ("upper-on-upper-independent", "A.9", "corners", None),
        ("hybrid-exits-independent", "A.14", "independent", "corners"),
        ("hybrid-exits-independent", "A.10", "corners", None),
        ("caroca-single", "A.12", None, "single"),
        ("caroca-single", "A.15", None, "common"),
    ],
)
def test_points_of_a_scheme_and_bound_come_before_those_of_a_robot(name, table, exits, anchors):
    for bound, kind, expected in (("r_A", "exits", exits), ("r_B", "anchors", anchors)):
        found = getattr(recipe_bounds(BY_NAME[table], bound, 0.1, RECIPES[name]), kind)
        assert expected in (None, found)


def test_mounting_and_goal_of_a_recipe_are_those_of_its_case():
    case = recipe_case("acrobot_large", "pbvs", RECIPES["camera-as-built"])
    np.testing.assert_allclose(case.X_PC.translation(), [-0.0631, 0.0, 0.01])
    np.testing.assert_allclose(case.X_PC.rotation().matrix()[:, 2], [0.0, 0.0, -1.0], atol=1e-12)
    down = recipe_case("caroca", "2.5d")
    np.testing.assert_allclose(down.X_PC.rotation().matrix(), np.diag([1, -1, -1]), atol=1e-12)
    np.testing.assert_array_equal(down.X_PC.translation(), [0.0, 0.0, 0.2])
    assert isinstance(
        recipe_case("caroca", "pbvs", RECIPES["opposite-corner"]).target, OppositeCorner
    )


@pytest.mark.parametrize(
    ("table", "bound", "value"),
    [
        ("A.17", "r_bp", 0.03),
        ("A.17", "r_bp", 0.5),
        ("A.17", "d_theta_bp_deg", 20),
        ("A.17", "r_B", 0.03),
        ("A.10", "r_bp", 0.03),
        ("A.10", "r_bp", 0.3),
        ("A.10", "d_theta_bp_deg", 10),
        ("A.12", "r_bp", 0.3),
        ("A.8", "r_bp", 0.05),
        ("A.8", "r_A", 0.04),
        ("A.14", "r_bp", 0.5),
        ("A.14", "d_theta_bp_deg", 10),
        ("A.13", "d_theta_pc_deg", 30),
        ("A.13", "r_B", 0.03),
        ("A.14", "r_A", 0.1),
    ],
)
def test_recipe_meets_published_rows(table, bound, value):
    one = BY_NAME[table]
    grid, case = recipe_grid(one.robot), recipe_case(one.robot, one.scheme)
    bounds, options = recipe_bounds(one, bound, value), recipe_options(one.robot)
    found = judge_stability(case, bounds, grid.pose_rows(), options=options).stable
    inside = found.reshape(grid.shape)[0]
    volume = workspace_volume(inside, grid.axes, VolumeRule.CORNERS).value
    assert 100.0 * volume / one.full == pytest.approx(one.rows[bound][value], abs=POINTS)


def test_negative_bounds_are_refused():
    with pytest.raises(StabilityError, match="r_A: found -1"):
        single_bounds(PerturbationBounds(), "r_A", -1.0)


def stable_in_numpy(case, bounds, pose, draws):
    """The sampled verdict at one pose, as one writes it down."""
    X_WP, m, cables = RigidTransform(pose[4:]), case.m, case.cables
    R_PC, p_PC = case.X_PC.rotation(), case.X_PC.translation()
    target = case.target.rows(R_PC.matrix()[np.newaxis], (pose[4:] + p_PC)[np.newaxis])
    L = np.zeros((6, 6))
    L[:3, :3], L[3:, 3:] = theta_u_interaction(target.theta_u[0]), -np.eye(3)
    L[3:, :3] = cross_matrix(target.error[0])
    truth, least = ModelAtPose(X_WP, cables, case.X_PC, L), []
    for d in draw_perturbations(pose, bounds, m, draws):
        points = d[18:].reshape(2, m, 3).transpose(0, 2, 1)
        estimate = ModelAtPose(
            RigidTransform(X_WP.rotation() @ rotation_from_vector(d[:3]), pose[4:] + d[3:6]),
            replace(cables, p_WA=cables.p_WA + points[0], p_PB=cables.p_PB + points[1]),
            RigidTransform(R_PC @ rotation_from_vector(d[6:9]), p_PC + d[9:12]),
            L,
        )
        Pi = stability_matrix(truth, estimate)
        least.append(np.min(np.linalg.eigvalsh(Pi + Pi.T)))
    return min(least) > 0.0


def test_plain_loop_agrees_with_the_kernel():
    case = recipe_case("acrobot_large", "pbvs")
    poses = recipe_grid("acrobot_large", quick=True).pose_rows()[::7]
    found = judge_stability(case, BASELINE, poses, options=VerdictOptions(draws=5)).stable
    assert [stable_in_numpy(case, BASELINE, pose, 5) for pose in poses] == found.tolist()
    assert 0 < np.sum(found) < len(poses)
