"""What an identification found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.numerics.own_terms import ProgramReport

OPTIMAL, AT_THE_RIM, MISFIT = "optimal", "at the rim of what bodies can have", "misfit"
"""Statuses: the most likely parameters; the same on a bound that the data alone would pass;
parameters with which the data is off by more than `MISFIT_FACTOR` says."""

MISFIT_FACTOR = 3.0
"""Residuals over their standard deviations, root mean square, above which nothing fits: what was
found then answers to something other than the noise of the log."""


@dataclass(frozen=True)
class Residual:
    """An equation that is off.

    Attributes:
        time: When [s].
        equation: Which, in words.
        value: What is not explained, in the unit.
        unit: Of the value.
        sigmas: By how many standard deviations the equation is off where the others of its stretch
            are known. With few cables it is more than the value over its own noise: tensions
            cannot make a wrench across their cables, however noisy they are.
    """

    time: float
    equation: str
    value: float
    unit: str
    sigmas: float


@dataclass(frozen=True)
class TermFit:
    """How one kind of measurement fits.

    Attributes:
        count: Equations.
        rms: Root mean square of their residuals over sigma.
        misfit: Root mean square of what is not explained, by quantity with its unit.
    """

    count: int
    rms: float
    misfit: dict[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentificationResult:
    """What an identification found.

    Attributes:
        status: `OPTIMAL`, `AT_THE_RIM` or `MISFIT`.
        solver: What solved it.
        model: The robot's dynamics as found.
        believed: As it was believed before.
        names: Of the unknown parameters.
        units: Theirs.
        values: Shape (f,).
        before: As they were believed, shape (f,).
        covariance: Shape (f, f). Where residuals are larger than noise it is that of the noise
            and `pose_error` that were found, multiplied by what is left of chi-square over
            degrees, and by how much more estimates scatter between stretches of the log than
            independent residuals make them. Where a bound is active, that of the problem without
            it.
        condition: Condition number of the weighted equations in typical sizes.
        terms: How measurements fit, by kind.
        chi_square: Of all residuals, over the noise that the log has by itself.
        degrees: Equations less unknowns.
        spread: Root of chi-square over degrees: 1 where sigmas are right.
        active: Bounds that the data alone would pass, in words.
        outliers: Equations that count less than others.
        largest: The largest residuals, largest first.
        steps: Times that it was solved.
        last_step: How far the last of them would have gone, in standard errors.
        wall_time: [s].
        pose_error: By how much poses are off beyond their noise, as residuals tell [m]; of
            rotations over the size of the platform [rad]. Equations are weighted with it; 0: the
            noise explains the residuals.
        remarks: That steps did not settle, or that priors contradict the log, in words.
        program: With own terms, how the program was solved; None: without.
    """

    status: str
    solver: str
    model: DynamicModel
    believed: DynamicModel
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    before: Array
    covariance: Array
    condition: float
    terms: dict[str, TermFit]
    chi_square: float
    degrees: int
    spread: float
    active: tuple[str, ...]
    outliers: int
    largest: tuple[Residual, ...]
    steps: int
    last_step: float
    pose_error: float = 0.0
    remarks: tuple[str, ...] = ()
    wall_time: float = 0.0
    program: ProgramReport | None = None

    @property
    def std(self) -> Array:
        """Standard errors of the parameters, shape (f,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
