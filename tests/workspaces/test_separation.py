"""Poses that no path joins: cells proven outside part them, by hand and with a wall."""

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.proven_sets import ProofSettings, ProvenSets
from cdpr_drake.workspaces.cable_interference import box_row
from cdpr_drake.workspaces.certified_boxes import CertifiedBoxes, PoseBox
from cdpr_drake.workspaces.proven_cells import ProvenCells
from cdpr_drake.workspaces.proven_connection import separated

FIRST, SECOND = np.array([0.5, 0.5, 0.5, 0, 0, 0]), np.array([3.5, 3.5, 3.5, 0, 0, 0])


def cells(excluded):
    box = PoseBox(np.zeros(6), np.array([4.0, 4.0, 4.0, 0, 0, 0]))
    none = CertifiedBoxes(
        np.empty((0, 6)), np.empty((0, 6)), np.empty(0, int), np.empty((0, 4)), True
    )
    return ProvenCells(box, np.arange(3), np.zeros((4, 4, 4), bool), excluded, none)


def layer():
    excluded = np.zeros((4, 4, 4), bool)
    excluded[2] = True
    return excluded


def test_a_layer_of_excluded_cells_parts_poses_and_one_with_a_hole_does_not():
    assert separated(cells(layer()), FIRST, SECOND)
    assert not separated(cells(layer()), FIRST, FIRST)
    for hole in ((2, 0, 0), (2, 3, 3)):
        leaky = layer()
        leaky[hole] = False  # open: neither proven inside nor outside
        assert not separated(cells(leaky), FIRST, SECOND)


def test_a_way_over_corners_of_cells_is_a_way():
    diagonal = np.ones((4, 4, 4), bool)
    for k in range(4):
        diagonal[k, k, k] = False
    assert not separated(cells(diagonal), FIRST, SECOND)


def test_a_pose_in_an_excluded_cell_is_parted_from_all():
    excluded = np.zeros((4, 4, 4), bool)
    excluded[0, 0, 0] = True
    assert separated(cells(excluded), FIRST, SECOND)


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
