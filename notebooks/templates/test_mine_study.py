"""The study `mine` confirms what it states, and writes it where it is told."""

from mine import STUDY

import cdpr_drake as cdpr


def test_what_it_states_holds():
    told = cdpr.run_study(STUDY, quick=True, workers=1).as_dict()
    assert [each["verdict"] for each in told["statements"]] == ["confirmed"]
    assert all(row["largest_n"] > 0.0 for row in told["runs"])


def test_it_writes_table_and_figure(tmp_path):
    folder = cdpr.run_study(STUDY, tmp_path / "out", quick=True, workers=1).folder
    assert (folder / "results.json").is_file()
    assert (folder / "tensions.png").is_file()
