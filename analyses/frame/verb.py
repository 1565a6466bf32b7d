"""What every verb of `import cdpr_drake as cdpr` runs in, and one command of several verbs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from typing import Any

from cdpr_drake.blas_threads import one_blas_thread
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.input_files import inputs_read_once

Verb = Callable[..., Any]


@contextmanager
def verb() -> Iterator[None]:
    """Each file is read once, and linear algebra has one thread: with more, sums have other digits.

    A decorator: `@verb()`.
    """
    with inputs_read_once(), one_blas_thread():
        yield


def either(plain: Verb, **others: Verb) -> Callable[[Verb], Verb]:
    """A decorator for a command that calls one of several verbs: `plain`, or what a switch names.

    The command takes the arguments of all verbs, whose docstrings describe them, and refuses
    arguments of a verb that is not called. What it decorates only declares the switches.

    Args:
        plain: The verb without a switch.
        others: Verbs by the names of their switches.
    """
    verbs = {"": plain, **others}
    accepted = {switch: _parameters(called) for switch, called in verbs.items()}
    kinds = {switch: f"with {switch}" for switch in others}
    kinds[""] = " and ".join(f"without {switch}" for switch in others)

    def decorate(declared: Verb) -> Verb:
        @wraps(declared)
        def command(*values: Any, **named: Any) -> Any:
            switches = [name for name in others if named.pop(name, False)]
            if len(switches) > 1:
                raise CdprError(f"{switches[0]}: found with {switches[1]}; accepted: one of them")
            switch = switches[0] if switches else ""
            for name in named:
                if name not in accepted[switch]:
                    owners = " or ".join(kinds[owner] for owner in verbs if name in accepted[owner])
                    raise CdprError(f"{name}: found {kinds[switch]}; accepted: {owners}")
            for name, parameter in list(accepted[switch].items())[len(values) :]:
                if parameter.default is parameter.empty and name not in named:
                    raise CdprError(f"{name}: found none {kinds[switch]}; accepted: a value")
            return verbs[switch](*values, **named)

        command.__signature__ = _signature(declared, accepted)  # type: ignore[attr-defined]
        command.__doc__ = _docstring(declared, verbs, accepted)
        return command

    return decorate


def _parameters(function: Verb) -> dict[str, inspect.Parameter]:
    return dict(inspect.signature(function, eval_str=True).parameters)


def _signature(
    declared: Verb, accepted: Mapping[str, Mapping[str, inspect.Parameter]]
) -> inspect.Signature:
    """The first argument of all verbs, then all others as options: of `plain`, switches, others."""
    first, *rest = accepted[""].values()
    merged = {parameter.name: parameter for parameter in rest} | _parameters(declared)
    for parameters in accepted.values():
        merged |= {name: parameter for name, parameter in parameters.items() if name not in merged}
    del merged[first.name]
    options = [
        parameter.replace(
            kind=inspect.Parameter.KEYWORD_ONLY,
            default=None if parameter.default is parameter.empty else parameter.default,
        )
        for parameter in merged.values()
    ]
    return inspect.Signature([first, *options])


def _docstring(
    declared: Verb, verbs: Mapping[str, Verb],
    accepted: Mapping[str, Mapping[str, inspect.Parameter]],
) -> str:  # fmt: skip
    """The docstring of a command, with descriptions of the arguments of all verbs."""
    texts: dict[str, str] = {}
    for called in (declared, *verbs.values()):
        for name, text in _described(called).items():
            owners = [f"--{switch}" for switch in verbs if switch and name in accepted[switch]]
            alone = owners and name not in accepted[""]
            texts.setdefault(name, f"With {' or '.join(owners)}: {text}" if alone else text)
    head = (inspect.getdoc(declared) or "").partition("\nArgs:")[0].rstrip()
    lines = [f"    {name}: {text}" for name, text in texts.items() if "," not in name]
    return "\n".join([head, "", "Args:", *lines])


def _described(function: Verb) -> dict[str, str]:
    """Descriptions of a function's arguments, each in one line."""
    from docstring_parser import parse

    entries = parse(inspect.getdoc(function) or "").params
    return {entry.arg_name: " ".join((entry.description or "").split()) for entry in entries}
