import pytest


@pytest.fixture
def write(tmp_path):
    """Writes a text, with its own line ends."""

    def written(name, text):
        (tmp_path / name).write_text(text, encoding="utf-8", newline="")
        return tmp_path / name

    return written
