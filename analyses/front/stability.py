"""Where a robot's visual servo is stable, over a grid of poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.front.session import Say, Session, asked_workers, kept_folder
from cdpr_drake.analyses.front.workspaces import pose_grid, stopped
from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.left_folders import RESULTS
from cdpr_drake.analyses.reporting.log_files import write_json
from cdpr_drake.analyses.visualization.figure_files import DEFAULT_FORMATS
from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds
from cdpr_drake.analyses.workspaces.stability_question import (
    StabilityQuestion,
    make_question,
    scenario_task,
)
from cdpr_drake.analyses.workspaces.stability_results import (
    StabilityWorkspaces,
    stability_workspaces,
)
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.errors import StabilityError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_wrench
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.summaries import as_kind
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HELD = ("limits", "mass", "wrench", "force", "moment", "pulleys")
"""What cables have to hold in `assess_stability`, by name."""

ASKED = ("scenario", "printed_matrix", "options")
"""What else it may be asked for, by name."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class DrawnStability(StabilityWorkspaces):
    """`StabilityWorkspaces` that draw and write themselves.

    Attributes:
        robot: The robot.
        folder: Where they were written; None: nowhere.
        failed: Of each picture that could not be written, the file and why.
    """

    robot: Robot
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    def plot(self, bounds: str | None = None) -> Figure:
        """Planes of the grid, coloured by what holds under bounds of a name; None: the first."""
        from cdpr_drake.analyses.workspaces.stability_figures import planes_figure

        return planes_figure(self, bounds, self.robot)

    def write(
        self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS, say: Say | None = None
    ) -> dict[str, str]:
        """Writes arrays, `results.json`, then figures and page, into a folder that exists.

        Args:
            folder: The folder; in the result's own the arrays of the grid are there already.
            formats: Endings of the files of figures.
            say: Told what should be known of the page.

        Returns:
            Of each picture that could not be written, the file and why, in one line.
        """
        from cdpr_drake.analyses.workspaces.stability_figures import stability_pictures
        from cdpr_drake.analyses.workspaces.stability_scene import scene_page

        if folder != self.folder:
            self.save(folder)
        write_json(folder / RESULTS, self.as_dict())
        page, note = scene_page(self, self.robot)
        if note and say is not None:
            say(f"note: {note}")
        return write_pictures(folder, stability_pictures(self, self.robot, formats) | page)


def stability_question(
    robot: Robot | str | Path,
    scheme: str = "pbvs",
    verdict: str = "searched",
    *,
    bounds: PerturbationBounds | Path | str | None = None,
    vary: Mapping[str, Sequence[float]] | None = None,
    grid: WorkspaceGrid | Sequence[int] | None = None,
    scenario: str | None = None,
    printed_matrix: bool = False,
    options: VerdictOptions | Mapping[str, Any] | None = None,
    **held: Any,
) -> StabilityQuestion:
    """What `assess_stability` computes; arguments as there."""
    for name in held:
        if name not in HELD:
            raise StabilityError(f"{name!r} is unknown; {closest(name, (*HELD, *ASKED))}")
    load = [held.pop(name, None) for name in ("wrench", "force", "moment")]
    return make_question(
        robot, scheme=scheme, verdict=verdict,
        bounds=load_bounds(Path(bounds)) if isinstance(bounds, str | Path) else bounds,
        vary=vary, grid=pose_grid(robot, grid), options=_options(options),
        statics=static_case(
            as_robot(robot, "assess_stability"), wrench=as_wrench(*load), **held
        ),
        task=None if scenario is None else scenario_task(robot, scenario),
        printed_matrix=printed_matrix,
    )  # fmt: skip


@verb()
def assess_stability(
    robot: Robot | str | Path,
    scheme: str = "pbvs",
    verdict: str = "searched",
    *,
    bounds: PerturbationBounds | Path | str | None = None,
    vary: Mapping[str, Sequence[float]] | None = None,
    grid: WorkspaceGrid | Sequence[int] | None = None,
    folder: Path | str | None = None,
    workers: int | str | None = 1,
    formats: Sequence[str] = DEFAULT_FORMATS,
    session: Session | None = None,
    **asked: Any,
) -> DrawnStability:
    """Where a visual servo is stable in spite of perturbations, and the platform can be held.

    Args:
        robot: The robot, or its name or path.
        scheme: pbvs, pbvs-line, 2.5d or ibvs.
        verdict: sampled, searched or certified.
        bounds: Perturbation bounds, or a file of them; None: those of the servoing thesis.
        vary: Values of single bounds, each with the others as they are [m, rad], in degrees where
            the name ends in _deg.
        grid: Poses, as `compute_workspace` takes them.
        folder: Where finished work, results, figures and page are kept, and work is continued
            from; None: nowhere.
        workers: Processes, or the address of a Dask scheduler; None: one for each
            processor, started where more than ten seconds of work are left.
        formats: Endings of the files of figures.
        session: Who follows it and may stop it; None: nobody.
        asked: What the cables have to hold: `limits` (2,) [N], `mass` [kg], `wrench` about Po in W,
            moments first, (6,) [N m, N], or `force` (3,) [N] and `moment` (3,) [N m]; `pulleys`,
            False to ignore the robot's pulleys there too (the criterion of stability always
            ignores them); `scenario`, whose object, desired view and camera replace those of the
            servoing thesis; `printed_matrix=True`: pbvs with the interaction matrix of the
            thesis' tables instead of the exact one, which `simulate` uses; `options`, how hard to
            look: `VerdictOptions`, or some of its fields by name.

    Raises:
        StoppedError: The session stopped it before it was finished.
        CdprError: Something is unknown, out of range, or not possible for the robot.
        OutputFolderError: The folder belongs to other arguments, or cannot be written.

    Source: servoing thesis 3.3, (3.27), (3.28).
    """
    question = stability_question(
        robot, scheme, verdict, bounds=bounds, vary=vary, grid=grid, **asked
    )
    told, (count, scheduler) = session or Session(), asked_workers(workers)
    with nullcontext() if folder is None else kept_folder(folder, told) as where:
        with told.computing():
            run = stability_workspaces(question, where, count, scheduler, told.progress, told.stop)
        if run.workspaces is None:
            raise stopped(run.progress)
        found = as_kind(
            DrawnStability, run.workspaces, robot=as_robot(robot, "assess_stability"), folder=where
        )
        if where is None:
            return found
        with told.doing("Writing results"):
            failed = found.write(where, formats, told.say)
    return replace(found, failed=failed)


def _options(options: VerdictOptions | Mapping[str, Any] | None) -> VerdictOptions:
    if isinstance(options, VerdictOptions):
        return options
    known = [one.name for one in fields(VerdictOptions)]
    for name in options or {}:
        if name not in known:
            raise StabilityError(f"options: {name!r} is unknown; {closest(name, known)}")
    return replace(VerdictOptions(), **(options or {}))
