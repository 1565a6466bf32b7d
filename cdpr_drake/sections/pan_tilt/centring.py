"""What turns a camera so that its target stays in the middle of the image."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.turned_view import centring_rates, spiral
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

NEVER = -1.0
"""Time since when the target is lost, where it is not [s]."""


class CentringLaw(LeafSystem):
    """Commands rates to pan and tilt of a camera, by what it sees; where it sees nothing, it looks.

    ============== =========== ===== ==========================================================
    port           type        unit  meaning
    ============== =========== ===== ==========================================================
    found          vector(1)   -     in, 1 while the turned camera sees the target
    corners        vector(2 n) px    in, its marks
    encoder_angles vector(2)   rad   in, pan and tilt as their encoders read them
    joint_rates    vector(2)   rad/s out, for a `PanTilt` by velocity
    ============== =========== ===== ==========================================================

    Discrete updates at the rate of the images. What goes to the middle of the image is the mean of
    the target's points. After some patience without the target the joints go along a spiral round
    where they lost it.
    """

    def __init__(
        self,
        target: PointTarget,
        pinhole: Pinhole,
        rate: float,
        *,
        gain: float,
        limits: tuple[Array, Array],
        patience: float,
        search: float,
    ) -> None:
        """For a target and a camera, at a rate [Hz].

        Args:
            target: What it keeps in view.
            pinhole: The camera.
            rate: Images per second [Hz].
            gain: Of the law [1/s].
            limits: Smallest and largest angles, shape (2,) each [rad].
            patience: Time without the target before the joints look for it [s].
            search: Speed of the look-out [rad/s].
        """
        super().__init__()
        self._target, self._pinhole, self._gain = target, pinhole.ideal, gain
        self._limits, self._patience, self._search, self._rate = limits, patience, search, rate
        lens = self._pinhole
        # Turns of the spiral lie half an image apart, so that none passes beside the target.
        self._pitch = float(
            min(np.arctan(0.5 * lens.width / lens.fx), np.arctan(0.5 * lens.height / lens.fy))
        )
        self.DeclareVectorInputPort("found", 1)
        self.DeclareVectorInputPort("corners", target.size)
        self.DeclareVectorInputPort("encoder_angles", 2)
        self._rates = self.DeclareDiscreteState(2)
        self._lost = self.DeclareDiscreteState(np.array([NEVER, 0.0, 0.0]))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareStateOutputPort("joint_rates", self._rates)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        angles = self.GetInputPort("encoder_angles").Eval(context)
        if self.GetInputPort("found").Eval(context)[0] != 0.0:
            marks = self.GetInputPort("corners").Eval(context)
            center = np.mean(self._target.normalized(marks, self._pinhole), axis=1)
            state.set_value(self._rates, centring_rates(center, float(angles[1]), self._gain))
            state.set_value(self._lost, np.array([NEVER, 0.0, 0.0]))
            return
        lost, now = context.get_discrete_state(self._lost).value(), context.get_time()
        if lost[0] == NEVER:
            lost = np.array([now, *angles])
        state.set_value(self._lost, lost)
        state.set_value(self._rates, self._look_out(now - lost[0], lost[1:], angles))

    def _look_out(self, time: float, middle: Array, angles: Array) -> Array:
        """Rates of the look-out, so long after the target was lost with the joints at `middle`."""
        if time < self._patience:
            return np.zeros(2)
        lower, upper = self._limits
        reach = float(np.max(np.linalg.norm([upper - middle, middle - lower], axis=1)))
        goal = middle + spiral(
            time - self._patience + 1.0 / self._rate, self._pitch, self._search, reach
        )
        return np.asarray((np.clip(goal, lower, upper) - angles) * self._rate)
