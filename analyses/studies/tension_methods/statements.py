"""What the Gazebo thesis states about tension methods, beside what the study found."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import SOURCE, Finding, statement
from cdpr_drake.analyses.studies.tension_methods.trial import Applied

JUMP = 0.1
"""A smooth motion changes no tension by as much within one control step of 1 ms [N]."""

GROWS = 1.05
"""A quantity grows with the gain if it does by this factor from one gain to the next."""

FACTOR = 2.0
"""A size is the printed one within this factor, below or above; a rise or a fall is if it is as
steep as the root of the printed one."""

FALLS = 1.3
"""An error falls with the gain if it does by this factor: the root of the least fall that figures
6.8 to 6.13 show, 1.7."""

STEADY = 1e-4
"""A steady-state error that could be seen in the figure [m]."""


def _run(
    runs: Runs, experiment: str, method: str, gain: float, applied: Applied = Applied.HELD
) -> Run:
    return runs.one(experiment=experiment, method=method, kp_per_s2=gain, applied=str(applied))


def _values(
    runs: Runs, column: str, experiment: str, method: str, gains: Iterable[float],
    applied: Applied = Applied.HELD,
) -> list[float]:  # fmt: skip
    """A column of runs that differ in their gains only."""
    return [_run(runs, experiment, method, gain, applied)[column] for gain in gains]


LP, QP = "linear_program", "quadratic_program"
GAINS = (100.0, 800.0, 1200.0)
"""Gains Kp at which all methods are printed [1/s^2]."""

LP_LARGEST, QP_LARGEST = (54.0, 456.0, 1224.0), (32.0, 110.0, 342.0)
"""Printed largest tensions of the programs at these gains [N]."""

PSEUDO_LARGEST = 117.0
"""That of the pseudo-inverse at each of them [N]."""


def _near(value: float, printed: float) -> bool:
    """Whether a value is a printed one within `FACTOR`."""
    return printed / FACTOR <= value <= printed * FACTOR


@statement(
    "Tensions of the linear program jump.",
    "seen in figures 6.8 to 6.10",
    source="Gazebo thesis 6.4.1",
    rule=f"by more than {JUMP:g} N within 1 ms at each gain",
    cause=SOURCE,
)
def lp_jumps(runs: Runs) -> Finding:
    """Jumps of the linear program's tensions."""
    jumps = _values(runs, "tension_jump_max_n", "thesis", LP, GAINS)
    return Finding(
        found=f"largest jump in 1 ms {_list(jumps)} N",
        held=[jump > JUMP for jump in jumps],
        some=False,
        why="Its optimum is a corner of the feasible set and changes from one corner to another.",
    )


@statement(
    "Tensions of the quadratic program jump, too, most at gain 1500.",
    "seen in figures 6.11 to 6.14",
    source="Gazebo thesis 6.4.2",
    rule=f"by more than {JUMP:g} N within 1 ms at each gain",
    cause=SOURCE,
)
def qp_jumps(runs: Runs) -> Finding:
    """Jumps of the quadratic program's tensions."""
    jumps = _values(runs, "tension_jump_max_n", "thesis", QP, (*GAINS, 1500.0))
    return Finding(
        found=f"largest jump in 1 ms {_list(jumps)} N",
        held=[jump > JUMP for jump in jumps],
        why="The 2-norm optimum is continuous where the wrench is. Jumps then come from the loop: "
        "a published version of the thesis' simulator runs it at 100 Hz, where gains of 800 and "
        "more are unstable (experiment slow).",
    )


@statement(
    "The largest tension of the quadratic program is below that of the linear program at "
    "equal gain.",
    "100: 32 against 54; 800: 110 against 456; 1200: 342 against 1224 N",
    source="Gazebo thesis 6.4.1, 6.4.2",
    rule="at each gain, on the trajectory and from a step; on the trajectory the ratio of both "
    f"within a factor {FACTOR:g} of the printed one",
    cause=SOURCE,
)
def qp_needs_less(runs: Runs) -> Finding:
    """Largest tensions of the quadratic program against the linear program's."""
    pairs = {
        name: list(
            zip(*(_values(runs, "tension_max_n", name, m, GAINS) for m in (QP, LP)), strict=True)
        )
        for name in ("thesis", "step")
    }
    words = "; ".join(
        f"{name}: " + ", ".join(f"{qp:.2f} against {lp:.2f}" for qp, lp in both)
        for name, both in pairs.items()
    )
    return Finding(
        found=f"{words} N (gains 100, 800, 1200)",
        held=[
            *(qp < lp for both in pairs.values() for qp, lp in both),
            *(
                _near(qp / lp, QP_LARGEST[k] / LP_LARGEST[k])
                for k, (qp, lp) in enumerate(pairs["thesis"])
            ),
        ],
        why="On the trajectory by little, since its largest tensions come at the end, near the "
        "exit points, where there is little to choose. The thesis does not say where it started; "
        "from a start error of some decimetres both are largest at the first request that can be "
        "met, where there is nothing to choose (largest_at_launch, largest_by_start_error).",
    )


