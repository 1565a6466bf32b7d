"""What is not finite does not reach a JSON file, wherever it stands."""

import json
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.log_files import finite, write_json


def test_lists_and_dicts_are_searched(tmp_path):
    found = finite({"a": np.inf, "runs": [{"time_s": float("inf")}, [np.nan, 1.0]], "words": "inf"})
    assert found == {"a": None, "runs": [{"time_s": None}, [None, 1.0]], "words": "inf"}
    write_json(tmp_path / "results.json", found)
    assert json.loads((tmp_path / "results.json").read_text()) == found


def test_a_file_that_cannot_be_written_leaves_the_one_before(tmp_path, monkeypatch):
    path = tmp_path / "results.json"
    write_json(path, {"runs": 1})

    def full(self, words, encoding):
        self.write_bytes(words[:5].encode())
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space"):
        write_json(path, {"runs": 2})
    assert json.loads(path.read_bytes()) == {"runs": 1}
    assert list(tmp_path.iterdir()) == [path]
