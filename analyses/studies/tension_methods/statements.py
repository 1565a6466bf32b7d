"""What the Gazebo thesis states about tension methods, beside what the study found."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.tension_methods.trial import Applied, TrialResult

JUMP = 0.1
"""A smooth motion changes no tension by as much within one control step of 1 ms [N]."""

GROWS = 1.05
"""A quantity grows with the gain if it does by this factor from one gain to the next."""

STEADY = 1e-4
"""A steady-state error that could be seen in the figure [m]."""


class _Runs:
    """Finds runs by what they are."""

    def __init__(self, runs: Iterable[TrialResult]) -> None:
        self._runs = {
            (r.spec.experiment, r.spec.method, r.spec.stiffness, r.spec.applied): r for r in runs
        }

    def __call__(
        self, experiment: str, method: str, gain: float, applied: Applied = Applied.HELD
    ) -> TrialResult:
        return self._runs[experiment, method, gain, applied]


def evaluate_statements(runs: Iterable[TrialResult], quick: bool = False) -> list[Statement]:
    """The statements whose runs are there, in the order of the thesis; of the `quick` form also
    the names of the others."""
    return evaluate_checks(CHECKS, _Runs(runs), quick)


def _lp_jumps(find: _Runs) -> Statement:
    """Jumps of the linear program's tensions."""
    jumps = [find("thesis", "linear_program", gain).largest_jump for gain in (100, 800, 1200)]
    return Statement(
        "Tensions of the linear program jump.",
        "seen in figures 6.8 to 6.10",
        f"largest jump in 1 ms {_list(jumps)} N",
        verdict(min(jumps) > JUMP),
        "Its optimum is a corner of the feasible set and changes from one corner to another.",
    )


def _qp_jumps(find: _Runs) -> Statement:
    """Jumps of the quadratic program's tensions."""
    jumps = [
        find("thesis", "quadratic_program", gain).largest_jump for gain in (100, 800, 1200, 1500)
    ]
    return Statement(
        "Tensions of the quadratic program jump, too, most at gain 1500.",
        "seen in figures 6.11 to 6.14",
        f"largest jump in 1 ms {_list(jumps)} N",
        verdict(min(jumps) > JUMP, max(jumps) > JUMP),
        "The 2-norm optimum is continuous where the wrench is. Jumps then come from the loop: a "
        "published version of the thesis' simulator runs it at 100 Hz, where gains of 800 and more "
        "are unstable (experiment slow).",
    )


def _qp_needs_less(find: _Runs) -> Statement:
    """Largest tensions of the quadratic program against the linear program's."""
    pairs = {
        name: [
            tuple(
                find(name, method, gain).largest_tension
                for method in ("quadratic_program", "linear_program")
            )
            for gain in (100, 800, 1200)
        ]
        for name in ("thesis", "step")
    }
    less = [qp < lp for both in pairs.values() for qp, lp in both]
    words = "; ".join(
        f"{name}: " + ", ".join(f"{qp:.2f} against {lp:.2f}" for qp, lp in both)
        for name, both in pairs.items()
    )
    return Statement(
        "The largest tension of the quadratic program is below that of the linear program at "
        "equal gain.",
        "100: 32 against 54; 800: 110 against 456; 1200: 342 against 1224 N",
        f"{words} N (gains 100, 800, 1200)",
        verdict(all(less), any(less)),
        "On the trajectory by little, since its largest tensions come at the end, near the exit "
        "points, where there is little to choose.",
    )


def _tension_grows(find: _Runs) -> Statement:
    """Largest tensions against the gain."""
    gains = (100, 800, 1200)
    still = [find("thesis", "quadratic_program", gain).largest_tension for gain in gains]
    step = [find("step", "quadratic_program", gain).largest_tension for gain in gains]
    return Statement(
        "Higher gains cost higher tensions.",
        "quadratic program 32, 110, 342 N",
        f"thesis {_list(still)} N; step {_list(step)} N",
        verdict(still[2] > 1.05 * still[0], step[2] > 1.05 * step[0]),
        "With the exact model there is no error for the gain to act on, except where the platform "
        "starts beside its goal. The thesis does not say where it started.",
    )


def _error_falls(find: _Runs) -> Statement:
    """Position errors against the gain."""
    gains = (100, 800, 1200)
    errors = [1e6 * find("thesis", "quadratic_program", gain).largest_error for gain in gains]
    return Statement(
        "Higher gains bring smaller position errors (both programs).",
        "figures 6.8, 6.9, 6.11 to 6.13",
        f"quadratic program, largest error {_list(errors)} um",
        verdict(errors[0] > errors[1] > errors[2]),
        "What is left comes from the wrench that is held for a millisecond.",
    )


def _no_better(find: _Runs) -> Statement:
    """Gain 1500 against 1200."""
    errors = [
        1e6 * find("thesis", "quadratic_program", gain).largest_error for gain in (1200, 1500)
    ]
    return Statement(
        "Gain 1500 is no appreciable improvement on 1200.",
        "figure 6.14",
        f"largest error {_list(errors)} um",
        verdict(errors[1] > 0.95 * errors[0], errors[0] - errors[1] < 1.0),
        "The error falls as one over the gain, but by less than a micrometre.",
    )


