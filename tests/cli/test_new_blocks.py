"""`cdpr new controller`, `estimator`, `study`: what they write runs, and its own test passes."""

import sys
from importlib import import_module
from inspect import signature

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from tests.messages import printed


def new(capsys, *words):
    with pytest.raises(SystemExit) as ended:
        main(["new", *words])
    return ended.value.code, printed(capsys)


@pytest.mark.parametrize("kind", ["controller", "estimator", "study"])
def test_a_new_block_passes_its_own_test(kind, tmp_path, capsys, monkeypatch):
    code, (out, _) = new(capsys, kind, "own_block", "--out", str(tmp_path))
    assert code == 0
    assert out.split() == [str(tmp_path / f"{name}.py") for name in ("own_block", "test_own_block")]
    for name in ("own_block", "test_own_block"):
        words = (tmp_path / f"{name}.py").read_text().lower()
        assert "mine" not in words
        assert "own_block" in words
    monkeypatch.syspath_prepend(tmp_path)
    before = dict(ESTIMATORS)
    try:  # here, since a process of its own would import Drake again
        tests = vars(import_module("test_own_block"))
        checks = [tests[name] for name in tests if name.startswith("test_")]
        assert checks
        for check in checks:
            check(**dict.fromkeys(signature(check).parameters, tmp_path))
    finally:
        ESTIMATORS.clear()
        ESTIMATORS.update(before)
        for name in ("own_block", "test_own_block"):
            sys.modules.pop(name, None)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["controler", "x"],
            "'controler' is unknown; did you mean controller? known: robot, scenario",
        ),
        (["controller", "My-Law"], "name: found 'My-Law'; accepted: the name of a Python module"),
        (["controller", "numpy"], "name: found 'numpy', an installed module"),
        (["estimator", "json"], "name: found 'json', an installed module"),
        (["estimator", "class"], "name: found 'class'; accepted: the name of a Python module"),
        (["estimator", "x", "--from", "planar"], "--from: found planar with estimator"),
    ],
)
def test_what_is_no_block_is_refused_in_one_line(words, said, tmp_path, capsys):
    code, (_, err) = new(capsys, *words, "--out", str(tmp_path))
    assert code == 2
    assert said in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [["controller", "law"], ["robot", "law"]])
def test_a_file_in_the_place_of_the_folder_is_named(words, tmp_path, capsys):
    file = tmp_path / "taken"
    file.write_text("mine")
    code, (_, err) = new(capsys, *words, "--out", str(file), "--overwrite")
    assert code == 2
    assert err == f"cdpr: {file}: found a file; accepted: a folder\n"
    assert file.read_text() == "mine"


def test_nothing_is_overwritten_unless_asked(tmp_path, capsys):
    (tmp_path / "law.py").write_text("mine")
    code, (_, err) = new(capsys, "controller", "law", "--out", str(tmp_path))
    assert code == 2
    assert "law.py" in err
    assert [path.name for path in tmp_path.iterdir()] == ["law.py"]
    assert new(capsys, "controller", "law", "--out", str(tmp_path), "--overwrite")[0] == 0
    assert "class Law" in (tmp_path / "law.py").read_text()
