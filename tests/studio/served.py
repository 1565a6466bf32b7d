"""The studio as a user starts it: `cdpr studio` in a process of its own."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from threading import Thread

LONGEST_START = 600.0
"""Until the address is printed [s]; Drake is imported before."""


@contextmanager
def served(folder, *arguments, program=("-m", "cdpr_drake", "studio")):
    """The address of a studio that works in a folder, its process, with what it has `said`."""
    words = [sys.executable, *program, *arguments, "--folder", str(folder), "--port", "0",
             "--no-browser"]  # fmt: skip
    # Else NiceGUI takes the port of its own tests.
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    )
    process.said = []
    reader = Thread(target=lambda: [process.said.append(line) for line in process.stdout])
    reader.start()  # or the server would wait, once the pipe is full
    try:
        yield _address(process), process
    finally:
        process.terminate()
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join()
        process.stdout.close()


def _address(process):
    end = time.monotonic() + LONGEST_START
    while time.monotonic() < end and process.poll() is None:
        for line in list(process.said):
            if line.startswith("cdpr studio at "):
                return line.split()[3]
        time.sleep(0.05)
    raise AssertionError(f"the studio did not start: {''.join(process.said)}")
