"""Makes the gallery: runs each command, and writes its picture and docs/gallery.md.

    python -m docs.gallery FOLDER     commands run in FOLDER; results that are there are taken
    python -m docs.gallery --check    exit code 1 where page and pictures do not agree

Needs Chromium, chromedriver, Selenium and Pillow.
"""

from __future__ import annotations

import argparse
import io
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "images" / "gallery"
PAGE = ROOT / "docs" / "gallery.md"

LARGEST = 400_000
"""No picture has more bytes than this."""

WIDTH = 960
"""Widest picture [px]."""

WINDOW = (1280, 860)
"""Of the browser that shows pages [px]."""

MENU = "document.querySelectorAll('.dg')"
"""Meshcat's own menu, which covers a corner of the scene."""

FRAMES = 24
"""Of an animation."""

FRAME_TIME = 160
"""Of each frame but the last [ms]."""

LAST_TIME = 1600
"""Of the last frame, before the animation begins again [ms]."""

SETTLED = 6.0
"""A scene is drawn in software and smoothly turned to its place; it takes this long at most [s]."""


@dataclass(frozen=True)
class Item:
    """A picture of the gallery.

    Attributes:
        name: Of its file, without ending.
        title: What is seen, in a few words.
        command: What makes it.
        shown: Below the working folder: a figure, or a page.
        moves: Whether the page is a replay to be recorded, and no picture.
        words: A sentence or two below the picture.
    """

    name: str
    title: str
    command: str
    shown: str
    words: str
    moves: bool = False


ITEMS = (
    Item(
        "servo", "Visual servoing", "cdpr simulate --out servo", "servo/replay.html",
        "ACROBOT drives its platform until the camera sees the tag where it should be. The folder "
        "has this replay, which opens in a browser without a network.",
        moves=True,
    ),
    Item(
        "pick_and_place", "Pick and place", "cdpr simulate acrobot_pick_and_place --out pick",
        "pick/replay.html",
        "The robot finds a box, takes it, and puts it down at a tag.", moves=True,
    ),
    Item(
        "image_path", "What the camera sees", "cdpr simulate --out servo", "servo/image_path.png",
        "The tag's centre in the image, from start to goal, and how far it is from a straight "
        "line.",
    ),
    Item(
        "tensions", "Tensions of a run", "cdpr simulate --out servo", "servo/tensions.png",
        "Tensions with their bounds. A bar marks the time while a cable is slack.",
    ),
    Item(
        "polygon", "Methods of tension distribution",
        "cdpr tension acrobot_large --pose 0.35,-0.27,0.45 --method all --plot polygon.png",
        "polygon.png",
        "All tensions that hold the platform are a polygon. Each method chooses a point of it.",
    ),
    Item(
        "workspace", "Where a robot can work", "cdpr workspace acrobot_large --out where",
        "where/workspace.html",
        "Poses at which tensions within the bounds hold the platform.",
    ),
    Item(
        "boxes", "A proven workspace",
        "cdpr workspace acrobot_large --kind static --certify --out proven", "proven/boxes.png",
        "Interval analysis proves every pose of a box inside, or outside.",
    ),
    Item(
        "stability", "Where a servo is stable",
        "cdpr stability acrobot_large --scheme pbvs --out stable", "stable/solids.png",
        "The servo converges there although its model of the robot is wrong.",
    ),
    Item(
        "path", "The fastest motion along a path",
        'cdpr plan acrobot_large --waypoints "-0.2,-0.1,0.2; 0,0.15,0.4; 0.2,-0.1,0.2"'
        " --limits 1,60 --out plan",
        "plan/path.png",
        "The plan keeps the limits of tensions and winches, and the simulated robot follows it.",
    ),
    Item(
        "caroca", "A robot in the browser", "cdpr view caroca --html caroca.html", "caroca.html",
        "Every robot, also one of your own, as a page that you can turn and send.",
    ),
    Item(
        "robots", "Robots of the package", "cdpr robots --gallery robots.html", "robots.html",
        "Robots from papers and machines, drawn to scale.",
    ),
)  # fmt: skip


