"""Runs the study, and what it leaves: numbers, tables, figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.table import Table
from scipy.stats import chi2

from cdpr_drake.analyses.reporting.log_files import finite
from cdpr_drake.analyses.reporting.progress import (
    DEFAULT_STUDY_SESSION,
    StoppableStudy,
    StudySession,
    WorkProgress,
)
from cdpr_drake.analyses.reporting.provenance import code_version, package_versions
from cdpr_drake.analyses.reporting.statements import Statement, new_table, statement_table, verdict
from cdpr_drake.analyses.studies.framework.seeded_study import DrawnStudy
from cdpr_drake.analyses.studies.identification import trials
from cdpr_drake.analyses.studies.identification.trials import MISFITS, CampaignTask, NoiseTask
from cdpr_drake.analyses.sweeps.sweep import run_study_sweep
from cdpr_drake.analyses.sweeps.workers import SweepTask
from cdpr_drake.analyses.visualization.figure_style import bar_style, line_style, new_figure
from cdpr_drake.arrays import Array
from cdpr_drake.palette import BOUND, nth_look

SEEDS, QUICK_SEEDS = 100, 2
CAMPAIGNS = 10
"""Seeds of which a campaign is simulated."""

NOISE, CAMPAIGN = "noise", "campaign"
NAMES = ("mass", "c x", "c y", "c z", "I xx", "I yy", "I zz", "I xy", "I xz", "I yz")
SURE = 0.01
"""Share of studies with right covariances in which chi-square of all seeds is called wrong."""

CONSISTENT = 0.1
"""By which chi-square per degree of freedom may differ from 1 and be right in part."""

BOUND_WITHIN = 0.2
BETTER = 1.5
"""Times that standard errors of a random excitation are as large, in the median."""

OUTSIDE_WITHIN, TRACKING_WITHIN = 1.5, 0.2


@dataclass(frozen=True, eq=False)
class IdentificationStudy(DrawnStudy, StoppableStudy):
    """What the study found.

    Attributes:
        quick: Whether it was the quick form.
        seeds: Of identifications from noisy logs.
        found: Arrays of what is finished, see `trials`, with the seeds as first axis.
        progress: Where it stood at the end.
    """

    quick: bool
    seeds: int
    found: dict[str, dict[str, Array]]
    progress: WorkProgress

    def statements(self) -> list[Statement]:
        """What has to hold, judged."""
        judges: dict[str, tuple[Callable[[], Statement], ...]] = {
            NOISE: (self._covariance, self._bound, self._designed),
            CAMPAIGN: (self._outside, self._tracking),
        }
        return [judge() for name, each in judges.items() if name in self.found for judge in each]

    def _covariance(self) -> Statement:
        squares = self.found[NOISE]["squares"]
        count = 10 * len(squares)
        ratio = float(np.sum(squares)) / count
        low, high = chi2.ppf([SURE / 2, 1 - SURE / 2], count) / count
        return Statement(
            "errors are as large as covariances say",
            "chi-square per degree of freedom of errors: 1",
            f"{ratio:.3f} (accepted {low:.3f} to {high:.3f})",
            verdict(bool(low < ratio < high), abs(ratio - 1.0) < CONSISTENT),
        )

    def _bound(self) -> Statement:
        ratios = self.found[NOISE]["errors"] / self.found[NOISE]["bound"]
        each = np.sqrt(np.mean(ratios**2, axis=0))
        total = float(np.sqrt(np.mean(ratios**2)))
        return Statement(
            "errors are at the Cramer-Rao bound of smoothed poses and tensions",
            "rms of errors over their bounds: 0.8 to 1.2",
            f"{total:.3f}; single parameters {each.min():.2f} to {each.max():.2f}",
            verdict(bool(abs(total - 1.0) < BOUND_WITHIN)),
        )

    def _designed(self) -> Statement:
        ratio = self.found[NOISE]["random"] / self.found[NOISE]["bound"]
        share = float(np.mean(np.all(ratio > 1.0, axis=1)))
        middle = float(np.median(ratio))
        return Statement(
            "designed excitations tell more than random ones of the same time and limits",
            f"standard errors of random ones over those: at least {BETTER} in the median",
            f"{middle:.2f}; all ten smaller in {100 * share:.0f} % of the seeds",
            verdict(middle >= BETTER, middle > 1.0),
        )

    def _outside(self) -> Statement:
        misfit = self.found[CAMPAIGN]["misfit"][..., :2]
        ratio = misfit[:, 1, 0] / misfit[:, 0, 0]
        gain = misfit[:, 1, 1] / misfit[:, 1, 0]
        return Statement(
            "a log that was not fitted is explained as well as the one that was",
            f"forces and moments not explained: at most {OUTSIDE_WITHIN} times as much",
            f"{np.max(ratio):.2f} times at most; before, {np.min(gain):.0f} times that or more",
            verdict(bool(np.all(ratio < OUTSIDE_WITHIN)), bool(np.median(ratio) < OUTSIDE_WITHIN)),
        )

    def _tracking(self) -> Statement:
        place = self.found[CAMPAIGN]["tracking"][:, :, 0]
        excess = place[:, 1] / place[:, 2] - 1.0
        words = ", ".join(
            f"{who} {1e3 * np.mean(place[:, k]):.3f} mm" for k, who in enumerate(trials.WHO)
        )
        return Statement(
            "with the identified robot the platform tracks as with the true one",
            "mean distance within 20 %",
            f"{words}; {100 * np.max(excess):.0f} % more at most",
            verdict(
                bool(np.all(excess < TRACKING_WITHIN)), bool(np.median(excess) < TRACKING_WITHIN)
            ),
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON: parameters, versions, numbers of all seeds, statements."""
        names = [name for name in dir(trials) if name.isupper()]
        return {
            "study": "identification",
            "quick": self.quick,
            "interrupted": self.interrupted,
            "seeds": list(range(self.seeds)),
            "parameters": {name: finite(getattr(trials, name)) for name in names},
            "versions": package_versions(),
            "names": list(NAMES),
            "misfits": list(MISFITS),
            "found": finite(
                {
                    name: {key: array.tolist() for key, array in arrays.items()}
                    for name, arrays in self.found.items()
                }
            ),
            "statements": [statement.as_dict() for statement in self.statements()],
        }

    def tables(self) -> list[Table]:
        """Tables for the terminal."""
        tables = []
        if NOISE in self.found:
            arrays = self.found[NOISE]
            table = new_table(
                f"Identifications, {len(arrays['errors'])} seeds", ("parameter",),
                ("rms error", "std. error", "error over bound", "random over designed"),
            )  # fmt: skip
            for k, name in enumerate(NAMES):
                error = np.sqrt(np.mean(arrays["errors"][:, k] ** 2))
                over = np.sqrt(np.mean((arrays["errors"] / arrays["bound"])[:, k] ** 2))
                ratio = np.median((arrays["random"] / arrays["bound"])[:, k])
                std = np.mean(arrays["std"][:, k])
                table.add_row(name, f"{error:.2g}", f"{std:.2g}", f"{over:.2f}", f"{ratio:.2f}")
            tables.append(table)
        statements = self.statements()
        if statements:
            tables.append(statement_table("What has to hold", statements))
        return tables

    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """The one figure of what is finished."""
        return {"identification": self._figure}

    def _figure(self) -> Figure:
        figure, axes = new_figure(1, 3, (16.0, 5.0), "Identification over seeds")
        if NOISE in self.found:
            arrays, places = self.found[NOISE], np.arange(len(NAMES))
            values = np.sort(arrays["squares"])
            share = (np.arange(len(values)) + 0.5) / len(values)
            axes[0].plot(values, share, marker="o", label="found", **line_style(nth_look(0)))
            low, high = chi2.ppf([0.001, 0.999], 10)
            x = np.linspace(float(low), float(high), 200)
            axes[0].plot(x, chi2.cdf(x, 10), label="chi-square", **line_style(BOUND))
            over = np.sqrt(np.mean((arrays["errors"] / arrays["bound"]) ** 2, axis=0))
            ratio = np.median(arrays["random"] / arrays["bound"], axis=0)
            axes[1].bar(places - 0.2, over, 0.4, label="rms error", **bar_style(nth_look(1)))
            axes[1].bar(
                places + 0.2, ratio, 0.4, label="bound, random poses", **bar_style(nth_look(2))
            )
            axes[1].axhline(1.0, **line_style(BOUND))
            axes[1].set_xticks(places, NAMES, rotation=60)
        if CAMPAIGN in self.found:
            place = 1e3 * self.found[CAMPAIGN]["tracking"][:, :, 0]
            for k, who in enumerate(trials.WHO):
                axes[2].plot(place[:, k], marker="osv"[k], label=who, **line_style(nth_look(k)))
            axes[2].set_yscale("log")
        axes[0].set(xlabel="errors over covariance, squared [-]", ylabel="share of seeds",
                    title="covariance")  # fmt: skip
        axes[1].set(ylabel="over the bound of the designed motion [-]", title="Cramer-Rao")
        axes[2].set(xlabel="seed", ylabel="mean distance [mm]", title="tracking by belief")
        for one in axes:
            if one.get_legend_handles_labels()[0]:
                one.legend()
        return figure


def study_identification(
    quick: bool = False, session: StudySession = DEFAULT_STUDY_SESSION
) -> IdentificationStudy:
    """Runs the study; each seed is an item of a sweep.

    Args:
        quick: Two seeds and one campaign, to see that everything works.
        session: How it is run, and how many seeds.

    Raises:
        OutputFolderError: The folder belongs to other arguments, or cannot be written.
        SweepError: A local process died.
    """
    seeds = session.seeds or (QUICK_SEEDS if quick else SEEDS)
    noise, campaign = NoiseTask(), CampaignTask()
    tasks: dict[str, tuple[SweepTask, int]] = {
        NOISE: (noise, seeds),
        CAMPAIGN: (campaign, 1 if quick else min(CAMPAIGNS, seeds)),
    }
    arguments = {
        "cdpr_drake": code_version(),
        "study": "identification",
        "quick": quick,
        "seeds": seeds,
        "tasks": {NOISE: asdict(noise), CAMPAIGN: asdict(campaign)},
    }
    result = run_study_sweep(tasks, 1, "trials", arguments, session)
    return IdentificationStudy(quick, seeds, result.finished, result.progress)
