"""How a visual servo moves, as data: gain, continuous start, filters, partition, switching.

`ServoLaw` and its parts are what one chooses. `adaptive_gain` and `saturation_share` are pieces of
the law as kernels. Below them stands where the numbers of a law and of a servo's memory are in the
arrays of `servo_step_kernel`.

Source: servoing thesis (1.31).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.target_motion import MotionFilter

FRAMES = ("platform", "base")
"""In which a twist can become cable velocities."""


@dataclass(frozen=True)
class ServoLaw:
    """How a visual servo moves.

    Attributes:
        gain: Adaptive gain lambda [1/s].
        sigma: Rate at which the continuous start is forgotten [1/s]; None starts abruptly.
        compensation: Estimates the object's motion; None takes it to be at rest.
        yaw: Secondary task, for features that leave a motion free; None: the least motion.
        frame: Frame in which the twist becomes cable velocities, one of `FRAMES`.
        smoothing: Time constant of a first-order filter of the error [s]; None: the error itself.
        partition: For `PartitionedFeatures`; None: all features at once.
        switching: For `SwitchedFeatures`; None: all features at once.
    """

    gain: AdaptiveGain
    sigma: float | None = None
    compensation: MotionFilter | None = None
    yaw: YawTask | None = None
    frame: str = "platform"
    smoothing: float | None = None
    partition: AxisPartition | None = None
    switching: ModeSwitching | None = None

    def uses_all_features(self) -> bool:
        """Whether a step solves for all features at once, as the analysis of stability takes it."""
        return self.partition is None and self.switching is None


@dataclass(frozen=True)
class AdaptiveGain:
    """Gain that falls from `at_zero` to `at_infinity` as the error grows.

    Attributes:
        at_zero: lambda(0) [1/s].
        at_infinity: lambda(infinity) [1/s]; equal to `at_zero` for a constant gain.
        slope: Fall of lambda at 0, per unit of the error's 2-norm [1/s].

    Source: servoing thesis (1.31).
    """

    at_zero: float
    at_infinity: float
    slope: float

    def __call__(self, error: Array) -> float:
        """lambda [1/s] for an error, any shape (n,), its components as they come (m and rad)."""
        size = math.sqrt(float(error @ error))
        return float(adaptive_gain(self.at_zero, self.at_infinity, self.slope, size))


@dataclass(frozen=True)
class YawTask:
    """A secondary task: turns the platform about the vertical as far as the features let it.

    Attributes:
        angle: Wanted yaw of the platform's x axis about z of W [rad].
        gain: [1/s].
    """

    angle: float
    gain: float


@dataclass(frozen=True, eq=False)
class EdgeField:
    """Keeps points away from the edges of the image; see `partitioned_law_kernel`.

    Attributes:
        gain: eta [1/s].
        distance: rho_0, within which an edge repels, at unit focal length [-].
        edges: Lowest and highest x, lowest and highest y of the image there, shape (4,) [-].
    """

    gain: float
    distance: float
    edges: Array


@dataclass(frozen=True)
class AxisPartition:
    """Motions about and along the optical axis by features of their own.

    Attributes:
        axis_gain: Their gain as a share of lambda.
        field: What keeps points in the image; None: nothing.
        goal: Where the four other motions want the points, one of `GOALS`.
    """

    axis_gain: float = 1.0
    field: EdgeField | None = None
    goal: str = "fixed"


@dataclass(frozen=True)
class ModeSwitching:
    """Two controllers, of which one acts; see `switching_law_kernel`.

    Attributes:
        pose_bound: Of half the square of the pose's error [rad^2 + m^2]; None: by the ratio.
        image_bound: Of half the square of the image's error [-]; None: by the ratio.
        bound_ratio: Times what they are at the start of a task.
        dwell: Least time between two switches [s].
        first: Which acts first, one of `MODES`.
    """

    pose_bound: float | None = None
    image_bound: float | None = None
    bound_ratio: float = 1.5
    dwell: float = 0.1
    first: str = "image"


@njit(cache=True)
def adaptive_gain(at_zero: float, at_infinity: float, slope: float, size: float) -> float:
    """lambda [1/s] for an error of this 2-norm; see `AdaptiveGain`."""
    span = at_zero - at_infinity
    if span == 0.0:
        return at_zero
    return span * math.exp(-slope / span * size) + at_infinity


@njit(cache=True)
def saturation_share(rates: Array, limit: float) -> float:
    """Largest share in (0, 1] of rates, shape (m,), that keeps all within +-limit, same unit.

    Scaling by one share keeps the direction of motion.
    """
    largest = 0.0
    for rate in rates:
        largest = max(largest, abs(rate))
    return 1.0 if largest <= limit else limit / largest


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
step before, V_0, -U_0 / lambda_0, the seven numbers from `MODE` on, and s of the step before,
which L V_C of that step follows."""

(
    MODE, SWITCHED_AT, SWITCHES, OF_POSE, OF_IMAGE, BOUND_OF_POSE, BOUND_OF_IMAGE,
) = range(SWITCH, FEATURES)  # fmt: skip
"""Of a switching servo: mode, time of the last switch [s], switches since the run began, both
functions of the step before, and their bounds in this task."""
