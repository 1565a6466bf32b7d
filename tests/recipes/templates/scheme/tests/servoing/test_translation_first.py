"""The toy scheme: its matrix against finite differences, and the loop, which is that of PBVS."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.servoing.translation_first import TranslationFirst
from cdpr_drake.servoing.visual_features import sighting

QUICK = ["camera.kind=projected", "duration=0.2"]

STEP, SLOPE_ERROR = 1e-6, 1e-7
"""Motion of a difference [m, rad], and what is left of its third order and of rounding."""

SAME = 1e-9
"""The same motion from sums in another order [m]."""


def test_the_matrix():
    X_CO = RigidTransform(RollPitchYaw(0.1, -0.2, 0.3), [0.05, -0.1, 0.6])
    features = TranslationFirst(RigidTransform([0.0, 0.0, 0.3]))

    def at(V):
        moved = exponential(V).inverse() @ X_CO
        return features.evaluate(sighting(moved, np.zeros(0)))[0]

    found = features.evaluate(sighting(X_CO, np.zeros(0)))[1]
    for column, V in enumerate(np.eye(6)):
        slope = (at(STEP * V) - at(-STEP * V)) / (2.0 * STEP)
        np.testing.assert_allclose(found[:, column], slope, atol=SLOPE_ERROR)


def test_the_path_is_that_of_pbvs():
    other, pbvs = (
        ServoRun(
            cdpr.load_scenario("acrobot_pbvs", [*QUICK, f"controller.scheme={scheme}"])
        ).simulate()
        for scheme in ("translation-first", "pbvs")
    )
    np.testing.assert_allclose(other.log["X_WP"], pbvs.log["X_WP"], atol=SAME)