@statement(
    "Higher gains cost higher tensions.",
    "quadratic program 32, 110, 342 N",
    source="Gazebo thesis 6.4.2",
    rule="on the trajectory, from gain to gain at least by the root of the printed factor; in "
    f"part: from a step, from gain 100 to 1200 by a factor of {GROWS:g}",
    cause=SOURCE,
)
def tension_grows(runs: Runs) -> Finding:
    """Largest tensions against the gain."""
    still, step = (_values(runs, "tension_max_n", name, QP, GAINS) for name in ("thesis", "step"))
    return Finding(
        found=f"thesis {_list(still)} N; step {_list(step)} N",
        held=[
            more / less >= (printed / before) ** 0.5
            for (less, more), (before, printed) in zip(
                pairwise(still), pairwise(QP_LARGEST), strict=True
            )
        ],
        some=step[2] > GROWS * step[0],
        why="With the exact model there is no error for the gain to act on, except where the "
        "platform starts beside its goal. The thesis does not say where it started; from a start "
        "error of some decimetres they grow as the gain does (largest_by_start_error).",
    )


@statement(
    "Higher gains bring smaller position errors (both programs).",
    "figures 6.8, 6.9, 6.11 to 6.13",
    source="Gazebo thesis 6.4.1, 6.4.2",
    rule=f"the largest errors by a factor of {FALLS:g}: of the linear program from gain 100 to "
    "800, of the quadratic one from gain to gain",
    cause=SOURCE,
)
def error_falls(runs: Runs) -> Finding:
    """Position errors against the gain."""
    lp = [1e6 * one for one in _values(runs, "position_error_max_m", "thesis", LP, GAINS[:2])]
    qp = [1e6 * one for one in _values(runs, "position_error_max_m", "thesis", QP, GAINS)]
    return Finding(
        found=f"largest error, linear program {_list(lp)} um, quadratic program {_list(qp)} um",
        held=[more > FALLS * less for errors in (lp, qp) for more, less in pairwise(errors)],
        some=False,
        why="What is left comes from the wrench that is held for a millisecond.",
    )


@statement(
    "Gain 1500 is no appreciable improvement on 1200.",
    "figure 6.14",
    source="Gazebo thesis 6.4.2",
    rule="the largest error falls by less than 5 %; in part: by less than 1 um",
    cause=SOURCE,
)
def no_better(runs: Runs) -> Finding:
    """Gain 1500 against 1200."""
    errors = [
        1e6 * one for one in _values(runs, "position_error_max_m", "thesis", QP, (1200.0, 1500.0))
    ]
    return Finding(
        found=f"largest error {_list(errors)} um",
        held=[errors[1] > 0.95 * errors[0]],
        some=errors[0] - errors[1] < 1.0,
        why="The error falls as one over the gain, but by less than a micrometre.",
    )


@statement(
    "Gain 1200 (linear program) and 1500 (quadratic program) oscillate and come near instability.",
    "figures 6.10, 6.14",
    source="Gazebo thesis 6.4.1, 6.4.2",
    rule="each falls, fails, or has a larger error than at gain 100; in part: what starts 50 mm "
    "beside it or is controlled at 100 Hz does",
    cause=SOURCE,
)
def unstable(runs: Runs) -> Finding:
    """Gains that come near instability."""
    ends = {gain: _run(runs, "slow", QP, gain) for gain in (*GAINS, 1500.0)}
    calm = _run(runs, "thesis", QP, 100.0)["position_error_max_m"]
    named = [_run(runs, "thesis", LP, 1200.0), _run(runs, "thesis", QP, 1500.0)]
    near = [_fails(one) or one["position_error_max_m"] > calm for one in named]
    far = _run(runs, "far_step", QP, 1200.0)
    bad = [f"{gain:g}" for gain, run in ends.items() if _fails(run)]
    return Finding(
        found=f"at 1 kHz largest errors {_list([1e6 * r['position_error_max_m'] for r in named])} "
        f"um, at gain 100 {1e6 * calm:.3g} um; from 50 mm beside it "
        + (f"falls after {far['end_time_s']:.1f} s" if far["lost"] else "does not fall")
        + f"; at 100 Hz unstable at gains {', '.join(bad) or 'none'}",
        held=near,
        some=any(near) or far["lost"] or bool(bad),
        why="A sampled loop needs Kd times the sampling time well below 2: 1.2 at 1 kHz, 12 at "
        "100 Hz. A suspended platform cannot be pulled down, so an overshooting request above g "
        "cannot be met.",
    )


