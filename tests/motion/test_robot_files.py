"""What the loader accepts of each motion type, and what it refuses by name."""

import numpy as np
import pytest

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_loader import load_robot
from tests.motion.small_robots import BEAM, MOTIONS, POINT, small_robot


@pytest.mark.parametrize("name", MOTIONS)
def test_every_small_robot_is_accepted(name):
    robot = small_robot(name)
    assert robot.motion_type().freedom <= 6
    assert np.linalg.norm(robot.down()) == pytest.approx(1.0)


def test_gravity_is_a_vector():
    np.testing.assert_allclose(load_robot("caroca").gravity_vector(), [0.0, 0.0, -9.81])
    g = small_robot("tilted_gravity").gravity_vector()
    np.testing.assert_allclose(g, 9.81 * np.array([0.3, -0.2, -1.0]) / np.sqrt(1.13))


@pytest.mark.parametrize(
    ("name", "changes", "field", "accepted"),
    [
        ("tripod", {"platform": POINT | {"center_of_mass": [0, 0, 0.1]}},
         "platform.center_of_mass", "null, or Po, 0 0 0, of a point mass, 3T"),
        ("hanging_four", {"motion": "3T"}, "cables[0].anchor_point",
         "Po, 0 0 0, of a point mass, 3T"),
        ("tripod", {"axis": [1, 0, 0]}, "axis", "null for 3T"),
        ("slope", {"axis": [0, 0, 0]}, "axis", "a direction, not zero, or null"),
        ("upright_point", {"plane_height": 0.3}, "plane_height",
         "a height for robots in a horizontal plane, null for others"),
        ("upright_body", {"home": {"position": [0.1, 0.2, 0.3], "angles_deg": [10, 0, 0]}},
         "home.angles_deg", "a turn about the plane's normal (0, 1, 0)"),
        ("beam", {"axis": [1, 0, 0]}, "cables[0].anchor_point",
         "a point of the beam's axis, through Po along (1, 0, 0)"),
        ("beam", {"platform": BEAM | {"size": [0.05, 0.08, 0.6]}}, "platform.inertia",
         "that of a body of revolution about (0, 0, 1); its spin does not count"),
        ("tilted_gravity", {"gravity_direction": [0, 0, 0]}, "gravity_direction",
         "a direction, not zero"),
    ],
)  # fmt: skip
def test_what_a_type_cannot_have_is_refused_by_name(name, changes, field, accepted):
    with pytest.raises(RobotFileError) as caught:
        small_robot(name, **changes)
    first = str(caught.value).splitlines()[0]
    assert first.startswith(f"{name}.yaml: {field}: found ")
    assert first.endswith(f"; accepted: {accepted}")
