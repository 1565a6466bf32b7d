"""The doctor finds what is missing and says the remedy."""

from cdpr_drake.analyses import installation as doctor
from cdpr_drake.errors import RenderingError


def test_this_machine_is_well():
    findings = doctor.examine_installation().findings
    assert [f for f in findings if not f.passed] == []
    assert {"Python", "drake", "EGL", "rendered camera"} <= {f.check for f in findings}


def test_missing_egl_is_named(monkeypatch):
    def missing():
        raise RenderingError("no libEGL.so.1")

    monkeypatch.setattr(doctor, "check_rendering", missing)
    monkeypatch.setattr(doctor, "CHECKS", (doctor._egl, doctor._python))
    egl, python = doctor.examine_installation().findings
    assert not egl.passed
    assert "libegl1" in egl.remedy
    assert python.passed


def test_a_crash_of_the_renderer_is_a_finding(monkeypatch):
    monkeypatch.setattr(doctor, "_RENDER_PROGRAM", "import os; os.abort()")
    finding = doctor._rendering()
    assert not finding.passed
    assert "projected" in finding.remedy


def test_what_is_optional_and_absent_is_no_fault_but_named():
    finding = doctor._extra("no-such-package", "gym", "learning environments")
    assert finding.passed
    assert "pip install 'cdpr_drake[gym]'" in finding.found
    assert "gymnasium" in {one.check for one in doctor.examine_installation().findings}


def test_missing_package_is_named():
    finding = doctor._package("no-such-package", "no_such_module")
    assert not finding.passed
    assert "pip install" in finding.remedy
