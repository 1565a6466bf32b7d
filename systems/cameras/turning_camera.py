"""Sections that turn a servo's camera: the core asks such a section where the camera looks."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder, System

from cdpr_drake.arrays import Array
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.sections import Section, sections_of


class TurningCamera(Section):
    """Base of a section whose blocks turn the servo's camera about its mounting."""

    @abstractmethod
    def add_view(
        self,
        builder: DiagramBuilder,
        model: Any,
        measurement: TargetMeasurement,
        settings: Any,
        prefix: str,
    ) -> System:
        """Adds what turns the camera, and connects it to the input X_BC of the block `camera`.

        Args:
            builder: The builder that has robot and camera.
            model: What the servo is about, a `ServoModel`.
            measurement: What the camera that turns measures.
            settings: The scenario, or the `VisualServoSettings` of somebody's own diagram.
            prefix: What the names of the blocks begin with.

        Returns:
            What the servo looks at: X_CO, found and marks as of a camera at the mounting.
        """

    @abstractmethod
    def aimed(self, mounting: CameraMounting, X_C0O: RigidTransform) -> CameraMounting:
        """The mounting of the camera when it is aimed at a target, as far as that is possible.

        Args:
            mounting: The mounting at rest.
            X_C0O: Pose of the target in the camera at rest [m].
        """

    @abstractmethod
    def mountings(
        self, mounting: CameraMounting, log: Mapping[str, Array], rows: Any, believed: bool = False
    ) -> Sequence[CameraMounting]:
        """The mounting of the camera at rows of a log.

        Args:
            mounting: The mounting at rest.
            log: The log.
            rows: Indices of the rows.
            believed: True for where the servo believes it to be.
        """


def turning_camera(settings: Any) -> tuple[str, TurningCamera | None]:
    """The section that turns a servo's camera, with its key; empty and None: the camera rests."""
    turning = ((key, one) for key, one in sections_of(settings) if isinstance(one, TurningCamera))
    return next(turning, ("", None))
