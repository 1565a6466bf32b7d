"""What Drake or Python raise is one line of at most 500 characters; mistakes stay tracebacks."""

import pytest

from cdpr_drake.cli import app
from cdpr_drake.errors import CdprError
from tests.messages import printed


def raising(problem):
    def make(arguments):
        def call(**options):
            raise problem

        return call

    return make


@pytest.mark.parametrize(
    "problem",
    [
        MemoryError(),
        OverflowError("int too large to convert to float"),
        ZeroDivisionError("division by zero"),
        RuntimeError("SpatialInertia: physically invalid:\n mass = nan\n and more"),
        RecursionError("maximum recursion depth exceeded"),
        CdprError("long " * 4000),
        OSError(28, "No space left on device"),
    ],
    ids=lambda problem: type(problem).__name__,
)
def test_errors_are_one_line(problem, monkeypatch, capsys):
    monkeypatch.delenv(app.TRACEBACK, raising=False)
    monkeypatch.setattr(app, "make_app", raising(problem))
    with pytest.raises(SystemExit) as ended:
        app.main(["robots"])
    error = printed(capsys).err
    assert ended.value.code == 2
    assert len(error.splitlines()) == 1
    assert len(error.strip()) <= 500
    assert error.startswith("cdpr: ")


def test_a_variable_lets_them_through(monkeypatch):
    monkeypatch.setenv(app.TRACEBACK, "1")
    monkeypatch.setattr(app, "make_app", raising(RuntimeError("from Drake")))
    with pytest.raises(RuntimeError, match="from Drake"):
        app.main(["robots"])


@pytest.mark.parametrize("mistake", [KeyError("name"), AssertionError()])
def test_mistakes_of_this_program_can_be_found(mistake, monkeypatch):
    monkeypatch.delenv(app.TRACEBACK, raising=False)
    monkeypatch.setattr(app, "make_app", raising(mistake))
    with pytest.raises(type(mistake)):
        app.main(["robots"])
