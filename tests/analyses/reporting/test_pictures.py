"""Pictures appear whole or not at all, and leave nothing behind."""

import gc
import os
import weakref

import pytest

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures


class Figure:
    """What refers to itself, as figures do."""

    def __init__(self):
        self.itself = self


def test_each_is_gone_before_the_next_is_drawn(tmp_path):
    seen, alive, thresholds = [], [], gc.get_threshold()

    def draw(path):
        alive.append(sum(figure() is not None for figure in seen))
        seen.append(weakref.ref(Figure()))
        path.write_text("x")

    assert write_pictures(tmp_path, dict.fromkeys("abc", draw)) == {}
    assert gc.get_threshold() == thresholds
    assert alive == [0, 0, 0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]


def test_one_that_fails_leaves_no_part_and_the_next_is_drawn(tmp_path):
    def broken(path):
        path.write_text("half")
        raise RuntimeError("no font\nat all")

    found = write_pictures(tmp_path, {"a.png": broken, "b.png": lambda path: path.write_text("x")})
    assert found == {"a.png": "no font"}
    assert [path.name for path in tmp_path.iterdir()] == ["b.png"]


def test_none_are_none(tmp_path):
    assert write_pictures(tmp_path, {}) == {}


def test_who_interrupts_a_figure_leaves_no_part_of_it(tmp_path):
    def interrupted(path):
        path.write_text("half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_pictures(tmp_path, {"figure.png": interrupted})
    assert os.listdir(tmp_path) == []
