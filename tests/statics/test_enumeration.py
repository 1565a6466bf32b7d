"""All poses of rest: counts known by hand, an exhaustive search in the plane, and random starts."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.errors import EquilibriumError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.statics.equilibria_at_position import enumerate_at_position
from cdpr_drake.statics.equilibrium import Stability
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from cdpr_drake.statics.homotopy_kernel import FOUND
from cdpr_drake.statics.inextensible_problem import Certificate
from cdpr_drake.statics.start_systems import KINDS, distinct, follow_all, start_system
from tests.statics.lost_solutions import lost
from tests.statics.statics_cases import (
    UPRIGHT,
    WEIGHT,
    flat,
    hanging,
    random_problem,
    rests_on_a_linkage,
)

EXACT = 1e-9
"""Doubles, of numbers about 1, after Newton's method."""

BISECTED = 1e-5
"""The search on the linkage bisects differences of heights, which are exact to 1e-10."""

PUBLISHED = {3: 156, 4: 216, 5: 140, 6: 40}
"""Complex solutions of a body on k cables: Abbasnejad and Carricato, 2015."""

RADIUS, LENGTH = 1.0, 1.7
THREE = [(RADIUS * np.cos(a), RADIUS * np.sin(a), 2.0) for a in 2 * np.pi / 3 * np.arange(3)]
POINT = hanging(THREE, [(0, 0, 0)] * 3, (0, 0, 0), num_turns=0)


def path_lengths(platform, X_WP):
    return cable_lengths(X_WP, platform.cables.p_WA, platform.cables.p_PB)


@pytest.mark.parametrize("name", KINDS)
def test_start_systems_are_solved_and_have_as_many_solutions_as_published(name):
    kind, start = KINDS[name], start_system(name)
    if not kind.planar:
        assert kind.count == (24 if kind.placed else PUBLISHED[kind.taut])
    X = start.solutions.copy()
    assert len(X) == kind.count == len(distinct(X, kind))
    ends = follow_all(kind, start.constants, start.constants[None], X, np.ones(len(X)))
    assert np.all(ends[:, 0] == FOUND)
    # Scaled to a quaternion of length one, they stay where they were.
    assert len(distinct(np.concatenate([X, start.solutions]), kind)) == kind.count


# By hand.


def test_a_pendulum_hangs_and_stands():
    platform = hanging([(0, 0, 2)], [(0.1, 0, 0.2)], (0, 0.3, -0.1))
    low, high = enumerate_equilibria(platform, np.array([1.2])).rests
    reach = np.linalg.norm([0.1, -0.3, 0.3])
    for rest, height in ((low, 0.8 - reach), (high, 0.8 + reach)):
        assert rest.X_WP.multiply(platform.p_PCo) == pytest.approx([0, 0, height], abs=EXACT)
        assert rest.tensions == pytest.approx([WEIGHT])
        assert rest.certificate == Certificate.CLOSED_FORM
        assert rest.family  # it turns about the vertical
    assert (low.stability, high.stability) == (Stability.NEUTRAL, Stability.UNSTABLE)
    # In a plane it is isolated, and turns about y only.
    platform = hanging([(0, 0, 2)], [(0.1, 0, 0.2)], (0.2, 0, -0.1), **UPRIGHT)
    low, high = enumerate_equilibria(platform, np.array([1.2])).rests
    assert (low.stability, high.stability) == (Stability.STABLE, Stability.UNSTABLE)
    assert not low.family
    for rest in (low, high):
        assert rest.X_WP.rotation().matrix()[1] == pytest.approx([0, 1, 0], abs=EXACT)


@pytest.mark.parametrize(
    ("third", "slack", "point"),
    [
        (LENGTH, False, (0, 0, 2 - np.sqrt(LENGTH**2 - RADIUS**2))),
        # The other two let it down below the middle between them, where the third is longer.
        (2.4, True, (0.25, np.sqrt(3) / 4, 2 - np.sqrt(LENGTH**2 - 0.75 * RADIUS**2))),
    ],
)
def test_a_point_mass_on_three_cables_rests_once(third, slack, point):
    (only,) = enumerate_equilibria(POINT, np.array([LENGTH, LENGTH, third])).rests
    assert only.X_WP.translation() == pytest.approx(point, abs=EXACT)
    assert only.stability == Stability.STABLE
    assert only.slack.tolist() == [False, False, slack]
    if not slack:
        depth = 2 - only.X_WP.translation()[2]
        assert only.tensions == pytest.approx(np.full(3, WEIGHT * LENGTH / depth / 3))


