"""Boxes merged to few sets: what they hold is proven, what was connected stays so, walls part."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry.optimization import LoadIrisRegionsYamlFile, Point
from pydrake.planning import GcsTrajectoryOptimization
from scipy import ndimage

from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE
from cdpr_drake.proofs.certified_boxes import CertifiedBoxes, PoseBox
from cdpr_drake.proofs.cuboid_cover import SumTable, cover_cells, set_groups
from cdpr_drake.proofs.cuboid_cover_kernel import count_cells, overlapping_pairs
from cdpr_drake.proofs.proven_cells import CellRegion, ProvenCells, raster_shape, whole_cells
from cdpr_drake.proofs.proven_connection import separated
from cdpr_drake.proofs.proven_sets import PoseSets, sets_of_cells
from cdpr_drake.proofs.robot_sets import ProofSettings, ProvenSets
from cdpr_drake.workspaces.cable_interference import box_row

FLAT = PoseBox(np.array([-1.0, 0.0, 0.5, 0, 0, 0]), np.array([1.0, 3.0, 0.5, 0, 0, 0]))


def random_cells(seed, shape, share=0.6):
    """Blobs: random numbers, smoothed, above a share."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=shape), 1.0)
    return noise > np.quantile(noise, 1.0 - share)


def cut_boxes(seed, box, axes, depth):
    """A box cut in halves at random, with random verdicts, as `certify` cuts."""
    random = np.random.default_rng(seed)
    stack, done = [(0.5 * (box.lower + box.upper), 0.5 * (box.upper - box.lower), 0)], []
    while stack:
        pose, size, level = stack.pop()
        if level == depth or random.random() < 0.15:
            done.append((pose, size, random.choice([INSIDE, OPEN, OUTSIDE], p=[0.85, 0.1, 0.05])))
            continue
        axis, size = random.choice(axes), size.copy()
        size[axis] *= 0.5
        for side in (-1.0, 1.0):
            moved = pose.copy()
            moved[axis] += side * size[axis]
            stack.append((moved, size, level + 1))
    poses, halves, verdicts = (np.array(part) for part in zip(*done, strict=True))
    return CertifiedBoxes(poses, halves, verdicts, np.zeros((1, 4)), True)


def made_sets():
    axes, shape = raster_shape(FLAT, 1.0, 2**7)
    inside = random_cells(5, shape, 0.7)
    cells = ProvenCells(FLAT, axes, inside, ~inside, cut_boxes(5, FLAT, axes, 1))
    lower, upper, _ = sets_of_cells(cells, 0.95)
    return PoseSets(lower, upper, axes, {"robot": "made", "kinds": ["static"]}, cells)


# Cells.


def test_shape_of_the_raster_follows_the_box():
    axes, shape = raster_shape(FLAT, 1.0, 2**7)
    assert axes.tolist() == [0, 1]
    assert shape == (8, 16)  # 2 m and 3 m: 0.25 m and 0.1875 m


def test_a_cell_is_whole_where_boxes_fill_it_also_small_ones():
    axes, shape, count = np.array([0, 1]), (8, 4), 0
    ticks = [
        FLAT.lower[a] + (FLAT.upper - FLAT.lower)[a] * (np.arange(64) + 0.5) / 64 for a in axes
    ]
    poses = np.repeat(FLAT.lower[np.newaxis], 64 * 64, axis=0)
    poses[:, :2] = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    for seed in range(4):
        boxes = cut_boxes(seed, FLAT, axes, 6)
        whole = whole_cells(boxes, INSIDE, FLAT, axes, shape)
        inside = boxes.at(poses) == INSIDE
        np.testing.assert_array_equal(whole, inside.reshape(8, 8, 4, 16).all(axis=(1, 3)))
        count += np.count_nonzero(whole)
    assert 10 < count < 4 * 32 - 10


