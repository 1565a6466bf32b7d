"""Figures of fits, of numbers that are made up."""

from io import BytesIO
from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest

from cdpr_drake.analyses.fits import swings
from cdpr_drake.analyses.fits.fit import Unknown
from cdpr_drake.analyses.fits.identification import parameter_figure
from cdpr_drake.models.robot_loader import load_robot
from tests.figure_faults import figure_faults


def stretch(begin):
    """One that swings, on which a hand pulls ever more."""
    time = np.linspace(0.0, 2.4, 121)
    turns = np.radians(np.exp(-time)[:, None] * np.sin(12.0 * time[:, None] + [0.0, 1.0, 2.0]))
    force = np.outer(20.0 * time, [0.0, 0.0, 1.0])
    rest = SimpleNamespace(time=time, force=force, means=lambda values: values[:96])
    return SimpleNamespace(
        stretch=SimpleNamespace(time=begin + time, known=np.ones(121)), measured_turns=turns,
        predicted_turns=0.9 * turns, lead=0.8, unexplained=rest,
    )  # fmt: skip


def found(count):
    robot = load_robot("irma4u")
    return SimpleNamespace(
        task=SimpleNamespace(robot=robot), held_out=[stretch(6.78)], values=None,
        fitted=[stretch(float(k)) for k in range(count - 1)],
        model=SimpleNamespace(by_name=lambda values: {"mass": robot.platform.mass}),
    )  # fmt: skip


def test_no_legend_lies_on_curves_and_titles_are_whole():
    for figure in (
        swings._turns_figure(found(1), found(1).held_out, "held out"),
        swings._unexplained_figure(found(1)),
        swings._unexplained_figure(found(2)),
    ):
        assert figure_faults(figure) == []
        assert all(axes.get_legend() is None for axes in figure.axes)
        assert "\n" not in figure.get_suptitle()


GROUPS = {"stiffness": "N", "length_offset": "m", "coulomb": "N m", "viscous": "N m s/rad",
          "static": "N m"}  # fmt: skip
NAMES = ["mass", *(f"C{k}.{what}" for what in GROUPS for k in range(1, 9))]
UNITS = ["kg", *(unit for unit in GROUPS.values() for _ in range(8))]


@pytest.mark.parametrize("compared", [True, False])
def test_all_rows_say_what_they_are(compared):
    """Also those of which no truth is known; labels are whole, and no legend is in the way."""
    value = 1.162345e-4
    unknowns = [
        Unknown(name, unit, 0.011 * value, value, before=0.9 * value,
                true=None if "offset" in name or not compared else 1.16e-4)
        for name, unit in zip(NAMES, UNITS, strict=True)
    ]  # fmt: skip
    figure = parameter_figure(unknowns, compared)
    shown = matplotlib.image.imread(BytesIO(figure._repr_png_()))
    assert np.all(shown[:, :2] == 1.0), "labels are cut on the left in a notebook"
    assert figure_faults(figure) == []
    (axes,) = figure.axes
    assert axes.get_legend() is None
    told = [text.xy[1] for text in axes.texts if text.get_text() == "no true value"]
    rows = [
        place for place, name in zip(axes.get_yticks(), NAMES, strict=True) if "offset" not in name
    ]
    assert len(told) == (8 if compared else 0)
    assert not set(told) & set(rows)
