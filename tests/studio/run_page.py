"""The studio's run panel in Chromium: a server in a process of its own, and what a person does."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

CHROMIUM, DRIVER = "/usr/bin/chromium", "/usr/bin/chromedriver"
LONGEST = 180.0
"""Nothing takes as long, unless it hangs [s]; kernels may have to be compiled."""


@contextmanager
def served(folder):
    """Address of a studio in a folder."""
    command = [sys.executable, "-P", "-m", "cdpr_drake", "studio", "--no-browser", "--port=0"]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    ) as server:  # fmt: skip
        try:
            yield server.stdout.readline().split()[3]
        finally:
            server.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                server.wait(30.0)
            server.kill()


@contextmanager
def browser(width=1280, height=1000):
    """A Chromium without a window; its scene is drawn by the processor."""
    options = Options()
    options.binary_location = CHROMIUM
    for word in (
        "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
        "--use-angle=swiftshader", "--enable-unsafe-swiftshader", f"--window-size={width},{height}",
    ):  # fmt: skip
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    try:
        yield driver
    finally:
        driver.quit()


class RunPage:
    """The run panel in a browser."""

    def __init__(self, driver, address):
        self.driver = driver
        driver.get(address)
        self.click(".q-tab", "Run")
        self.until(lambda: self.select("scenario"))

    def until(self, holds):
        """Waits for something to hold; returns it."""
        end = time.monotonic() + LONGEST
        while time.monotonic() < end:
            with suppress(StaleElementReferenceException, IndexError):
                found = holds()
                if found:
                    return found
            time.sleep(0.1)
        raise AssertionError(f"not within {LONGEST:g} s; the page says {self.words()}")

    def found(self, selector, words=""):
        """Elements of the page that have these words."""
        every = self.driver.find_elements(By.CSS_SELECTOR, selector)
        return [each for each in every if words in each.text]

    def click(self, selector, words=""):
        """Clicks what has these words, once it is there."""
        self.until(lambda: self.found(selector, words))[0].click()

    def select(self, label):
        """The list of a label."""
        return [
            each for each in self.found(".q-select", label)
            if each.find_element(By.CSS_SELECTOR, ".q-field__label").text == label
        ]  # fmt: skip

    def choose(self, label, option):
        """Chooses from a list, as soon as the page listens."""

        def offered():
            if not self.found(".q-menu .q-item"):
                self.select(label)[0].click()
                time.sleep(1.0)
            return [each for each in self.found(".q-menu .q-item") if each.text == option]

        self.until(offered)[0].click()
        self.until(lambda: not self.found(".q-menu .q-item"))

    def type(self, label, text):
        """Types into a field."""
        self.driver.execute_script(
            "const [label, text] = arguments;"
            "const input = [...document.querySelectorAll('input')]"
            "  .find(e => e.getAttribute('aria-label') === label);"
            "input.value = text; input.dispatchEvent(new Event('input', {bubbles: true}));",
            label, text,
        )  # fmt: skip

    def press(self, words):
        """Presses a button by its name."""
        self.driver.find_element(By.CSS_SELECTOR, f'button[aria-label="{words}"]').click()

    def words(self):
        """State, outcome, progress and problems."""
        return self.driver.execute_script(
            "return ['.cdpr-state', '.cdpr-outcome', '.cdpr-soft', '.studio-problem']"
            ".map(s => [...document.querySelectorAll(s)].map(e => e.innerText).join(' '))"
        )

    def frames(self):
        """Frames of plots that were drawn, rows that they have, and the browser's time [s]."""
        return self.driver.execute_script(
            "const data = document.querySelector('.cdpr-plots').dataset;"
            "return [Number(data.frames || 0), Number(data.rows || 0), performance.now() / 1000]"
        )
