"""Pictures appear whole or not at all, and leave nothing behind."""

import gc
import weakref

import pytest

from cdpr_drake.analyses.reporting import write_pictures


class Figure:
    """What refers to itself, as figures do."""

    def __init__(self):
        self.itself = self


@pytest.mark.parametrize("frozen", [False, True])
def test_each_is_gone_before_the_next_is_drawn(tmp_path, frozen):
    seen, alive = [], []

    def draw(path):
        alive.append(sum(figure() is not None for figure in seen))
        seen.append(weakref.ref(Figure()))
        path.write_text("x")

    before = gc.get_freeze_count()
    if frozen and not before:
        gc.freeze()
    try:
        count = gc.get_freeze_count()
        assert write_pictures(tmp_path, dict.fromkeys("abc", draw)) == {}
        assert bool(gc.get_freeze_count()) == bool(count)
    finally:
        if frozen and not before:
            gc.unfreeze()
    assert alive == [0, 0, 0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]


def test_one_that_fails_leaves_no_part_and_the_next_is_drawn(tmp_path):
    def broken(path):
        path.write_text("half")
        raise RuntimeError("no font\nat all")

    found = write_pictures(tmp_path, {"a.png": broken, "b.png": lambda path: path.write_text("x")})
    assert found == {"a.png": "no font"}
    assert [path.name for path in tmp_path.iterdir()] == ["b.png"]
