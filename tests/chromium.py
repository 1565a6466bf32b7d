"""Debian's Chromium without a window, driven by Selenium, for tests of pages."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip

LONGEST_WAIT = 300.0
"""For what a page should come to show; a loaded machine draws in software [s]."""

POLL = 0.1
"""Time between two looks [s]; Selenium's own half a second would be most of what a test takes."""

AXE = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations'], iframes: false}).then(found => done(
    found.violations.flatMap(rule => rule.nodes
        .filter(node => ['serious', 'critical'].includes(node.impact))
        .map(node => `${rule.id}: ${node.target.join(' ')}: ${node.html.slice(0, 160)}`))),
    problem => done(['axe failed: ' + problem]));
"""
"""Without what is in frames: Drake's scene is Meshcat's page, not ours."""


@contextmanager
def chromium(profile: Path, size: tuple[int, int] = (1280, 800)) -> Iterator[Any]:
    """A browser with a new profile in a folder, and a window of a size [px]; else skips the test.

    Its log of messages of pages is kept, see `complaints`.
    """
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("no chromium with chromedriver is installed (Debian: chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for argument in (*ARGUMENTS, f"--user-data-dir={profile}", "--window-size={},{}".format(*size)):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    page = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        page.set_script_timeout(LONGEST_WAIT)
        yield page
    finally:
        page.quit()


@contextmanager
def cleared(page: Any, size: tuple[int, int] = (1280, 800)) -> Iterator[Any]:
    """A browser that others have used, with an empty page, a window of a size [px], and no log.

    The page is empty afterwards, too: a scene that stayed open would be drawn, in software, sixty
    times a second beside all tests that follow.
    """
    page.get("about:blank")
    page.execute_cdp_cmd("Network.clearBrowserCookies", {})  # of all pages, not of the empty one
    page.set_window_size(*size)
    page.get_log("browser")
    try:
        yield page
    finally:
        page.get("about:blank")


def wait_for(page: Any, condition: str, patience: float = LONGEST_WAIT) -> Any:
    """Waits so long [s] until a JavaScript expression is true in a page, and returns its value."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(page, patience, POLL).until(
        lambda browser: browser.execute_script(f"return {condition}")
    )


def complaints(page: Any) -> list[str]:
    """What pages said that is an error, or wanted from a network."""
    said = [(line["level"], line["message"]) for line in page.get_log("browser")]
    return [words for level, words in said if level == "SEVERE" or "net::" in words]


def axe_file() -> Path:
    """axe.min.js, named by `AXE_FILE` or of axe-core-python; without one the test is skipped."""
    if "AXE_FILE" in os.environ:
        return Path(os.environ["AXE_FILE"])
    found = find_spec("axe_core_python")
    if found is None or found.origin is None:
        pytest.skip("axe-core-python is not installed (pip install '.[test]')")
    return Path(found.origin).with_name("axe.min.js")


def grave(page: Any) -> list[str]:
    """What axe-core finds serious or critical in a page as it is shown now, one line each."""
    if not page.execute_script("return typeof axe !== 'undefined'"):
        page.execute_script(axe_file().read_text(encoding="utf-8"))
    return page.execute_async_script(AXE)
