"""The recording of a run of a mechanism as one page that opens without a server."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cdpr_drake.analyses.visualization.mechanism_picture import MechanismScene
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay import (
    BYTES_EACH,
    FEWEST_FRAMES,
    LARGEST_PAGE,
    REPLAY_RATE,
    SAMPLED_FRAMES,
    Recorded,
    fitting_page,
    frame_indices,
)
from cdpr_drake.analyses.visualization.replay_page import PageNotes, with_notes
from cdpr_drake.analyses.visualization.replay_signals import (
    frame_signals,
    packed,
    tension_curves,
)
from cdpr_drake.arrays import Array
from cdpr_drake.models.mechanism_schema import Mechanism


def write_mechanism_replay(
    path: Path,
    mechanism: Mechanism,
    log: Mapping[str, Array],
    *,
    limits: tuple[float, float],
    title: str = "",
) -> None:
    """Writes the recording of a run as one HTML file of at most `LARGEST_PAGE`.

    Args:
        path: The file.
        mechanism: The mechanism.
        log: "time", shape (n,) [s], "positions", shape (n, nq), "tensions", shape (n, m) [N].
        limits: Smallest and largest tension that are shown with the tensions [N].
        title: Of the page.
    """
    curves = tension_curves(log, limits)
    scale = float(np.max(log["tensions"]))

    def notes(scene: MechanismScene, frames: dict[str, str] | None) -> PageNotes:
        return PageNotes(
            names=scene.routes.names, places=scene.exits(), full_scale=scale, title=title,
            frames=frames, curves=None if frames is None else curves,
        )  # fmt: skip

    def page(most: int) -> Recorded:
        scene = _scene(mechanism, log, scale)
        each = BYTES_EACH * (scene.plant.num_bodies() + 2 * scene.routes.p_BQ.shape[1])
        most = min(most, max(FEWEST_FRAMES, LARGEST_PAGE // each))
        shown = frame_indices(log["time"], REPLAY_RATE, most)
        positions, tensions = log["positions"][shown], log["tensions"][shown]
        slack, exits = np.zeros(tensions.shape, bool), []
        scene.record()
        for frame, time in enumerate(log["time"][shown]):
            scene.plant.SetPositions(scene.plant_context, positions[frame])
            slack[frame] = scene.draw(tensions[frame], float(time))
            exits.append(scene.exits().T)
        scene.meshcat.StopRecording()
        scene.meshcat.PublishRecording()
        frames = frame_signals(log, shown, slack)
        frames["places"] = packed(np.array(exits), np.float32)
        scene.plant.SetPositions(scene.plant_context, positions[0])
        words = with_notes(scene.meshcat.StaticHtml(), notes(scene, frames))
        return Recorded(words, len(shown), most)

    def still() -> str:
        scene = _scene(mechanism, log, scale)
        scene.draw(log["tensions"][0])
        return with_notes(scene.meshcat.StaticHtml(), notes(scene, None))

    path.write_text(fitting_page(page, still), encoding="utf-8")


def _scene(mechanism: Mechanism, log: Mapping[str, Array], scale: float) -> MechanismScene:
    """The mechanism where it starts, in a window that shows it wherever it goes."""
    scene = MechanismScene(mechanism, open_meshcat())
    some = np.unique(np.linspace(0, len(log["time"]) - 1, SAMPLED_FRAMES).astype(int))
    corners = []
    for q in log["positions"][some][::-1]:
        scene.plant.SetPositions(scene.plant_context, q)
        corners.append(scene.box())
    lower, upper = (np.array(each) for each in zip(*corners, strict=True))
    scene.show_cables(scale, lower.min(axis=0), upper.max(axis=0))
    return scene  # drawn by who records: what was drawn before has no keys in a recording
