"""The studio as a user starts it: `cdpr studio` in a process of its own."""

import os
import select
import subprocess
import sys
import time
from contextlib import contextmanager

LONGEST_START = 600.0
"""Until the address is printed [s]; Drake is imported before."""


@contextmanager
def served(folder, *arguments, program=("-m", "cdpr_drake", "studio")):
    """The address of a studio that works in a folder, and its process."""
    words = [sys.executable, *program, *arguments, "--folder", str(folder),
             "--port", "0", "--no-browser"]  # fmt: skip
    # Else NiceGUI takes the port of its own tests.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )
    try:
        yield _address(process), process
    finally:
        process.terminate()
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def _address(process):
    said, end = "", time.monotonic() + LONGEST_START
    while time.monotonic() < end and process.poll() is None:
        if not select.select([process.stdout], [], [], 0.2)[0]:
            continue
        line = process.stdout.readline()
        if line.startswith("cdpr studio at "):
            return line.split()[3]
        said += line
    raise AssertionError(f"the studio did not start: {said}")
