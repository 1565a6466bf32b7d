"""What the fusing filter is made for: cameras and poses as believed, and how far to trust what."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models import DepthSensorModel, InertialSensorModel
from cdpr_drake.systems.estimators.encoder_lengths import EncoderLengths
from cdpr_drake.systems.estimators.sensor_fusion_settings import SensorFusionSettings
from cdpr_drake.vision import Pinhole


@dataclass(frozen=True, kw_only=True)
class Eye:
    """A camera as the filter knows it.

    Attributes:
        points: Points of what it looks at in that one's frame, shape (3, n) [m].
        pinhole: Its intrinsic parameters.
        rate: Images per second [Hz].
        latency: Time from an image to its reading [s].
        used: Whether it is a source; one that is not only says where points lie in its image.
        depth: The depth camera beside it; None: there is none.
    """

    points: Array
    pinhole: Pinhole
    rate: float
    latency: float
    used: bool = True
    depth: DepthSensorModel | None = None

    @property
    def focal(self) -> float:
        """Focal length [px]."""
        return float(np.sqrt(self.pinhole.fx * self.pinhole.fy))

    def age(self, now: float) -> tuple[int, float]:
        """Number of the image whose reading is new at a time [s], and how old it is [s]."""
        number = int(np.floor(now * self.rate + 1e-6))
        return number, now - number / self.rate + self.latency

    def past(self, rate: float) -> int:
        """How many control steps at a rate [Hz] back its readings may be."""
        per_image = rate / self.rate
        between = 0 if abs(per_image - round(per_image)) < 1e-9 else 1
        return int(np.ceil(self.latency * rate - 1e-6)) + between


@dataclass(frozen=True, kw_only=True)
class FusionTask:
    """What the filter is made for.

    Attributes:
        X_WP0: Pose believed at the start [m].
        X_PC: Camera on the platform, as believed [m].
        counted: The lengths that the winches count.
        tuning: How far to trust what.
        rate: Control steps per second [Hz].
        on_board: The servo's camera; None: it is not used.
        external: The camera in the world; None: it is not used.
        X_WE: That camera in W, as believed [m].
        X_PQ: Its tag on the platform [m].
        X_WO: Pose of the object as it is told; None: nothing is [m].
        p_PS: Where the IMU is on the platform, shape (3,) [m].
        imu: The IMU; None: what was asked for tells the motion.
        gravity: Acceleration of gravity in W, shape (3,) [m/s^2].
    """

    X_WP0: RigidTransform
    X_PC: RigidTransform
    counted: EncoderLengths
    tuning: SensorFusionSettings
    rate: float
    on_board: Eye | None = None
    external: Eye | None = None
    X_WE: RigidTransform | None = None
    X_PQ: RigidTransform | None = None
    X_WO: RigidTransform | None = None
    p_PS: Array = field(default_factory=lambda: np.zeros(3))
    imu: InertialSensorModel | None = None
    gravity: Array | None = None
