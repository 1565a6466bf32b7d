import pytest

from cdpr_drake.analyses.queries.figures import static_figure
from cdpr_drake.analyses.queries.static_query import at_pose
from cdpr_drake.models import load_robot


@pytest.mark.parametrize("model", ["elastic", "catenary", "inextensible"])
def test_figure(model):
    report = at_pose(load_robot("planar"), load_robot("planar").home.transform(), model, True)
    figure = static_figure(report, "title")
    side, above, tensions, _ = figure.axes
    assert side.get_xlabel() == "x [m]"
    assert above.get_ylabel() == "y [m]"
    assert len(tensions.patches) == 4
