"""Rows of every group of benchmarks: each says what its ratio is; no time is asserted."""

import pytest

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS
from cdpr_drake.analyses.reporting.timing import interleaved, seconds_per_call
from tests.analyses.benchmarks.once import without_repeats

FASTER = ("times faster", "times as fast", "real-time factor", "in the time of one")
"""Words by which a ratio is how much faster what is timed is than what it is compared with."""

RATES = ("/s", "per s of processor time", "per second of processor time")
"""Ends of units of what is larger where it is faster."""

PHYSICS = 19 + 7 + 3
"""Rows of statics, of closed loops with physical effects, and of what cables do besides."""


@pytest.fixture(scope="module", params=sorted(BENCH_GROUPS))
def rows(request):
    with pytest.MonkeyPatch.context() as patch:
        without_repeats(patch)
        found = BENCH_GROUPS[request.param](True)
    assert found or request.param == "learning", "there are none without Gymnasium only"
    assert request.param != "physics" or len(found) == PHYSICS
    return found


def test_every_row_of_a_group_says_what_its_ratio_is(rows):
    for row in rows:
        assert row.value > 0.0, row
        assert row.baseline_value > 0.0, row
        assert row.as_dict()["ratio_means"], row
        expected = row.baseline_value / row.value
        if row.unit.endswith(RATES) or not any(words in row.ratio_means for words in FASTER):
            expected = row.value / row.baseline_value
        if "two cores" in row.ratio_means:
            expected *= 2.0
        assert row.ratio == pytest.approx(expected), row


def test_rows_of_a_group_have_names_of_their_own(rows):
    assert len({(row.name, row.baseline) for row in rows}) == len(rows)


def test_interleaved_takes_turns_and_drops_the_first():
    calls = []

    def work(name, values):
        def call():
            calls.append(name)
            return next(values)

        return call

    medians = interleaved([work("a", iter([99.0, 1, 2, 3])), work("b", iter([99.0, 7, 5, 6]))], 3)
    assert medians == [2, 6]
    assert "".join(calls) == "abababab"


def test_seconds_per_call_calls():
    calls = []
    assert seconds_per_call(lambda: calls.append(1), 7) >= 0.0
    assert len(calls) == 7