def test_a_region_of_cells_has_the_boxes_that_share_more_than_a_border_with_it():
    cells = made_sets().cells
    shape, shares = np.array(cells.inside.shape), []
    for seed in range(4):
        boxes = cut_boxes(seed, FLAT, cells.axes, 9)
        mask = np.random.default_rng(seed).random(shape) < 0.1
        meets = CellRegion(cells, mask).meets(boxes.poses, boxes.halves)
        low, high = cells.edges(np.argwhere(mask)), cells.edges(np.argwhere(mask) + 1)
        a, b = boxes.poses[:, :2], boxes.halves[:, :2]
        shared = np.minimum((a + b)[:, None], high) - np.maximum((a - b)[:, None], low)
        np.testing.assert_array_equal(meets, np.any(np.all(shared > 1e-9, axis=2), axis=1))
        shares.append(np.mean(meets))
    assert 0.0 < np.mean(shares) < 1.0


def test_a_pose_on_a_border_lies_in_the_cells_on_both_sides():
    cells = made_sets().cells
    pose = FLAT.lower.copy()
    pose[:2] = cells.edges(np.array([2, 3]))
    assert sorted(map(tuple, cells.cells_at(pose).tolist())) == [(1, 2), (1, 3), (2, 2), (2, 3)]
    pose[0] = 2.0
    assert not len(cells.cells_at(pose))


# Covers.


@given(st.integers(0, 2**20), st.sampled_from([(12, 9), (7, 6, 8), (5, 4, 5, 3)]))
@settings(max_examples=20)
def test_sets_are_good_cover_and_keep_what_is_connected(seed, shape):
    good = random_cells(seed, shape)
    parts, _ = ndimage.label(good)
    cells = np.argwhere(good)
    must = cells[np.random.default_rng(seed).integers(0, len(cells), 3)]
    cover = cover_cells(good, 0.9, must)
    covered = np.zeros(shape, bool)
    for low, high in cover.tolist():
        place = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        assert np.all(good[place])  # what a set holds is proven
        for axis in range(len(shape)):  # and no layer can be added
            for edge in (low[axis] - 1, high[axis]):
                if 0 <= edge < shape[axis]:
                    layer = list(place)
                    layer[axis] = slice(edge, edge + 1)
                    assert not np.all(good[tuple(layer)])
        covered[place] = True
    assert np.count_nonzero(covered) >= 0.9 * np.count_nonzero(good)
    assert np.all(covered[tuple(must.T)])
    pairs = set(zip(parts[tuple(cover[:, 0].T)].tolist(), set_groups(cover).tolist(), strict=True))
    for side in zip(*pairs, strict=True):  # one part of the cells, one group of the sets
        assert len(set(side)) == len(pairs)
    assert np.array_equal(cover, cover_cells(good, 0.9, must))


def test_a_cover_that_is_not_connected_gets_the_cells_between():
    good = np.zeros((30, 9), bool)
    good[:10], good[20:] = True, True
    good[10:20, 4] = True  # a corridor of 10 of 190 cells, which a share of 0.9 need not cover
    cover = cover_cells(good, 0.9, np.zeros((0, 2)))
    assert len(np.unique(set_groups(cover))) == 1
    assert np.any((cover[:, 0, 0] <= 12) & (cover[:, 1, 0] >= 14))


def test_counts_of_cells_are_those_of_slices():
    cells = random_cells(3, (5, 6, 4))
    table = SumTable.of(cells)
    low, high = np.array([1, 0, 2]), np.array([4, 5, 4])
    assert count_cells(table.flat, table.strides, low, high) == cells[1:4, 0:5, 2:4].sum()


def test_boxes_that_touch_share_no_set():
    lower, upper = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 1.0], [2.0, 1.0]])
    assert not len(overlapping_pairs(lower, upper, 2))
    assert overlapping_pairs(lower, upper, 1).tolist() == [[0, 1]]


# Sets of poses.


def test_sets_cover_poses_of_their_cells_and_no_other():
    sets = made_sets()
    cells = sets.cells
    poses = np.repeat(FLAT.lower[np.newaxis], 500, axis=0)
    poses[:, :2] = np.random.default_rng(0).uniform(FLAT.lower[:2], FLAT.upper[:2], (500, 2))
    covered = np.array([sets.covers(pose) for pose in poses])
    inside = np.array([np.any(cells.inside[tuple(cells.cells_at(pose).T)]) for pose in poses])
    assert not np.any(covered & ~inside)
    assert not np.all(inside)
    assert np.sum(covered) > 0.9 * np.sum(inside)  # the sets were to hold 95 % of the cells
    other = poses[0].copy()
    other[5] = 0.1
    assert not sets.covers(other)
    assert not len(cells.cells_at(other))


