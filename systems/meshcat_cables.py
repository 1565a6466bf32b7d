"""Cables in Meshcat, coloured by tension and red when slack."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Cylinder, Meshcat, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cable_geometry import cable_vectors
from cdpr_drake.models import Robot

SLACK_COLOR = Rgba(0.90, 0.10, 0.10)

TENSION_COLORS = (
    Rgba(0.27, 0.00, 0.33),
    Rgba(0.27, 0.20, 0.50),
    Rgba(0.21, 0.36, 0.55),
    Rgba(0.15, 0.50, 0.56),
    Rgba(0.12, 0.63, 0.53),
    Rgba(0.29, 0.76, 0.43),
    Rgba(0.63, 0.85, 0.22),
    Rgba(0.99, 0.91, 0.14),
)
"""From the lowest to the highest tension, after matplotlib's viridis, which has no red."""


class CablePictures:
    """Draws the cables of a robot in Meshcat, also into a recording.

    A recording keeps transforms and properties, not geometry. So a cable is a cylinder of unit
    length, posed and scaled, once in every colour, of which one is visible.
    """

    def __init__(self, meshcat: Meshcat, robot: Robot, full_scale: float, path: str = "cables"):
        """Places the cables in Meshcat; `full_scale` is the tension of the last colour [N]."""
        self._meshcat = meshcat
        self._robot = robot
        self._p_WA, self._p_PB = robot.exit_points(), robot.anchor_points()
        self._full_scale = max(full_scale, 1e-9)
        self._paths = [f"{path}/{cable.name}" for cable in robot.cables]
        self._shown = [-1] * len(self._paths)
        size = float(np.linalg.norm(robot.frame.upper - robot.frame.lower))
        # Thinner than this would vanish on the screen.
        radius = max(robot.cable.diameter / 2.0, 1.6e-3 * size)
        for cable in self._paths:
            for level, color in enumerate((SLACK_COLOR, *TENSION_COLORS)):
                rod = f"{cable}/rod/{level}"
                meshcat.SetObject(rod, Cylinder(radius, 1.0), color)
                meshcat.SetProperty(rod, "visible", False)

    def draw(self, X_WP: RigidTransform, tensions: Array, time: float | None = None) -> None:
        """Draws the cables to a platform at X_WP [m] under tensions, shape (m,) [N].

        While Meshcat records, `time` [s] is where it goes in the recording.
        """
        p_AB_W, _ = cable_vectors(X_WP, self._p_WA, self._p_PB)
        for i, path in enumerate(self._paths):
            length = float(np.linalg.norm(p_AB_W[:, i]))
            R = RotationMatrix.MakeFromOneVector(p_AB_W[:, i], 2)
            X_WRod = RigidTransform(R, self._p_WA[:, i] + p_AB_W[:, i] / 2.0)
            self._meshcat.SetTransform(path, X_WRod, time)
            self._meshcat.SetProperty(f"{path}/rod", "scale", [1.0, 1.0, length], time)
            level = self._level(float(tensions[i]))
            if level != self._shown[i]:
                if self._shown[i] >= 0:
                    old = f"{path}/rod/{self._shown[i]}"
                    self._meshcat.SetProperty(old, "visible", False, time)
                elif time is not None:
                    for other in range(len(TENSION_COLORS) + 1):
                        hidden = f"{path}/rod/{other}"
                        self._meshcat.SetProperty(hidden, "visible", False, time)
                self._meshcat.SetProperty(f"{path}/rod/{level}", "visible", True, time)
                self._shown[i] = level

    def _level(self, tension: float) -> int:
        """0 for a slack cable, else 1 to the number of colours."""
        if tension <= 0.0:
            return 0
        last = len(TENSION_COLORS)
        return min(1 + int(last * tension / self._full_scale), last)


class MeshcatCables(LeafSystem):
    """Draws the cables while a simulation runs.

    ======== ============== ==== =========================================
    port     type           unit meaning
    ======== ============== ==== =========================================
    X_WP     RigidTransform m    in, pose of the platform
    tensions vector(m)      N    in, 0 where slack
    ======== ============== ==== =========================================
    """

    def __init__(self, pictures: CablePictures, num_cables: int, rate: float = 32.0) -> None:
        """Draws `rate` [Hz] times per simulated second."""
        super().__init__()
        self._pictures = pictures
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", num_cables)
        self.DeclarePeriodicPublishEvent(1.0 / rate, 0.0, self._draw)
        self.DeclareForcedPublishEvent(self._draw)

    def _draw(self, context: Context) -> None:
        self._pictures.draw(
            self._X_WP.Eval(context), self._tensions.Eval(context), context.get_time()
        )
