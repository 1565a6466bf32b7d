"""The stability criterion of a servo in a diagram, and the block that follows it."""

from __future__ import annotations

from dataclasses import replace

from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.geometry import CableSet
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.monitoring import ServoCriterion, StabilitySettings, StabilityWatch


def criterion_of(blocks: VisualServoBlocks, pulleys: bool) -> ServoCriterion:
    """The stability criterion of a servo.

    Args:
        blocks: The servo.
        pulleys: Whether its controller reckons with pulleys.
    """
    return servo_criterion(blocks, blocks.block.forces.cable_set(), pulleys)


def servo_criterion(model: ServoModel, cables: CableSet, pulleys: bool) -> ServoCriterion:
    """The same of a servo without blocks, with its cables as they are simulated."""
    believed = model.believed
    if not pulleys:
        believed = replace(believed, cables=believed.cables.without_pulleys())
    return ServoCriterion(
        cables=cables,
        believed=believed,
        camera=model.mounting.X_BC,
        features=model.controller.tasks[-1].features,
        target=model.target,
        sees=model.X_CO,
        judges_law=model.controller.law.uses_all_features(),
    )


def add_stability_watch(
    builder: DiagramBuilder,
    blocks: VisualServoBlocks,
    settings: StabilitySettings,
    *,
    pulleys: bool = False,
    name: str = "stability",
) -> StabilityWatch:
    """Adds a `StabilityWatch` to a servo, in somebody's builder.

    Args:
        builder: The builder that has the servo.
        blocks: The servo.
        settings: From which tension a cable counts.
        pulleys: Whether its controller reckons with pulleys.
        name: Of the block.
    """
    watch = StabilityWatch(criterion_of(blocks, pulleys), settings.threshold)
    builder.AddNamedSystem(name, watch)
    for port, source in (
        ("X_WP", blocks.block.GetOutputPort("X_WP")),
        ("X_WP_estimated", blocks.estimator.GetOutputPort("X_WP")),
        ("tensions", blocks.block.GetOutputPort("tensions")),
        ("slack", blocks.block.GetOutputPort("slack")),
    ):
        builder.Connect(source, watch.GetInputPort(port))
    return watch
