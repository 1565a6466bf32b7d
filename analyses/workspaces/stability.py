"""Where a visual servo is stable in spite of perturbations: the verb `assess_stability`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.frame.folder import results_folder
from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.jobs import finished_jobs
from cdpr_drake.analyses.frame.result import Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import (
    DEFAULT_FORMATS,
    Formats,
    InputFile,
    Limits,
    OutFolder,
    RobotWord,
    ScenarioWord,
    Vector,
    Workers,
    Wrench,
    named_numbers,
    one_of,
    words,
)
from cdpr_drake.analyses.reporting.deferred_figures import Pictures
from cdpr_drake.analyses.reporting.provenance import code_version
from cdpr_drake.analyses.workspaces.grid_runs import (
    POSES,
    Chunks,
    GridResult,
    Span,
    grid_words,
    load_grid,
    region_numbers,
    reused,
)
from cdpr_drake.analyses.workspaces.pose_grid import (
    Grid,
    Orientations,
    grid_arguments,
    make_grid,
    plain,
)
from cdpr_drake.analyses.workspaces.robot_conditions import static_case
from cdpr_drake.analyses.workspaces.servo_stability import (
    KINDS,
    STRAIGHT,
    ServoStability,
    robot_stability,
    scenario_view,
    varied,
)
from cdpr_drake.errors import StabilityError, TensionProblemError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_wrench
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import SCHEMES
from cdpr_drake.stability.verdict import VERDICTS, StabilityChunk, VerdictOptions, judge_stability
from cdpr_drake.workspaces.static_feasibility import StaticCase, statically_feasible
from cdpr_drake.workspaces.volume import VolumeRule, WorkspaceVolume, workspace_volume

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHUNK_POSES = {"sampled": 1024, "searched": 256, "certified": 64}
"""Poses of a chunk for each verdict: seconds of work, which Ctrl-C waits for."""

BASE, GIVEN = "baseline", "given"
"""Names of the servoing thesis' bounds, and of other ones; the others are variations of them."""

USED_OPTIONS = {
    "sampled": ("draws", "seed", "magnitude", "margins"),
    "searched": ("draws", "seed", "magnitude", "margins", "searches", "steps"),
    "certified": (
        "draws", "seed", "magnitude", "margins", "searches", "steps", "rounds", "pieces",
    ),
}  # fmt: skip
"""For each verdict the fields of `VerdictOptions` that its numbers depend on."""

LEVERS_IN_WORDS = {
    "error": "L_s with [e_t]x, as (1.47) of the servoing thesis prints it",
    "object": "L_s with [s_t]x, exact",
}
"""What PBVS' interaction matrix has in its rotational columns, by `StabilityCase.lever`."""

