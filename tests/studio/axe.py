"""What axe-core finds wrong with a page: names, roles, contrast, keyboard.

The file comes from the package axe-core-python (extra `test`), which has nothing else that is used
here. `AXE_FILE` names another axe.min.js.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import Any

import pytest

GRAVE = ("serious", "critical")
"""Impacts that count as faults."""

RUN = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations'], iframes: false}).then(found => done(
    found.violations.flatMap(rule => rule.nodes.map(node => ({
        rule: rule.id, impact: node.impact, target: node.target.join(' '), html: node.html,
        why: node.failureSummary})))),
    problem => done([{rule: 'axe failed', impact: 'critical', target: '', html: '',
                      why: String(problem)}]));
"""
"""Drake's scene in its frame is Meshcat's page, not ours."""


def axe_file() -> Path:
    """Where axe.min.js is; without one the test is skipped, with the reason."""
    if "AXE_FILE" in os.environ:
        return Path(os.environ["AXE_FILE"])
    found = importlib.util.find_spec("axe_core_python")
    if found is None or found.origin is None:
        pytest.skip("axe-core-python is not installed (pip install '.[test]')")
    return Path(found.origin).with_name("axe.min.js")


def findings(page: Any) -> list[dict[str, str]]:
    """All that axe finds in a page as it is shown now, by element."""
    if not page.execute_script("return typeof axe !== 'undefined'"):
        page.execute_script(axe_file().read_text(encoding="utf-8"))
    return list(page.execute_async_script(RUN))


def grave(page: Any) -> list[str]:
    """What is serious or critical, one line each; empty is what is wanted."""
    return [
        f"{one['rule']}: {one['target']}: {one['html'][:160]}"
        for one in findings(page)
        if one["impact"] in GRAVE
    ]
