"""How files of models are read here."""

import pytest

from cdpr_drake.models import drake_parsing


@pytest.fixture
def in_this_process(monkeypatch):
    """Drake reads at once; `test_drake_parsing` has what must be tried in another process."""
    monkeypatch.setattr(drake_parsing, "try_first", lambda *_: None)
