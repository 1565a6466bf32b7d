"""The guard sees faults that were there, and figures of the house have none."""

import numpy as np
import pytest

from cdpr_drake.analyses.frame.figures import bare_figure, new_figure, styled
from cdpr_drake.analyses.studies.servo_figures import fit_box, path
from cdpr_drake.analyses.visualization.solids import NO_CELL, draw_solid
from cdpr_drake.palette import nth_look
from cdpr_drake.workspaces.volume import surface_quads
from tests.figure_faults import figure_faults


def plain():
    """A figure without a fault."""
    figure, axes = new_figure(1, 1, (6.0, 4.0), "A line")
    axes.plot([0.0, 1.0], [0.0, 1.0], label="line")
    axes.set(xlabel="time [s]", ylabel="length [m]", ylim=(-0.1, 2.0))
    return figure, axes


def test_a_good_figure_has_no_faults():
    figure, axes = plain()
    axes.legend(loc="upper left")
    assert figure_faults(figure) == []


def two_words(axes, *angles):
    for words, angle in zip(("along a line", "across it"), angles, strict=True):
        axes.text(0.5, 1.5, words, rotation=angle)


def over_bars(axes):
    axes.bar([0.5], [1.9], 0.9)
    axes.legend(loc="upper center")


def under_legend(axes):
    axes.text(0.02, 1.9, "words", va="top")
    axes.legend(loc="upper left")


def offset(axes):
    axes.plot([0.0, 1.0], [1e6, 1e6 + 1e-3])
    axes.set_ylim(1e6, 1e6 + 1e-3)


SPOILED = [  # the layout makes no room for words of the figure
    (lambda axes: axes.figure.text(0.97, 0.5, "far to the right"), "cut off"),
    (lambda axes: two_words(axes, 0.0, 0.0), "on each other"),
    (lambda axes: two_words(axes, 40.0, -40.0), "on each other"),
    (lambda axes: axes.legend(loc="center right"), "legend over curve"),
    (over_bars, "legend over bars"), (under_legend, "on a legend"), (offset, "offset"),
    (lambda axes: axes.text(0.5, 1.5, "who reads this", fontsize=5.0), "letters of 5 pt"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "words"), SPOILED, ids=[words for _, words in SPOILED])
def test_each_fault_is_seen(spoil, words):
    figure, axes = plain()
    with styled():
        spoil(axes)
    assert any(fault.startswith(words) for fault in figure_faults(figure))


@pytest.mark.parametrize(
    ("size", "columns", "ends"),
    [
        ((8.0, 6.6), 1, [[0.09, -0.1, 0.28], [0.18, -0.02, 0.46]]),
        ((14.0, 7.0), 2, [[-0.12, -0.2, 0.3], [0.12, 0.1, 0.3]]),
        ((14.0, 7.0), 2, [[-0.8, -1.2, 0.3], [0.4, 0.0, 1.8]]),
    ],
)
def test_numbers_and_names_of_axes_in_space_do_not_meet(size, columns, ends):
    figure = bare_figure(size, "Path of the camera, Co, in the world frame W")
    with styled():
        axes = figure.add_subplot(1, columns, 1, projection="3d")
        path(axes, np.linspace(*ends, 20), nth_look(0), "camera")
        fit_box(axes, np.array(ends))
        figure.legend(loc="outside lower center")
    assert figure_faults(figure) == []


def test_words_in_space_are_where_they_are_drawn():
    """Their first two coordinates were taken for a place in the picture."""
    figure = bare_figure((6.0, 5.0), "A point far from the origin")
    with styled():
        axes = figure.add_subplot(projection="3d")
        fit_box(axes, np.array([[2.0, 2.0, 0.0], [3.0, 3.0, 1.0]]))
        axes.text(2.5, 2.5, 0.5, "within")
    assert figure_faults(figure) == []
    with styled():
        axes.text(2.5, 2.5, 0.5, "there too")
        axes.text(2.5, 2.5, 9.0, "outside")
    faults = figure_faults(figure)
    assert faults == ["cut off: 'outside'", "on each other: 'within' and 'there too'"]


@pytest.mark.parametrize("upper", [(0.5, 0.5, 1.1), (7.0, 5.0, 6.0)])
def test_solids_have_labels_of_their_axes_beside_ticks_or_say_that_there_is_none(upper):
    figure = bare_figure((13.0, 5.4), "Solids")
    frame = np.array([-upper[0], -upper[1], 0.0]), np.array(upper)
    ends = [np.linspace(0.4 * low, 0.4 * high, 4) for low, high in zip(*frame, strict=True)]
    quads = surface_quads(np.ones((4, 4, 4), bool), ends), np.empty((0, 4, 3))
    with styled():
        for place, faces in enumerate((*quads, quads[0])):
            axes = figure.add_subplot(1, 3, place + 1, projection="3d", computed_zorder=False)
            draw_solid(axes, faces, "#3f8f5f", frame, np.array(frame).T)
            words = [NO_CELL] if place == 1 else []
            assert [text.get_text() for text in axes.texts] == words
    assert figure_faults(figure) == []
