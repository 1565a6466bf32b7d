"""The study of slack in images: one image, and what it says of deviations."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.seen_slack import drawn_pose, image_row, spread


def test_an_image_tells_slack_cables_from_taut_ones():
    row = image_row("exact", 0)
    assert row["slack"] + row["taut"] == 8
    assert row["hits"] >= 0.8 * (row["slack"] - row["unseen_slack"])
    assert row["false_slack"] == 0
    first, again = (drawn_pose(0)[1] for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert np.sum(first > 0.0) == row["slack"]


@pytest.mark.parametrize(("squares", "held"), [(1.0, True), (9.0, False), (0.1, False)])
def test_deviations_may_be_too_small_or_too_large(squares, held):
    image = {"pose": "exact", "slack": 4, "taut": 4, "unseen": 0, "squares": squares,
             "largest_sigmas": 4.0}  # fmt: skip
    verdicts, words = spread(pd.DataFrame([image, image]))
    assert verdicts == [held]
    assert "of the 2 images" in words
