"""Input that makes no sense is refused in one line that names it."""

import numpy as np
import pytest

from cdpr_drake.errors import CdprError, ControlGainError, TensionProblemError
from cdpr_drake.tensions.correction_gain import tension_gain
from cdpr_drake.tensions.methods import (
    METHODS,
    Distributor,
    TensionMethod,
    distribute,
    distribute_batch,
    feasible_polygon,
)
from cdpr_drake.tensions.problem import TensionProblem
from cdpr_drake.tensions.program import TensionProgram, make_program
from cdpr_drake.tensions.slack_correction import length_thresholds

W = np.array([[1.0, 0.0, -1.0, 0.5], [0.0, 1.0, -1.0, -0.5]])
NAN, INFINITY, ONES = np.nan, np.inf, np.ones(4)


def problem(**parts):
    numbers = {"W": W, "wrench": [1, -3], "lower": np.zeros(4), "upper": (9, 9, 9, 9), **parts}
    return TensionProblem(**numbers)


def batch(**parts):
    numbers = {"W": W[None], "wrenches": [[1.0, -3.0]], "lower": 0 * ONES, "upper": 9 * ONES}
    return distribute_batch(**{**numbers, **parts})


def own(change):
    program = TensionProgram(problem())
    try:
        change(program)
    finally:
        assert not program.has_own_terms


def other(W, wrench, start=None):
    return Distributor(problem(), "log_barrier")(W, wrench, start)


def flat_robot():
    """All cables in one plane: three of six motions have no force."""
    angles = np.arange(8) * np.pi / 4.0
    u = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    arms = 0.1 * np.stack([np.sin(3.0 * angles), np.cos(angles), 0.0 * angles])
    W = np.vstack([np.cross(arms.T, u.T).T, u])
    return TensionProblem(W, np.zeros(6), np.zeros(8), np.full(8, 60.0))


REFUSALS = {
    "vector W": (lambda: problem(W=ONES), r"W: found shape \(4,\); accepted: \(n, m\)"),
    "cube W": (lambda: problem(W=W[None]), r"W: found shape \(1, 2, 4\); accepted: \(n, m\)"),
    "words": (lambda: problem(W="many"), "W: found no array of numbers; accepted: one"),
    "wrench": (lambda: problem(wrench=[1.0]), r"wrench: found shape \(1,\); accepted: \(2,\)"),
    "lower": (lambda: problem(lower=[0.0]), r"lower: found shape \(1,\); accepted: \(4,\)"),
    "flat upper": (lambda: problem(upper=60.0), r"upper: found shape \(1,\); accepted: \(4,\)"),
    "reference": (lambda: problem(reference=np.ones(5)), r"reference: found shape \(5,\)"),
    "row scale": (lambda: problem(row_scale=ONES), r"row_scale: found shape \(4,\); accepted: \(2"),
    "NaN in W": (lambda: problem(W=W * NAN), r"W: found \[\[nan .*; accepted: finite numbers"),
    "NaN wrench": (lambda: problem(wrench=[NAN, 0]), r"wrench: found \[nan .*; accepted: finite"),
    "NaN lower": (lambda: problem(lower=[0, NAN, 0, 0]), "lower: found .*nan.*; accepted: finite"),
    "NaN upper": (lambda: problem(upper=[9, 9, 9, NAN]), "upper: found .*nan.*; accepted: finite"),
    "endless down": (lambda: problem(upper=[9, 9, 9, -INFINITY]), "upper: found .*-inf.*; accept"),
    "complex": (lambda: problem(wrench=[1.0, 2.0j]), "wrench: found complex numbers; accepted: r"),
    "hardly complex": (lambda: problem(wrench=[1, 1e-300j]), "wrench: found complex numbers"),
    "a word": (lambda: problem(wrench=["one", 1]), "wrench: found no array of numbers; accepted"),
    "NaN reference": (lambda: problem(reference=ONES * NAN), "reference: found .*; accepted: fin"),
    "negative": (lambda: problem(lower=[0, -1, 0, 0]), r"lower: found \[ 0\. -1\. .*; accepted"),
    "crossed": (
        lambda: problem(lower=[0, 5, 0, 0], upper=[9, 4, 9, 9]),
        r"upper: found \[9\. 4\. .*below lower \[0\. 5\. .*accepted: lower <= upper",
    ),
    "zero scale": (lambda: problem(row_scale=[0, 1]), r"row_scale: found \[0\. 1\.\]; accepted"),
    "few cables": (
        lambda: problem(W=W.T, wrench=ONES, lower=[0, 0], upper=[9, 9]),
        "W: found 2 cables for 4 degrees of freedom; accepted: at least 4 cables",
    ),
    "rank 1": (lambda: problem(W=np.ones((2, 4))), "W: found rank 1; accepted: 2, full rank"),
    "rank 0": (lambda: problem(W=np.zeros((2, 4))), "W: found rank 0; accepted: 2, full rank"),
    "nearly rank 1": (lambda: problem(W=np.ones((2, 4)) + 1e-13 * W), "W: found rank 1"),
    "flat robot": (flat_robot, "W: found rank 3; accepted: 6, full rank"),
    "batch of one": (lambda: batch(W=W), r"W: found shape \(2, 4\); accepted: \(k, n, m\)"),
    "batch wrench": (lambda: batch(wrenches=[1, 0]), r"wrenches: found shape \(2,\); accepted"),
    "batch bounds": (lambda: batch(lower=10 * ONES), "upper: found .*below lower"),
    "batch cables": (lambda: batch(W=W[:, :1], wrenches=[[1]], lower=[0] * 4), r"W: found shape"),
    "batch NaN": (lambda: batch(wrenches=[[NAN, 0]]), "wrenches: found .*; accepted: finite"),
    "batch complex": (lambda: batch(wrenches=[[1j, 0]]), "wrenches: found complex numbers"),
    "batch infinity": (lambda: batch(upper=INFINITY * ONES), "upper: found .*inf.*; accepted: fin"),
    "batch reference": (lambda: batch(method="reference_program"), "found no reference"),
    "batch method": (lambda: batch(method="kernel"), "kernel: found redundancy m - n = 2"),
    "threads": (lambda: batch(threads=0), "threads: found 0; accepted: at least 1"),
    "unknown method": (lambda: distribute(problem(), "magic"), "found magic; accepted: .*closed"),
    "no polygon": (
        lambda: feasible_polygon(problem(W=np.eye(2, 3), lower=[0] * 3, upper=[1] * 3)),
        "feasible polygon: found redundancy 1; accepted: 2",
    ),
    "other shape": (
        lambda: other(W[:, :2], [1, 1]), r"found shapes \(2, 2\), \(2,\); accepted: \(2, 4\)"
    ),
    "other wrench": (lambda: other(W, ONES), "found shapes"),
    "other NaN": (lambda: other(W * NAN, [1, 1]), "found NaN, infinity or overflow"),
    "other infinity": (lambda: other(W, [INFINITY, 1]), "found NaN, infinity or overflow"),
    "other singular": (lambda: other(np.ones((2, 4)), [1, 1]), "singular to rounding"),
    **{
        f"endless {name}": (
            lambda name=name: distribute(problem(upper=INFINITY * ONES), name),
            f"{name}: found an infinite upper tension.*; accepted: finite ones",
        )
        for name, method in METHODS.items() if method.central and method.takes(2)
    },
    "start": (lambda: other(W, [1, 1], np.ones(3)), r"start: found shape \(3,\); accepted: \(4,\)"),
    "goal": (lambda: make_program(problem(), "barycenter"), "found barycenter; accepted: linear"),
    "no goal": (lambda: make_program(problem(), "magic"), "goal: found magic"),
    "goal reference": (lambda: make_program(problem(), "reference_program"), "found no reference"),
    "names": (lambda: TensionProgram(problem(), names=["a"]), "names: found 1; accepted: 4"),
    "cost shape": (lambda: own(lambda p: p.AddQuadraticCost(np.ones(3))), r"found shape \(3,\)"),
    "no cable": (lambda: own(lambda p: p.values("C9")), "of: found 'C9'; accepted: cable 1"),
    "cost of many": (lambda: own(lambda p: p.AddCost(lambda t: t)), r"an array of shape \(4,\)"),
    "kernel name": (lambda: TensionMethod.from_program("kernel", None), "one that no kernel has"),
    "no name": (lambda: TensionMethod.from_program("", None), "accepted: one that no kernel has"),
    "stiffness": (lambda: tension_gain([1e5, 0], 25.0), "stiffness of .*: found 0; accepted"),
    "rate": (lambda: tension_gain(1e5, 0.0), "rate of .*above 0"),
    "no rate": (lambda: tension_gain(1e5, NAN), "rate of .*above 0"),
    "delay": (lambda: tension_gain(1e5, 25.0, -1.0), "delay of .*at least 0"),
    "margin": (lambda: tension_gain(1e5, 25.0, margin=0.9), "margin of .*found 0.9.*at least 1"),
}  # fmt: skip


