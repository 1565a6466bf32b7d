"""What is not finite does not reach a JSON file, wherever it stands."""

import json

import numpy as np

from cdpr_drake.analyses.reporting import finite, write_json


def test_lists_and_dicts_are_searched(tmp_path):
    found = finite({"a": np.inf, "runs": [{"time_s": float("inf")}, [np.nan, 1.0]], "words": "inf"})
    assert found == {"a": None, "runs": [{"time_s": None}, [None, 1.0]], "words": "inf"}
    write_json(tmp_path / "results.json", found)
    assert json.loads((tmp_path / "results.json").read_text()) == found
