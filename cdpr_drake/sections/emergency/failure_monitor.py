"""Watches for failures other than broken cables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.failure_detection import AlarmRule
from cdpr_drake.estimation.failure_watch import EncoderWatch, MotorWatch, count_repeats
from cdpr_drake.geometry.poses import pose_row

FOUND = ("found_jammed", "found_powerless", "frozen_tension", "frozen_encoder")
"""Alarms that there is one of for each cable."""

OF_CAMERA = ("camera_dark", "camera_late")
"""Alarms of the camera."""


@dataclass(frozen=True)
class WatchRules:
    """When something is an alarm.

    Attributes:
        motor: What of motors is watched.
        torque: Alarms of torque that nothing explains [N m].
        repeats: Equal readings in a row of a tension sensor.
        encoder: What of encoders is watched.
        lag: Alarms of lengths that lag behind drives [m].
        dark: Without a sight of the target [s].
        late: With the very same sight [s].
    """

    motor: MotorWatch
    torque: AlarmRule
    repeats: int
    encoder: EncoderWatch
    lag: AlarmRule
    dark: float
    late: float


class FailureMonitor(LeafSystem):
    """Which winches, sensors and cameras have failed, by what nothing else explains.

    =============== ============== ==== ========================================================
    port            type           unit meaning
    =============== ============== ==== ========================================================
    torques         vector(m)      N m  in, asked of the motors, positive pays out
    tensions        vector(m)      N    in, measured
    lengths         vector(m)      m    in, measured unstrained lengths
    length_rates    vector(m)      m/s  in, of the unstrained lengths, as the drives know them
    found           vector(1)      -    in, whether the camera sees the target
    X_CO            RigidTransform m    in, the target as the camera sees it
    found_jammed    vector(m)      -    out, 1 for each drum that is driven and stands still
    found_powerless vector(m)      -    out, 1 for each drum that turns without its motor
    frozen_tension  vector(m)      -    out, 1 for each tension sensor that reads one number
    frozen_encoder  vector(m)      -    out, 1 for each encoder that does not follow its drive
    camera_dark     vector(1)      -    out, 1 if the target was not seen for too long
    camera_late     vector(1)      -    out, 1 if no new image came for too long
    torque_residual vector(m)      N m  out, torque of each motor that nothing explains
    length_lag      vector(m)      m    out, by how much each encoder lags behind its drive
    =============== ============== ==== ========================================================

    Samples its inputs at a rate; alarms stay, but for one. A drum that is blocked, and one whose
    static friction holds it although its motor has no power, look alike while they stand: both are
    `found_jammed`. A cable can turn the second one only: a drum that was told jammed and turns, as
    often in a row as makes an alarm, is `found_powerless` from then on. After one failure others
    may be told that it brings with it: the first one counts.
    """

    def __init__(self, rules: WatchRules) -> None:
        """With m motors, by what its rules say."""
        super().__init__()
        self.rules, m = rules, len(rules.motor.radius)
        self._m, self._period = m, rules.motor.period
        names = ("torques", "tensions", "lengths", "length_rates")
        self._of_cables = [self.DeclareVectorInputPort(name, m) for name in names]
        self._found = self.DeclareVectorInputPort("found", 1)
        self._X_CO = self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        flags = np.zeros((4, m))
        self._parts = {
            "flags": (0, flags),
            "motor": (1, rules.motor.fresh()),
            "motor_counts": (2, np.zeros(m)),
            "repeats": (3, np.array([np.zeros(m), np.full(m, np.nan)])),
            "encoder": (4, rules.encoder.fresh(m)),
            "encoder_counts": (5, np.zeros(m)),
            # Flags, for how long without a sight, with the same one, and that.
            "camera": (6, np.concatenate([np.zeros(4), np.full(7, np.nan)])),
            "turns": (7, np.zeros(m)),
        }
        tickets = {}
        for name, (_, start) in self._parts.items():
            tickets[name] = self.discrete_state_ticket(self.DeclareDiscreteState(start.ravel()))
        for name, part, row in (
            *((name, "flags", k) for k, name in enumerate(FOUND)),
            ("torque_residual", "motor", 1), ("length_lag", "encoder", 0),
        ):  # fmt: skip

            def write(
                context: Context, output: BasicVector, part: str = part, row: int = row
            ) -> None:
                output.SetFromVector(self._part(context, part)[row])

            self.DeclareVectorOutputPort(name, m, write, {tickets[part]})
        for k, name in enumerate(OF_CAMERA):

            def tell(context: Context, output: BasicVector, k: int = k) -> None:
                output.SetFromVector([self._part(context, "camera")[k]])

            self.DeclareVectorOutputPort(name, 1, tell, {tickets["camera"]})
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)

    def _part(self, context: Context, name: str) -> Array:
        index, start = self._parts[name]
        return np.array(context.get_discrete_state(index).value()).reshape(start.shape)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        rules = self.rules
        torques, tensions, lengths, rates = (port.Eval(context) for port in self._of_cables)
        flags = self._part(context, "flags")
        motor = rules.motor.step(self._part(context, "motor"), torques, tensions, rates)
        strange, unexplained = rules.torque.step(
            self._part(context, "motor_counts"), np.abs(motor[1])
        )
        first = (unexplained > 0.0) & (flags[0] + flags[1] == 0.0)
        stands = rules.motor.stands(rates)
        turns = np.where(stands, 0.0, self._part(context, "turns") + 1.0)
        driven = (flags[0] > 0.0) & (turns >= rules.torque.in_a_row)
        repeats = count_repeats(self._part(context, "repeats"), tensions)
        encoder = rules.encoder.step(self._part(context, "encoder"), lengths, rates)
        behind, lags = rules.lag.step(self._part(context, "encoder_counts"), np.abs(encoder[0]))
        flags = np.array([
            np.maximum(flags[0], first & stands) * np.logical_not(driven),
            np.maximum(flags[1], driven | (first & np.logical_not(stands))),
            np.maximum(flags[2], repeats[0] >= rules.repeats - 1.0), lags,
        ])  # fmt: skip
        for name, value in (
            ("flags", flags), ("motor", motor), ("motor_counts", strange), ("repeats", repeats),
            ("encoder", encoder), ("encoder_counts", behind),
            ("camera", self._look(self._part(context, "camera"), context)), ("turns", turns),
        ):  # fmt: skip
            state.set_value(self._parts[name][0], np.asarray(value, float).ravel())

    def _look(self, memory: Array, context: Context) -> Array:
        dark, late, unseen, same = memory[:4]
        sees = self._found.Eval(context)[0] != 0.0
        row = pose_row(self._X_CO.Eval(context))
        unseen = 0.0 if sees else unseen + self._period
        same = same + self._period if sees and np.array_equal(row, memory[4:]) else 0.0
        dark = max(dark, float(unseen > self.rules.dark))
        late = max(late, float(same > self.rules.late))
        return np.concatenate([[dark, late, unseen, same], row])