@pytest.mark.parametrize(("call", "message"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal(call, message):
    with pytest.raises((TensionProblemError, ControlGainError), match=message) as caught:
        call()
    assert isinstance(caught.value, CdprError)
    assert len(str(caught.value).splitlines()) == 1


def test_shape_of_thresholds():
    with pytest.raises(ValueError, match="found 'cubic'; accepted: linear, exponential"):
        length_thresholds(ONES, 1.0, 2.0, lowest=ONES, highest=ONES, shape="cubic")


@pytest.mark.parametrize("r", [0, 1, 2, 3])
@pytest.mark.parametrize("name", [n for n, m in METHODS.items() if m.redundancies])
def test_redundancy(name, r):
    W = np.random.default_rng(r).normal(size=(3, 3 + r))
    numbers = TensionProblem(W, -W @ np.full(3 + r, 30.0), np.zeros(3 + r), np.full(3 + r, 60.0))
    accepted = METHODS[name].redundancies
    if r in accepted:
        assert distribute(numbers, name).status == "feasible"
    else:
        words = f"{name}: found redundancy m - n = {r}; accepted: "
        words += " or ".join(map(str, accepted))
        with pytest.raises(TensionProblemError, match=words):
            Distributor(numbers, name)


def test_sensible_input_is_converted():
    for W_, wrench in ((W, [1, -3]), (np.asfortranarray(W), np.array([1, -3]))):
        numbers = problem(W=W_, wrench=wrench, lower=[3] * 4, upper=[3] * 4)
        assert numbers.redundancy == 2
        for array in (numbers.W, numbers.wrench, numbers.lower, numbers.upper):
            assert array.dtype == float
            assert array.flags.c_contiguous
    np.testing.assert_array_equal(problem(wrench=[1 + 0j, -3]).wrench, [1.0, -3.0])
    back = np.asfortranarray(W)
    back.flags.writeable = False
    expected = distribute(problem(wrench=[-20, -30], upper=np.full(4, 50.0)))
    ready = Distributor(problem(upper=np.full(4, 50.0)))
    np.testing.assert_array_equal(ready(back, [-20, -30]).tensions, expected.tensions)