Variations: TypeAlias = Annotated[
    Any,
    words(named_numbers, "name=value,value,..., as in r_A=0.005,0.01", "NAME=VALUE,...", many=True),
]
"""Values of bounds by name; in Python a mapping."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Stability(GridResult):
    """Stability workspaces of one robot and scheme under one or several perturbation bounds.

    Attributes:
        stable: True if the servo is stable under each bounds, shape (b, k, nx, ny, nz).
        margin: Smallest eigenvalue of the symmetric part of Pi, as the verdict knows it, same
            shape [-]; minus infinity if Pi does not exist or nothing was proven.
        feasible: True if the platform can be held, shape (k, nx, ny, nz).
    """

    stable: np.ndarray
    margin: np.ndarray
    feasible: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the perturbation bounds."""
        return tuple(self.arguments["bounds"])

    @property
    def interaction_matrix(self) -> str:
        """Which interaction matrix was used, in words; empty if a scheme has but one."""
        about = self.arguments
        return LEVERS_IN_WORDS[about["case"]["lever"]] if about["scheme"] == "pbvs" else ""

    def inside(self, kind: str, bounds: str | None = None) -> np.ndarray:
        """Which poses belong to a workspace, shape (k, nx, ny, nz).

        Args:
            kind: One of `KINDS`.
            bounds: Name of the perturbation bounds; None: the first.
        """
        index = 0 if bounds is None else self.names.index(bounds)
        masks = {"Z": self.stable[index], "S": self.feasible}
        return masks["Z"] & masks["S"] if kind == "SZ" else masks[kind]

    def places(self, kind: str, bounds: str | None = None) -> np.ndarray:
        """Which positions belong to it in every orientation of the grid, shape (nx, ny, nz)."""
        return np.all(self.inside(kind, bounds), axis=0)

    def volume(
        self, kind: str, rule: VolumeRule | str = VolumeRule.CORNERS, bounds: str | None = None
    ) -> WorkspaceVolume:
        """Volume of the positions that belong to a workspace in every orientation."""
        return workspace_volume(self.places(kind, bounds), self.grid.axes, rule)

    def as_dict(self) -> dict[str, Any]:
        """Arguments, versions and volumes for JSON."""
        return {
            **self.arguments,
            "interaction_matrix": self.interaction_matrix or None,
            "versions": self.versions,
            "workspaces": [
                {"bounds": name, **{kind: self._numbers(kind, name) for kind in KINDS}}
                for name in self.names
            ],
        }

    def _numbers(self, kind: str, name: str) -> dict[str, Any]:
        return region_numbers(self.inside(kind, name), self.places(kind, name), self.grid.axes)

    def tables(self) -> list[Table]:
        """Shares and volumes under each bounds."""
        about = self.arguments
        rows = []
        for name in self.names:
            volumes = {kind: self.volume(kind, bounds=name) for kind in KINDS}
            shares = (f"{100.0 * volumes[kind].share:.1f}" for kind in KINDS)
            rows.append((name, *shares, *(f"{volumes[kind].value:.4g}" for kind in ("Z", "SZ"))))
        unit = self.volume("Z").unit
        heads = "bounds", *(f"{kind} [%]" for kind in KINDS), f"Z [{unit}]", f"SZ [{unit}]"
        title = f"{about['robot']}, {about['scheme']}, {about['verdict']}: cells inside"
        return [Table(title, heads, rows)]

    def lines(self) -> list[str]:
        """Kinds, geometry, interaction matrix, and where results are."""
        matrix = self.interaction_matrix
        return [
            grid_words(self.grid, self.robot),
            *(f"{kind}: {title}" for kind, title in KINDS.items()),
            f"cables: {self.geometry}",
            *([f"interaction matrix: {matrix}"] if matrix else []),
            *self.last_lines(),
        ]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """Planes of the grid, solids, and volumes against varied bounds."""
        from cdpr_drake.analyses.workspaces import stability_figures as draw

        figures: dict[str, Callable[[], Figure]] = {"planes": partial(draw.planes_figure, self)}
        if min(self.grid.shape[1:]) > 1 and self.robot is not None:
            figures["solids"] = partial(draw.solids_figure, self)
        if draw.curves(self):
            figures["volumes"] = partial(draw.curves_figure, self)
        return figures

    def columns(self) -> dict[str, np.ndarray]:
        """A row a pose: where it is, whether it can be held, and under each bounds Z and margin."""
        columns = {**self.grid.columns(), "S": self.feasible.reshape(-1)}
        for k, name in enumerate(self.names):
            columns[f"Z {name}"] = self.stable[k].reshape(-1)
            columns[f"margin {name}"] = self.margin[k].reshape(-1)
        return columns

    def arrays(self) -> dict[str, np.ndarray]:
        """Names are those of the attributes."""
        return {"stable": self.stable, "margin": self.margin, "feasible": self.feasible}

    def page(self, robot: Robot) -> tuple[Pictures, str]:
        """What writes the page for the browser, and what should be known of it."""
        from cdpr_drake.analyses.workspaces.workspace_scene import stability_page

        return stability_page(self, robot)


def load_stability(path: Path | str) -> Stability:
    """Reads what `Stability.save` wrote, from its file or folder.

    Raises:
        DataFileError: There is no such file, or it is not of that kind.
    """
    about, grid, arrays = load_grid(path, "stable", "workspaces", "cdpr stability")
    return Stability(**about, grid=grid, **arrays)


