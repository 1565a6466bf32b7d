"""The study of workspaces: what it asks of robots, and what it says of volumes and shapes."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.workspaces import (
    FIGURE,
    frame_grid,
    platforms_differ,
    pose_shares,
    possible_kinds,
    remains_large,
    static_row,
)
from cdpr_drake.analyses.workspaces.conditions import OF_POSES


def figures(robot, fine, half, inside=True):
    """Static workspaces of a robot at two lower limits, of which the higher keeps so much."""
    return [
        {"group": FIGURE, "robot": robot, "upper_share": 1.0, "lower_limit_n": lower,
         "frame_share": 0.4, "points_m3": points, "half_points_m3": halves,
         "arrays": {"holds_static": np.full((3, 3, 3), inside)}}
        for lower, points, halves in ((1.0, fine, half), (0.0, 1.0, 1.0))
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("fine", "half", "held"),
    [
        (0.907, 0.9065, [True, True]),
        (0.907, 0.893, [False, True]),
        (0.894, 0.876, [False, True]),
        (0.894, 0.893, [False, False]),
    ],
)
def test_where_the_grid_decides_whether_a_workspace_remains_large_it_is_said(fine, half, held):
    assert remains_large("caroca", pd.DataFrame(figures("caroca", fine, half)))[0] == held


def test_platforms_may_be_the_same():
    small = figures("acrobot_small", 1.0, 1.0)
    for inside in (True, False):
        large = figures("acrobot_large", 1.0, 1.0, inside)
        assert platforms_differ(pd.DataFrame([*small, *large]))[0] == [not inside] * 2


def test_half_as_many_cells_are_every_second_point():
    row = static_row("acrobot_small", (0.0, 60.0), 0.2)
    assert all(count % 2 for count in row["points"])
    inside = row["holds_static"][::2, ::2, ::2].astype(float)
    for _ in range(3):
        inside = np.trapezoid(inside, dx=1.0 / (len(inside) - 1), axis=0)
    assert row["half_points_m3"] == pytest.approx(row["frame_m3"] * inside)


def test_a_robot_without_a_camera_is_asked_for_all_but_what_a_camera_sees():
    grids = {name: frame_grid(name, (3, 3, 3)) for name in ("caroca_gazebo", "planar")}
    _, kinds, _, left_out = possible_kinds("caroca_gazebo", grids["caroca_gazebo"])
    assert set(OF_POSES) - set(kinds) == set(left_out) == {"target-visible"}
    assert left_out["target-visible"].startswith("caroca_pbvs.yaml:17: camera.mount")
    assert possible_kinds("planar", grids["planar"])[3] == {}


def test_shares_are_those_of_the_poses():
    first, second = np.array([True, True, False, False]), np.array([True, False, True, False])
    shares = pose_shares({"static": first, "wrench-closure": second})
    assert list(shares.values()) == [0.5, 0.5, 0.5, 0.25]
