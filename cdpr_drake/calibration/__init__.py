"""Which constants a robot has, from what was measured while it stood at some poses.

Unknown may be exit and anchor points, where winches begin to count and their drums' radii, pulleys,
the camera on the platform and tags that it sees. Measured are lengths, poses by a tracker, corners
of tags in images, swivel angles, tensions of a platform at rest. All that was measured enters over
its standard deviation; what is found is most likely, with its covariance, and what cannot be told
is named.

Poses and frames: W world, P platform, C camera, T tag. A pose steps by a rotation vector about the
axes of the frame that it stands in, then a translation. Readings of winches count from `start`.

Source: Triggs et al., Bundle adjustment, a modern synthesis, 2000; Borgstrom et al., NIMS-PL, a
cable-driven robot with self-calibration capabilities, 2009; Ida, Merlet, Carricato, Automatic
self-calibration of suspended under-actuated cable-driven parallel robot, 2019.
"""

from cdpr_drake.calibration.guesses import (
    guessed_tags,
    guessed_tracker,
    poses_by_tags,
    with_tags,
)
from cdpr_drake.calibration.identifiability import Identifiability
from cdpr_drake.calibration.measurements import (
    simulated_corners,
    simulated_lengths,
    simulated_poses,
    simulated_swivels,
)
from cdpr_drake.calibration.parameters import (
    GROUPS,
    CalibrationModel,
    ParameterGroup,
    ParameterLayout,
    model_difference,
    moved_frames,
    moved_model,
    parameter_layout,
)
from cdpr_drake.calibration.pose_design import choose_poses, expected_std, informing_rows
from cdpr_drake.calibration.pose_search import (
    HUBER,
    OUTLIER,
    FoundPoses,
    guessed_from,
    guessed_stations,
    robust_costs,
    robust_poses,
    turned_starts,
)
from cdpr_drake.calibration.program import CalibrationProgram, first_readings
from cdpr_drake.calibration.result import CalibrationResult, Fit, Outlier
from cdpr_drake.calibration.stations import Point, Stations

__all__ = [
    "GROUPS", "HUBER", "OUTLIER", "CalibrationModel", "CalibrationProgram", "CalibrationResult",
    "Fit", "FoundPoses", "Identifiability", "Outlier", "ParameterGroup", "ParameterLayout",
    "Point", "Stations", "choose_poses", "expected_std", "first_readings", "guessed_from",
    "guessed_stations", "guessed_tags", "guessed_tracker", "informing_rows", "model_difference",
    "moved_frames", "moved_model", "parameter_layout", "poses_by_tags", "robust_costs",
    "robust_poses", "simulated_corners", "simulated_lengths", "simulated_poses",
    "simulated_swivels", "turned_starts", "with_tags",
]  # fmt: skip
