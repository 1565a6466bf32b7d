"""A stream for drives as a picture: what they are sent, and what of it is stretch and sag."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.planning.cable_streams import CableStream
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.visualization.cable_figures import draw_cables
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS, figure_writers
from cdpr_drake.analyses.visualization.figure_style import bare_figure, styled
from cdpr_drake.cables.models import CABLE_MODELS


def stream_pictures(stream: CableStream, formats: Sequence[str] = DEFAULT_FORMATS) -> Pictures:
    """What draws the figure of a stream, by the name of its file."""
    return dict(figure_writers({"stream": lambda: stream_figure(stream)}, formats))


def stream_figure(stream: CableStream) -> Figure:
    """Lengths and motor angles over time, and by how much lengths are below straight ways."""
    sags = CABLE_MODELS[stream.model].sags
    made_up = "stretch less sag" if sags else "stretch"
    verdict = "no cable goes slack" if stream.check.keeps_taut else "CABLES GO SLACK"
    title = (
        f"{stream.robot.name}: stream of {len(stream.times)} points at {stream.rate:g} Hz, "
        f"{stream.model} cables\n{verdict}; angles are zero at the home pose at rest"
    )
    shown: list[tuple[str, Any]] = [
        ("unstrained length [m]", stream.lengths),
        ("motor angle [turns],\npositive pays out", stream.motor_angles / (2.0 * np.pi)),
        (f"{made_up} [mm]", 1e3 * stream.stretch),
    ]
    figure = bare_figure((11.0, 9.0), title)
    with styled():
        places = figure.subplots(len(shown), 1, sharex=True)
        for place, (label, values) in zip(places, shown, strict=True):
            draw_cables(place, stream.robot, stream.times, values)
            place.set(ylabel=label)
            place.margins(x=0.01)
        places[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
        places[-1].set(xlabel="time [s]")
    return figure