@verb()
def assess_stability(
    robot: RobotWord, scheme: Annotated[str, one_of(SCHEMES)] = "pbvs",
    verdict: Annotated[str, one_of(VERDICTS)] = "searched", *, bounds: InputFile = None,
    vary: Variations = None, grid: Grid = None, orientation: Orientations = (),
    scenario: ScenarioWord = None, printed_matrix: bool = False,
    draws: int = VerdictOptions.draws, seed: int = VerdictOptions.seed,
    searches: int = VerdictOptions.searches, pieces: int = VerdictOptions.pieces,
    limits: Limits = None, mass: float | None = None, wrench: Wrench = None, force: Vector = None,
    moment: Vector = None, pulleys: bool = True, folder: OutFolder = None,
    overwrite: bool = False, workers: Workers = None, formats: Formats = DEFAULT_FORMATS,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Stability:  # fmt: skip
    """Finds where a visual servo is stable (Z), the platform can be held (S), and both (SZ).

    The same call goes on in its folder after a stop.

    Args:
        robot: Robot by name or file.
        scheme: Visual servoing scheme.
        verdict: How stability is judged: by random perturbations, by a search for the worst one,
            or by a proof.
        bounds: YAML file of perturbation bounds; in Python also PerturbationBounds. Default: those
            of the servoing thesis.
        vary: Values of one bound, such as r_A=0.005,0.01 [m] or d_theta_bp_deg=3,10, each with the
            others as they are; may be repeated.
        grid: x,y,z, each a number of points in the default box, or lower:upper:step [m]; in Python
            also a WorkspaceGrid. Default: the robot's grid.
        orientation: Angles phi,theta,psi of the platform, each a number or lower:upper:step [deg];
            may be repeated. Default: unturned.
        scenario: Scenario whose object, desired view and camera count; default: the task of the
            published workspaces, the opposite corner of the grid, half a turn away.
        printed_matrix: Judge pbvs with the interaction matrix of the thesis' tables, instead of
            the exact one of the servo that cdpr simulate runs.
        draws: Random perturbations per pose, for all verdicts.
        seed: Seed of the perturbations, for all verdicts.
        searches: Local searches for the worst perturbation per pose; searched and certified.
        pieces: Pieces of the perturbations that a certificate looks at, at most; more prove more,
            and take longer; certified only.
        limits: Smallest and largest tension [N]; default: the robot's.
        mass: Mass of the platform [kg]; default: the robot's.
        wrench: Wrench on the platform about Po in W, beside its weight, moments first [N m, N].
        force: Instead of a wrench: force on the platform in Po, in W [N].
        moment: Instead of a wrench: moment on the platform in W [N m].
        pulleys: Take the robot's pulleys into account where the platform is held; the criterion
            of stability always ignores them.
        folder: Results folder; default on the command line: one named by the arguments.
        overwrite: Replace other results in the folder.
        workers: Processes, or a Dask scheduler; default: one process for each processor, for long
            work.
        formats: Formats of the figures' files.
        follow: Who follows.

    Raises:
        StoppedError: It was stopped before it was finished.
        CdprError: Something is unknown, out of range, or not possible for the robot.
        OutputFolderError: The folder holds other results or files, or cannot be written.

    Source: servoing thesis 3.3, (3.27), (3.28).
    """
    loaded = as_robot(robot, "assess_stability")
    if mass is not None and not (math.isfinite(mass) and mass >= 0.0):
        raise TensionProblemError(f"mass: found {mass:g}; accepted: >= 0 [kg]")
    poses = make_grid(loaded, robot, grid, orientation)
    options = VerdictOptions(draws=draws, seed=seed, searches=searches, pieces=pieces)
    view = None if scenario is None else scenario_view(robot, scenario)
    held = static_case(loaded, limits, mass, as_wrench(wrench, force, moment), pulleys)
    servo = robot_stability(
        robot, poses, view, scheme=scheme, verdict=verdict, bounds=bounds, options=options,
        printed_matrix=printed_matrix,
    )  # fmt: skip
    named = _variations(servo.bounds, BASE if bounds is None else GIVEN, vary)
    over = held.cables.has_pulleys()
    arguments = plain({
        "cdpr_drake": code_version(), "robot": loaded.name,
        "geometry": loaded.geometry_words(over) + (f"; {STRAIGHT}" if over else ""),
        "scheme": scheme, "verdict": verdict,
        "options": {name: getattr(options, name) for name in USED_OPTIONS[verdict]},
        "bounds": {name: each.as_dict() for name, each in named.items()},
        "grid": grid_arguments(poses), "case": servo.case, "statics": held,
    })  # fmt: skip
    title = f"{loaded.name}-{scheme}-{verdict}"
    with results_folder(title, arguments, folder, overwrite, follow.results, grows=True) as results:
        if results is not None and reused(results, follow):
            return replace(load_stability(results.path), robot=loaded).written(
                results, formats, follow
            )
        servos = [replace(servo, bounds=each) for each in named.values()]
        work = partial(judged_poses, held, servos)
        chunk = max(CHUNK_POSES[verdict] // len(set(named.values())), 1)
        chunks = Chunks(poses.size, chunk, results, follow)
        for job in finished_jobs(
            work, chunks.missing, workers, stop=follow.stop, say=follow.say, name=POSES
        ):
            chunks.add(job)
        # The poses come first in these arrays, then the bounds.
        shaped: dict[str, Any] = {name: array.T.reshape(*array.shape[1:], *poses.shape)
                  for name, array in chunks.arrays().items()}  # fmt: skip
        result = Stability(arguments=arguments, grid=poses, robot=loaded, **shaped)
        if results is not None:
            result.save(results)
        return result.written(results, formats, follow)


def judged_poses(
    held: StaticCase, servos: Sequence[ServoStability], span: Span
) -> dict[str, np.ndarray]:
    """Arrays of some poses of a grid.

    `feasible`, shape (n,), see servoing thesis (1.25); `stable` and `margin` under the bounds of
    each servo, shape (n, b). Equal bounds are judged once.
    """
    grid, poses = servos[0].grid, servos[0].grid.pose_rows(*span)
    feasible = statically_feasible(held, grid.positions(*span), grid.rotations(*span))
    judged: dict[PerturbationBounds, StabilityChunk] = {}
    for servo in servos:
        if servo.bounds not in judged:
            judged[servo.bounds] = judge_stability(
                servo.case, servo.bounds, poses, servo.verdict, servo.options
            )
    columns = {
        name: np.stack([getattr(judged[servo.bounds], name) for servo in servos], axis=1)
        for name in ("stable", "margin")
    }
    return {"feasible": feasible, **columns}


def _variations(base: PerturbationBounds, name: str, vary: Any) -> dict[str, PerturbationBounds]:
    """Bounds by name: the base, and the base with one bound changed."""
    named = {name: base}
    for parameter, values in vary.items() if isinstance(vary, Mapping) else vary or ():
        for value in map(float, values):
            changed = varied(base, parameter, value)
            if named.setdefault(f"{parameter}={value:g}", changed) != changed:
                raise StabilityError(
                    f"{parameter}: found values that agree to six digits, {value!r} among them; "
                    "accepted: values further apart"
                )
    return named
