"""Makes `docs/fonts/equations.woff`: `python -m tests.docs.make_equations_font FONT`.

FONT is DejaVuMathTeXGyre.ttf (Debian: fonts-dejavu-extra), or another one with a table MATH.
"""

import sys
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont

FONT = Path(__file__).parents[2] / "docs" / "fonts" / "equations.woff"

LETTERS = [
    *range(0x20, 0x7F), *range(0x391, 0x3D7), 0x210E,  # 0x210e: h in italics
    *range(0x1D434, 0x1D468), *range(0x1D6E2, 0x1D71C),  # italics
]  # fmt: skip

SIGNS = (
    "¨¯°±·×‖†′″…∀∂∃∅∇∈∉−∏∑∓∘∗√∝∞∥∧∨∩∪∫∼≈≠≡≤≥≪≫⊂⊤⊥⋮⋯⋱→←⇒⇔↦⌈⌉⌊⌋⏞⏟⟨⟩ˆ˙˜ℕℝ"
    "\u0305\u0307\u0332\u2003\u2009\u2013\u2015\u2061\u2062"  # bars, dots, spaces, invisible ones
)


def main(source: str) -> None:
    """Keeps what equations need of a font, under another name, as its licence wants."""
    options = subset.Options(flavor="woff", hinting=False, layout_features=[], name_IDs=[0, 13, 14])
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=[*LETTERS, *map(ord, SIGNS)])
    font = TTFont(source)
    font["name"].names = [name for name in font["name"].names if name.nameID in (0, 13, 14)]
    subsetter.subset(font)
    subset.save_font(font, str(FONT), options)


if __name__ == "__main__":
    main(sys.argv[1])
