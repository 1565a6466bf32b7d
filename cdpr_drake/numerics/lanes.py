"""Eight numbers at once in kernels: a type of numba with the arithmetic of floats, lane by lane.

`Lanes` has +, -, *, / among themselves and with floats, which stand for eight of the same. Each
lane is rounded as a float is, so a kernel in lanes gives the bits of its scalar form wherever the
order of operations is the same. LLVM makes of them what the processor has: one register of
AVX-512, two of AVX, four of SSE. Nothing is left to its own search for loops that it can widen,
which finds no sums in a fixed order, and nothing with a branch.

Arrays need not be filled up: what is loaded beyond the last number is zero.
"""

from __future__ import annotations

import operator
from typing import Any, ClassVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import PrimitiveModel
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, register_model

COUNT = 8
"""Numbers in lanes."""

_DOUBLE, _WHOLE = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.VectorType(_DOUBLE, COUNT)
_MASK = ir.VectorType(ir.IntType(1), COUNT)
_INDICES = ir.VectorType(ir.IntType(32), COUNT)


class Lanes(types.Type):
    """The type of eight numbers."""

    def __init__(self) -> None:
        """There is one."""
        super().__init__(name="Lanes")


LANES = Lanes()


@register_model(Lanes)
class _LanesModel(PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """Eight of a float."""
    if value.type == _VECTOR:
        return value
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, _index(0))
    return builder.shuffle_vector(one, one, ir.Constant(_INDICES, [0] * COUNT))


def _index(k: int) -> Any:
    return ir.Constant(ir.IntType(32), k)


def _define(operation: Any, instruction: str) -> None:
    pairs = [(LANES, LANES), (LANES, types.float64), (types.float64, LANES)]

    class Template(ConcreteTemplate):
        cases: ClassVar = [signature(LANES, *pair) for pair in pairs]

    infer_global(operation)(Template)

    def lower(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*(_spread(builder, one) for one in arguments))

    for pair in pairs:
        lower_builtin(operation, *pair)(lower)


for _operation, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define(_operation, _instruction)


def _call(builder: Any, name: str, arguments: list[Any], result: Any = _VECTOR) -> Any:
    """What an intrinsic function of LLVM makes of lanes."""
    kind = ir.FunctionType(result, [one.type for one in arguments])
    function = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
    return builder.call(function, arguments)


@intrinsic
def root_of(typing: Any, x: Any) -> Any:
    """Square roots of lanes; of what is negative NaN."""
    if x != LANES:
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        return _call(builder, "llvm.sqrt.v8f64", list(arguments))

    return LANES(LANES), generate


@intrinsic
def positive_where(typing: Any, condition: Any, x: Any) -> Any:
    """x where the condition is above zero and x is not below zero, else 0.0; NaN in x stays."""
    if (condition, x) != (LANES, LANES):
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        condition, x = arguments
        zero = ir.Constant(_VECTOR, [0.0] * COUNT)
        pulls = builder.fcmp_ordered(">", condition, zero)
        kept = builder.fcmp_unordered(">=", x, zero)
        return builder.select(builder.and_(pulls, kept), x, zero)

    return LANES(LANES, LANES), generate


@intrinsic
def within(typing: Any, x: Any, limit: Any) -> Any:
    """max(min(x, limit), -limit) of lanes and a float; NaN in x stays."""
    if (x, limit) != (LANES, types.float64):
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        x, limit = arguments
        top, bottom = _spread(builder, limit), _spread(builder, builder.fneg(limit))
        x = builder.select(builder.fcmp_ordered("<", top, x), top, x)
        return builder.select(builder.fcmp_ordered(">", bottom, x), bottom, x)

    return LANES(LANES, types.float64), generate


def _place(context: Any, builder: Any, given: Any, arguments: Any) -> tuple[Any, Any]:
    """Where lanes of an array begin, and which of them lie within it.

    Args:
        context: Of numba.
        builder: Of LLVM.
        given: Types of the array and of a whole number.
        arguments: The array and the number of the first lane in it.
    """
    made = context.make_array(given[0])(context, builder, arguments[0])
    first = context.cast(builder, arguments[1], given[1], types.int64)
    numbers = ir.Constant(ir.VectorType(_WHOLE, COUNT), list(range(COUNT)))
    left = ir.Constant(numbers.type, ir.Undefined)
    left = builder.insert_element(left, builder.sub(made.nitems, first), _index(0))
    left = builder.shuffle_vector(left, left, ir.Constant(_INDICES, [0] * COUNT))
    pointer = builder.bitcast(builder.gep(made.data, [first]), _VECTOR.as_pointer())
    return pointer, builder.icmp_signed("<", numbers, left)


