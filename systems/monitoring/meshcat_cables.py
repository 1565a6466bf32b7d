"""Cables in Meshcat, coloured by tension and red when slack, as they sag and hang."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Cylinder, Meshcat, Rgba
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.cables.states import slack_tensions
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.palette import SLACK, TENSIONS, UNKNOWN, rgb
from cdpr_drake.systems.robots.settings import CableSettings

SLACK_COLOR = Rgba(*rgb(SLACK))

UNKNOWN_COLOR = Rgba(*rgb(UNKNOWN.color))
"""Of cables whose tensions nobody knows."""

TENSION_COLORS = tuple(Rgba(*rgb(color)) for color in TENSIONS)
"""From the lowest to the highest tension."""

THIN = 1.6e-3
"""Radius of a drawn cable at least, of the size of what is shown."""

UNSEEN = 0.25
"""What the end of a rod may be off, of its radius."""


class CableChains:
    """Chains of rods in Meshcat that follow the curves of cables, also into a recording.

    A recording keeps transforms and properties, not geometry. So a cable is a chain of cylinders
    of unit length, posed and scaled: one straight, more where it sags, hangs slack or runs over a
    pulley or through eyelets. Every cable has one chain for each number of cylinders and colour
    that was needed so far, of which one is visible.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        paths: Sequence[str],
        radius: float,
        full_scale: float,
        colors: Sequence[str] | None = None,
    ):
        """For cables at paths in Meshcat.

        Args:
            meshcat: Where to.
            paths: Of each cable.
            radius: Of all rods [m].
            full_scale: Tension of the last colour [N].
            colors: Of each cable that is not slack, #rrggbb; None: by its tension.
        """
        self._meshcat, self._paths, self._radius = meshcat, list(paths), radius
        self._colors = None if colors is None else [Rgba(*rgb(color)) for color in colors]
        self._full_scale = max(full_scale, 1e-9)
        self._shown: list[str | None] = [None] * len(self._paths)
        self._chains: set[str] = set()
        self._placed: dict[str, tuple[Array, Array]] = {}
        self._waiting: dict[str, tuple[tuple[Array, Array], float | None]] = {}
        self._began: float | None = None

    def follow(
        self, curves: Sequence[Array], tensions: Array, slack: np.ndarray, time: float | None
    ) -> None:
        """Draws the cables along curves.

        Args:
            curves: Points of each cable in W, shape (3, k) [m].
            tensions: Shape (m,) [N]; a cable with NaN is grey.
            slack: Which cables are red, shape (m,), bool.
            time: While Meshcat records, where this goes in the recording [s].
        """
        if self._began is None:
            self._began = time
        for i, curve in enumerate(curves):
            rods = curve.shape[1] - 1
            chain = f"{self._paths[i]}/{rods}/{0 if slack[i] else self._level(float(tensions[i]))}"
            self._make(chain, rods, time, i)
            self._pose(chain, curve, time)
            if chain != self._shown[i]:
                before = self._shown[i]
                if before is not None:
                    self._meshcat.SetProperty(before, "visible", False, time)
                self._meshcat.SetProperty(chain, "visible", True, time)
                self._shown[i] = chain

    def _make(self, chain: str, rods: int, time: float | None, cable: int) -> None:
        """Makes a cable's chain if it is not there yet, invisible in what was recorded before."""
        if chain in self._chains:
            return
        self._chains.add(chain)
        level = int(chain.rpartition("/")[2])
        color = TENSION_COLORS[level - 1] if level > 0 else SLACK_COLOR
        if level > 0 and self._colors is not None:
            color = self._colors[cable]
        if level < 0:
            color = UNKNOWN_COLOR
        for k in range(rods):
            self._meshcat.SetObject(f"{chain}/{k}/rod", Cylinder(self._radius, 1.0), color)
        self._meshcat.SetProperty(chain, "visible", False)
        if time is not None and time != self._began:
            self._meshcat.SetProperty(chain, "visible", False, self._began)

    def _pose(self, chain: str, points: Array, time: float | None) -> None:
        """Poses the rods of a chain; leaves out of a recording what nobody would see move."""
        for k, ends in enumerate(pairwise(points.T)):
            rod = f"{chain}/{k}"
            if rod in self._placed:
                moved = np.abs(np.subtract(ends, self._placed[rod]))
                if np.max(moved) < UNSEEN * self._radius:
                    self._waiting[rod] = (ends, time)
                    continue
            # Else the browser would let it creep here since it was last placed.
            if rod in self._waiting and time is not None:
                self._place(rod, *self._waiting.pop(rod))
            self._place(rod, ends, time)

    def _place(self, rod: str, ends: tuple[Array, Array], time: float | None) -> None:
        start, end = ends
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            R = RotationMatrix.MakeFromOneVector(end - start, 2)
            self._meshcat.SetTransform(rod, RigidTransform(R, (start + end) / 2.0), time)
        self._meshcat.SetProperty(f"{rod}/rod", "scale", [1.0, 1.0, length], time)
        self._placed[rod] = ends

    def _level(self, tension: float) -> int:
        """-1 for a cable of unknown tension, else 1 to the number of colours of tensions."""
        if np.isnan(tension):
            return -1
        if self._colors is not None:
            return 1
        last = len(TENSION_COLORS)
        return min(1 + int(last * tension / self._full_scale), last)


