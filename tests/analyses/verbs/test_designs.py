"""The verb that chooses a design."""

import json

from matplotlib.figure import Figure

import cdpr_drake as cdpr
from tests.analyses.verbs.verb_checks import one_line, shows_itself


def test_a_design(planar, tmp_path):
    found = cdpr.optimize_design(
        planar, goals="capacity-margin", folder=tmp_path / "d", generations=1
    )
    told = json.loads((tmp_path / "d" / "results.json").read_text())
    assert found.as_dict()["best"] == told["best"]
    assert (tmp_path / "d" / "designs.csv").is_file()
    again = cdpr.optimize_design("planar", goals="capacity-margin", generations=1)
    assert again.as_dict()["best"] == told["best"]
    shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.optimize_design(planar, goals="beauty"), "beauty")
    one_line(lambda: cdpr.optimize_design(planar, parameters="no.yaml"), "no.yaml")
