"""Puts every figure of every command on one page, in colour and in grey.

    python -m docs.contact_sheet FOLDER            runs COMMANDS there; results that are there stay
    python -m docs.contact_sheet FOLDER --no-run   shows the figures that are found below FOLDER

The page is FOLDER/contact_sheet.html, and FOLDER/contact_sheet/NN.png are the same as pictures. It
is for looking: a line that grey does not show, labels that meet, a legend without units.
"""

from __future__ import annotations

import argparse
import base64
import html
import io
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from PIL import Image, ImageDraw

COMMANDS = (
    "cdpr simulate --camera projected --out servo",
    "cdpr simulate acrobot_pick_and_place --camera projected --out pick",
    "cdpr simulate caroca_computed_torque --out torque",
    "cdpr simulate acrobot_slack_start_tca --camera projected --out slack",
    "cdpr simulate acrobot_broken_cable --out broken",
    "cdpr simulate acrobot_table_edge --out edge",
    "cdpr simulate acrobot_adaptation --camera projected --out adaptation",
    "cdpr simulate acrobot_pbvs --camera projected --seeds 0:20 --out seeds",
    "cdpr simulate cable_arm_computed_torque --out mechanism",
    "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all --plot tension.png",
    "cdpr static caroca --plot static.png",
    "cdpr workspace acrobot_large --out workspace",
    "cdpr workspace acrobot_large --kind static --measure capacity-margin --out measure",
    "cdpr workspace acrobot_large --kind static --certify --out boxes",
    "cdpr stability acrobot_large --scheme pbvs --out stability",
    'cdpr plan acrobot_large --waypoints "0,0,0.2; 0.1,-0.1,0.3" --limits 1,60 --out plan',
    "cdpr plan acrobot_large --proven --from 0,0,0.2 --to 0.2,0.1,0.3 --out proven",
    "cdpr design acrobot_large --goal static --quick --out design",
    "cdpr calibrate-campaign acrobot_sensors --out calibrate",
    "cdpr study tension-methods --quick --out study",
)  # fmt: skip
"""Each writes figures; a command that does not end well is named on the page."""

WIDTH = 620
"""Of a figure on the sheet, once in colour and once in grey beside it [px]."""

ROWS = 4
"""Figures on one picture."""

MARGIN = 24
"""For the name above a figure [px]."""


def main(given: Sequence[str] | None = None) -> int:
    """Runs the commands, unless told not to, and writes the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--no-run", action="store_true", help="only show what is there")
    options = parser.parse_args(given)
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    failed = [] if options.no_run else run(folder)
    shown = figures(folder)
    if not shown:
        parser.error(f"{folder}: found no figures; accepted: a folder with .png files below it")
    write_page(folder, shown, failed)
    write_pictures(folder / "contact_sheet", folder, shown)
    print(f"{len(shown)} figures: {folder / 'contact_sheet.html'}")
    return 1 if failed else 0


def run(folder: Path) -> list[str]:
    """Runs each command whose result is not there; what failed, with its last line."""
    failed = []
    for command in COMMANDS:
        words = shlex.split(command)
        kept = folder / words[-1]
        if kept.exists():
            continue
        began = time.monotonic()
        program = [str(Path(sys.executable).parent / "cdpr"), *words[1:]]
        ended = subprocess.run(program, cwd=folder, capture_output=True, text=True)
        print(f"{ended.returncode} {time.monotonic() - began:6.1f} s  {command}", flush=True)
        if ended.returncode:
            last = (ended.stderr.strip().splitlines() or [""])[-1]
            failed.append(f"{command}: exit code {ended.returncode}: {last}")
    return failed


def figures(folder: Path) -> list[Path]:
    """Every figure below a folder, but sheets."""
    sheets = folder / "contact_sheet"
    return [path for path in sorted(folder.rglob("*.png")) if sheets not in path.parents]


def in_both(path: Path) -> tuple[Image.Image, Image.Image]:
    """A figure as wide as the sheet's column, in colour and in grey."""
    with Image.open(path) as opened:
        image = opened.convert("RGB")
    size = (WIDTH, max(round(image.height * WIDTH / image.width), 1))
    small = image.resize(size, Image.Resampling.LANCZOS)
    return small, small.convert("L").convert("RGB")


def write_page(folder: Path, shown: Sequence[Path], failed: Sequence[str]) -> None:
    """The page, with all pictures in it."""
    rows = "".join(
        f"<h2>{html.escape(str(path.relative_to(folder)))}</h2>"
        + "".join(f'<img alt="" src="{address}">' for address in addresses(path))
        for path in shown
    )
    problems = "".join(f"<li>{html.escape(line)}</li>" for line in failed)
    (folder / "contact_sheet.html").write_text(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>Figures</title>"
        "<style>body{font:14px sans-serif}h2{font-size:14px}img{margin-right:8px}</style>"
        f"<h1>{len(shown)} figures, in colour and in grey</h1><ul>{problems}</ul>{rows}</html>",
        encoding="utf-8",
    )


def addresses(path: Path) -> Iterator[str]:
    """The figure's two pictures as addresses that hold them."""
    for image in in_both(path):
        kept = io.BytesIO()
        image.save(kept, "WEBP", quality=80)
        yield "data:image/webp;base64," + base64.b64encode(kept.getvalue()).decode()


def write_pictures(sheets: Path, folder: Path, shown: Sequence[Path]) -> None:
    """Sheets of `ROWS` figures each."""
    sheets.mkdir(exist_ok=True)
    for number, first in enumerate(range(0, len(shown), ROWS)):
        some = shown[first : first + ROWS]
        pairs = [in_both(path) for path in some]
        height = sum(colour.height + MARGIN for colour, _ in pairs)
        sheet = Image.new("RGB", (2 * WIDTH, height), "white")
        draw, top = ImageDraw.Draw(sheet), 0
        for path, (colour, grey) in zip(some, pairs, strict=True):
            draw.text((4, top + 6), str(path.relative_to(folder)), fill="black")
            sheet.paste(colour, (0, top + MARGIN))
            sheet.paste(grey, (WIDTH, top + MARGIN))
            top += colour.height + MARGIN
        sheet.save(sheets / f"{number:02d}.png")


if __name__ == "__main__":
    sys.exit(main())
