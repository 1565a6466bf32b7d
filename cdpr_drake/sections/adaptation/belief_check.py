"""Asks the stability criterion whether a servo may believe a model that was learnt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.sections.adaptation.geometry_learner import Offer
from cdpr_drake.systems.monitoring.servo_criterion import ServoCriterion


@dataclass(frozen=True, eq=False)
class BeliefCheck:
    """The criterion of a servo for robots that may be true, where it is and where it goes.

    Attributes:
        criterion: The servo's; its true cables and camera are replaced by those that may be true.
        X_CdO: Desired pose of the target in the camera [m].
    """

    criterion: ServoCriterion
    X_CdO: RigidTransform

    def __call__(self, offer: Offer) -> tuple[float, float]:
        """Worst margins over robots and poses of what is offered and of what was before.

        Minus infinity where a cable of a robot cannot run. Where the criterion does not know the
        law, or features leave a motion free, both are NaN, and nothing is believed.
        """
        X_WPd = offer.X_WO @ (offer.X_PC @ self.X_CdO).inverse()
        poses = ((offer.X_WP, offer.X_WP_estimated), (X_WPd, X_WPd))
        return (self._worst(offer, offer.points, poses), self._worst(offer, offer.before, poses))

    def _worst(
        self,
        offer: Offer,
        points: Array,
        poses: tuple[tuple[RigidTransform, RigidTransform], ...],
    ) -> float:
        believed = self.criterion.believed
        model = replace(believed, cables=moved_cables(believed.cables, points))
        taut = np.ones(model.cables.count, bool)
        least = np.inf
        for robot in offer.robots:
            judged = replace(
                self.criterion,
                cables=moved_cables(self.criterion.cables, robot),
                believed=model,
                camera=offer.X_PC,
                sees=lambda X_WP, _: (X_WP @ offer.X_PC).inverse() @ offer.X_WO,
            )
            for X_WP, X_estimated in poses:
                try:
                    margin = judged.at(X_WP, X_estimated, taut, 0.0)[1]
                except CableGeometryError:
                    return -np.inf
                least = min(least, margin) if np.isfinite(margin) else np.nan
        return float(least)


def moved_cables(cables: CableSet, points: Array) -> CableSet:
    """Cables with other exit and anchor points, shape (2, m, 3) [m]."""
    return replace(cables, p_WA=points[0].T.copy(), p_PB=points[1].T.copy())
