"""Visual servoing of a cable robot as a block, whatever the features and the law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.controller import Command, ServoController
from cdpr_drake.servoing.packed_features_kernel import CENTER, MARKS
from cdpr_drake.servoing.visual_features import Sighting, VisualFeatures, columns
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target

_NO_MARKS = np.empty(0)

MODE_PORT, MODE_SIZE = "servo_mode", 6
"""What a switching servo says of itself, see `ServoController.mode`."""


class FeatureServo(LeafSystem):
    """Moves the platform until the camera sees the target as it should.

    ================= ============== ======== ===============================================
    port              type           unit     meaning
    ================= ============== ======== ===============================================
    X_CO              RigidTransform m        in, measured pose of the target in the camera
    found             vector(1)      -        in, 1 while the target is seen
    corners           vector         px       in, or `ellipses`: marks of the target, as from
                                              `TargetMeasurement`
    X_WP              RigidTransform m        in, estimated pose of the platform
    cable_velocities  vector(m)      m/s      out, to the winches, positive pays out
    platform_velocity vector(6)      rad/s,   out, the twist (w, v) of P in P that the cables
                                     m/s      are asked for
    error             vector(k)      rad, m,  out, s - s*(t) of the features, last one measured
                                     -
    gain              vector(1)      1/s      out, adaptive gain lambda
    servo_mode        vector(6)      -        out, of a switching servo only: which controller acts
                                              (0 pose, 1 image), switches so far, L_P and L_I, and
                                              their bounds
    ================= ============== ======== ===============================================

    Discrete updates at a rate of its own. While the target is not found the cables stop; when it
    is found again the task begins anew, with its continuous start and its plan. Velocities beyond
    the cables' speed are scaled down together, so the direction of motion stays.

    Source: servoing thesis 1.4 and 4.2; the law is that of `ServoController`.
    """

    def __init__(
        self, controller: ServoController, target: Target, pinhole: Pinhole, rate: float
    ) -> None:
        """With a law, the target and the camera that it sees, and a control rate [Hz]."""
        super().__init__()
        self.controller = controller
        self._target, self._pinhole = target, pinhole
        self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        self.DeclareVectorInputPort("found", 1)
        self.DeclareVectorInputPort(target.mark, target.size)
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._outputs = {
            name: self.DeclareDiscreteState(size)
            for name, size in (
                ("cable_velocities", controller.cable_count),
                ("platform_velocity", 6),
                ("error", controller.size),
                ("gain", 1),
                (MODE_PORT, MODE_SIZE),
            )
            if name != MODE_PORT or controller.law.switching is not None
        }
        self._memory = self.DeclareDiscreteState(controller.fresh_memory())
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        for name, index in self._outputs.items():
            self.DeclareStateOutputPort(name, index)

    def replans(self, context: Context) -> int:
        """How often the path was planned again, from this system's own context."""
        return self.controller.replans(context.get_discrete_state(self._memory).value())

    def _update(self, context: Context, state: DiscreteValues) -> None:
        outputs, memory = self.decide(
            lambda name: self.GetInputPort(name).Eval(context),
            context.get_discrete_state(self._memory).value(),
            context.get_time(),
        )
        state.set_value(self._memory, memory)
        for name, value in outputs.items():
            state.set_value(self._outputs[name], value)

    def logged(self) -> tuple[str, ...]:
        """Names of the outputs that a log keeps."""
        mode = () if self.controller.law.switching is None else (MODE_PORT,)
        return ("error", "gain", "platform_velocity", "cable_velocities", *mode)

    def nothing(self) -> dict[str, Array]:
        """What stands on the outputs before the first step, by their names."""
        outputs = {
            "cable_velocities": np.zeros(self.controller.cable_count),
            "platform_velocity": np.zeros(6),
            "error": np.zeros(self.controller.size),
            "gain": np.zeros(1),
        }
        if self.controller.law.switching is not None:
            outputs[MODE_PORT] = np.zeros(MODE_SIZE)
        return outputs

    def decide(
        self, read: Callable[[str], Any], memory: Array, time: float
    ) -> tuple[dict[str, Array], Array]:
        """One step: the outputs that change, by their names, and the controller's memory.

        Args:
            read: Gives what stands at an input, by its name.
            memory: The controller's memory; it is not changed.
            time: Time [s].
        """
        if read("found")[0] == 0.0:
            rest = self.nothing()
            for kept in ("error", MODE_PORT):
                rest.pop(kept, None)
            return rest, self.controller.lose(memory)
        command, memory = control_step(
            self.controller,
            memory,
            (self._target, self._pinhole),
            (read("X_CO"), read(self._target.mark)),
            read("X_WP"),
            time,
        )
        outputs = {
            "cable_velocities": command.cable_velocities,
            "platform_velocity": command.V_P,
            "error": command.error,
            "gain": np.array([command.gain]),
        }
        if self.controller.law.switching is not None:
            outputs[MODE_PORT] = self.controller.mode(memory)
        return outputs, memory


def control_step(
    controller: ServoController,
    memory: Array,
    camera: tuple[Target, Pinhole],
    measured: tuple[RigidTransform, Array],
    X_WP: RigidTransform,
    time: float,
) -> tuple[Command, Array]:
    """One step of a controller, from what a camera measured.

    Args:
        controller: The controller.
        memory: Its memory.
        camera: What the camera looks at, and its intrinsic parameters.
        measured: Pose X_CO of the target [m] and its marks [px, px^2].
        X_WP: Estimated pose of the platform.
        time: Time [s].
    """
    (target, pinhole), (X_CO, marks) = camera, measured
    features = controller.tasks[0].features
    if not controller.sees_packed:
        seen = make_sighting(features, target, pinhole, X_CO, marks)
        return controller.step(memory, seen, X_WP.rotation().matrix(), X_WP.translation(), time)
    packed = np.empty(MARKS + (len(marks) if features.uses_marks else 0))
    packed[:CENTER] = columns(X_CO)
    if features.uses_center:
        packed[CENTER:MARKS] = target.center(marks, X_CO, pinhole)
    if features.uses_marks:
        target.write_normalized(marks, pinhole, packed[MARKS:])
    return controller.step_packed(memory, packed, columns(X_WP), time)


def make_sighting(
    features: VisualFeatures, target: Target, pinhole: Pinhole, X_CO: RigidTransform, marks: Array
) -> Sighting:
    """What features need of a measured pose [m] and measured marks [px, px^2] of a target."""
    return Sighting(
        X_CO.rotation().matrix(),
        X_CO.translation(),
        target.center(marks, X_CO, pinhole) if features.uses_center else _NO_MARKS,
        target.normalized(marks, pinhole) if features.uses_marks else _NO_MARKS,
    )
