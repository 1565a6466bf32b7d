"""What tests of commands share."""

import errno
import os
from contextlib import contextmanager
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.frame.folder import Folder


@contextmanager
def only(*endings):
    """Lets runs and grids write their data and, of pictures, files with these endings."""
    write_files = Folder.write_all

    def write_all(folder, writers, *more):
        kept = {name: draw for name, draw in writers.items() if name.endswith(endings)}
        return write_files(folder, kept, *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Folder, "write_all", write_all)
        yield


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder of its own, where the command is called."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def without_pictures():
    """Where nobody looks at figures: to draw them takes longer than to compute."""
    with only(".mat", ".parquet"):
        yield


@pytest.fixture
def replay_only():
    """The replay stands for all pictures."""
    with only("replay.html"):
        yield


@pytest.fixture
def no_room_for_pictures(monkeypatch):
    """A disk that is full when pictures and pages come: each is begun and not finished."""
    write_text = Path.write_text

    def cut(path, words, **options):
        write_text(path, words[:100] if ".html" in path.name else words, **options)
        if ".html" in path.name:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def cut_figure(_, path, **options):
        Path(path).write_bytes(b"\x89PNG")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", cut)
    monkeypatch.setattr(Figure, "savefig", cut_figure)
