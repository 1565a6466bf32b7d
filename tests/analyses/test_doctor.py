"""The doctor finds what is missing and says the remedy."""

import pytest

from cdpr_drake.analyses import installation as doctor
from cdpr_drake.errors import RenderingError
from cdpr_drake.kernel_cache.kernel_list import group_names
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.cli.commands import run, told


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


def test_the_doctor_compiles_step_by_step(capsys, monkeypatch):
    done = []
    steps = [(name, lambda name=name: done.append(name)) for name in ("one", "two")]
    monkeypatch.setattr("cdpr_drake.analyses.installation.compilation_steps", lambda: steps)
    monkeypatch.setattr("cdpr_drake.analyses.installation.default_workers", lambda: 1)
    monkeypatch.setattr("cdpr_drake.analyses.installation.compile_needed", done.append)
    found = told(capsys, "doctor", "--compile")
    assert done == [group_names(), "one", "two"]
    assert found["steps"] == [doctor.LISTED, "one", "two"]
    assert found["wall_time_s"] >= 0.0
    code, _, err = run(capsys, "doctor", "--compile")
    assert (code, "Kernels are compiled and kept" in err) == (0, True)


def test_steps_of_compilation_are_all_scenarios_and_both_engines_of_the_default():
    names = [name for name, _ in doctor.compilation_steps()]
    assert set(scenario_names()) < set(names)
    assert {"tension methods", "acrobot_pbvs, compiled engine"} < set(names)
    assert names[1] == "acrobot_pbvs"
    dict(doctor.compilation_steps())["tension methods"]()
    dict(doctor.compilation_steps())["acrobot_pbvs"]()
