"""A robot whose platform carries a load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot


def loaded_robot(robot: Robot, mass: float, p_PL: Array, edge: float) -> Robot:
    """The robot with a homogeneous cube fixed to its platform; to a point mass it is one as well.

    Args:
        robot: The robot.
        mass: Of the cube [kg].
        p_PL: Its middle in P, shape (3,) [m].
        edge: Of the cube [m].
    """
    platform = robot.platform
    if robot.motion_type().is_point:
        return replace(robot, platform=replace(platform, mass=platform.mass + mass))
    middle = SpatialInertia(mass, np.zeros(3), UnitInertia.SolidCube(edge))
    cube = middle.Shift(-np.asarray(p_PL, float))
    both = platform_inertia(robot)
    both += cube
    center = both.get_com()
    I_com = both.Shift(center).CalcRotationalInertia().CopyToFullMatrix3()
    six = np.array([*np.diag(I_com), I_com[0, 1], I_com[0, 2], I_com[1, 2]])
    return replace(
        robot,
        platform=replace(
            platform, mass=both.get_mass(), center_of_mass=np.array(center), inertia=six
        ),
    )
