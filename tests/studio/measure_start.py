"""Processor time from `cdpr studio` to its address, to its page, and to what comes behind it.

`python -m tests.studio.measure_start`

Counted is the time of the studio's process with its threads, also that of Python's start. The page
is asked for as a browser asks, as soon as the address is printed. Then, in Chromium, whose own time
is not counted, until all panels have been loaded and the tensions at the pose are in the page.
Printed as JSON, median and largest.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
from pathlib import Path
from urllib.request import HTTPCookieProcessor, build_opener

from tests.chromium import chromium, wait_for
from tests.studio.served import served

LONGEST = 120.0
"""Until the page is answered [s]."""

TENSIONS = "(document.querySelector('.studio-live')?.innerText ?? '').includes('limits')"
"""The tensions are in the page; they are computed when all panels are loaded."""


def processor_time(pid: int) -> float:
    """Of a process and its threads [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start_times(folder: Path) -> dict[str, float]:
    """Of one start: processor time to each stage, and the page's size."""
    with served(folder) as (address, process):
        found = {"to_address_s": processor_time(process.pid)}
        client = build_opener(HTTPCookieProcessor())
        client.open(address, timeout=LONGEST).close()  # it gives the cookie
        with client.open(address.partition("?")[0], timeout=LONGEST) as answer:
            found["page_kb"] = len(answer.read()) / 1e3
        found["to_page_s"] = processor_time(process.pid)
        with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
            page.get(address)
            wait_for(page, TENSIONS)
            found["to_tensions_s"] = processor_time(process.pid)
    return found


def main() -> None:
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--starts", type=int, default=5)
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        starts = [start_times(Path(folder)) for _ in range(asked.starts)]
    told = {}
    for name in starts[0]:
        values = [one[name] for one in starts]
        told[name] = {"median": statistics.median(values), "largest": max(values)}
    print(json.dumps({"starts": asked.starts} | told, indent=2))


if __name__ == "__main__":
    main()