@pytest.mark.parametrize(("length", "count"), [(1.2, 1), (1.45, 2)])
def test_an_isosceles_platform_on_two_cables(length, count):
    """Exit points at -1 and 1, anchor points at -0.3 and 0.3.

    Upright the cables span 0.7 each way, upside down 1.3: so it hangs upright, and where the cables
    are longer than 1.3 m also upside down, and above the exit points cables would have to push.
    """
    exits, anchors = flat([(-1, 2), (1, 2)]), flat([(-0.3, 0), (0.3, 0)])
    platform, lengths = hanging(exits, anchors, (0, 0, -0.1), **UPRIGHT), np.full(2, length)
    rests = enumerate_equilibria(platform, lengths).rests
    heights = [2 - np.sqrt(length**2 - (1 - s * 0.3) ** 2) for s in (1, -1)[:count]]
    symmetric = [rest for rest in rests if abs(rest.X_WP.translation()[0]) < EXACT]
    assert [rest.X_WP.translation()[2] for rest in symmetric] == pytest.approx(heights, abs=EXACT)
    for rest, span in zip(symmetric, (0.7, 1.3), strict=False):
        tension = 0.5 * WEIGHT * length / np.sqrt(length**2 - span**2)
        assert rest.tensions == pytest.approx([tension, tension])
        assert rest.certificate == Certificate.PROVEN
    assert rests[0].stability == Stability.STABLE
    taut = [rest for rest in rests if not np.any(rest.slack)]
    assert len(taut) == len(rests_on_a_linkage(platform, lengths))


def test_a_body_in_space_on_two_cables_has_the_poses_of_the_plane_twice():
    """Either way round: the plane of cables is that of the exit points."""
    exits, anchors = flat([(-1, 2), (1, 2.2)]), flat([(-0.3, 0), (0.3, 0.05)])
    mirrored = [(-x, 0, z) for x, _, z in anchors]
    lengths, center = np.array([1.3, 1.4]), (0.05, 0, -0.1)
    energies = [
        [rest.energy for rest in enumerate_equilibria(platform, lengths).rests]
        for platform in (
            hanging(exits, anchors, center, **UPRIGHT),
            hanging(exits, mirrored, (-0.05, 0, -0.1), **UPRIGHT),
            hanging(exits, anchors, center),
        )
    ]
    assert energies[2] == pytest.approx(sorted(energies[0] + energies[1]), abs=EXACT)


def test_a_pendulum_turns_to_where_a_slack_cable_reaches():
    """It hangs on the first cable however it is turned, the second reaches only one side of it."""
    exits, anchors = [(0, 0, 2), (1.0, 0, 1.3)], [(0, 0, 0), (-0.4, 0, -0.3)]
    platform = hanging(exits, anchors, (0, 0, -0.3))
    rests = enumerate_equilibria(platform, np.array([1.0, 0.95])).rests
    (hung,) = [rest for rest in rests if rest.tensions[1] == 0 and rest.energy < WEIGHT]
    assert hung.family
    assert hung.X_WP.translation() == pytest.approx([0, 0, 1], abs=EXACT)
    # Unturned, its second anchor point is 1.5 m away, turned by pi 0.85 m.
    assert hung.X_WP.multiply(platform.cables.p_PB[:, 1])[0] > 0.35


# By other searches.


def test_two_cables_in_the_plane_miss_nothing_of_the_linkage():
    random, total = np.random.default_rng(5), 0
    for _ in range(12):
        platform, lengths = random_problem(random, 2, upright=True)
        expected = rests_on_a_linkage(platform, lengths)
        try:
            rests = enumerate_equilibria(platform, lengths).rests
        except EquilibriumError:
            assert not expected
            continue
        taut = [rest for rest in rests if np.all(rest.tensions > 0.0)]
        assert len(taut) == len(expected)
        for rest in taut:
            x, _, z = rest.X_WP.translation()
            R = rest.X_WP.rotation().matrix()
            off = np.abs(np.array(expected) - [x, z, np.arctan2(R[2, 0], R[0, 0])])
            off[:, 2] = np.minimum(off[:, 2], 2 * np.pi - off[:, 2])
            assert np.min(np.max(off, axis=1)) < BISECTED
        total += len(taut)
    assert total >= 8


