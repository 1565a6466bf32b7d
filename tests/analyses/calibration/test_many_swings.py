"""Behaviours of cables come back from swings that Drake's plant made; few of many seeds."""

import numpy as np
import pytest

from tests.analyses.calibration.many_swings import TRUE, identified, off_by

FARTHEST = 4.0
"""Standard errors, as in the other tests of free motion; `many_swings` counts those beyond 3."""

SEEDS = (0,)
"""Each costs some seconds; `python -m tests.analyses.calibration.many_swings` does a hundred."""


@pytest.mark.parametrize("group", list(TRUE))
def test_what_the_plant_swung_with_is_found(group):
    for seed in SEEDS:
        found = identified(group, seed)
        assert 0.85 < found.spread < 1.15
        assert np.max(np.abs(off_by(group, found))) < FARTHEST
