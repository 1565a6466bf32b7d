"""What is wrong with a figure, as far as a program sees it: asked of figures by their tests.

Words that are cut off at the edge or lie on other words, a legend that covers data, numbers at
ticks that are to be added to another one, letters that are too small for the figure's width.
"""

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.legend import Legend
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Text3D

from cdpr_drake.analyses.frame.figures import lay_out, styled

EDGE = 2.0
"""So far may a box of words reach over the edge [px]: boxes hold room for letters that go deep."""

COMMON = 0.12
"""Share of the smaller of two boxes of words that may be common, for the same reason."""

LEAST_FONT = 7.0
"""Of words [pt]."""


def figure_faults(figure):
    """Faults of a figure, a line each; none: an empty list."""
    lay_out(figure)
    with styled():  # how many ticks there are is asked of the style whenever they are
        FigureCanvasAgg(figure).draw()  # places what legends hold
        words = [(text, corners(text)) for text in shown_words(figure)]
        return [*cut_words(figure, words), *words_on_words(words),
                *words_on_legends(figure, words), *covered_data(figure), *offsets(figure),
                *small_words(words)]  # fmt: skip


def shown_words(figure):
    """All texts of a figure that are seen."""
    found = []
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip() and text.get_figure() is not None:
            found.append(text)
    kept = {id(text) for axes in figure.axes if axes.axison for text in ticks_of(axes)}
    drawn = {id(text) for text in hidden_ticks(figure)}
    return [text for text in found if id(text) not in drawn or id(text) in kept]


def axes_axes(axes):
    return [axis for name in ("xaxis", "yaxis", "zaxis") if (axis := getattr(axes, name, None))]


def ticks_of(axes):
    """Texts of the ticks that are drawn: within the limits."""
    for axis in axes_axes(axes):
        for tick in axis._update_ticks():
            yield from (tick.label1, tick.label2)


def hidden_ticks(figure):
    """Texts of all ticks that exist, drawn or not."""
    for axes in figure.axes:
        for axis in axes_axes(axes):
            for tick in (*axis.majorTicks, *axis.minorTicks):
                yield from (tick.label1, tick.label2)


def corners(text):
    """Corners of the box of words, turned as they are, shape (4, 2) [px]."""
    turned = extent(text)
    middle = np.array([turned.x0 + turned.x1, turned.y0 + turned.y1]) / 2.0
    angle = text.get_rotation()
    if angle % 90.0 == 0.0:
        half = np.array([turned.width, turned.height]) / 2.0
        angle = 0.0
    else:
        text.set_rotation(0.0)
        flat = extent(text)
        text.set_rotation(angle)
        half = np.array([flat.width, flat.height]) / 2.0
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return middle + (signs * half) @ np.array([[c, s], [-s, c]])


def extent(text):
    """Box of words [px]; of words at a point in space where they are drawn."""
    if not isinstance(text, Text3D):
        return text.get_window_extent()
    point = text.get_position_3d()
    Text.set_position(text, proj3d.proj_transform(*point, text.axes.get_proj())[:2])
    box = text.get_window_extent()
    Text.set_position(text, point[:2])
    return box


def cut_words(figure, words):
    """Words that reach over the edge of the figure."""
    for text, box in words:
        low, high = box.min(axis=0), box.max(axis=0)
        if np.any(low < -EDGE) or np.any(high > figure.bbox.max + EDGE):
            yield f"cut off: {text.get_text()!r}"


def depth(one, other):
    """By how much two boxes of words overlap where they do least [px]; none: below 0."""
    least = np.inf
    for box in (one, other):
        for side in (box[1] - box[0], box[2] - box[1]):
            length = np.linalg.norm(side)
            normal = side / length
            a, b = one @ normal, other @ normal
            least = min(least, min(a.max(), b.max()) - max(a.min(), b.min()))
    return least


def words_on_words(words):
    """Pairs of words that lie on each other."""
    for (one, a), (other, b) in combinations(words, 2):
        if np.any(a.min(0) > b.max(0)) or np.any(b.min(0) > a.max(0)):
            continue
        smaller = min(np.linalg.norm(a[2] - a[1]), np.linalg.norm(b[2] - b[1]))
        if depth(a, b) > COMMON * max(smaller, 8.0):
            yield f"on each other: {one.get_text()!r} and {other.get_text()!r}"


def legends_of(figure):
    """All legends that are seen."""
    return [one for one in figure.findobj(Legend) if one.get_visible()]


def words_on_legends(figure, words):
    """Words that lie on a legend they do not belong to."""
    for legend in legends_of(figure):
        own = {id(text) for text in legend.findobj(Text)}
        (x0, y0), (x1, y1) = legend.get_window_extent().get_points()
        box = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        for text, other in words:
            if id(text) not in own and depth(box, other) > EDGE:
                yield f"on a legend: {text.get_text()!r}"


def covered_data(figure):
    """Legends within axes that cover curves, symbols or bars."""
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is None or not legend.get_visible():
            continue
        box = legend.get_window_extent()
        if not box.overlaps(axes.bbox) or axes.name == "3d":
            continue
        box = Bbox.from_extents(box.x0 + 2, box.y0 + 2, box.x1 - 2, box.y1 - 2)
        for what in covered(axes, box):
            yield f"legend over {what} in {axes.get_title()!r} {axes.get_ylabel()!r}"


def covered(axes: Axes, box):
    for line in axes.lines:
        if line.get_transform() != axes.transData or not line.get_visible():
            continue
        path = line.get_path().transformed(line.get_transform())
        if line.get_linestyle() == "None":
            hit = bool(len(path.vertices)) and bool(np.any(inside(path.vertices, box)))
        else:
            hit = path.intersects_bbox(box, filled=False)
        if hit:
            yield f"curve {line.get_label()!r}"
    for patch in axes.patches:
        bar = isinstance(patch, Rectangle) and patch.get_zorder() > 0  # shades lie below
        if bar and patch.get_window_extent().overlaps(box):
            yield "bars"
            break
    for some in axes.collections:
        offsets_ = np.asarray(some.get_offsets(), float)
        if len(offsets_) > 1 and np.any(inside(axes.transData.transform(offsets_), box)):
            yield "symbols"


def inside(points, box):
    return np.all((points > box.min) & (points < box.max), axis=1)


def offsets(figure):
    """Axes whose numbers are to be multiplied or added to another one."""
    for axes in figure.axes:
        for axis in axes_axes(axes):
            if words := axis.get_offset_text().get_text():
                yield f"offset {words!r} at {axis.get_label_text()!r}"


def small_words(words):
    """Words in too small letters."""
    small = {round(text.get_fontsize(), 1) for text, _ in words if text.get_fontsize() < LEAST_FONT}
    if small:
        yield f"letters of {min(small):g} pt"
