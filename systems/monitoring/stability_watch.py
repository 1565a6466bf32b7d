"""The stability criterion along a run, with the cables that are slack left out.

`ServoCriterion` is the criterion at moments of a servo, `StabilityWatch` the block that gives it as
signals of the log, and `StabilitySettings` the scenario section `stability` that asks for it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, CacheEntry, Context, LeafSystem, ValueProducer

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.straight_cables import PLANAR_ROWS
from cdpr_drake.schema.declarations import In, settings
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.servoing.visual_features import VisualFeatures
from cdpr_drake.stability.criterion import ModelAtPose, stability_margin, stability_matrix
from cdpr_drake.systems.controllers.schemes import ideal_sighting
from cdpr_drake.vision.target import Target


@dataclass(frozen=True, kw_only=True, eq=False)
class ServoCriterion:
    """The criterion of a servo: what is true of it, and what it believes.

    Truth and belief see the same object, as in the thesis: between them stand the platform's pose,
    the points of the cables, and the camera on the platform.

    Attributes:
        cables: The true cables.
        believed: The robot that the controller believes in; with pulleys where it reckons them.
        camera: True pose of the camera on the platform, X_PC [m].
        features: The features that are controlled.
        target: What the camera sees.
        sees: True pose of the object in the camera, from that of the platform and the time [s].
        judges_law: Whether the law is that of the criterion, all features at once.
    """

    cables: CableSet
    believed: BelievedRobot
    camera: RigidTransform
    features: VisualFeatures
    target: Target
    sees: Callable[[RigidTransform, float], RigidTransform]
    judges_law: bool = True

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the platform."""
        return 3 if self.believed.is_planar() else 6

    def at(
        self, X_WP: RigidTransform, X_estimated: RigidTransform, taut: np.ndarray, time: float
    ) -> tuple[int, float]:
        """Rank of the Jacobian and margin of Pi, with the taut cables only.

        Args:
            X_WP: True pose of the platform.
            X_estimated: Its estimate.
            taut: Which cables pull, shape (m,) bool.
            time: Time, for a target that moves [s].

        Returns:
            The rank, and the smallest eigenvalue of the symmetric part of Pi; 0 if the rank is less
            than the platform's degrees of freedom, NaN where the features leave a motion free or
            the criterion does not know the law.

        Raises:
            CableGeometryError: A cable cannot run.

        Source: servoing thesis 5.3.1, (3.1), (3.8).
        """
        planar, freedom = self.believed.is_planar(), self.freedom
        J = cable_jacobian(X_WP, self.cables)[taut]
        if planar:
            J = J[:, list(PLANAR_ROWS)]
        rank = int(np.linalg.matrix_rank(J)) if len(J) else 0
        if self.features.rank < freedom or not self.judges_law:
            return rank, float("nan")
        if rank < freedom:
            return rank, 0.0
        _, L = self.features.evaluate(ideal_sighting(self.target, self.sees(X_WP, time)))
        Pi = stability_matrix(
            ModelAtPose(X_WP, self.cables, self.camera, np.array(L)),
            ModelAtPose(X_estimated, self.believed.cables, self.believed.X_PC, np.array(L)),
            local=len(L) > freedom,
            taut=taut,
            planar=planar,
        )
        return rank, stability_margin(Pi)


class StabilityWatch(LeafSystem):
    """Tells whether enough cables pull, and whether the servo is stable by the criterion.

    ================ ============== ==== ====================================================
    port             type           unit meaning
    ================ ============== ==== ====================================================
    X_WP             RigidTransform m    in, true pose of the platform
    X_WP_estimated   RigidTransform m    in, its estimate
    tensions         vector(m)      N    in, true ones
    slack            vector(m)      -    in, 1 where slack
    taut_cables      vector(1)      -    out, number of cables that pull
    jacobian_rank    vector(1)      -    out, rank of the Jacobian with their rows only; 0 where a
                                         cable cannot run
    stability_margin vector(1)      -    out, smallest eigenvalue of the symmetric part of Pi; 0
                                         where the rank is less than the platform's degrees of
                                         freedom, NaN where the features leave a motion free or a
                                         cable cannot run
    ================ ============== ==== ====================================================

    Reckons when an output is asked for, and costs nothing else.

    Source: servoing thesis 5.3.1, Fig. 5.18.
    """

    def __init__(self, criterion: ServoCriterion, threshold: float | None = None) -> None:
        """With a servo's criterion, and the tension from which a cable pulls [N]; None: one that is
        not slack."""
        super().__init__()
        self._criterion, self._threshold = criterion, threshold
        m = criterion.cables.count
        self._X_WP = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._X_hat = self.DeclareAbstractInputPort("X_WP_estimated", Value(RigidTransform()))
        self._tensions = self.DeclareVectorInputPort("tensions", m)
        self._slack = self.DeclareVectorInputPort("slack", m)
        found = self.DeclareCacheEntry(
            "stability",
            ValueProducer(lambda: Value(np.zeros(3)), self._calc),
            {self.time_ticket(), self.all_input_ports_ticket()},
        )
        for k, name in enumerate(("taut_cables", "jacobian_rank", "stability_margin")):
            self._declare_part(name, k, found)

    def _declare_part(self, name: str, k: int, found: CacheEntry) -> None:
        def write(context: Context, output: BasicVector) -> None:
            output.SetAtIndex(0, found.Eval(context)[k])

        self.DeclareVectorOutputPort(name, 1, write, {found.ticket()})

    def _calc(self, context: Context, value: Value) -> None:
        value.set_value(self._now(context))

    def _now(self, context: Context) -> Array:
        """Taut cables, rank and margin at a context's time, shape (3,) [-]."""
        if self._threshold is None:
            taut = self._slack.Eval(context) == 0.0
        else:
            taut = self._tensions.Eval(context) >= self._threshold
        count = float(np.sum(taut))
        try:
            rank, margin = self._criterion.at(
                self._X_WP.Eval(context), self._X_hat.Eval(context), taut, context.get_time()
            )
        except CableGeometryError:
            return np.array([count, 0.0, np.nan])
        return np.array([count, float(rank), margin])


@settings
class StabilitySettings:
    """Logs how many cables pull, the rank of their Jacobian, and the criterion's margin."""

    threshold: Annotated[
        float | None,
        In("N", ge=0.0),
        "Tension from which a cable counts as taut; null: one that is not slack.",
    ] = None
