"""Robots as packages for Drake: package.xml, URDF, and model directives that add them.

A program that reads model directives puts the robot's frame and platform into a plant by

    - add_directives: {file: package://NAME/NAME.dmd.yaml}

and cables beside them by `models.find_robot` and `systems.add_cable_robot`.
"""

from __future__ import annotations

from xml.sax.saxutils import escape

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

PACKAGE = """<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>{title}</description>
  <maintainer email="nobody@example.com">unknown</maintainer>
  <license>unknown</license>
</package>
"""

DIRECTIVES = """\
# The frame stands in the world; the platform is free, at its home pose. Cables are no model:
# models.find_robot finds the platform, systems.robots.add_cable_robot adds them.
directives:
- add_model:
    name: {name}
    file: package://{name}/{name}.urdf
    default_free_body_pose:
      platform:
        translation: {translation}
        rotation: !Rpy {{deg: {angles}}}
"""


def write_drake_package(
    name: str, title: str, urdf: str, X_WP_home: RigidTransform
) -> dict[str, str]:
    """Files of a package, text by name, the URDF first.

    Args:
        name: Of the robot and the package.
        title: What it is, in one line.
        urdf: The robot as URDF, with links `frame` and `platform`.
        X_WP_home: Home pose of the platform [m].
    """
    angles = np.rad2deg(RollPitchYaw(X_WP_home.rotation()).vector()) + 0.0
    return {
        f"{name}.urdf": urdf,
        f"{name}.dmd.yaml": DIRECTIVES.format(
            name=name,
            translation=(X_WP_home.translation() + 0.0).tolist(),
            angles=angles.tolist(),
        ),
        "package.xml": PACKAGE.format(name=name, title=escape(title or name)),
    }