def main(given: Sequence[str] | None = None) -> int:
    """Makes pictures and page, or checks them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="where commands run")
    parser.add_argument("--only", default="", help="names of pictures, with commas")
    parser.add_argument("--check", action="store_true", help="make nothing")
    options = parser.parse_args(given)
    if options.check:
        problems = list(found_problems())
        print("\n".join(problems) or "gallery: page and pictures agree")
        return 1 if problems else 0
    if options.folder is None:
        parser.error("found no folder; accepted: one where commands run, or --check")
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    PICTURES.mkdir(exist_ok=True)
    wanted = options.only.split(",") if options.only else [item.name for item in ITEMS]
    for item in ITEMS:
        if item.name in wanted:
            make(item, folder)
            print(f"{item.name}: {picture(item).stat().st_size / 1000:.0f} kB", flush=True)
    PAGE.write_text(page(), encoding="utf-8")
    return 0


def picture(item: Item) -> Path:
    """Its file."""
    return PICTURES / f"{item.name}.webp"


def make(item: Item, folder: Path) -> None:
    """Runs the command unless its result is there, and writes the picture."""
    shown = folder / item.shown
    if not shown.is_file():
        program = [str(Path(sys.executable).parent / "cdpr"), *shlex.split(item.command)[1:]]
        subprocess.run(program, cwd=folder, check=True)
    if shown.suffix != ".html":
        write([Image.open(shown).convert("RGB")], picture(item))
        return
    with open_page(shown) as browser:
        write(list(frames(browser)) if item.moves else [look(browser)], picture(item))


def open_page(path: Path) -> Any:
    """A browser with a page, once its scene stands still."""
    from contextlib import contextmanager

    from tests.chromium import chromium

    @contextmanager
    def opened() -> Iterator[Any]:
        with tempfile.TemporaryDirectory() as profile, chromium(Path(profile), WINDOW) as browser:
            browser.get(path.as_uri() + "#t=0")
            time.sleep(SETTLED)
            browser.execute_script(f"for (const e of {MENU}) e.style.display = 'none'")
            yield browser

    return opened()


def look(browser: Any) -> Image.Image:
    """What a page shows."""
    return Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")


def frames(browser: Any) -> Iterator[Image.Image]:
    """A replay from start to end; its own time axis is moved."""
    for k in range(FRAMES):
        browser.execute_async_script(
            "const axis = document.getElementById('cdpr-axis'), done = arguments[1];"
            "const from = Number(axis.min), to = Number(axis.max);"
            "axis.value = from + arguments[0] * (to - from);"
            "axis.dispatchEvent(new Event('input'));"
            "requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 100)));",
            k / (FRAMES - 1),
        )
        yield look(browser)


def write(images: Sequence[Image.Image], path: Path) -> None:
    """Writes a picture or an animation of at most `LARGEST` bytes, with the best quality for it.

    Raises:
        ValueError: The lowest quality is still too large.
    """
    scale = min(WIDTH / images[0].width, 1.0)
    size = (round(images[0].width * scale), round(images[0].height * scale))
    small = [image.resize(size, Image.Resampling.LANCZOS) for image in images]
    times = [FRAME_TIME] * (len(small) - 1) + [LAST_TIME]
    for quality in (85, 70, 55, 40, 25):
        kept = io.BytesIO()
        more = {"save_all": True, "append_images": small[1:], "duration": times, "loop": 0}
        small[0].save(kept, "WEBP", quality=quality, method=6, **(more if len(small) > 1 else {}))
        if kept.tell() <= LARGEST:
            path.write_bytes(kept.getvalue())
            return
    raise ValueError(f"{path}: found {kept.tell()} bytes; accepted: up to {LARGEST}")


def page() -> str:
    """The page: each picture with the command that makes it."""
    out = [
        "# Gallery\n\nEach picture is followed by the command that makes it. "
        "Colours of cables and limits are explained in [the command](guides/command.md).\n"
    ]
    for item in ITEMS:
        out.append(f"\n## {item.title}\n\n![{item.title}](images/gallery/{item.name}.webp)\n")
        out.append(f"\n{item.words}\n\n```text\n{item.command}\n```\n")
    return "".join(out)


def found_problems() -> Iterator[str]:
    """What is wrong with page and pictures."""
    if not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page():
        yield f"{PAGE.name}: is not what `python -m docs.gallery` writes"
    known = {picture(item) for item in ITEMS}
    for path in sorted({*PICTURES.glob("*"), *known}):
        if path not in known:
            yield f"{path.name}: found a picture of no item"
        elif not path.is_file():
            yield f"{path.name}: is not there"
        elif path.stat().st_size > LARGEST:
            yield f"{path.name}: found {path.stat().st_size} bytes; accepted: up to {LARGEST}"


if __name__ == "__main__":
    sys.exit(main())