def test_sets_are_read_again_as_they_were_and_a_file_has_the_same_bytes(tmp_path):
    sets = made_sets()
    first, second = sets.save(tmp_path / "a.yaml"), made_sets().save(tmp_path / "b.yaml")
    assert first.read_bytes() == second.read_bytes()
    read = PoseSets.load(first)
    for name in ("lower", "upper", "axes", "graph"):
        np.testing.assert_array_equal(getattr(read, name), getattr(sets, name))
    assert read.about == sets.about
    regions = LoadIrisRegionsYamlFile(first, "regions")
    assert len(regions) == len(sets)
    assert regions["set_00000"].PointInSet(0.5 * (sets.lower + sets.upper)[0, :2])


def test_regions_go_into_drakes_graph_of_convex_sets():
    boxes = np.array([[0, 0, 2, 1], [1, 0, 3, 3], [0, 2, 2, 4]], float)
    lower, upper = np.zeros((3, 6)), np.zeros((3, 6))
    lower[:, :2], upper[:, :2] = boxes[:, :2], boxes[:, 2:]
    sets = PoseSets(lower, upper, np.array([0, 1]))
    assert sets.graph.tolist() == [[0, 1], [1, 2]]
    gcs = GcsTrajectoryOptimization(2)
    middle = gcs.AddRegions(sets.regions(), 1, 0.0, 100.0)
    start = gcs.AddRegions([Point([0.2, 0.5])], 0)
    goal = gcs.AddRegions([Point([0.2, 3.5])], 0)
    gcs.AddEdges(start, middle)
    gcs.AddEdges(middle, goal)
    gcs.AddPathLengthCost(1.0)
    way, result = gcs.SolvePath(start, goal)
    assert result.is_success()
    assert way.value(way.end_time()).ravel() == pytest.approx([0.2, 3.5], abs=1e-5)


# Poses that no path joins.

FIRST, SECOND = np.array([0.5, 0.5, 0.5, 0, 0, 0]), np.array([3.5, 3.5, 3.5, 0, 0, 0])


def are_separated(excluded, first=FIRST, second=SECOND):
    box = PoseBox(np.zeros(6), np.array([4.0, 4.0, 4.0, 0, 0, 0]))
    none = CertifiedBoxes(
        np.empty((0, 6)), np.empty((0, 6)), np.empty(0, int), np.empty((0, 4)), True
    )
    cells = ProvenCells(box, np.arange(3), np.zeros((4, 4, 4), bool), excluded, none)
    return separated(cells, first, second)


def excluded(cells):
    mask = np.zeros((4, 4, 4), bool)
    mask[cells] = True
    return mask


def test_a_layer_of_excluded_cells_parts_poses_and_one_with_a_hole_does_not():
    layer = excluded(2)
    assert are_separated(layer)
    assert not are_separated(layer, second=FIRST)
    for hole in ((2, 0, 0), (2, 3, 3)):
        leaky = layer.copy()
        leaky[hole] = False  # open: neither proven inside nor outside
        assert not are_separated(leaky)
    assert are_separated(excluded((0, 0, 0)))  # the start's own cell
    diagonal = ~excluded((range(4), range(4), range(4)))
    assert not are_separated(diagonal)  # a way over corners of cells is a way


@pytest.mark.parametrize(("height", "parted"), [(1.6, True), (0.25, False)])
def test_a_wall_across_the_frame_parts_what_a_low_one_does_not(height, parted):
    wall = np.array([box_row([0.0, 0.0, 0.5 * height], [0.1, 3.0, height])])
    ends = [np.array([x, 0.0, 0.4, 0, 0, 0]) for x in (-0.25, 0.25)]
    found = ProvenSets.find(
        "acrobot_large", ("collision-free",), None, wall,
        settings=ProofSettings(boxes=20_000, cells=2**15, pulleys=False),
    )  # fmt: skip
    assert separated(found.cells, *ends) == parted
    assert found.joined(*ends) == (not parted)
