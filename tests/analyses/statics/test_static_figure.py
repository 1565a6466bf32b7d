import pytest

from cdpr_drake.analyses.statics.static_figures import static_figure
from cdpr_drake.analyses.statics.static_query import static_at_pose
from cdpr_drake.models.robot_loader import load_robot
from tests.figure_faults import figure_faults


@pytest.mark.parametrize("model", ["elastic", "catenary", "inextensible"])
def test_figure(model):
    report = static_at_pose(
        load_robot("planar"), load_robot("planar").home.transform(), model, True
    )
    figure = static_figure(report, "title")
    assert figure_faults(figure) == []
    side, above, tensions, *modes = figure.axes
    assert len(modes) == (model != "inextensible")  # those have no vibrations, and no panel
    assert side.get_xlabel() == "x in W [m]"
    assert above.get_ylabel() == "y in W [m]"
    assert len(tensions.patches) == 4