def _drawn_radius(robot: Robot) -> float:
    """Of all rods [m]: thinner ones than the least would vanish on the screen."""
    size = float(np.linalg.norm(robot.frame.upper - robot.frame.lower))
    return max(float(np.max(robot.diameters())) / 2.0, THIN * size)


class CablePictures:
    """Draws the cables of a robot in Meshcat, also into a recording, by `CableChains`."""

    def __init__(
        self,
        meshcat: Meshcat,
        robot: Robot,
        full_scale: float,
        path: str = "cables",
        settings: CableSettings | None = None,
        *,
        colors: Sequence[str] | None = None,
    ):
        """Places the cables in Meshcat.

        Args:
            meshcat: Where to.
            robot: The robot.
            full_scale: Tension of the last colour [N].
            path: In Meshcat.
            settings: Model of the cables, and whether they run over pulleys; None: straight,
                from fixed exit points.
            colors: Of each cable that is not slack, #rrggbb; None: by its tension.
        """
        settings = CableSettings() if settings is None else settings
        self._settings, self._path, self._full_scale = settings, path, full_scale
        self._set, self._model = settings.cable_set(robot), settings.model_of(robot)
        self._radius = _drawn_radius(robot)
        self._paths = self._paths_of(robot)
        self._chains = CableChains(meshcat, self._paths, self._radius, full_scale, colors)

    def _paths_of(self, robot: Robot) -> list[str]:
        return [f"{self._path}/{cable.name}" for cable in robot.cables]

    def move_to(self, robot: Robot, full_scale: float) -> bool:
        """Draws the cables of a robot whose cables look the same, with the rods that are there.

        Rods that are made anew take a browser longer than rods that move.

        Args:
            robot: The robot.
            full_scale: Tension of its last colour [N].

        Returns:
            Whether that can be: names, thickness and colours have to be the same.
        """
        same = (
            self._paths_of(robot) == self._paths
            and _drawn_radius(robot) == self._radius
            and full_scale == self._full_scale
        )
        if same:
            self._set = self._settings.cable_set(robot)
        return same

    def draw(
        self,
        X_WP: RigidTransform,
        tensions: Array,
        time: float | None = None,
        unstrained_lengths: Array | None = None,
    ) -> None:
        """Draws the cables to a platform at X_WP [m].

        Args:
            X_WP: The pose.
            tensions: Shape (m,) [N]; a slack cable is red, see `slack_tensions`, one with
                NaN grey.
            time: While Meshcat records, where this goes in the recording [s].
            unstrained_lengths: From the exit points to the platform, which decide how cables sag
                and hang, shape (m,) [m]; None: all are straight.
        """
        model, l0 = self._model, unstrained_lengths
        if l0 is None:
            model, l0 = ELASTIC, np.zeros(self._set.count)
        curves = cable_curves(self._set, model, X_WP, l0, least_sag=0.5 * self._radius)
        self._chains.follow(curves, tensions, self.slack(tensions, unstrained_lengths), time)

    def slack(self, tensions: Array, unstrained_lengths: Array | None = None) -> np.ndarray:
        """Which cables are slack, shape (m,), bool; arguments as those of `draw`."""
        l0 = np.zeros(self._set.count) if unstrained_lengths is None else unstrained_lengths
        model = ELASTIC if unstrained_lengths is None else self._model
        return np.asarray(tensions <= slack_tensions(self._set, model, l0))

    def rods(self, X_WP: RigidTransform, unstrained_lengths: Array) -> int:
        """How many cylinders all cables take at a pose; arguments as those of `draw`."""
        curves = cable_curves(
            self._set, self._model, X_WP, unstrained_lengths, least_sag=0.5 * self._radius
        )
        return sum(curve.shape[1] - 1 for curve in curves)


class MeshcatCables(LeafSystem):
    """Draws the cables while a simulation runs.

    ================== ============== ==== ============================================
    port               type           unit meaning
    ================== ============== ==== ============================================
    X_WP               RigidTransform m    in, pose of the platform
    tensions           vector(m)      N    in, at the platform
    unstrained_lengths vector(m)      m    in, optional; without it, cables are straight
    ================== ============== ==== ============================================
    """

    def __init__(self, pictures: CablePictures, num_cables: int, rate: float = 32.0) -> None:
        """Draws `rate` [Hz] times per simulated second."""
        super().__init__()
        self._pictures = pictures
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", num_cables)
        self._l0 = self.DeclareVectorInputPort("unstrained_lengths", num_cables)
        self.DeclarePeriodicPublishEvent(1.0 / rate, 0.0, self._draw)
        self.DeclareForcedPublishEvent(self._draw)

    def _draw(self, context: Context) -> None:
        self._pictures.draw(
            self._X_WP.Eval(context),
            self._tensions.Eval(context),
            context.get_time(),
            self._l0.Eval(context) if self._l0.HasValue(context) else None,
        )
