"""Bounds by intervals, by Lipschitz's constants and cable by cable: proven, and how tight."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial.transform import Rotation

from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.criterion_closed_forms import planar_margin
from cdpr_drake.stability.desired_view import FixedError, FixedPlace
from cdpr_drake.stability.interval_bound import interval_margins
from cdpr_drake.stability.linear_forms_kernel import cable_remainder
from cdpr_drake.stability.lipschitz_bound import lipschitz_margins
from cdpr_drake.stability.perturbation_bounds import (
    BASELINE,
    DIRECTIONS,
    PLANAR_BASELINE,
    PerturbationBounds,
)
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions, judge_stability
from tests.stability.stability_cases import (
    CASES,
    ROUNDING,
    pose_of,
    random_poses,
    spatial_case,
)

BOUNDS = {"interval": interval_margins, "lipschitz": lipschitz_margins}
ALLOWANCE = 3e-5  # the bound of Lipschitz takes 2e-5 off for rounding
SETTLED = 1e-9  # intervals are so near the closed form: the enclosed left inverse has a width
ONE = VerdictOptions(threads=1)


def baseline(case):
    return PLANAR_BASELINE if case.planar else BASELINE


def planar_robot_at_goal():
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
def test_no_error_inside_beats_a_bound(bound, name, share, seed, only, points):
    case, base = CASES[name], baseline(CASES[name])
    bounds = base.scaled(share)
    if only is not None:  # one error alone, and larger, so that its own part is seen
        bounds = PerturbationBounds(**{only: 5.0 * share * getattr(base, only)})
    bounds = bounds.varied(exits=points, anchors=points)
    poses = random_poses(12, case.planar)[seed % 12 :][:1]
    low = BOUNDS[bound](case, bounds, poses)
    for magnitude in ("full", "inside"):
        options = VerdictOptions(draws=200, seed=seed, magnitude=magnitude, threads=1)
        assert judge_stability(case, bounds, poses, options=options).margin >= low - ROUNDING
    worst = judge_stability(case, bounds, poses, "searched", ONE)
    assert worst.margin >= low - ROUNDING


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("bound", BOUNDS)
def test_bounds_are_of_use_for_small_errors(bound, name):
    """Without error it is the margin 1; it falls with the errors; a sixtieth is still proven."""
    case = CASES[name]
    poses, base = random_poses(6, case.planar), baseline(case)
    low = [BOUNDS[bound](case, base.scaled(s), poses) for s in (0.0, 1e-3, 1.0 / 60.0, 0.1)]
    assert low[0] == pytest.approx(np.ones(6), abs=ALLOWANCE)
    assert all(np.all(larger < smaller) for smaller, larger in pairwise(low))
    assert np.all(low[2] > 0.0)


@pytest.mark.parametrize("degrees", [5.0, 30.0, 41.0, 43.0, 80.0, 89.0, 91.0])
def test_a_camera_turned_about_its_axis_has_the_closed_form(degrees):
    """The servo is stable below 90 deg, with the margin cos G.

    Rodrigues' formula has z sin(z) / z within [-G, G] and 1 - z^2 (1 - cos z) / z^2 within
    [1 - G^2 / 2, 1] by intervals, which gives 1 - G - G^2 / 2 and a limit of 42 deg; the constant
    of Lipschitz is 1 + sin G, so that its limit is where G (1 + sin G) = 1, 36 deg.
    """
    case, G = planar_robot_at_goal(), math.radians(degrees)
    bounds, pose = PerturbationBounds(d_theta_pc=G), random_poses(1, planar=True)
    worst = judge_stability(case, bounds, pose, "searched", ONE).margin[0]
    assert worst == pytest.approx(planar_margin(G, 0.0), abs=ROUNDING)
    intervals = interval_margins(case, bounds, pose)[0]
    assert intervals == pytest.approx(1.0 - G - 0.5 * G * G, abs=SETTLED)
    lipschitz = 1.0 - G * (1.0 + math.sin(min(G, 0.5 * math.pi)))
    assert lipschitz_margins(case, bounds, pose)[0] == pytest.approx(lipschitz, abs=ALLOWANCE)
    assert (worst > 0.0) == (degrees < 90.0)
    assert (intervals > 0.0) == (degrees < math.degrees(math.sqrt(3.0) - 1.0))


def test_cut_boxes_bound_more():
    """Without end they come to the truth: the turn in 64 parts gives cos G up to three of them."""
    case, G = planar_robot_at_goal(), math.radians(60.0)
    bounds, pose = PerturbationBounds(d_theta_pc=G), random_poses(1, planar=True)
    margins = [interval_margins(case, bounds, pose, parts)[0] for parts in (1, 2, 4, 64)]
    assert margins == sorted(margins)
    part = 2.0 * G / 64.0
    assert math.cos(G) - 3.0 * part < margins[-1] <= math.cos(G)


def test_the_constants_of_lipschitz_do_not_see_how_the_world_is_turned():
    place, up, poses = np.array([0.1, 0.0, 0.2]), np.array([0, 0, 1.0]), random_poses(4)
    case = spatial_case("pbvs", target=FixedPlace(place, up))
    X = RigidTransform(RollPitchYaw(0.4, -1.1, 2.0), [0.3, -0.2, 0.5])
    cables = replace(case.cables, p_WA=X.multiply(case.cables.p_WA))
    turned = replace(case, cables=cables, target=FixedPlace(X.multiply(place), up))
    there = np.array([pose_row(X @ pose_of(row)) for row in poses])
    bounds = BASELINE.scaled(0.1)
    expected = lipschitz_margins(case, bounds, poses)
    assert lipschitz_margins(turned, bounds, there) == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("bound", BOUNDS)
def test_nothing_is_bounded_where_a_cable_may_vanish(bound):
    bounds = BASELINE.varied(r_bp=5.0)
    assert np.all(np.isneginf(BOUNDS[bound](CASES["pbvs"], bounds, random_poses(2))))


# The remainder cable by cable. In the whole criterion sums over cables hide terms of third order.

COUNT = 40_000  # random cables and perturbations for each question
TIGHT = {"n": 0.99, "z_w": 0.98}
"""Shares of the bound that the worst cables reach at least; found 0.9999 and 0.997. Of 25 terms
and factors of the bound, 19 let some cable pass it where they are dropped alone; the others,
products of F with |db| or of third order in F, lie below what is left elsewhere."""
LARGEST = {
    "F": 0.5, "G": 0.8, "r_bp": 0.3, "arm": 1.0, "size_A": 0.2, "size_B": 0.2, "seen": 0.5,
    "lever": 1.0,
}  # fmt: skip
"""Bounds of the perturbations and arms of a cable of 1 m are drawn up to these [rad, m]."""


def directions(random):
    """Unit vectors for the eight perturbations and arms of each cable, often in one plane."""
    V = random.normal(size=(COUNT, 8, 3))
    flat = random.random(COUNT) < 0.5
    V[flat, :, 2] = 0.0
    along = random.random((COUNT, 8)) < 0.3  # along or across the cable, which is x
    V[along & (random.random((COUNT, 8)) < 0.5)] *= [1.0, 1e-9, 1e-9]
    return V / np.linalg.norm(V, axis=2, keepdims=True)


def times(R, x):
    return np.einsum("nij,nj->ni", R, x)


def dot(x, y):
    return np.sum(x * y, axis=1, keepdims=True)


def remainders(random, which):
    """What the expansion misses per unit of n or of z_w, and its bound, each of shape (COUNT,).

    Many bounds of perturbations are zero, so that every term is large somewhere.
    """
    s = {
        name: largest * random.random(COUNT) ** 2 * (random.random(COUNT) < 0.5)
        for name, largest in LARGEST.items()
    }
    V = directions(random)
    radii = np.stack([s[k] for k in ("F", "G", "r_bp", "size_A", "size_B", "arm", "lever")], axis=1)
    f, g, dp, da, db, b, c = np.moveaxis(radii[:, :, None] * V[:, :7], 1, 0)
    share = random.random((COUNT, 1))
    other = Rotation.random(COUNT, random_state=1).apply(V[:, 7])
    dt, ds = share * s["seen"][:, None] * V[:, 7], (1.0 - share) * s["seen"][:, None] * other
    u = np.broadcast_to([1.0, 0.0, 0.0], (COUNT, 3))
    cross = np.cross
    turn_f, turn_g = Rotation.from_rotvec(f).as_matrix(), Rotation.from_rotvec(g).as_matrix()

    def across(x):
        return x - u * dot(u, x)

    q = u + dp - da + times(turn_f, b + db) - b  # length 1, so P / l is `across`
    U = times(np.swapaxes(turn_f, 1, 2), q / np.linalg.norm(q, axis=1, keepdims=True))
    shift = dp + cross(f, b)
    U1 = across(shift) - cross(f, u)
    curved = -dot(u, shift) * across(shift) - 0.5 * dot(across(shift), across(shift)) * u
    U2 = curved + 0.5 * across(cross(f, cross(f, b))) - cross(f, across(shift))
    U2 = U2 + 0.5 * cross(f, cross(f, u))

    def missed(n, zw):
        zv = n - cross(zw, c)
        N = times(turn_g, zv + cross(ds, zw)) + cross(times(turn_g, zw), c + db - dt)
        n_g = cross(g, zv) + cross(cross(g, zw), c)
        seen = cross(ds + dt, zw)
        later = times(turn_g, zv) - zv + cross(times(turn_g, zw) - zw, c) - n_g
        swung = times(turn_g, cross(ds, zw)) - cross(ds, zw) - cross(times(turn_g, zw) - zw, dt)
        known = dot(u, n + n_g + seen + cross(zw, db) + later + swung)
        known = known + dot(U1 + across(db - da) + U2, n) + dot(U1, n_g + seen)
        return (dot(U, N) - known)[:, 0]

    nothing = np.zeros((COUNT, 3))
    basis = [np.broadcast_to(e, (COUNT, 3)) for e in np.eye(3)]
    parts = [missed(e, nothing) if which == "n" else missed(nothing, e) for e in basis]
    known, lone = s["r_bp"] + s["F"] * s["arm"], s["size_A"] + s["size_B"]
    bounds = np.full(COUNT, np.inf)
    for k in np.flatnonzero(known + lone < 0.9):
        bounds[k] = cable_remainder(
            known[k], s["arm"][k], s["lever"][k], 1.0, s["F"][k], s["G"][k], s["seen"][k], lone[k],
            s["size_B"][k],
        )[0 if which == "n" else 1]  # fmt: skip
    return np.linalg.norm(parts, axis=0), bounds


@pytest.mark.parametrize("which", ["n", "z_w"])
def test_no_cable_moves_beyond_the_remainder_and_some_as_far(which):
    missed, bounds = remainders(np.random.default_rng(3), which)
    assert np.all(missed <= bounds + 1e-12)  # sums of numbers up to 10 in double precision
    large = np.isfinite(bounds) & (bounds > 1e-6)
    assert np.max(missed[large] / bounds[large]) > TIGHT[which]
