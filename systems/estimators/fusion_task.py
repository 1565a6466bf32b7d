"""What the fusing filter is made for: cameras and poses as believed, and how far to trust what."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.camera_miscalibration import Calibration
from cdpr_drake.estimation.sensor_filter import EXTERNAL, ON_BOARD, Prior
from cdpr_drake.models.sensor_catalogue import DepthSensorModel, InertialSensorModel
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.sensor_fusion_settings import (
    CalibrationDoubt,
    SensorFusionSettings,
)
from cdpr_drake.vision.pinhole import Pinhole

SUREST_DEPTH = 1e-5
"""No depth is trusted further than this standard deviation [m]."""


@dataclass(frozen=True, kw_only=True)
class CameraModel:
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

    def depth_deviations(self, depths: Array, share: float) -> Array:
        """Standard deviations of depths, shape (n,) [m], over what the depth camera's type says."""
        assert self.depth is not None
        deviations = self.depth.noise + self.depth.noise_per_square * depths**2
        return np.asarray(np.maximum(deviations * share, SUREST_DEPTH))

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
    on_board: CameraModel | None = None
    external: CameraModel | None = None
    X_WE: RigidTransform | None = None
    X_PQ: RigidTransform | None = None
    X_WO: RigidTransform | None = None
    p_PS: Array = field(default_factory=lambda: np.zeros(3))
    imu: InertialSensorModel | None = None
    gravity: Array | None = None

    def calibrations(self) -> tuple[Calibration, Calibration]:
        """What is told of the camera on board, and of that in the world."""
        t = self.tuning
        X_WE = RigidTransform() if self.X_WE is None else self.X_WE
        return (
            _calibration(
                ON_BOARD, self.X_PC, spread(t.on_board_rotation_deg, t.on_board_position),
                t.on_board_doubt,
            ),
            _calibration(
                EXTERNAL, X_WE, spread(t.external_rotation_deg, t.external_position),
                t.external_doubt,
            ),
        )  # fmt: skip

    def prior(self, slack: Array) -> Prior:
        """How uncertain everything is at the start, with cables of which so much may be slack that
        nobody knows of, shape (m,) [m]."""
        t, imu = self.tuning, self.imu
        on_board, external = self.calibrations()
        return Prior(
            pose=spread(t.start_rotation_deg, t.start_position),
            on_board=on_board.prior,
            external=external.prior,
            offsets=np.hypot(t.length_offset, slack),
            biases=np.zeros(6)
            if imu is None
            else np.repeat([imu.gyroscope_bias, imu.accelerometer_bias], 3),
        )


def _calibration(
    columns: slice, X: RigidTransform, told: Array, doubt: CalibrationDoubt | None
) -> Calibration:
    if doubt is None:
        return Calibration(columns, X, told)
    wrong = spread(doubt.rotation_deg, doubt.position)
    return Calibration(columns, X, told, wrong, doubt.probability)


def inertial_variances(imu: InertialSensorModel) -> tuple[Array, Array]:
    """Variances per time of what an IMU feels, and of its biases, each of shape (6,)
    [rad^2/s, m^2/s^3]."""
    noise = np.repeat([imu.gyroscope_noise**2, imu.accelerometer_noise**2], 3)
    walk = np.repeat([imu.gyroscope_walk**2, imu.accelerometer_walk**2], 3)
    return noise, walk


def spread(rotation_deg: float, translation: float) -> Array:
    """Standard deviations of a twist, shape (6,) [rad, m]."""
    return np.repeat([float(np.radians(rotation_deg)), translation], 3)
