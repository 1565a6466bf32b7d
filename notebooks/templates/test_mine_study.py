"""The study `mine` confirms what it states, and writes it where it is told."""

from mine import STUDY

import cdpr_drake as cdpr


def test_what_it_states_holds(tmp_path):
    result = cdpr.run_study(STUDY, tmp_path / "out", quick=True, workers=1)
    assert [fact["verdict"] for fact in result.statements] == ["confirmed"]
    assert (result.rows["largest_n"] > 0.0).all()
    assert (result.folder / "results.json").is_file()
    assert (result.folder / "tensions.png").is_file()
