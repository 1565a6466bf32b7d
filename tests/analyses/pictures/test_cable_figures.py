"""Pictures of paths show the cables as they run."""

import numpy as np
import pytest

from cdpr_drake.analyses.pictures.cable_figures import Path3D, path_figure
from cdpr_drake.geometry import cable_paths
from cdpr_drake.models import load_robot
from cdpr_drake.spatial import pose_row


@pytest.mark.parametrize("pulleys", [False, True])
def test_cables_run_over_the_pulleys_that_the_run_has(pulleys):
    robot = load_robot("caroca")
    cables = robot.cable_set() if pulleys else robot.cable_set().without_pulleys()
    X_WP = robot.home.transform()
    slack = np.arange(cables.count) == 2
    log = {"X_WP": pose_row(X_WP)[None], "slack": slack[None]}
    path = Path3D(np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]]), "way", "C0", "-")
    lines = path_figure("t", robot, cables, log, [path]).axes[0].lines[1:]
    assert len(lines) == cables.count
    tangents = cable_paths(X_WP, cables).p_WT
    for i, line in enumerate(lines):
        points = np.array(line.get_data_3d())
        np.testing.assert_allclose(points[:, 0], cables.p_WA[:, i], atol=1e-12)
        np.testing.assert_allclose(points[:, -2], tangents[:, i], atol=1e-12)
        np.testing.assert_allclose(points[:, -1], X_WP.multiply(cables.p_PB[:, i]), atol=1e-12)
        assert (points.shape[1] > 2) == pulleys
        assert (line.get_color() == "C3") == slack[i]
