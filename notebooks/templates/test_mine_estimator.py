"""The estimator `mine` begins where the platform is, and runs beside a servo."""

import numpy as np
from mine import errors


def test_it_begins_at_the_true_pose():
    distance, angle = errors(0.2)
    assert distance[0] < 1e-3
    assert np.all(np.isfinite(angle))
