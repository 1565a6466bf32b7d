"""The worst perturbation that a search finds at a pose."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.kernel_threads import over_rows
from cdpr_drake.perturbation_bounds import PerturbationBounds, vector_size
from cdpr_drake.stability_case import StabilityCase
from cdpr_drake.stability_searched import searched_margins
from cdpr_drake.stability_verdict import VerdictOptions, packed_case


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
        [rad, m], see `cdpr_drake.perturbation_bounds`; zeros where none lowers the eigenvalue
        below the 1 of the nominal model.

    Raises:
        StabilityError: As `judge`.
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
