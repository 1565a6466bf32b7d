"""An estimator of your own: logged beside the one in charge.

`advance` gets what the ports read, the estimate of the step before and the time since then, and
returns the estimate now. This one reads nothing and drifts back to where the platform began.
"""

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.systems.estimators import ESTIMATORS, EstimatorKind, PoseEstimator


class Homing(PoseEstimator):
    """The pose of the step before, a tenth of the way nearer to where it began."""

    def __init__(self, X_WP0, rate):
        super().__init__(X_WP0, rate, np.zeros(0))
        self.home = X_WP0

    def advance(self, read, X_WP, extra, elapsed):
        p = 0.9 * X_WP.translation() + 0.1 * self.home.translation()
        X_WP.set_translation(p)
        return X_WP, extra


ESTIMATORS["homing"] = EstimatorKind("homing", lambda task: Homing(task.robot.X_WP0, task.rate))

changes = ["camera.kind=projected", "estimator.compare=[homing]"]
run = cdpr.simulate("acrobot_pbvs", changes)
print(run)
print("signals of its own:", [name for name in run.log if "homing" in name])
