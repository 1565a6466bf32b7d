"""The pose estimators that a scenario can name; a new one is one entry of `ESTIMATORS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.systems.control_integration import ControlIntegration

if TYPE_CHECKING:
    # The schema takes the names of the estimators from here.
    from cdpr_drake.systems.scenario import Scenario
    from cdpr_drake.systems.servo_model import ServoModel

EstimatorFactory = Callable[
    ["Scenario", "ServoModel", DiagramBuilder, Mapping[str, OutputPort]], System
]
"""Adds an estimator, named "estimator", to the builder and connects its inputs.

It gets the scenario, the robot as the controller believes it to be, the builder and the ports that
an estimator may read, by name: `ESTIMATOR_PORTS`. It returns the system, which has an output port
X_WP, the estimated pose of the platform; the caller connects that one. X_WP must not depend on the
inputs "platform_velocity" and "cable_velocities" of the same instant through the servo: the servo
holds those in discrete state, so there is no algebraic loop.
"""

ESTIMATOR_PORTS = (
    "platform_velocity",
    "cable_velocities",
    "X_CO",
    "found",
    "corners",
    "X_WP",
    "lengths",
    "unstrained_lengths",
    "tensions",
)
"""Ports that are offered: those of the servo and of the camera, and the robot's true ones."""


def _control_integration(
    scenario: Scenario,
    model: ServoModel,
    builder: DiagramBuilder,
    ports: Mapping[str, OutputPort],
) -> System:
    estimator = builder.AddNamedSystem(
        "estimator", ControlIntegration(model.X_WP0, scenario.controller.rate)
    )
    builder.Connect(ports["platform_velocity"], estimator.GetInputPort("platform_velocity"))
    return estimator


ESTIMATORS: dict[str, EstimatorFactory] = {"control_integration": _control_integration}
"""By the name that a scenario gives as `estimator.kind`."""
