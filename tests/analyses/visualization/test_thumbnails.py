"""Pictures of robots in the gallery."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.robot_gallery import thumbnail
from cdpr_drake.models.robot_loader import load_robot


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_a_thumbnail_has_all_cables_in_true_proportions(name):
    robot = load_robot(name)
    svg = ElementTree.fromstring(thumbnail(robot))
    paths = [path for path in svg.iter("path") if path.get("class") == "cable"]
    assert len(paths) == len(robot.cables)
    ends = np.array([re.findall(r"-?\d+\.\d", path.get("d")) for path in paths], float)
    if robot.is_planar():  # seen from above, so that lengths in the plane are to scale
        cables, X_WP = robot.cable_set(), robot.home.transform()
        true = np.linalg.norm(cables.p_WA - X_WP.multiply(cables.p_PB), axis=0)
        drawn = np.linalg.norm(ends[:, 2:] - ends[:, :2], axis=1)
        np.testing.assert_allclose(drawn / drawn[0], true / true[0], rtol=0.01)
    assert np.all((ends >= 0.0) & (ends <= 280.0))
