"""A folder of its own for commands."""

import pytest


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder of its own, where the command is called."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
