"""Bounds of the margin by intervals and by constants of Lipschitz: proven, and how tight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.criterion_closed_forms import planar_margin
from cdpr_drake.stability.desired_view import FixedError, FixedPlace
from cdpr_drake.stability.interval_bound import interval_margins
from cdpr_drake.stability.lipschitz_bound import lipschitz_margins
from cdpr_drake.stability.perturbation_bounds import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    PerturbationBounds,
)
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from tests.stability.stability_cases import planar_case, random_poses, spatial_case

Margins = Callable[[StabilityCase, PerturbationBounds, Array], Array]

BOUNDS: dict[str, Margins] = {"interval": interval_margins, "lipschitz": lipschitz_margins}

CASES = {
    "pbvs": spatial_case("pbvs"),
    "pbvs exact": spatial_case("pbvs", lever="object"),
    "line": spatial_case("pbvs-line"),
    "2.5d": spatial_case("2.5d"),
    "ibvs": spatial_case("ibvs"),
    "slack": spatial_case("pbvs", taut=np.arange(8) != 3),
    "planar": planar_case(),
}

ROUNDING = 1e-9
"""Of a margin that the kernels compute, through an inverse of condition up to about 1e3."""

ALLOWANCE = 3e-5
"""The bound of Lipschitz takes 2e-5 off for rounding."""

SETTLED = 1e-9
"""So near a bound by intervals is to its closed form: the enclosed left inverse has a width."""


def planar_robot_at_goal() -> StabilityCase:
    cables = load_robot("planar").cable_set().without_pulleys()
    return StabilityCase(cables, planar=True, target=FixedError())


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("bound", BOUNDS)
@settings(max_examples=15)
@given(
    share=st.floats(0.005, 0.3),
    seed=st.integers(0, 10_000),
    only=st.sampled_from([None, "r_bp", "d_theta_bp", "r_pc", "d_theta_pc", "r_A", "r_B"]),
    points=st.sampled_from(DIRECTIONS),
)
def test_no_error_inside_beats_a_bound(
    bound: str, name: str, share: float, seed: int, only: str | None, points: str
) -> None:
    case = CASES[name]
    base = PLANAR_BASELINE if case.planar else BASELINE
    bounds = base.scaled(share)
    if only is not None:  # one error alone, and larger, so that its own part is seen
        bounds = PerturbationBounds(**{only: 5.0 * share * getattr(base, only)})
    bounds = bounds.varied(exits=points, anchors=points)
    poses = random_poses(12, case.planar)[seed % 12 :][:1]
    low = BOUNDS[bound](case, bounds, poses)
    for magnitude in ("full", "inside"):
        options = VerdictOptions(draws=200, seed=seed, magnitude=magnitude, threads=1)
        assert judge_stability(case, bounds, poses, options=options).margin >= low - ROUNDING
    worst = judge_stability(case, bounds, poses, "searched", VerdictOptions(threads=1))
    assert worst.margin >= low - ROUNDING


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("bound", BOUNDS)
def test_bounds_are_of_use_for_small_errors(bound: str, name: str) -> None:
    """Without error it is the margin 1; it falls with the errors; a sixtieth is still proven."""
    case, base = CASES[name], (PLANAR_BASELINE if CASES[name].planar else BASELINE)
    poses = random_poses(6, case.planar)
    found = [BOUNDS[bound](case, base.scaled(s), poses) for s in (0.0, 1e-3, 1.0 / 60.0, 0.1)]
    assert found[0] == pytest.approx(np.ones(6), abs=ALLOWANCE)
    assert all(np.all(larger < smaller) for smaller, larger in pairwise(found))
    assert np.all(found[2] > 0.0)


@pytest.mark.parametrize("degrees", [5.0, 30.0, 41.0, 43.0, 80.0, 89.0, 91.0])
def test_a_camera_turned_about_its_axis_has_the_closed_form(degrees: float) -> None:
    """The servo is stable below 90 deg, with the margin cos G.

    Rodrigues' formula has z sin(z) / z within [-G, G] and 1 - z^2 (1 - cos z) / z^2 within
    [1 - G^2 / 2, 1] by intervals, which gives 1 - G - G^2 / 2 and a limit of 42 deg; the constant
    of Lipschitz is 1 + sin G, so that its limit is where G (1 + sin G) = 1, 36 deg.
    """
    case, G = planar_robot_at_goal(), math.radians(degrees)
    bounds, pose = PerturbationBounds(d_theta_pc=G), random_poses(1, planar=True)
    worst = judge_stability(case, bounds, pose, "searched", VerdictOptions(threads=1)).margin[0]
    assert worst == pytest.approx(planar_margin(G, 0.0), abs=ROUNDING)
    intervals = interval_margins(case, bounds, pose)[0]
    assert intervals == pytest.approx(1.0 - G - 0.5 * G * G, abs=SETTLED)
    lipschitz = lipschitz_margins(case, bounds, pose)[0]
    assert lipschitz == pytest.approx(
        1.0 - G * (1.0 + math.sin(min(G, 0.5 * math.pi))), abs=ALLOWANCE
    )
    assert (worst > 0.0) == (degrees < 90.0)
    assert (intervals > 0.0) == (degrees < math.degrees(math.sqrt(3.0) - 1.0))


def test_cut_boxes_bound_more() -> None:
    """Without end they come to the truth: the turn in 64 parts gives cos G up to three of them."""
    case, G = planar_robot_at_goal(), math.radians(60.0)
    bounds, pose = PerturbationBounds(d_theta_pc=G), random_poses(1, planar=True)
    margins = [interval_margins(case, bounds, pose, parts)[0] for parts in (1, 2, 4, 64)]
    assert margins == sorted(margins)
    part = 2.0 * G / 64.0
    assert math.cos(G) - 3.0 * part < margins[-1] <= math.cos(G)


def test_the_constants_of_lipschitz_do_not_see_how_the_world_is_turned() -> None:
    case = spatial_case("pbvs", target=FixedPlace(np.array([0.1, 0.0, 0.2]), np.array([0, 0, 1.0])))
    poses = random_poses(4)
    X = RigidTransform(RollPitchYaw(0.4, -1.1, 2.0), [0.3, -0.2, 0.5])
    cables = replace(case.cables, p_WA=X.multiply(case.cables.p_WA))
    place = X.multiply(np.array([0.1, 0.0, 0.2]))
    turned = replace(case, cables=cables, target=FixedPlace(place, np.array([0, 0, 1.0])))
    moved = [
        pose_row(X @ RigidTransform(Quaternion(q / np.linalg.norm(q)), p))
        for q, p in zip(poses[:, :4], poses[:, 4:], strict=True)
    ]
    bounds = BASELINE.scaled(0.1)
    expected = lipschitz_margins(case, bounds, poses)
    assert lipschitz_margins(turned, bounds, np.array(moved)) == pytest.approx(
        expected, abs=ROUNDING
    )


@pytest.mark.parametrize("bound", BOUNDS)
def test_nothing_is_bounded_where_a_cable_may_vanish(bound: str) -> None:
    bounds = BASELINE.varied(r_bp=5.0)
    assert np.all(np.isneginf(BOUNDS[bound](spatial_case("pbvs"), bounds, random_poses(2))))


@pytest.mark.parametrize("bound", BOUNDS)
def test_what_no_proof_covers_is_refused(bound: str) -> None:
    poses = random_poses(1)
    with pytest.raises(StabilityError, match="d_theta_s"):
        BOUNDS[bound](spatial_case("pbvs"), BASELINE.varied(d_theta_s=0.1), poses)
    with pytest.raises(StabilityError, match="perturbed"):
        BOUNDS[bound](spatial_case("pbvs", perturbed="truth"), BASELINE, poses)
