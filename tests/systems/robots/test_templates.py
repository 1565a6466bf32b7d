"""Classes out of Drake's templates."""

import inspect

import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.framework import LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.systems.robots.templates import class_for_floats

DEEP = 60
"""Calls upon calls, as in an import."""


def template(scope, base):
    @TemplateSystem.define("Nothing_", T_list=(float, AutoDiffXd), scope=scope)
    def Nothing_(T):
        class Impl(base[T]):
            def _construct(self, converter=None):
                LeafSystem_[T].__init__(self, converter=converter)

            def _construct_copy(self, other, converter=None):
                Impl._construct(self, converter=converter)

        return Impl

    return Nothing_


def deeply(function, depth=DEEP):
    return deeply(function, depth - 1) if depth else function()


class Scope:
    __name__ = "somewhere"


def test_drake_looks_through_a_short_stack_only(monkeypatch):
    frames, stack = [], inspect.stack

    def counted(*arguments):
        found = stack(*arguments)
        frames.append(len(found))
        return found

    monkeypatch.setattr(inspect, "stack", counted)
    nothing = template(Scope(), LeafSystem_)
    made = deeply(lambda: class_for_floats(nothing))
    assert made is nothing[float]
    assert made().ToAutoDiffXd().num_output_ports() == 0
    assert max(frames, default=0) < DEEP // 2


def test_what_goes_wrong_is_said():
    with pytest.raises(RuntimeError, match="must inherit from"):
        class_for_floats(template(Scope(), {float: object, AutoDiffXd: object}))
