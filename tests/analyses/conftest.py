"""A robot and a pose for tests of the verbs."""

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.models.robot_loader import load_robot


@pytest.fixture(scope="module")
def planar():
    return load_robot("planar")


@pytest.fixture(scope="module")
def aside(planar):
    return cdpr.Pose(
        position=np.array([0.1, -0.05, planar.plane_height]), angles_deg=np.array([0.0, 0.0, 5.0])
    )
