"""Processor time from `cdpr studio` to its address, to its page, and to what is loaded behind it.

`python -m tests.studio.measure_start`

The page is asked for as a browser does, with the token, as soon as the address is printed; without
a browser, whose own time is not the studio's. Counted is the processor time of the studio's
process; what it starts in further threads is part of that. Printed as JSON, median and largest.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from pathlib import Path
from urllib.request import HTTPCookieProcessor, build_opener

from tests.studio.served import served

QUIET = 0.5
"""Where the process took less than `IDLE` for so long, all is loaded [s]."""

IDLE = 0.03
"""Processor time that a server without a page takes in `QUIET` [s]."""

LONGEST = 120.0
"""Until all is loaded [s]."""


def processor_time(pid: int) -> float:
    """Of a process and its threads [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start_times(folder: Path) -> dict[str, float]:
    """Of one start: processor time to each stage, and the page's size."""
    with served(folder) as (address, process):
        found = {"to_address_s": processor_time(process.pid)}
        browser = build_opener(HTTPCookieProcessor())
        browser.open(address, timeout=LONGEST).close()  # the cookie
        with browser.open(address.partition("?")[0], timeout=LONGEST) as answer:
            found["page_kb"] = len(answer.read()) / 1e3
        found["to_page_s"] = processor_time(process.pid)
        end, before = time.monotonic() + LONGEST, -1.0
        while time.monotonic() < end:
            now = processor_time(process.pid)
            if now - before < IDLE:
                break
            before = now
            time.sleep(QUIET)
        found["to_rest_s"] = before
    return found


def main() -> None:
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--starts", type=int, default=5)
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        starts = [start_times(Path(folder)) for _ in range(asked.starts)]
    told = {
        name: {"median": statistics.median(values), "largest": max(values)}
        for name in starts[0]
        for values in [[one[name] for one in starts]]
    }
    print(json.dumps({"starts": asked.starts} | told, indent=2))


if __name__ == "__main__":
    main()
