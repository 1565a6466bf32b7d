"""Whether a servo is stable at poses, in spite of any perturbation within bounds.

Three verdicts of growing weight: `sampled` looks at random perturbations, `searched` looks for the
worst one, `certified` proves that there is none. At every pose certified implies searched implies
sampled, and the margins are ordered likewise.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import StabilityError, accepted_names
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.stability.criterion_at_pose_kernel import CaseArrays, PoseRows
from cdpr_drake.stability.desired_view import TargetRows
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds, vector_size
from cdpr_drake.stability.perturbation_samples_kernel import direction_codes, pose_bits
from cdpr_drake.stability.sampled_kernel import sampled_margins
from cdpr_drake.stability.searched_kernel import searched_margins
from cdpr_drake.stability.stability_case import (
    OBJECT_POSE_MODELS,
    SCHEMES,
    SPATIAL_SCHEMES,
    StabilityCase,
)

VERDICTS = ("sampled", "searched", "certified")
"""Verdicts by growing weight."""

PROOFS = "cdpr_drake.proofs.certified_kernel"
"""What the verdict `certified` is proven by; the wing of proofs hangs on here, by name."""


@dataclass(frozen=True)
class VerdictOptions:
    """How hard to look.

    Attributes:
        draws: Random perturbations per pose.
        seed: Start of the random numbers; a pose's draws depend on it and on the pose alone.
        magnitude: "full" for perturbations as large as the bounds allow, "inside" for magnitudes
            that fill the balls evenly.
        searches: Local searches per pose at most: one half, rounded up, from draws that were worse
            than all before them, the last ones first, the others from random directions.
        steps: Steps of a search at most.
        rounds: Rounds of the certificate at most.
        pieces: Pieces of the perturbations that the certificate of a pose looks at, at most; 1:
            only the whole.
        margins: Whether margins are wanted; without, a pose is left at its first unstable
            perturbation, or as soon as it is certified.
        threads: Number of threads; None: all cores.
    """

    draws: int = 50
    seed: int = 0
    magnitude: str = "full"
    searches: int = 6
    steps: int = 20
    rounds: int = 10
    pieces: int = 100
    margins: bool = True
    threads: int | None = None

    def __post_init__(self) -> None:
        """Refuses what cannot be done.

        Raises:
            StabilityError: A number out of range or an unknown word.
        """
        for name, lowest in (
            ("draws", 1), ("seed", 0), ("searches", 1), ("steps", 1), ("rounds", 1), ("pieces", 1),
            ("threads", 1),
        ):  # fmt: skip
            value = getattr(self, name)
            if value is not None and value < lowest:
                raise StabilityError(f"{name}: found {value}; accepted: at least {lowest}")
        if self.magnitude not in ("full", "inside"):
            raise StabilityError(f"magnitude: found {self.magnitude}; accepted: full, inside")


@dataclass(frozen=True, eq=False)
class StabilityChunk:
    """Verdicts on a chunk of poses.

    Attributes:
        stable: Whether the criterion holds, shape (N,) bool.
        margin: Smallest eigenvalue of (Pi + Pi') / 2 that was found, or for `certified` a lower
            bound of it over all perturbations, shape (N,) [-]; minus infinity where a Jacobian is
            singular or nothing was proven.
    """

    stable: np.ndarray
    margin: Array


def judge_stability(
    case: StabilityCase,
    bounds: PerturbationBounds,
    poses: Array,
    verdict: str = "sampled",
    options: VerdictOptions | None = None,
) -> StabilityChunk:
    """Judges poses; the result of a pose does not depend on the others.

    Args:
        case: Robot, scheme, target.
        bounds: What limits the perturbations.
        poses: Nominal platform poses X_WP, rows of quaternion (w, x, y, z) and position [m], shape
            (N, 7). Quaternions are normalised.
        verdict: One of `VERDICTS`.
        options: How hard to look.

    Raises:
        StabilityError: Unknown verdict, poses of another shape or that are not finite, a planar
            robot's pose that is not turned about z, a target that does not give what the scheme
            needs, or a certificate for perturbations that none covers: of the truth, of the
            object's orientation, or of its position under 2 1/2 D and IBVS.
    """
    if verdict not in VERDICTS:
        raise StabilityError(f"verdict: found {verdict}; {accepted_names(verdict, VERDICTS)}")
    return _judged(case, bounds, poses, (verdict,), options or VerdictOptions())[verdict]


def judge_all_verdicts(
    case: StabilityCase,
    bounds: PerturbationBounds,
    poses: Array,
    options: VerdictOptions | None = None,
) -> dict[str, StabilityChunk]:
    """Every verdict at once, with one search instead of two; as `judge_stability` else."""
    return _judged(case, bounds, poses, VERDICTS, options or VerdictOptions())


def _judged(
    case: StabilityCase,
    bounds: PerturbationBounds,
    poses: Array,
    verdicts: tuple[str, ...],
    options: VerdictOptions,
) -> dict[str, StabilityChunk]:
    certify = "certified" in verdicts
    if certify:
        refuse_unproven(case, bounds)
    arrays, rows = packed_case(case, bounds, poses)
    count, size = len(rows.poses), vector_size(case.m)
    margins = {verdict: np.empty(count) for verdict in VERDICTS}
    found_at = np.zeros((count if certify else 0, size))
    from_draws = (options.searches + 1) // 2
    from_vectors = options.searches - from_draws
    first_only = not options.margins
    looking = (
        arrays, rows, options.draws, options.seed, options.magnitude == "inside", first_only,
    )  # fmt: skip
    threads = options.threads
    if "sampled" in verdicts:
        over_rows(sampled_margins, count, threads, *looking, margins["sampled"])
    if certify or "searched" in verdicts:
        over_rows(
            searched_margins, count, threads, *looking, from_draws, from_vectors, options.steps,
            margins["searched"], found_at,
        )  # fmt: skip
    if certify:
        over_rows(
            import_module(PROOFS).certified_margins, count, threads, arrays, rows,
            margins["searched"], found_at, options.rounds, options.pieces, first_only,
            margins["certified"],
        )  # fmt: skip
    return {
        verdict: StabilityChunk(margins[verdict] > 0.0, margins[verdict]) for verdict in verdicts
    }


def refuse_unproven(case: StabilityCase, bounds: PerturbationBounds) -> None:
    """Raises StabilityError for perturbations that no proof covers, see `judge_stability`."""
    if case.perturbed != "estimate":
        raise StabilityError(
            f"perturbed: found {case.perturbed} for a certificate; accepted: estimate"
        )
    most = import_module(PROOFS).MOST_CABLES
    if case.m > most:
        raise StabilityError(
            f"cables: found {case.m} taut for a certificate; accepted: at most {most}"
        )
    if bounds.d_theta_s > 0.0:
        raise StabilityError(
            f"d_theta_s: found {bounds.d_theta_s:g} for a certificate; accepted: 0 [rad]"
        )
    if bounds.r_s > 0.0 and case.scheme in SPATIAL_SCHEMES:
        raise StabilityError(
            f"r_s: found {bounds.r_s:g} for a certificate of {case.scheme}; accepted: 0 [m]"
        )


def packed_case(
    case: StabilityCase, bounds: PerturbationBounds, poses: Array
) -> tuple[CaseArrays, PoseRows]:
    """A case and poses as the kernels take them; arguments and errors as `judge_stability`."""
    poses, unit = _checked_poses(poses, case.planar)
    arrays = _case_arrays(case, bounds)
    if case.planar:
        arrays.A[:, 2], arrays.B[:, 2], arrays.t[2] = 0.0, 0.0, 0.0
    R_WP = rotations_of_quaternions(unit)
    p_WC = poses[:, 4:] + np.einsum("nij,j->ni", R_WP, arrays.t)
    rows = case.target.rows(np.einsum("nij,jk->nik", R_WP, arrays.C), p_WC)
    error, theta_u = rows.error, rows.theta_u
    if not (np.all(np.isfinite(error)) and np.all(np.isfinite(theta_u))):
        raise StabilityError("target: found NaN or infinity; accepted: finite numbers [m, rad]")
    if case.planar:
        error, theta_u = error * [1.0, 1.0, 0.0], theta_u * [0.0, 0.0, 1.0]
    _refuse_unseen(case, bounds, rows)
    seen = (np.ascontiguousarray(x, float) for x in (theta_u, error, rows.p_CO, rows.R_CO))
    return arrays, PoseRows(poses, pose_bits(poses), *seen)


def _checked_poses(poses: Array, planar: bool) -> tuple[Array, Array]:
    """A copy of the poses, of a planar robot in its plane, and their unit quaternions."""
    poses = np.array(poses, float, ndmin=2)
    if poses.ndim != 2 or poses.shape[1] != 7:
        raise StabilityError(f"poses: found shape {poses.shape}; accepted: (N, 7)")
    if not np.all(np.isfinite(poses)):
        raise StabilityError("poses: found NaN or infinity; accepted: finite numbers")
    norms = np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
    if np.any(norms < 1e-6):
        raise StabilityError("poses: found a quaternion of zeros; accepted: (w, x, y, z) of a turn")
    if planar:
        if np.any(np.abs(poses[:, 1:3]) > 1e-9 * norms):
            raise StabilityError("poses: found a planar robot tilted; accepted: turns about z")
        poses[:, 1:3], poses[:, 6] = 0.0, 0.0
    return poses, poses[:, :4] / norms


def _case_arrays(case: StabilityCase, bounds: PerturbationBounds) -> CaseArrays:
    taut = case.taut_cables()
    arrays = CaseArrays(
        np.ascontiguousarray(case.cables.p_WA.T[taut]),
        np.ascontiguousarray(case.cables.p_PB.T[taut]),
        np.ascontiguousarray(case.X_PC.rotation().matrix()),
        np.array(case.X_PC.translation(), float),
        SCHEMES.index(case.scheme),
        case.planar,
        OBJECT_POSE_MODELS.index(case.lever),
        case.perturbed == "truth",
        np.zeros((3, 0)) if case.p_OK is None else np.ascontiguousarray(case.p_OK, float),
        bounds.radii(),
        direction_codes(bounds),
    )
    for name, value in (("p_WA", arrays.A), ("p_PB", arrays.B), ("X_PC", arrays.t)):
        if not np.all(np.isfinite(value)):
            raise StabilityError(f"{name}: found NaN or infinity; accepted: finite numbers [m]")
    return arrays


def _refuse_unseen(case: StabilityCase, bounds: PerturbationBounds, rows: TargetRows) -> None:
    moved = bounds.r_s > 0.0 or bounds.d_theta_s > 0.0
    if case.scheme == "ibvs" and moved and case.p_OK is None:
        raise StabilityError("p_OK: found none; accepted: points of the object, since r_s > 0")
    needs = case.scheme == "2.5d" or (case.scheme == "ibvs" and case.p_OK is not None)
    if (needs or case.lever == "object") and np.any(np.isnan(rows.p_CO)):
        raise StabilityError(f"target: found no object position; scheme {case.scheme} needs p_CO")
    if case.scheme == "ibvs" and case.p_OK is not None and np.any(np.isnan(rows.R_CO)):
        raise StabilityError("target: found no object orientation; ibvs with points needs R_CO")


def worst_perturbations(
    case: StabilityCase,
    bounds: PerturbationBounds,
    poses: Array,
    options: VerdictOptions | None = None,
) -> tuple[Array, Array]:
    """Perturbations within bounds that bring the servo closest to instability.

    A local search from several starts; there may be worse ones.

    Args:
        case: Robot, scheme, target.
        bounds: What limits the perturbations.
        poses: Nominal platform poses, rows (qw, qx, qy, qz, x, y, z), shape (N, 7) [-, m].
        options: How hard to look.

    Returns:
        Smallest eigenvalues of the symmetric part of Pi that were found, shape (N,) [-], as the
        verdict `searched` has them, and the perturbations that have them, shape (N, 18 + 6 m)
        [rad, m], see `stability.perturbation_bounds`; zeros where none lowers the eigenvalue
        below the 1 of the nominal model.

    Raises:
        StabilityError: As `judge_stability`.
    """
    o = options or VerdictOptions()
    arrays, rows = packed_case(case, bounds, poses)
    count = len(rows.poses)
    margin, found_at = np.empty(count), np.zeros((count, vector_size(case.m)))
    from_draws = (o.searches + 1) // 2
    inside = o.magnitude == "inside"
    over_rows(
        searched_margins, count, o.threads, arrays, rows, o.draws, o.seed, inside, False,
        from_draws, o.searches - from_draws, o.steps, margin, found_at,
    )  # fmt: skip
    return margin, found_at
