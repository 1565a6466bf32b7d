"""Files appear whole or not at all, and follow no link."""

import os

import pytest

from cdpr_drake.analyses.reporting.log_files import write_whole
from cdpr_drake.analyses.reporting.written_files import whole_file


def test_a_file_in_the_making_follows_no_link(tmp_path):
    """Links in a folder that others may write to, by all names that could be foreseen."""
    victim = tmp_path / "victim"
    victim.write_text("years of work")
    folder = tmp_path / "out"
    folder.mkdir()
    for link in (".part-a.json", ".part-abcdefgh-a.json", ".a.json.part"):
        (folder / link).symlink_to(victim)
    parts = set()
    for _ in range(3):
        with whole_file(folder / "a.json") as part:
            parts.add(part.name)
            assert part.stat().st_size == 0
            part.write_text("new")
    assert victim.read_text() == "years of work"
    assert len(parts) == 3


def test_what_ends_before_the_file_is_whole_leaves_the_old_one(tmp_path):
    def interrupted():
        with whole_file(tmp_path / "a.csv") as part:
            part.write_text("half")
            raise KeyboardInterrupt

    write_whole(tmp_path / "a.csv", "1")
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert os.listdir(tmp_path) == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == "1"


def test_files_get_the_rights_that_others_get(tmp_path):
    write_whole(tmp_path / "a.csv", "1")
    (tmp_path / "b.csv").write_text("1")
    assert (tmp_path / "a.csv").stat().st_mode == (tmp_path / "b.csv").stat().st_mode
