"""Timing helpers and the benchmark rows, without asserting any time."""

import pytest

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS
from cdpr_drake.analyses.reporting.timing import interleaved, seconds_per_call
from tests.analyses.benchmarks.once import without_repeats


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


@pytest.mark.parametrize("group", sorted(set(BENCH_GROUPS) - {"physics"}))
def test_every_group_has_rows_with_a_ratio(group, monkeypatch):
    """The rows of physics have tests of their own, which take long enough once."""
    without_repeats(monkeypatch)
    for row in BENCH_GROUPS[group](True):
        assert row.ratio > 0.0
        assert row.as_dict()["ratio_means"]
