from itertools import pairwise

import numpy as np

from cdpr_drake.analyses.simulation import adaptation_report
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.estimators.geometry_learner import (
    ADAPTATION,
    ADAPTATION_PARTS,
    LEARNT,
    LEARNT_SIGMA,
)
from tests.figure_faults import figure_faults

APART = 0.1
"""Between a panel and the label of the next one [inch]."""


def test_no_legend_hides_numbers_that_rise_early_and_labels_are_as_long_as_axes():
    robot, time = load_robot("acrobot_small"), np.linspace(0.0, 8.0, 81)
    m = len(robot.cables)
    truth = np.append(adaptation_report.true_points(robot), np.zeros(m))
    log = {
        "time": time,
        LEARNT: truth + 0.0117 * np.exp(-time)[:, None],
        LEARNT_SIGMA: np.full((81, 7 * m), 0.01),
        ADAPTATION: np.outer(1.0 - np.exp(-3.0 * time), np.full(len(ADAPTATION_PARTS), 20.0)),
    }
    figure = adaptation_report.adaptation_figure("What was learnt", log, robot)
    assert figure_faults(figure) == []
    for row in np.reshape(figure.axes, (2, 3)):
        for axes in row:
            assert axes.yaxis.label.get_window_extent().height < axes.bbox.height
        for left, right in pairwise(row):
            begin = right.yaxis.label.get_window_extent().x0
            assert begin - left.bbox.x1 > APART * figure.dpi
