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
from tests.statics.hanging import (
    UPRIGHT,
    WEIGHT,
    flat,
    hanging,
    random_problem,
    rests_on_a_linkage,
)
from tests.statics.lost_solutions import lost

EXACT = 1e-9
"""Doubles, of numbers about 1, after Newton's method."""

SEEN = 1e-5
"""The search on the linkage bisects differences of heights, which are exact to 1e-10."""

PUBLISHED = {3: 156, 4: 216, 5: 140, 6: 40}
"""Complex solutions of a body on k cables: Abbasnejad and Carricato, 2015."""


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


def test_a_pendulum_hangs_and_stands():
    platform = hanging([(0, 0, 2)], [(0.1, 0, 0.2)], (0, 0.3, -0.1))
    low, high = enumerate_equilibria(platform, np.array([1.2])).rests
    reach = np.linalg.norm([0.1, -0.3, 0.3])
    for one, height, stability in (
        (low, 0.8 - reach, Stability.NEUTRAL),  # it turns about the vertical
        (high, 0.8 + reach, Stability.UNSTABLE),
    ):
        assert one.X_WP.multiply(platform.p_PCo) == pytest.approx([0, 0, height], abs=EXACT)
        assert one.tensions == pytest.approx([WEIGHT])
        assert (one.stability, one.certificate) == (stability, Certificate.CLOSED_FORM)
        assert one.family


def test_a_pendulum_in_a_plane_is_isolated():
    platform = hanging([(0, 0, 2)], [(0.1, 0, 0.2)], (0.2, 0, -0.1), **UPRIGHT)
    low, high = enumerate_equilibria(platform, np.array([1.2])).rests
    assert (low.stability, high.stability) == (Stability.STABLE, Stability.UNSTABLE)
    assert not low.family
    for one in (low, high):  # it turns about y only
        assert one.X_WP.rotation().matrix()[1] == pytest.approx([0, 1, 0], abs=EXACT)


RADIUS, LENGTH = 1.0, 1.7
THREE = [(RADIUS * np.cos(a), RADIUS * np.sin(a), 2.0) for a in 2 * np.pi / 3 * np.arange(3)]


@pytest.mark.parametrize(
    ("third", "slack", "point"),
    [
        (LENGTH, False, (0, 0, 2 - np.sqrt(LENGTH**2 - RADIUS**2))),
        # The other two let it down below the middle between them, where the third is longer.
        (2.4, True, (0.25, np.sqrt(3) / 4, 2 - np.sqrt(LENGTH**2 - 0.75 * RADIUS**2))),
    ],
)
def test_a_point_mass_on_three_cables_rests_once(third, slack, point):
    platform = hanging(THREE, [(0, 0, 0)] * 3, (0, 0, 0), num_turns=0)
    (only,) = enumerate_equilibria(platform, np.array([LENGTH, LENGTH, third])).rests
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
    platform = hanging(exits, anchors, (0, 0, -0.1), **UPRIGHT)
    lengths = np.full(2, length)
    found = enumerate_equilibria(platform, lengths)
    heights = [2 - np.sqrt(length**2 - (1 - s * 0.3) ** 2) for s in (1, -1)[:count]]
    symmetric = [one for one in found.rests if abs(one.X_WP.translation()[0]) < EXACT]
    assert [one.X_WP.translation()[2] for one in symmetric] == pytest.approx(heights, abs=EXACT)
    for one, span in zip(symmetric, (0.7, 1.3), strict=False):
        tension = 0.5 * WEIGHT * length / np.sqrt(length**2 - span**2)
        assert one.tensions == pytest.approx([tension, tension])
        assert one.certificate == Certificate.PROVEN
    assert found.rests[0].stability == Stability.STABLE
    seen = rests_on_a_linkage(platform, lengths)
    taut = [one for one in found.rests if not np.any(one.slack)]
    assert len(taut) == len(seen)


