"""Medians of several works, taken in turns."""

from cdpr_drake.analyses.reporting.timing import interleaved


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
