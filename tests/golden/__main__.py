"""Makes golden files, or compares them with what there is now.

    python -m tests.golden make FOLDER [--only studies/case-1,problems] [--again]
    python -m tests.golden compare FOLDER [--only ...] [--again] [--now OTHER]

`make` takes what is finished as it is, unless --again. `compare` makes the same files with the
present code in FOLDER/now, or in OTHER, and goes on there; what other code made there is made
again. Both can be stopped at any time. Exit code 1: something differs, is missing, or failed.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from tests.golden.comparison import Difference, compare_files, largest_relative
from tests.golden.making import Item, all_items, answer_batch, code_state, made_by, make_item
from tests.golden.questions import INPUTS

MOST_SHOWN = 40
"""Differences of one file that are printed, unless --all."""


def chosen(items: list[Item], only: str | None) -> list[Item]:
    """Items whose name is asked for, or begins with what is asked for and a slash.

    Raises:
        SystemExit: A word chooses nothing.
    """
    if only is None:
        return items
    found: list[Item] = []
    for word in only.split(","):
        more = [
            item for item in items
            if item.file.removesuffix(".json") == word or item.file.startswith(f"{word}/")
        ]  # fmt: skip
        if not more:
            names = ", ".join(item.file.removesuffix(".json") for item in items)
            raise SystemExit(f"--only: found {word!r}; accepted: {names}, or their folders")
        found += [item for item in more if item not in found]
    return found


def make(items: list[Item], folder: Path, again: bool, only_this_code: bool) -> int:
    """Makes what is not finished; returns how many could not be made."""
    state, failed = code_state(), 0
    for number, item in enumerate(items):
        before = made_by(folder / item.file)
        where = f"[{number + 1}/{len(items)}] {item.file}"
        if before is not None and not again and (before == state or not only_this_code):
            print(f"{where}: kept" + ("" if before == state else ", made by other code"))
            continue
        began = time.monotonic()
        why = make_item(item, folder, state)
        failed += why is not None
        words = f"{time.monotonic() - began:.0f} s" if why is None else f"FAILED: {why}"
        print(f"{where}: {words}", flush=True)
    return failed


def compare(names: list[str], folder: Path, now: Path, show_all: bool) -> int:
    """Prints all differences; returns their number."""
    every: list[Difference] = []
    for name in names:
        found = compare_files(name, folder / name, now / name)
        every += found
        for one in found if show_all else found[:MOST_SHOWN]:
            print(one)
        if len(found) > MOST_SHOWN and not show_all:
            print(f"{name}: {len(found) - MOST_SHOWN} more differences; --all prints them")
    files = len({one.file for one in every})
    share = largest_relative(every)
    words = "" if share is None else f"; largest relative difference {share:.3e}"
    print(f"{len(names)} files compared, {len(every)} differences in {files} of them{words}")
    return len(every)


def main() -> int:
    """Makes or compares; returns the exit code."""
    if sys.argv[1:2] == ["batch"]:
        answer_batch(Path(sys.argv[2]), int(sys.argv[3]))
        return 0
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("task", choices=("make", "compare"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", help="names such as studies/case-1, or folders such as problems")
    parser.add_argument("--again", action="store_true", help="make again what is finished")
    parser.add_argument("--now", type=Path, help="where compare makes the present results")
    parser.add_argument("--all", action="store_true", help="print every difference")
    given = parser.parse_args()
    folder = given.folder.absolute()
    if given.task == "compare" and not folder.is_dir():
        parser.error(f"{folder}: there is no such folder; accepted: one that make wrote")
    now = folder if given.task == "make" else (given.now or folder / "now").absolute()
    now.mkdir(parents=True, exist_ok=True)
    items = chosen(all_items(folder / INPUTS), given.only)
    failed = make(items, now, given.again, only_this_code=given.task == "compare")
    print(f"{len(items)} golden files, {failed} failed")
    if given.task == "make":
        return 1 if failed else 0
    names = [item.file for item in items]
    if given.only is None:  # what the present code does not know any more
        kept = [
            p
            for part in sorted({item.file.split("/")[0] for item in items})
            for p in folder.glob(f"{part}/*")
        ]
        names += sorted({str(p.relative_to(folder)) for p in kept} - set(names))
    return 1 if compare(names, folder, now, given.all) or failed else 0


if __name__ == "__main__":
    sys.exit(main())
