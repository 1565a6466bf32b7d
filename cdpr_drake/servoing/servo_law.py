"""How a visual servo moves, as data: gain, continuous start, filters, partition, switching."""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.gain import AdaptiveGain
from cdpr_drake.servoing.target_motion import MotionFilter

FRAMES = ("platform", "base")


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
    """Keeps points away from the edges of the image; see `partition_kernel`.

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
    """Two controllers, of which one acts; see `switching_kernel`.

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
