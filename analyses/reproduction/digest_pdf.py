"""Typesets the digest of a report as a PDF of A4 pages with text that can be selected.

reportlab does it, which is installed with the extra `report`. The same story gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl

from cdpr_drake.analyses.reproduction.digest_story import (
    Block,
    Drawing,
    Grid,
    Heading,
    Picture,
    Title,
    Words,
)
from cdpr_drake.analyses.reproduction.pictures import small_png
from cdpr_drake.analyses.visualization.figure_files import figure_png
from cdpr_drake.errors import OutputFormatError

DIGEST = "digest.pdf"
"""Its file, beside the page."""

NO_REPORTLAB = "reportlab is not installed: pip install 'cdpr_drake[report]'"
"""Why there is no digest where it cannot be typeset."""

MARGIN, GUTTER = 17.0, 14.0
"""Of a page, at the sides, and above and below [mm]."""

ROOM, ROOM_PART = 40.0, 22.0
"""Below a heading of a section, or of a part: with less a page begins [mm]."""

FRAME = 6.0
"""Of reportlab, between text and margin [pt]."""

FONTS = {
    "DejaVuSans": "DejaVuSans.ttf",
    "DejaVuSans-Bold": "DejaVuSans-Bold.ttf",
    "DejaVuSans-Oblique": "DejaVuSans-Oblique.ttf",
    "DejaVuSans-BoldOblique": "DejaVuSans-BoldOblique.ttf",
}
"""Those that come with matplotlib: the standard ones of PDF lack Greek letters and signs."""

SIZE, SMALL, HEAD, LEADING = 8.5, 6.6, 5.8, 1.28
"""Letters of paragraphs, of tables, of their heads [pt], and lines over letters."""

INK, GREY, LINE, SOFT = "#1b1d21", "#5b616b", "#c9ccd1", "#f4f5f7"

HIGHEST = 62.0
"""Of a picture [mm], so that four are on a page."""


def can_typeset() -> bool:
    """Whether reportlab is installed."""
    return find_spec("reportlab") is not None


def write_digest(path: Path, story: Sequence[Block]) -> None:
    """Writes a digest.

    Args:
        path: Of the PDF.
        story: What stands in it, see `digest_story`.

    Raises:
        OutputFormatError: reportlab is not installed.
        OSError: The file cannot be written.
    """
    if not can_typeset():
        raise OutputFormatError(NO_REPORTLAB)
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.units import mm
    from reportlab.platypus import SimpleDocTemplate

    _register_fonts()
    title = next((block.words for block in story if isinstance(block, Title)), DIGEST)

    class Document(SimpleDocTemplate):
        """Whose headings are in the outline."""

        def afterFlowable(self, flowable: Any) -> None:
            """Takes a heading into the outline."""
            level = getattr(flowable, "outline_level", None)
            if level is not None:
                key = f"heading-{self.seq.nextf('heading')}"
                self.canv.bookmarkPage(key)
                self.canv.addOutlineEntry(flowable.getPlainText(), key, level, closed=level > 0)

    document = Document(
        str(path), pagesize=A4, leftMargin=MARGIN * mm, rightMargin=MARGIN * mm,
        topMargin=GUTTER * mm, bottomMargin=GUTTER * mm + 4 * mm, title=title,
        author="cdpr_drake", subject="What was published, repeated", lang="en", invariant=1,
        pageCompression=1, displayDocTitle=1, initialFontName="DejaVuSans",
    )  # fmt: skip

    def foot(canvas: Any, _: Any) -> None:
        canvas.setFont("DejaVuSans", SMALL)
        canvas.setFillColor(GREY)
        height = (GUTTER - 2) * mm
        canvas.drawString(MARGIN * mm + FRAME, height, title)
        number = str(canvas.getPageNumber())
        canvas.drawRightString(A4[0] - MARGIN * mm - FRAME, height, number)

    typesetter = _Typesetter(document.width - 2 * FRAME, mm)
    flowables = [each for block in story for each in typesetter.flowables(block)]
    document.build(flowables, onFirstPage=foot, onLaterPages=foot)


def _register_fonts() -> None:
    from reportlab.lib.fonts import addMapping
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for number, (name, file) in enumerate(FONTS.items()):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(folder / file)))
        addMapping("DejaVuSans", number % 2, number // 2, name)


class _Typesetter:
    """Makes what reportlab lays out of blocks."""

    def __init__(self, width: float, mm: float) -> None:
        """With the width of the text [pt] and a millimetre in points."""
        from reportlab.lib.styles import ParagraphStyle

        def style(name: str, size: float, **more: Any) -> Any:
            return ParagraphStyle(
                name, fontName="DejaVuSans", fontSize=size, leading=LEADING * size, textColor=INK,
                **more,
            )  # fmt: skip

        self._width, self._mm = width, mm
        self._styles = {
            "title": style("title", 19, spaceAfter=6),
            "section": style("section", 13, spaceBefore=11, spaceAfter=4),
            "part": style("part", 10, spaceBefore=8, spaceAfter=2),
            "words": style("words", SIZE, spaceAfter=3),
            "small": style("small", SMALL, spaceAfter=4),
            "cell": style("cell", SMALL),
            "number": style("number", SMALL, alignment=2),
            "head": style("head", HEAD),
            "number head": style("number head", HEAD, alignment=2),
            "caption": style("caption", SMALL + 0.6, spaceBefore=2, spaceAfter=8),
        }
        for name in ("small", "caption"):
            self._styles[name].textColor = GREY

    def flowables(self, block: Block) -> Iterator[Any]:
        """Of one block."""
        from reportlab.platypus import CondPageBreak, KeepTogether, PageBreak

        if isinstance(block, Title):
            yield self._words(f"<b>{escape(block.words)}</b>", "title")
        elif isinstance(block, Heading):
            if block.new_page:
                yield PageBreak()
            # Not kept with all that follows it, which may be a table of several pages.
            yield CondPageBreak((ROOM_PART if block.part else ROOM) * self._mm)
            kind = "part" if block.part else "section"
            heading = self._words(f"<b>{escape(block.words)}</b>", kind)
            heading.outline_level = int(block.part)
            yield heading
        elif isinstance(block, Words):
            lead = f"<b>{escape(block.lead)}</b>" if block.lead else ""
            yield self._words(lead + escape(block.words), "small" if block.small else "words")
        elif isinstance(block, Grid):
            yield self._table(block)
        else:
            content = figure_png(block.draw()) if isinstance(block, Drawing) else _file(block)
            caption = self._words(escape(block.words), "caption")
            picture = [] if content is None else [self._picture(content)]
            yield KeepTogether([*picture, caption])

    def _words(self, words: str, style: str) -> Any:
        from reportlab.platypus import Paragraph

        return Paragraph(words, self._styles[style])

    def _picture(self, content: bytes) -> Any:
        from reportlab.lib.utils import ImageReader
        from reportlab.platypus import Image

        wide, high = ImageReader(BytesIO(content)).getSize()
        scale = min(self._width / wide, HIGHEST * self._mm / high)
        return Image(BytesIO(content), wide * scale, high * scale)

    def _table(self, grid: Grid) -> Any:
        from reportlab.platypus import LongTable, TableStyle

        def cell(column: int, words: str, strong: bool, head: bool = False) -> Any:
            shown = f"<b>{escape(words)}</b>" if strong else escape(words)
            if column >= grid.numbers:
                return self._words(shown, "number head" if head else "number")
            return self._words(shown, "head" if head else "cell")

        data = [[cell(k, words, True, True) for k, words in enumerate(grid.heads)]]
        for number, line in enumerate(grid.lines):
            data.append([cell(k, words, number in grid.strong) for k, words in enumerate(line)])
        style = [
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("BACKGROUND", (0, 0), (-1, 0), SOFT),
            ("LINEBELOW", (0, 0), (-1, -1), 0.4, LINE),
            ("LEFTPADDING", (0, 0), (-1, -1), 3),
            ("RIGHTPADDING", (0, 0), (-1, -1), 3),
            ("TOPPADDING", (0, 0), (-1, -1), 1.6),
            ("BOTTOMPADDING", (0, 0), (-1, -1), 2.4),
        ]
        style += [("LINEABOVE", (0, k + 1), (-1, k + 1), 0.8, GREY) for k in grid.strong]
        return LongTable(
            data, colWidths=[share * self._width for share in grid.widths], repeatRows=1,
            style=TableStyle(style), spaceBefore=3, spaceAfter=6,
        )  # fmt: skip


def _file(picture: Picture) -> bytes | None:
    return small_png(picture.path)