def _unstable(find: _Runs) -> Statement:
    """Gains that come near instability."""
    ends = {gain: find("slow", "quadratic_program", gain) for gain in (100, 800, 1200, 1500)}
    calm = find("thesis", "quadratic_program", 100)
    named = [find("thesis", "linear_program", 1200), find("thesis", "quadratic_program", 1500)]
    near = [r.lost or r.failures > 0 or r.largest_error > calm.largest_error for r in named]
    far = find("far_step", "quadratic_program", 1200)
    bad = [f"{gain:g}" for gain, run in ends.items() if run.lost or run.failures > 0]
    return Statement(
        "Gain 1200 (linear program) and 1500 (quadratic program) oscillate and come near "
        "instability.",
        "figures 6.10, 6.14",
        f"at 1 kHz largest errors {_list([1e6 * r.largest_error for r in named])} um, at gain 100 "
        f"{1e6 * calm.largest_error:.3g} um; from 50 mm beside it "
        + (f"falls after {far.end_time:.1f} s" if far.lost else "does not fall")
        + f"; at 100 Hz unstable at gains {', '.join(bad) or 'none'}",
        verdict(all(near), any(near) or far.lost or bool(bad)),
        "A sampled loop needs Kd times the sampling time well below 2: 1.2 at 1 kHz, 12 at 100 Hz. "
        "A suspended platform cannot be pulled down, so an overshooting request above g cannot "
        "be met.",
    )


def _pseudo_inverse_negative(find: _Runs) -> Statement:
    """Negative tensions by the pseudo-inverse."""
    held = find("thesis", "pseudo_inverse", 100, Applied.PUSHED)
    printed = find("printed", "pseudo_inverse", 100, Applied.PUSHED)
    return Statement(
        "The pseudo-inverse gives negative tensions, at the beginning.",
        "figures 6.15 to 6.17",
        f"start moved inside: smallest {held.smallest_tension:.2f} N, below 1 N in "
        f"{held.failures} of {held.steps} steps; printed start: {printed.smallest_tension:.2f} N, "
        f"{printed.negative_tensions} negative tensions",
        verdict(
            held.smallest_tension < 0.0 and printed.smallest_tension < 0.0,
            printed.smallest_tension < 0.0,
        ),
        "From the printed start, which no tensions hold; inside it breaks the bound of 1 N only.",
    )


def _pseudo_inverse_117(find: _Runs) -> Statement:
    """The pseudo-inverse's largest tension at each gain."""
    largest = [
        find("printed", "pseudo_inverse", gain, Applied.PUSHED).largest_tension
        for gain in (100, 800, 1200)
    ]
    return Statement(
        "The pseudo-inverse's largest tension is the same at all three gains.",
        "117 N",
        f"{_list(largest)} N",
        verdict(max(largest) - min(largest) < 0.01 * max(largest)),
        "The same at all gains, but an order of magnitude less: weight and acceleration ask for no "
        "more. Where its 117 N come from is not known.",
    )


def _closed_form_negative(find: _Runs) -> Statement:
    """Negative and largest tensions by the closed form."""
    runs = [find("thesis", "closed_form", gain, Applied.PUSHED) for gain in (100, 800, 1200)]
    largest = [r.largest_tension for r in runs]
    grows = largest[1] > GROWS * largest[0] and largest[2] > GROWS * largest[1]
    negative = all(r.smallest_tension < 0.0 for r in runs)
    return Statement(
        "The closed form gives negative tensions; its largest tensions grow with the gain.",
        "267, 385, 517 N",
        f"largest {_list(largest)} N, smallest {_list([r.smallest_tension for r in runs])} N",
        verdict(negative and grows, negative),
        "Negative and of the printed size, since the middle of 1 and 6500 N is far from what 1 kg "
        "needs; but the same at all gains.",
    )


def _closed_form_steady(find: _Runs) -> Statement:
    """What error the closed form leaves."""
    pushed = find("thesis", "closed_form", 100, Applied.PUSHED)
    cut = find("thesis", "closed_form", 100, Applied.CUT)
    return Statement(
        "The closed form at gain 100 ends with a steady-state error.",
        "figure 6.18",
        f"mean error of the last tenth {1e6 * pushed.last_error:.2g} um where cables may push; "
        "where they cannot, the platform "
        + (f"falls after {cut.end_time:.2f} s" if cut.lost else "stays up"),
        verdict(pushed.last_error > STEADY),
        "Its tensions balance the wrench exactly, so nothing is left with the exact model. A "
        "published version of the thesis' simulator balances forces but not moments, which large "
        "opposed tensions may turn into an error; not tried here.",
    )


CHECKS: tuple[Callable[[_Runs], Statement], ...] = (
    _lp_jumps,
    _qp_jumps,
    _qp_needs_less,
    _tension_grows,
    _error_falls,
    _no_better,
    _unstable,
    _pseudo_inverse_negative,
    _pseudo_inverse_117,
    _closed_form_negative,
    _closed_form_steady,
)


def _list(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
