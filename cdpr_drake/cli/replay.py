"""`cdpr replay`: a log of a machine beside a model of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cdpr_drake.analyses.frame.words import Formats, OutFolder, RobotWord
from cdpr_drake.analyses.front.logs import replay_log
from cdpr_drake.analyses.logs.log_formats import AUTO
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.cli.log_options import Axes, LogFormat, Mapping, Rate, Units, log_request
from cdpr_drake.cli.sessions import Answer


def replay(
    log: Path, /, *, robot: RobotWord, fit_frame: bool = False,
    drive: Annotated[bool, Parameter(name="--follow")] = False, log_format: LogFormat = AUTO,
    unit: Units = None, mapping: Mapping = None, rate: Rate = None, body: str | None = None,
    axes: Axes = None, out: OutFolder = None, overwrite: bool = False, formats: Formats = ("png",),
) -> Answer:  # fmt: skip
    """Replays a log of a machine beside a model of it, with residuals by cable.

    Writes replay.html with the measured run and the model's platform, residuals, replay.csv and
    summary.json. Compares lengths at the measured poses, poses from the measured lengths, and
    tensions with those that carry the weight. With --follow the simulated robot follows the log's
    lengths; its distance from the measured poses is the error between simulation and machine.

    Args:
        log: Log, as import-log writes or reads it.
        robot: Robot of the log.
        fit_frame: Fit the tracker's frame to the positions that the model has for the measured
            lengths; without, the tracker measures in W.
        drive: Also drive the simulated robot with the log's cable lengths.
        log_format: Reader; auto says which and why.
        unit: Units that the file does not state, as length=mm,force=N.
        mapping: YAML file of what columns are: columns: [time_s, C1_length_mm, ''], or name:
            header; skip_rows, separator, rate_hz.
        rate: Rows per second, for files without times [1/s].
        body: Rigid body of a tracker that is the platform.
        axes: Axes of a tracker's file that are x,y,z of W, as z,x,y or -z,-x,y.
        out: Results folder; default: a new one below runs/.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
    """
    request = log_request(unit=unit, mapping=mapping, rate=rate, body=body, axes=axes)
    folder = out if out is not None else free_folder(Path("runs") / f"replay-{log.stem}")
    replayed = replay_log(
        log, robot, request, format=log_format, fit_frame=fit_frame, follow=drive, folder=folder,
        overwrite=overwrite, formats=tuple(formats),
    )  # fmt: skip
    return Answer(
        numbers=replayed.as_dict(), printed=[repr(replayed), f"results: {folder}"],
        drawing=replayed.plot,
    )  # fmt: skip