def test_random_starts_find_nothing_else():
    """The long form: python -m tests.statics.lost_solutions."""
    poses, missing = lost(problems=6, seed=1, searches=12)
    assert not missing
    assert poses > 6


@pytest.fixture(scope="module")
def three():
    """A body in space on three cables, its lengths and poses of rest."""
    platform, lengths = random_problem(np.random.default_rng(3), 3, upright=False)
    return platform, lengths, enumerate_equilibria(platform, lengths)


def test_certificates_need_a_solution_and_say_where_it_is_alone(three):
    platform, lengths, result = three
    assert result.complete
    assert result.paths.paths == 3 * 2 * 12 + 156
    for rest in result.rests:
        if np.count_nonzero(rest.tensions) > 1:
            assert rest.certificate == Certificate.PROVEN
        assert rest.unbalanced < EXACT
        taut, paths = rest.tensions > 0.0, path_lengths(platform, rest.X_WP)
        assert paths[taut] == pytest.approx(lengths[taut], abs=EXACT)
        assert np.all(paths <= lengths + EXACT)


def test_a_tilted_world_changes_nothing(three):
    platform, lengths, result = three
    tilt = (RotationMatrix.MakeXRotation(0.7) @ RotationMatrix.MakeYRotation(-0.4)).matrix()
    cables = replace(platform.cables, p_WA=tilt @ platform.cables.p_WA)
    tilted = replace(platform, cables=cables, weight_W=tilt @ platform.weight_W)
    others = enumerate_equilibria(tilted, lengths).rests
    for rest, other in zip(result.rests, others, strict=True):
        expected = tilt @ rest.X_WP.multiply(platform.p_PCo)
        assert other.X_WP.multiply(platform.p_PCo) == pytest.approx(expected, abs=1e-7)


def test_a_position_gives_back_the_turn_and_the_lengths(three):
    platform, lengths, result = three
    rest = next(rest for rest in result.rests if np.all(rest.tensions > 0.0))
    placed = enumerate_at_position(platform, rest.X_WP.translation(), [0, 1, 2])
    assert (placed.paths.paths, placed.paths.lost) == (24, 0)
    errors = [pose_error(rest.X_WP, other.X_WP)[1] for other in placed.rests]
    best = int(np.argmin(errors))
    assert errors[best] < 1e-7
    assert placed.lengths[best] == pytest.approx(lengths, abs=1e-8)
    assert placed.rests[best].stability == rest.stability


def test_lengths_of_more_cables_than_motions_from_one_pose():
    exits = flat([(-1, 2), (1, 2), (-1.2, 0), (1.2, 0)])
    anchors = flat([(-0.2, 0.1), (0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)])
    platform = hanging(exits, anchors, (0.02, 0, 0), **UPRIGHT)
    X_WP = RigidTransform(RotationMatrix.MakeYRotation(0.1), [0.1, 0.0, 1.1])
    rests = enumerate_equilibria(platform, path_lengths(platform, X_WP)).rests
    (rest,) = [rest for rest in rests if pose_error(rest.X_WP, X_WP)[0] < 1e-7]
    assert rest.certificate == Certificate.PROVEN_TAUT
    assert not np.any(rest.slack)


def test_elastic_cables_stretch_by_their_tensions_and_loose_starts_lead_down():
    """Above all cables hang loose, and none of them is a start for the search."""
    l0 = np.full(3, LENGTH)
    result = sample_equilibria(POINT, l0, most=200)
    (only,) = result.rests
    assert result.stopped
    assert result.expected < 1.5
    paths, depth = path_lengths(POINT, only.X_WP), 2 - only.X_WP.translation()[2]
    assert only.tensions == pytest.approx(1e5 * (paths / LENGTH - 1), rel=1e-6)
    assert np.sum(only.tensions) * depth / paths[0] == pytest.approx(WEIGHT)
    above = RigidTransform(only.X_WP.translation() + np.array([0.0, 0.0, 0.5]))
    assert np.all(path_lengths(POINT, above) < LENGTH)
    again = sample_equilibria(POINT, l0, most=1, starts=[above])
    assert pose_error(again.rests[0].X_WP, only.X_WP)[0] < 1e-9