def _fails(run: Run) -> bool:
    return bool(run["lost"] or run["failures"] > 0)


@statement(
    "The pseudo-inverse gives negative tensions, at the beginning.",
    "figures 6.15 to 6.17",
    source="Gazebo thesis 6.4.3",
    rule="from the start that was moved inside and from the printed one; in part: the latter",
    cause=SOURCE,
)
def pseudo_inverse_negative(runs: Runs) -> Finding:
    """Negative tensions by the pseudo-inverse."""
    held, printed = (
        _run(runs, name, "pseudo_inverse", 100.0, Applied.PUSHED) for name in ("thesis", "printed")
    )
    return Finding(
        found=f"start moved inside: smallest {held['tension_min_n']:.2f} N, below 1 N in "
        f"{held['failures']} of {held['control_steps']} steps; printed start: "
        f"{printed['tension_min_n']:.2f} N, {printed['negative_tensions']} negative tensions",
        held=[held["tension_min_n"] < 0.0, printed["tension_min_n"] < 0.0],
        some=printed["tension_min_n"] < 0.0,
        why="From the printed start, which no tensions hold; inside it breaks the bound of 1 N "
        "only.",
    )


@statement(
    "The pseudo-inverse's largest tension is the same at all three gains.",
    f"{PSEUDO_LARGEST:g} N",
    source="Gazebo thesis 6.4.3",
    rule=f"the same within 1 %; the printed one within a factor {FACTOR:g}",
    cause=SOURCE,
)
def pseudo_inverse_117(runs: Runs) -> Finding:
    """The pseudo-inverse's largest tension at each gain."""
    largest = _values(runs, "tension_max_n", "printed", "pseudo_inverse", GAINS, Applied.PUSHED)
    return Finding(
        found=f"{_list(largest)} N",
        held=[
            max(largest) - min(largest) < 0.01 * max(largest),
            all(_near(one, PSEUDO_LARGEST) for one in largest),
        ],
        why="The same at all gains, but an order of magnitude less: weight and acceleration ask "
        "for no more. A start error makes it grow with the gain; forces that act for a tenth of "
        "the time give its order, though not the same at all gains (one_step_117). The number may "
        "be copied.",
    )


@statement(
    "The closed form gives negative tensions; its largest tensions grow with the gain.",
    "267, 385, 517 N",
    source="Gazebo thesis 6.4.4",
    rule=f"negative at each gain; from gain to gain by a factor of {GROWS:g}",
    cause=SOURCE,
)
def closed_form_negative(runs: Runs) -> Finding:
    """Negative and largest tensions by the closed form."""
    largest, smallest = (
        _values(runs, column, "thesis", "closed_form", GAINS, Applied.PUSHED)
        for column in ("tension_max_n", "tension_min_n")
    )
    negative = max(smallest) < 0.0
    return Finding(
        found=f"largest {_list(largest)} N, smallest {_list(smallest)} N",
        held=[negative, all(more > GROWS * less for less, more in pairwise(largest))],
        some=negative,
        why="Negative and of the printed size, since the middle of 1 and 6500 N is far from what "
        "1 kg needs; but the same at all gains. From a start error, which the thesis does not "
        "tell, they grow (largest_by_start_error).",
    )


@statement(
    "The closed form at gain 100 ends with a steady-state error.",
    "figure 6.18",
    source="Gazebo thesis 6.4.4",
    rule=f"the mean of the last tenth above {1e3 * STEADY:g} mm where cables may push",
    cause=SOURCE,
)
def closed_form_steady(runs: Runs) -> Finding:
    """What error the closed form leaves."""
    pushed, cut = (
        _run(runs, "thesis", "closed_form", 100.0, how) for how in (Applied.PUSHED, Applied.CUT)
    )
    last = pushed["position_error_last_tenth_m"]
    return Finding(
        found=f"mean error of the last tenth {1e6 * last:.2g} um where cables may push; "
        "where they cannot, the platform "
        + (f"falls after {cut['end_time_s']:.2f} s" if cut["lost"] else "stays up"),
        held=[last > STEADY],
        why="Its tensions balance the wrench exactly, so nothing is left with the exact model. A "
        "published version of the thesis' simulator balances forces but not moments; then the "
        "closed form's large opposed tensions turn the platform over, and it is lost (experiments "
        "start_error at 100 Hz, one_step).",
    )


CHECKS = (
    lp_jumps, qp_jumps, qp_needs_less, tension_grows, error_falls, no_better, unstable,
    pseudo_inverse_negative, pseudo_inverse_117, closed_form_negative, closed_form_steady,
)  # fmt: skip


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
