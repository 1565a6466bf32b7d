"""What case study VI and its appendix share: image-based servoing on four points, on ACROBOT."""

from __future__ import annotations

from cdpr_drake.analyses.case_studies import as_transform, pose_item

START = as_transform(((0.118, -0.104, 0.459), (16.0, 13.8, 20.6)))
"""Printed initial pose of the platform in W."""

EDGE = 0.0854
"""Edge of the square of points [m]."""

DESIRED_COORDINATE = 0.167
"""Printed desired coordinates of the points are +- this, at unit focal length [-]."""

DEPTH = EDGE / 2.0 / DESIRED_COORDINATE
"""Desired distance of the points from the camera [m]."""

SETUP = (
    "controller.scheme=ibvs",
    "controller.lambda_0=1.0",
    "controller.lambda_infinity=0.2",
    "controller.lambda_slope=30",
    "target.kind=dots",
    f"target.size={EDGE}",
    "target.pose={position: [0.0735, -0.03, 0]}",
    pose_item("initial_pose", START),
    f"desired={{position: [0, 0, {DEPTH:.6g}], angles_deg: [180, 0, 180]}}",
    "duration=60",
)

ASSUMPTIONS = (
    "The printed poses of the platform and the printed features do not fit each other. The pattern "
    "lies on the ground where the initial features and the initial pose put its middle; that also "
    "gives its size, and with the desired features the desired distance.",
    "Directions of perturbations are not printed; each run draws its own from its seed.",
    "Stop rules and sigma are those of case study I.",
)
