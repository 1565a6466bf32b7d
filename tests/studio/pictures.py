"""Pictures of the studio's panels, to be looked at, and the one of its guide.

`python -m tests.studio.pictures FOLDER`, or with `--guide` the picture of docs/guides/studio.md.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from tests.chromium import chromium, wait_for
from tests.studio.served import served

SIZES = {"1280": (1280, 800, 1.0), "1920": (1920, 1080, 1.0), "phone": (390, 844, 2.0)}
GUIDE = Path(__file__).parents[2] / "docs" / "images" / "studio.png"
SETTLED = 4.0
"""Until fonts, scene and numbers are there [s]."""


def look(page: object, size: str, dark: bool) -> None:
    """Gives the page a size and a liking for dark or light."""
    width, height, scale = SIZES[size]
    page.execute_cdp_cmd(  # type: ignore[attr-defined]
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": size == "phone"},
    )
    liking = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": liking})  # type: ignore[attr-defined]


def main() -> None:
    """Writes them."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, nargs="?")
    options.add_argument("--guide", action="store_true")
    asked = options.parse_args()
    looks = [("1280", False)] if asked.guide else [(s, d) for d in (False, True) for s in SIZES]
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as (address, _):
        for size, dark in looks:
            with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as page:
                look(page, size, dark)
                page.get(address)
                wait_for(page, "document.querySelectorAll('.q-tab').length > 0")
                count = page.execute_script("return document.querySelectorAll('.q-tab').length")
                for number in range(count):
                    tab = page.find_elements("css selector", ".q-tab")[number]
                    name = tab.text.split("\n")[-1].lower()
                    tab.click()
                    time.sleep(SETTLED)
                    if asked.guide and name == "robot":
                        page.save_screenshot(str(GUIDE))
                    elif not asked.guide:
                        asked.folder.mkdir(parents=True, exist_ok=True)
                        kind = "dark" if dark else "light"
                        page.save_screenshot(str(asked.folder / f"{name}_{size}_{kind}.png"))


if __name__ == "__main__":
    main()