def _is_vector(array: Any) -> bool:
    return isinstance(array, types.Array) and (array.ndim, array.layout) == (1, "C")


@intrinsic
def load_lanes(typing: Any, array: Any, first: Any) -> Any:
    """Lanes of array[first:first + 8], zero beyond the array's end.

    Args:
        array: One axis, without gaps.
        first: Not negative, and within the array.
    """
    if not _is_vector(array):
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place, mask = _place(context, builder, given.args, arguments)
        zero = ir.Constant(_VECTOR, [0.0] * COUNT)
        name = "llvm.masked.load.v8f64.p0"
        return _call(builder, name, [place, _index(8), mask, zero])

    return LANES(array, first), generate


@intrinsic
def store_lanes(typing: Any, array: Any, first: Any, x: Any) -> Any:
    """array[first:first + 8] <- lanes, those within the array; arguments as of `load_lanes`."""
    if not _is_vector(array) or x != LANES:
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place, mask = _place(context, builder, given.args[:2], arguments[:2])
        name = "llvm.masked.store.v8f64.p0"
        _call(builder, name, [arguments[2], place, _index(8), mask], ir.VoidType())
        return context.get_dummy_value()

    return types.none(array, first, LANES), generate


@intrinsic
def lane_of(typing: Any, x: Any, k: Any) -> Any:
    """Lane k of lanes, a float."""
    if x != LANES:
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        return builder.extract_element(arguments[0], arguments[1])

    return types.float64(LANES, types.int64), generate


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Lane j of row i as lane i of row j, of eight rows."""
    for step in (1, 2, 4):
        mixed = list(rows)
        for i in range(COUNT):
            if i & step:
                continue
            upper = [k + COUNT - step if k & step else k for k in range(COUNT)]
            lower = [k + COUNT if k & step else k + step for k in range(COUNT)]
            for place, picked in ((i, upper), (i + step, lower)):
                chosen = ir.Constant(_INDICES, picked)
                mixed[place] = builder.shuffle_vector(rows[i], rows[i + step], chosen)
        rows = mixed
    return rows


@intrinsic
def less_sums(typing: Any, sums: Any, terms: Any, count: Any) -> Any:
    """Lanes of six totals, each less the lanes of its terms, in their order from the first on.

    So each total is rounded as in a loop over its terms.

    Args:
        sums: Totals in the first six lanes; what stands in the others is not kept.
        terms: Six lanes, terms of the first total, of the second and so on.
        count: How many terms count; more than eight count as eight.
    """
    if sums != LANES or terms != types.UniTuple(LANES, 6):
        return None

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        sums, terms, count = arguments
        zero = ir.Constant(_VECTOR, [0.0] * COUNT)
        rows = _transposed(builder, [*cgutils.unpack_tuple(builder, terms), zero, zero])
        whole = builder.icmp_signed(">=", count, _WHOLE(COUNT))
        with builder.if_else(whole) as (then, otherwise):
            with then:
                all_of = sums
                for row in rows:
                    all_of = builder.fsub(all_of, row)
                after_all = builder.basic_block
            with otherwise:
                some_of = sums
                for j, row in enumerate(rows):
                    counts = builder.icmp_signed("<", _WHOLE(j), count)
                    some_of = builder.select(counts, builder.fsub(some_of, row), some_of)
                after_some = builder.basic_block
        total = builder.phi(_VECTOR)
        total.add_incoming(all_of, after_all)
        total.add_incoming(some_of, after_some)
        return total

    return LANES(LANES, terms, types.int64), generate


@intrinsic
def no_lanes(typing: Any) -> Any:
    """Eight zeros."""
    return LANES(), lambda *_: ir.Constant(_VECTOR, [0.0] * COUNT)
