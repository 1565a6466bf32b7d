"""What axe-core finds wrong with a page: names, roles, contrast, keyboard."""

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

RUN = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations'], iframes: false}).then(found => done(
    found.violations.flatMap(rule => rule.nodes
        .filter(node => ['serious', 'critical'].includes(node.impact))
        .map(node => `${rule.id}: ${node.target.join(' ')}: ${node.html.slice(0, 160)}`))),
    problem => done(['axe failed: ' + problem]));
"""
"""Drake's scene in its frame is Meshcat's page, not ours."""


def axe_file():
    """axe.min.js, named by `AXE_FILE` or of axe-core-python; without one the test is skipped."""
    if "AXE_FILE" in os.environ:
        return Path(os.environ["AXE_FILE"])
    if (found := find_spec("axe_core_python")) is None:
        pytest.skip("axe-core-python is not installed (pip install '.[test]')")
    return Path(found.origin).with_name("axe.min.js")


def grave(page):
    """What is serious or critical in a page as it is shown now, one line each."""
    if not page.execute_script("return typeof axe !== 'undefined'"):
        page.execute_script(axe_file().read_text(encoding="utf-8"))
    return page.execute_async_script(RUN)
