"""Processor time from `cdpr studio` to its address, to its page, and to what comes behind it.

`python -m tests.studio.measure_start`

Counted is the time of the studio's process with its threads, also that of Python's start. The page
is asked for as a browser asks, as soon as the address is printed. Then, in Chromium, whose own time
is not counted, until all panels have been loaded and the tensions at the pose are in the page.
Printed as JSON, median and largest.
"""

import argparse
import json
import os
import statistics
import tempfile
from pathlib import Path

import httpx

from tests.chromium import chromium, wait_for
from tests.studio.run_page import text_of
from tests.studio.served import served


def processor_time(pid):
    """Of a process and its threads [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start_times(folder):
    """Of one start: processor time to each stage, and the page's size."""
    with served(folder) as (address, process), httpx.Client(timeout=120.0) as client:
        told = {"to_address_s": processor_time(process.pid)}
        client.get(address)  # it gives the cookie
        told["page_kb"] = len(client.get(address.partition("?")[0]).content) / 1e3
        told["to_page_s"] = processor_time(process.pid)
        with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
            page.get(address)
            wait_for(page, f"{text_of('.studio-live')}.includes('limits')")
            told["to_tensions_s"] = processor_time(process.pid)
    return told


def main():
    """Measures, and prints JSON."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--starts", type=int, default=5)
    count = options.parse_args().starts
    with tempfile.TemporaryDirectory() as folder:
        starts = [start_times(folder) for _ in range(count)]
    told = {"starts": count}
    for name in starts[0]:
        values = [one[name] for one in starts]
        told[name] = {"median": statistics.median(values), "largest": max(values)}
    print(json.dumps(told, indent=2))


if __name__ == "__main__":
    main()
