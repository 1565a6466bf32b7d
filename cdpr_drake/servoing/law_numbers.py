"""Where the numbers of a law and of a servo's memory stand, for the kernels of this room."""

from __future__ import annotations

(
    GAIN_AT_ZERO, GAIN_AT_INFINITY, GAIN_SLOPE, SIGMA, YAW_GAIN, YAW_ANGLE, IN_BASE_FRAME,
    CABLE_SPEED, SIGN, KIND, AXIS_GAIN, EDGE_GAIN, EDGE_DISTANCE, X_LOWEST, X_HIGHEST, Y_LOWEST,
    Y_HIGHEST, POSE_BOUND, IMAGE_BOUND, BOUND_RATIO, DWELL, AHEAD, FIRST_MODE, GOAL,
) = range(24)  # fmt: skip
"""Numbers of a law: lambda(0), lambda(infinity) [1/s], its slope; sigma [1/s], NaN for an abrupt
start; gain [1/s] and angle [rad] of the secondary task, NaN for none; 1 if twists become cable
velocities in W; largest cable speed [m/s]; 1, or -1 if the camera stands in the world; how features
become a twist, `WHOLE`, `PARTITIONED` or `SWITCHING`. Then those of `AxisPartition`: gain about and
along the axis as a share of lambda; of its field, NaN for none, gain [1/s], width and the image's
edges at unit focal length. Then those of `ModeSwitching`: bounds of the two functions, NaN for a
ratio times what they are when the task begins; that ratio; least time between two switches [s]; how
far ahead they are foreseen [s]; the mode of the start. Last the `GOALS` of a partition."""

LAW_SIZE = 24

WHOLE, PARTITIONED, SWITCHING = range(3)
"""All features at once; axis before the rest; pose or image."""

FIXED, TURNED = range(2)
"""Where a partition wants its points."""

GOALS = ("fixed", "turned")
"""Their names, in that order."""

POSE_MODE, IMAGE_MODE = range(2)
"""Which features a switching servo uses."""

MODES = ("pose", "image")
"""Their names, in that order."""

POSE_ROWS = 6
"""Features of a switching servo that are the pose; the rest is the image."""

BEGUN, TASK, TWIST, BEFORE, TOWARD, SWITCH, FEATURES = 0, 1, 2, 8, 14, 20, 27
"""Where a memory begins to hold: when the task began (negative: it has not), its number, V_C of the
step before, V_0, -U_0 / lambda_0, the seven numbers of `SWITCH_NUMBERS`, and s of the step before,
which L V_C of that step follows."""

(
    MODE, SWITCHED_AT, SWITCHES, OF_POSE, OF_IMAGE, BOUND_OF_POSE, BOUND_OF_IMAGE,
) = range(SWITCH, FEATURES)  # fmt: skip
"""Of a switching servo: mode, time of the last switch [s], switches since the run began, both
functions of the step before, and their bounds in this task."""
