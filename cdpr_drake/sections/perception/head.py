"""A head on two joints that carries a camera or another sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.sensor_noise import encoder_readings, sample_noise, sensor_random
from cdpr_drake.systems.sensors.sampled_sensor import PAN_TILT

MODES = ("velocity", "position")

_ANGLES, _RATES, _TIME = slice(0, 2), slice(2, 4), 4


@dataclass(frozen=True, kw_only=True)
class PanTiltJoints:
    """Two joints, pan and tilt.

    Attributes:
        lower: Smallest angles, shape (2,) [rad].
        upper: Largest angles, shape (2,) [rad].
        speed: Largest speeds, shape (2,) [rad/s].
        counts_per_turn: Counts of the encoders per turn of a joint.
        zero_error: Standard deviation of the angle at which an encoder says zero [rad].
        offset: What the encoders read too much beside that, shape (2,) [rad]; None: nothing.
        noise: Standard deviation of a reading, of which there is one at each look [rad].
    """

    lower: Array
    upper: Array
    speed: Array
    counts_per_turn: int = 4096
    zero_error: float = 0.0
    offset: Array | None = None
    noise: float = 0.0


def head_pose(X_BM: RigidTransform, arm: Array, angles: Array) -> RigidTransform:
    """Pose X_BH of the head [m].

    Args:
        X_BM: Pose of the joints' frame M on the body: z ahead, x to the right, y down, as of a
            camera [m].
        arm: Position of Ho from where the axes meet, with both angles zero, shape (3,) [m].
        angles: Pan, positive to the right, and tilt, positive upwards, shape (2,) [rad].
    """
    R = RotationMatrix.MakeYRotation(angles[0]) @ RotationMatrix.MakeXRotation(angles[1])
    return X_BM @ RigidTransform(R, R @ np.asarray(arm, float))


class PanTilt(LeafSystem):
    """Turns a head by commands, as fast and as far as its joints can.

    =============== ============== ==== ========================================================
    port            type           unit meaning
    =============== ============== ==== ========================================================
    command         vector(2)      rad  in, angles or their rates of pan and tilt, by the mode
                                   /s
    angles          vector(2)      rad  out, true ones
    encoder_angles  vector(2)      rad  out, whole counts, zero where the encoders believe it
    X_BH            RigidTransform m    out, true pose of the head on its body; X_PC of a camera
    X_BH_encoder    RigidTransform m    out, that by the encoders
    =============== ============== ==== ========================================================

    The joints look at the command at a fixed rate; between two looks they turn steadily, and stop
    where they cannot go on. By position, they turn so that they are there at the next look, or as
    fast as they can. Their motion does not act on the body.
    """

    def __init__(
        self,
        joints: PanTiltJoints,
        X_BM: RigidTransform,
        *,
        arm: Array | None = None,
        mode: str = "velocity",
        rate: float = 100.0,
        seed: int = 0,
        start: Array | None = None,
        stream: int = PAN_TILT,
    ) -> None:
        """With joints on a body.

        Args:
            joints: The joints.
            X_BM: Pose of the joints' frame M on the body B, as for `head_pose` [m].
            arm: Position of Ho from where the axes meet, shape (3,) [m]; zero if None.
            mode: One of `MODES`.
            rate: Looks at the command per second [Hz].
            seed: Seed of the encoders' zeros and noise.
            start: Angles at the start, shape (2,) [rad]; zero if None.
            stream: Which of a run's random numbers these are.

        Raises:
            SensorError: The mode, the rate or the limits cannot be.
        """
        super().__init__()
        if mode not in MODES:
            raise SensorError(f"mode: found {mode!r}; accepted: {' or '.join(MODES)}")
        if not rate > 0.0:
            raise SensorError(f"rate of a pan-tilt: found {rate:g}; accepted: a number > 0 [Hz]")
        if not np.all(joints.lower <= joints.upper):
            raise SensorError("lower: accepted: at most upper, of both joints [rad]")
        self.joints, self._X_BM, self._mode, self._rate = joints, X_BM, mode, rate
        self._arm = np.zeros(3) if arm is None else np.asarray(arm, float)
        self._zero = joints.zero_error * sensor_random(seed, stream).standard_normal(2)
        if joints.offset is not None:
            self._zero = self._zero - joints.offset
        self._seed, self._stream = seed, stream
        start = np.clip(np.zeros(2) if start is None else start, joints.lower, joints.upper)
        self.DeclareVectorInputPort("command", 2)
        self.DeclareDiscreteState(np.concatenate([start, np.zeros(3)]))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._look)
        ticket = {self.time_ticket(), self.xd_ticket()}
        for name, value in (("angles", self.angles), ("encoder_angles", self.encoder_angles)):
            self._declare_angles(name, value, ticket)
            port = "X_BH" if name == "angles" else "X_BH_encoder"
            self._declare_pose(port, value, ticket)

    def angles(self, context: Context) -> Array:
        """True angles now, shape (2,) [rad], from this system's own context."""
        state = context.get_discrete_state_vector().value()
        turned = state[_ANGLES] + (context.get_time() - state[_TIME]) * state[_RATES]
        return np.clip(turned, self.joints.lower, self.joints.upper)

    def encoder_angles(self, context: Context) -> Array:
        """What the encoders say now, shape (2,) [rad], from this system's own context."""
        angles = self.angles(context) - self._zero
        if self.joints.noise > 0.0:
            number = round(context.get_time() * self._rate)
            angles = angles + self.joints.noise * sample_noise(
                self._seed, self._stream, number, len(angles)
            )
        return encoder_readings(angles, self.joints.counts_per_turn)

    def head(self, angles: Array) -> RigidTransform:
        """X_BH at angles, shape (2,) [rad]."""
        return head_pose(self._X_BM, self._arm, angles)

    def _look(self, context: Context, state: DiscreteValues) -> None:
        angles, command = self.angles(context), self.get_input_port(0).Eval(context)
        if self._mode == "position":
            goal = np.clip(command, self.joints.lower, self.joints.upper)
            command = (goal - angles) * self._rate
        rates = np.clip(command, -self.joints.speed, self.joints.speed)
        state.set_value(np.concatenate([angles, rates, [context.get_time()]]))

    def _declare_angles(self, name, value, ticket) -> None:  # type: ignore[no-untyped-def]
        def write(context: Context, output: BasicVector) -> None:
            output.SetFromVector(value(context))

        self.DeclareVectorOutputPort(name, 2, write, ticket)

    def _declare_pose(self, name, value, ticket) -> None:  # type: ignore[no-untyped-def]
        def write(context: Context, output: AbstractValue) -> None:
            output.set_value(self.head(value(context)))

        self.DeclareAbstractOutputPort(name, lambda: Value(RigidTransform()), write, ticket)
