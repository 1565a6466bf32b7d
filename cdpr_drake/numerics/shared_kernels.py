"""Kernels that others call where they are, instead of taking them in, once somebody needs them.

numba compiles a kernel together with all that it calls, again for each caller, whether a run comes
there or not. A shared kernel stays outside: its callers read its address from a slot in memory and
jump there. Who finds the slot empty has the kernel compiled, or loaded from the cache folder, and
goes on. So a robot without pulleys at its platform never waits for their kernels, and a law that
ten kernels call is compiled once.

A call costs some nanoseconds, so what takes less than a tenth of a microsecond is not worth it. The
results are the same to the last bit; where the compiler may reorder sums (`fastmath`) in what is
called, compare golden files.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba.core import cgutils, errors, types
from numba.core.registry import cpu_target
from numba.extending import intrinsic, typeof_impl

from cdpr_drake.numerics.kernel_calls import call_at_address, kernel_address

_ADDRESS, _MAKER = range(2)
"""A slot: where the machine code begins, 0 before there is one, and the Python object to call
then. numba has no name for either while it compiles a caller, which may be kept on disk."""

_WORD = ir.IntType(64)

VECTOR, MATRIX = types.float64[::1], types.float64[:, ::1]
"""Arrays as almost all signatures have them."""


_KEPT: list[tuple[Any, Any]] = []
"""Slots and what they point to: compiled code has their addresses as long as the process lives."""


class SharedKernel:
    """A kernel for one signature; kernels call it by its slot, Python as any other kernel.

    Attributes:
        kernel: What numba.njit made.
        py_func: Its Python function.
        signature: Types of its arguments and of its result.
        symbol: The slot's name for the linker.
        call: What stands for it in kernels.
    """

    def __init__(self, kernel: Any, signature: Any) -> None:
        """Makes the slot; nothing is compiled.

        Args:
            kernel: What numba.njit made, cached.
            signature: A signature of numba.
        """
        self.kernel, self.py_func, self.signature = kernel, kernel.py_func, signature
        self.__doc__, self.__name__ = kernel.__doc__, kernel.__name__
        self.__module__ = kernel.__module__
        # With the types, so that a caller kept on disk never meets a kernel of other ones.
        self.symbol = f"shared {kernel.__module__}:{kernel.__name__} {signature}"
        maker = self.make
        self._slot = (ctypes.c_int64 * 2)(0, id(maker))
        _KEPT.append((self._slot, maker))
        binding.add_symbol(self.symbol, ctypes.addressof(self._slot))
        self.call = intrinsic(_definition(self))

    def __call__(self, *arguments: Any) -> Any:
        """Calls it from Python."""
        return self.kernel(*arguments)

    def __getattr__(self, name: str) -> Any:
        """What numba's dispatchers have, such as `compile` and `signatures`.

        Raises:
            AttributeError: They have it not.
        """
        if "kernel" not in self.__dict__:  # before it is made, as `copy` asks
            raise AttributeError(name)
        return getattr(self.kernel, name)

    def make(self) -> None:
        """Compiles it or loads it, unless that is done, and puts its address into the slot."""
        self._slot[_ADDRESS] = kernel_address(self.kernel, self.signature)

    def forget(self) -> None:
        """Empties the slot: the next caller has the kernel made anew."""
        self._slot[_ADDRESS] = 0

    def is_made(self) -> bool:
        """Whether its callers find an address."""
        return self._slot[_ADDRESS] != 0


def shared(signature: Any) -> Callable[[Any], SharedKernel]:
    """A decorator over `njit(cache=True)` that makes a kernel a shared one.

    Args:
        signature: A signature of numba, as `types.float64(types.float64[::1])`. Arguments of other
            types are converted where numba would do so.
    """
    return lambda kernel: SharedKernel(kernel, signature)


@typeof_impl.register(SharedKernel)
def _type_of(kernel: SharedKernel, _: Any) -> Any:
    return cpu_target.typing_context.resolve_value_type(kernel.call)


def _definition(kernel: SharedKernel) -> Callable[..., Any]:
    """How numba types and writes a call: the function that `intrinsic` takes."""
    signature, name = kernel.signature, kernel.__name__
    jump = call_at_address(signature)

    def definition(typing: Any, *arguments: Any) -> Any:
        if len(arguments) != len(signature.args):
            raise errors.TypingError(f"{name}: found {len(arguments)} arguments")
        for found, wanted in zip(arguments, signature.args, strict=True):
            if typing.can_convert(found, wanted) is None:
                raise errors.TypingError(f"{name}: found {found}; accepted: {wanted}")
        return signature, generate

    def generate(context: Any, builder: Any, given: Any, arguments: Any) -> Any:
        place = _address(context, builder, kernel.symbol)
        return jump(context, builder, given, [place, *arguments])

    names = inspect.signature(kernel.py_func).parameters
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    definition.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(each, kind) for each in ("typing", *names)]
    )
    definition.__name__ = name
    return definition


def _address(context: Any, builder: Any, symbol: str) -> Any:
    """Code that reads the slot, and has the kernel made where it is empty.

    What Python raises meanwhile, also by Ctrl-C, goes on to who called the compiled code.
    """
    slot = builder.module.globals.get(symbol)
    if slot is None:
        slot = ir.GlobalVariable(builder.module, ir.ArrayType(_WORD, 2), symbol)
    place = cgutils.gep_inbounds(builder, slot, 0, _ADDRESS)
    empty = builder.icmp_unsigned("==", builder.load(place), _WORD(0))
    with builder.if_then(empty, likely=False):
        python = context.get_python_api(builder)
        held = python.gil_ensure()
        maker = builder.load(cgutils.gep_inbounds(builder, slot, 0, _MAKER))
        made = python.call_function_objargs(builder.inttoptr(maker, python.pyobj), ())
        failed = cgutils.is_null(builder, made)
        with builder.if_then(builder.not_(failed)):
            python.decref(made)
        python.gil_release(held)
        with builder.if_then(failed, likely=False):
            context.call_conv.return_exc(builder)
    return builder.load(place)
