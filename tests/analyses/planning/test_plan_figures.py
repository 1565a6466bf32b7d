"""The phase plane of a plan, of numbers that are made up."""

from types import SimpleNamespace

import numpy as np

from cdpr_drake.analyses.planning.path_plan import phase_figure
from cdpr_drake.models.robot_loader import load_robot
from tests.figure_faults import figure_faults


def test_what_the_end_can_be_reached_from_is_seen_where_it_is_the_largest_speed():
    s = np.linspace(0.0, 1.0, 51)
    largest = 1.0 + 0.3 * np.cos(9.0 * s)
    plan = SimpleNamespace(
        trajectory=SimpleNamespace(stations=s), largest=largest,
        reachable=np.column_stack([0.0 * s, np.minimum(largest, 4.0 * (1.0 - s))]),
    )  # fmt: skip
    samples = SimpleNamespace(
        parameters=s, speeds=np.sqrt(np.minimum(0.9 * largest, 4.0 * s * (1.0 - s))),
        active=lambda: {"torque": np.repeat(s[:, None] > 0.5, 8, axis=1)},
    )  # fmt: skip
    run = SimpleNamespace(
        solution=plan, samples=samples, robot=load_robot("acrobot_large"), title="made up"
    )
    figure = phase_figure(run)
    assert figure_faults(figure) == []
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    wide = lines["largest from which the end can be reached"]
    for label in ("largest at this point by itself", "plan"):
        assert wide.get_linewidth() > 2.0 * lines[label].get_linewidth()
        assert figure.axes[0].lines.index(lines[label]) > figure.axes[0].lines.index(wide)
