"""What results say of the code that computed them."""

import re

from cdpr_drake.analyses.reporting.provenance import code_version, hash_of_sources


def test_the_code_has_a_version_and_a_hash():
    assert re.fullmatch(r"[\w.]+ [0-9a-f]{12}", code_version())


def test_the_hash_changes_with_sources_alone_and_not_with_their_place(tmp_path):
    for place in ("here", "there"):
        folder = tmp_path / place / "package"
        (folder / "cli").mkdir(parents=True)
        (folder / "a.py").write_text("a = 1")
        (folder / "robot.yaml").write_text("name: x")
        (folder / "cli" / "b.py").write_text("b = 1")
    here, there = tmp_path / "here" / "package", tmp_path / "there" / "package"
    before = hash_of_sources([here], [here / "cli"])
    assert before == hash_of_sources([there], [there / "cli"])
    assert before == hash_of_sources([here, here / "cli"], [here / "cli"])
    (here / "notes.txt").write_text("no matter")
    (here / "cli" / "b.py").write_text("b = 2")
    assert hash_of_sources([here], [here / "cli"]) == before
    assert hash_of_sources([here]) != hash_of_sources([there])
    for name, words in (("a.py", "a = 2"), ("robot.yaml", "name: y")):
        old = (here / name).read_text()
        (here / name).write_text(words)
        assert hash_of_sources([here], [here / "cli"]) != before
        (here / name).write_text(old)
    (here / "a.py").rename(here / "c.py")
    assert hash_of_sources([here], [here / "cli"]) != before
