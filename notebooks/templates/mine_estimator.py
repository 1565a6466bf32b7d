"""The estimator `mine`: run this file to see how well it does, its test to see that it works."""

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.systems.estimators import ESTIMATORS, EstimatorKind, PoseEstimator

NAME = "mine"


class Mine(PoseEstimator):
    """The pose believed at the start, for ever.

    An estimator that declares an input `measured_lengths` gets the lengths that the encoders
    count, one with `X_CO` the seen pose of the target, and so on: inputs are connected by name.
    """

    def advance(self, read, X_WP, extra, elapsed):
        """The estimate now, from that of the step before: replace this by yours."""
        return X_WP, extra


ESTIMATORS[NAME] = EstimatorKind(NAME, lambda task: Mine(task.robot.X_WP0, task.rate, np.zeros(0)))


def errors(seconds=1.0):
    """How far its pose was from the true one beside a visual servo, shape (n,) each [m, rad]."""
    changes = ["camera.kind=projected", f"duration={seconds}", f"estimator.compare=[{NAME}]"]
    log = cdpr.simulate("acrobot_pbvs", changes).log
    return pose_rows_distance(log["X_WP"], log[f"X_WP_{NAME}"])


if __name__ == "__main__":
    distance, angle = errors()
    print(f"estimate off at the end: {1e3 * distance[-1]:.2f} mm, {np.degrees(angle[-1]):.3f} deg")
