"""Normal numbers of a kernel are those of numpy's generator."""

import numpy as np
import pytest

from cdpr_drake.numerics.normal_numbers_kernel import seed_words, standard_normals

BEYOND_THE_LAYERS = 3.6541528853610088
"""Where numpy's ziggurat ends: larger numbers come from logarithms."""


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1, 2**32, 2**70 + 5])
def test_streams_of_seeds_and_numbers(seed):
    out, words = np.empty(8), seed_words(seed)
    for number in range(200):
        standard_normals(words, number, out)
        expected = np.random.default_rng([seed, number]).standard_normal((2, 4))
        np.testing.assert_array_equal(out, expected.ravel())


def test_a_long_stream_with_its_tail():
    out = np.empty(200_000)
    standard_normals(seed_words(5), 1, out)
    np.testing.assert_array_equal(out, np.random.default_rng([5, 1]).standard_normal(len(out)))
    assert np.max(np.abs(out)) > BEYOND_THE_LAYERS