def test_two_cables_in_the_plane_miss_nothing_of_the_linkage():
    random, total = np.random.default_rng(5), 0
    for _ in range(12):
        platform, lengths = random_problem(random, 2, upright=True)
        seen = rests_on_a_linkage(platform, lengths)
        try:
            found = enumerate_equilibria(platform, lengths)
        except EquilibriumError:
            assert not seen
            continue
        taut = [one for one in found.rests if np.all(one.tensions > 0.0)]
        assert len(taut) == len(seen)
        for one in taut:
            x, _, z = one.X_WP.translation()
            R = one.X_WP.rotation().matrix()
            here = np.array([x, z, np.arctan2(R[2, 0], R[0, 0])])
            off = np.abs(np.array(seen) - here)
            off[:, 2] = np.minimum(off[:, 2], 2 * np.pi - off[:, 2])
            assert np.min(np.max(off, axis=1)) < SEEN
        total += len(taut)
    assert total >= 8


def test_a_body_in_space_on_two_cables_has_the_poses_of_the_plane_twice():
    """Either way round: the plane of cables is that of the exit points."""
    exits, anchors = flat([(-1, 2), (1, 2.2)]), flat([(-0.3, 0), (0.3, 0.05)])
    lengths, center = np.array([1.3, 1.4]), (0.05, 0, -0.1)
    upright = enumerate_equilibria(hanging(exits, anchors, center, **UPRIGHT), lengths).rests
    mirrored = [(-x, 0, z) for x, _, z in anchors]
    other = enumerate_equilibria(
        hanging(exits, mirrored, (-0.05, 0, -0.1), **UPRIGHT), lengths
    ).rests
    space = enumerate_equilibria(hanging(exits, anchors, center), lengths).rests
    heights = sorted(one.energy for one in [*upright, *other])
    assert [one.energy for one in space] == pytest.approx(heights, abs=EXACT)


def test_a_pendulum_turns_to_where_a_slack_cable_reaches():
    """It hangs on the first cable however it is turned, the second reaches only one side of it."""
    exits, anchors = [(0, 0, 2), (1.0, 0, 1.3)], [(0, 0, 0), (-0.4, 0, -0.3)]
    platform = hanging(exits, anchors, (0, 0, -0.3))
    lengths = np.array([1.0, 0.95])
    found = enumerate_equilibria(platform, lengths).rests
    (hung,) = [one for one in found if one.tensions[1] == 0 and one.energy < WEIGHT]
    assert hung.family
    assert hung.X_WP.translation() == pytest.approx([0, 0, 1], abs=EXACT)
    # Unturned, its second anchor point is 1.5 m away, turned by pi 0.85 m.
    assert hung.X_WP.multiply(platform.cables.p_PB[:, 1])[0] > 0.35


def test_random_starts_find_nothing_else():
    """The long form: python -m tests.statics.lost_solutions."""
    counts = lost(problems=6, seed=1, searches=40)
    assert counts.lost == 0
    assert counts.poses > 6


def test_certificates_need_a_solution_and_say_where_it_is_alone():
    platform, lengths = random_problem(np.random.default_rng(3), 3, upright=False)
    found = enumerate_equilibria(platform, lengths)
    assert found.complete
    assert found.paths.paths == 3 * 2 * 12 + 156
    for one in found.rests:
        if np.count_nonzero(one.tensions) > 1:
            assert one.certificate == Certificate.PROVEN
        assert one.unbalanced < EXACT
        taut = one.tensions > 0.0
        cables = platform.cables
        paths = cable_lengths(one.X_WP, cables.p_WA, cables.p_PB)
        assert paths[taut] == pytest.approx(lengths[taut], abs=EXACT)
        assert np.all(paths <= lengths + EXACT)


def test_lengths_of_more_cables_than_motions_from_one_pose():
    exits = flat([(-1, 2), (1, 2), (-1.2, 0), (1.2, 0)])
    anchors = flat([(-0.2, 0.1), (0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)])
    platform = hanging(exits, anchors, (0.02, 0, 0), **UPRIGHT)
    X_WP = RigidTransform(RotationMatrix.MakeYRotation(0.1), [0.1, 0.0, 1.1])
    lengths = cable_lengths(X_WP, platform.cables.p_WA, platform.cables.p_PB)
    found = enumerate_equilibria(platform, lengths)
    here = [one for one in found.rests if pose_error(one.X_WP, X_WP)[0] < 1e-7]
    assert len(here) == 1
    assert here[0].certificate == Certificate.PROVEN_TAUT
    assert not np.any(here[0].slack)


