"""Every key and every name that a page puts in backticks is there."""

import pytest

from tests.docs.names import ROOT, unknown_names

PAGES = sorted(
    [*(ROOT / "docs").rglob("*.md"), *(ROOT / f"{name}.md" for name in (
        "README", "ARCHITECTURE", "CONTRIBUTING",
    ))]
)  # fmt: skip


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_keys_and_names_are_there(page):
    assert list(unknown_names(page.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    "span",
    ["cables.surplus", "controller.lambda_3=1", "robot.cabel_set()", "geometry.CableSett",
     "distribute_batsch", "no_such_function(robot)", "CableRobott"],
)  # fmt: skip
def test_what_is_not_there_is_found(span):
    assert list(unknown_names(f"Some words, `{span}`, and more.")) == [span]


@pytest.mark.parametrize(
    "span",
    ["perturbations.slack", "controller.lambda_0=1.5", "robot.cable_set()", "geometry.CableSet",
     "distribute_batch", "cables.CABLE_MODELS", "camera.fault", "log.csv", "X_WP"],
)  # fmt: skip
def test_what_is_there_is_not(span):
    assert list(unknown_names(f"Some words, `{span}`.\n\n```python\nno.such_thing()\n```\n")) == []
