"""What all results and refusals of the verbs are asked."""

import ast
import inspect
import json
import re
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.result import Result
from cdpr_drake.summaries import MOST_LINES, Summarized

STUB = Path(cdpr.__file__).with_suffix(".pyi")
HOMES = {
    alias.name: node.module for node in ast.parse(STUB.read_text()).body for alias in node.names
}
"""Names of the front door, with the module of each."""


def shows_itself(result):
    """In a few lines, as text and as HTML; what a verb returned also for JSON, and as a figure."""
    if isinstance(result, Result):
        assert as_json(result)
        assert isinstance(result.plot(), Figure)
        assert re.search("<(table|p)>", result._repr_html_())
        assert " object at 0x" not in repr(result)
        return repr(result)
    if type(result) in RESULTS:
        assert as_json(result)
        assert isinstance(result.plot(), Figure)
    lines = repr(result).splitlines()
    if isinstance(result, Result):
        rows = sum(len(table.rows) for table in result.tables())
        assert result._repr_html_().count("<tr>") >= rows
        assert " object at 0x" not in repr(result)
        return repr(result)
    assert 2 <= len(lines) <= MOST_LINES
    assert " object at 0x" not in repr(result)
    assert result._repr_html_().count("<tr>") >= len(lines) - 1
    return repr(result)


def verbs():
    """Functions of the front door that answer, by name; `plot` only draws."""
    homes = {
        name: home
        for name, home in HOMES.items()
        if home.startswith("analyses.") and "studies" not in home
    }
    names = homes.keys() - {"plot"}
    return {n: getattr(cdpr, n) for n in names if inspect.isfunction(getattr(cdpr, n))}


def result_classes():
    """What the verbs return."""
    found = set()
    for verb in verbs().values():
        told = get_type_hints(verb)["return"]
        found |= {one for one in (get_args(told) or (told,)) if inspect.isclass(one)}
    return {kind for kind in found if issubclass(kind, Summarized | Result)}


RESULTS = result_classes()


def as_json(result):
    return json.loads(json.dumps(result.as_dict()))


def one_line(call, *words):
    """A call that is refused with one line that has these words."""
    with pytest.raises(cdpr.CdprError) as problem:
        call()
    assert "\n" not in str(problem.value)
    for word in words:
        assert word in str(problem.value)
