"""The doctor finds what is missing and says the remedy."""

import pytest

from cdpr_drake.analyses import installation as doctor
from cdpr_drake.errors import RenderingError
from tests.cli.commands import told


def test_this_machine_is_well(capsys):
    checks = {entry["check"]: entry["passed"] for entry in told(capsys, "doctor")}
    assert all(checks.values())
    assert {"Python", "drake", "EGL", "rendered camera", "gymnasium"} <= set(checks)


def missing():
    raise RenderingError("no libEGL.so.1")


@pytest.mark.parametrize(
    ("name", "value", "check", "remedy"),
    [
        ("check_rendering", missing, lambda: doctor._egl(), "libegl1"),
        ("_RENDER_PROGRAM", "import os; os.abort()", lambda: doctor._rendering(), "projected"),
        ("GRAPHICS", "", lambda: doctor._package("no-package", "no_module"), "pip install"),
    ],
    ids=["EGL", "a crash of the renderer", "package"],
)
def test_a_check_that_fails_names_the_remedy_and_the_rest_still_run(
    monkeypatch, name, value, check, remedy
):
    monkeypatch.setattr(doctor, name, value)
    monkeypatch.setattr(doctor, "CHECKS", (check, doctor._python))
    examination = doctor.examine_installation()
    failed, python = examination.as_dict()
    assert examination.exit_code == 1
    assert not failed["passed"]
    assert remedy in failed["remedy"]
    assert (python["passed"], python["remedy"]) == (True, "")


def test_what_is_optional_and_absent_is_no_fault_but_named():
    finding = doctor._extra("no-such-package", "gym", "learning environments")
    assert finding.passed
    assert "pip install '.[gym]'" in finding.found
