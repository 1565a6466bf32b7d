"""What is wrong with a built site: `python -m tests.docs.built_site FOLDER`; exit code 1, if so.

Pages are read as they stand on the disk, and searched in Chromium as they open from it. Some that
stand for all are asked axe about, light and dark.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from fontTools.ttLib import TTFont

from tests.chromium import LONGEST_WAIT, chromium, grave, wait_for
from tests.docs.make_equations_font import FONT

UNREAD = ("code", "pre", "script", "style", "math", "textarea", "svg", "noscript")
"""Elements whose text is no prose."""

WITHOUT_END = ("area", "br", "col", "hr", "img", "input", "link", "meta", "source", "wbr")

RAW = {
    "language of a code span": re.compile(r"#!\w+"),
    "LaTeX": re.compile(r"\\[a-zA-Z]{2,}|\$\S[^$]*\$|[_^]\{"),
    "a fence": re.compile(r"```|~~~"),
    "a link": re.compile(r"\]\([^)\s]*\)"),
    "a reference": re.compile(r"\]\[[\w.-]+\]|::: \w"),
    "bold face": re.compile(r"\*\*\w"),
    "a table": re.compile(r"\|\s*:?-{3,}|={5,}"),
}
"""Markup that a reader should not see, by what it is."""

FETCHED = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href"}
"""What a page needs to be shown."""

SEARCHED = {"tension": 3, "calibration": 1, "wrench": 1}
"""Words that the search finds, on at least so many pages."""

ASKED = (
    "index.html", "gallery.html", "guides/studio.html", "theory/tensions.html",
    "notebooks/tour.html", "reference/commands.html",
)  # fmt: skip
"""Pages that axe looks at: pictures, tables, code, equations, signatures."""

ANSWERED = (
    "(e => e !== null && /\\d|No match/.test(e.innerText))"
    "(document.querySelector('.md-search-result__meta'))"
)
"""Whether a page's search has told what it found."""


class Page(HTMLParser):
    """A page's prose, anchors and links.

    Attributes:
        anchors: Names that links of any page can end with.
        links: Addresses of links, and of what is fetched to show the page.
        fetched: Those that are fetched.
        prose: Pieces of text that a reader sees, code and equations left out.
        equations: Characters of equations.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.prose: list[str] = []
        self.equations: set[str] = set()
        self._unread = self._math = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        address = given.get(FETCHED.get(tag, ""))
        if address and given.get("rel") not in ("canonical", "prev", "next"):
            self.links.append(address)
            self.fetched.append(address)
        if tag not in WITHOUT_END:
            self._unread += tag in UNREAD
            self._math += tag == "math"

    def handle_endtag(self, tag: str) -> None:
        self._unread -= tag in UNREAD
        self._math -= tag == "math"

    def handle_data(self, data: str) -> None:
        if not self._unread:
            self.prose.append(data)
        if self._math:
            self.equations |= {*data.strip()}


def raw_markup(page: Page) -> Iterator[str]:
    """Markup that was not turned into what it stands for, with what is round it."""
    for text in page.prose:
        for what, pattern in RAW.items():
            if found := pattern.search(text):
                around = text[max(found.start() - 20, 0) : found.end() + 20]
                yield f"shows {what}: {' '.join(around.split())!r}"


def dead_links(place: Path, pages: dict[Path, Page]) -> Iterator[str]:
    """Links to no file, or to no anchor in a page; what would be fetched from a network."""
    for address in pages[place].links:
        parts = urlsplit(address)
        if parts.scheme or parts.netloc:
            if address in pages[place].fetched and parts.scheme != "data":
                yield f"fetches {address!r} from a network"
            continue
        goal = (place.parent / unquote(parts.path)).resolve() if parts.path else place
        anchor = unquote(parts.fragment)
        if not goal.is_file():
            yield f"links to {address!r}, which is not there"
        elif anchor and goal in pages and anchor not in pages[goal].anchors:
            yield f"links to {address!r}; that page has no such place"


def page_problems(site: Path) -> Iterator[str]:
    """What is wrong in the pages themselves, each with the page's name."""
    site = site.resolve()
    files = [path for path in sorted(site.rglob("*.html")) if path.name != "404.html"]
    if not files:
        yield f"{site}: holds no page"
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in files}
    known = {*map(chr, TTFont(FONT).getBestCmap())}
    for path, page in pages.items():
        strange = [f"equation with {sign!r}, not in {FONT.name}" for sign in page.equations - known]
        for problem in (*raw_markup(page), *dead_links(path, pages), *strange):
            yield f"{path.relative_to(site)}: {problem}"


def search_problems(
    site: Path, browser: Any, searched: dict[str, int], patience: float = LONGEST_WAIT
) -> Iterator[str]:
    """Words that the search of a site that was opened from a disk does not find, in so many [s]."""
    from selenium.common.exceptions import TimeoutException

    address = (site.resolve() / "index.html").as_uri()
    for word, least in searched.items():
        browser.get("about:blank")
        browser.get(f"{address}?q={word}")
        try:
            wait_for(browser, ANSWERED, patience)
        except TimeoutException:
            yield f"search for {word!r} from a disk: no answer"
            break
        found = len(browser.find_elements("css selector", ".md-search-result__item"))
        if found < least:
            yield f"search for {word!r} from a disk: found {found} pages; accepted: {least} or more"


def axe_problems(site: Path, browser: Any, asked: Sequence[str]) -> Iterator[str]:
    """What axe finds that is serious or critical in pages, light and dark."""
    for scheme in ("light", "dark"):
        liking = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": liking})
        for name in asked:
            browser.get((site.resolve() / name).as_uri())
            yield from (f"{name}, {scheme}: {found}" for found in grave(browser))
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def main(site: Path) -> int:
    """Prints what is wrong with a site; 1 if anything is."""
    problems = list(page_problems(site))
    with tempfile.TemporaryDirectory() as profile, chromium(Path(profile)) as browser:
        problems += search_problems(site, browser, SEARCHED)
        problems += axe_problems(site, browser, ASKED)
    print("\n".join(problems) or "site: no raw markup, no dead link; search and axe are content")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