def test_a_tilted_world_changes_nothing():
    platform, lengths = random_problem(np.random.default_rng(3), 3, upright=False)
    tilt = RotationMatrix.MakeXRotation(0.7) @ RotationMatrix.MakeYRotation(-0.4)
    tilted = replace(
        platform,
        cables=replace(platform.cables, p_WA=tilt.matrix() @ platform.cables.p_WA),
        weight_W=tilt.matrix() @ platform.weight_W,
    )
    plain, other = (
        enumerate_equilibria(platform, lengths).rests,
        enumerate_equilibria(tilted, lengths).rests,
    )
    assert len(plain) == len(other)
    for one, two in zip(plain, other, strict=True):
        expected = tilt.matrix() @ one.X_WP.multiply(platform.p_PCo)
        assert two.X_WP.multiply(platform.p_PCo) == pytest.approx(expected, abs=1e-7)


def test_a_position_gives_back_the_turn_and_the_lengths():
    platform, lengths = random_problem(np.random.default_rng(3), 3, upright=False)
    one = next(
        one for one in enumerate_equilibria(platform, lengths).rests if np.all(one.tensions > 0.0)
    )
    placed = enumerate_at_position(platform, one.X_WP.translation(), [0, 1, 2])
    assert placed.paths.paths == 24
    assert placed.paths.lost == 0
    errors = [pose_error(one.X_WP, other.X_WP)[1] for other in placed.rests]
    best = int(np.argmin(errors))
    assert errors[best] < 1e-7
    assert placed.lengths[best] == pytest.approx(lengths, abs=1e-8)
    assert placed.rests[best].stability == one.stability


def test_a_start_above_all_cables_leads_down_to_the_rest():
    """There all hang loose, and none of them is a start for the search."""
    platform = hanging(THREE, [(0, 0, 0)] * 3, (0, 0, 0), num_turns=0)
    l0 = np.full(3, LENGTH)
    (only,) = sample_equilibria(platform, l0, most=200).rests
    above = RigidTransform(only.X_WP.translation() + np.array([0.0, 0.0, 0.5]))
    paths = cable_lengths(above, platform.cables.p_WA, platform.cables.p_PB)
    assert np.all(paths < LENGTH)
    found = sample_equilibria(platform, l0, most=1, starts=[above])
    assert pose_error(found.rests[0].X_WP, only.X_WP)[0] < 1e-9


def test_elastic_cables_stretch_by_their_tensions():
    platform = hanging(THREE, [(0, 0, 0)] * 3, (0, 0, 0), num_turns=0)
    found = sample_equilibria(platform, np.full(3, LENGTH), most=200)
    (only,) = found.rests
    assert found.stopped
    assert found.expected < 1.5
    paths = cable_lengths(only.X_WP, platform.cables.p_WA, platform.cables.p_PB)
    assert only.tensions == pytest.approx(1e5 * (paths / LENGTH - 1), rel=1e-6)
    assert only.tensions @ (2 - only.X_WP.translation()[2:]).repeat(3) / paths[0] == pytest.approx(
        WEIGHT
    )


@pytest.mark.parametrize(
    ("change", "lengths", "words"),
    [
        ({}, [0.3, 0.3, 0.3], "together are"),
        ({}, [1.0, np.nan, 1.0], "NaN"),
        ({}, [1.0, 1.0], "2 numbers"),
        ({"weight_W": np.zeros(3)}, [1.5, 1.5, 1.5], "no weight"),
        (
            {"num_turns": 1, "num_moves": 2, "axis": (0.0, 0.0, 1.0)},
            [1.5, 1.5, 1.5],
            "no weight",
        ),
    ],
)
def test_lengths_that_no_pose_has_are_named(change, lengths, words):
    platform = replace(hanging(THREE, 0.1 * np.array(THREE), (0, 0, 0)), **change)
    with pytest.raises(EquilibriumError, match=words):
        enumerate_equilibria(platform, np.array(lengths))
