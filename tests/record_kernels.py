"""Writes `kernel_cache/kernels.tsv`: which kernels simulations need.

`python -m tests.record_kernels FOLDER` does each group's work in a process of its own, all with one
cache folder that is empty at first; it takes some minutes. What is in FOLDER already, is not done
again. Needed where a test says so: a kernel of the default simulation was added, renamed, or gets
other arguments.
"""

import gc
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from cdpr_drake.cli.process import BROKEN, DEFAULT, GROUPS, QUESTIONS
from cdpr_drake.kernel_cache import kernel_list

UNOPTIMISED = {
    "CDPR_COMPILE_HELPERS": "0", "NUMBA_OPT": "0", "NUMBA_LOOP_VECTORIZE": "0",
    "NUMBA_SLP_VECTORIZE": "0",
}  # fmt: skip
"""Environment in which kernels are compiled sooner; names and types are the same."""


def recorded(dispatcher):
    """Notes what a process asks numba's dispatchers for: a list that grows.

    Its entries are name, words of the arguments, and an entry's number within which it was asked.
    """
    asked, stack = [], []
    compile_here = dispatcher.compile

    def compile_and_note(self, sig):
        name = name_of(self)
        if name is None:
            return compile_here(self, sig)
        types = getattr(sig, "args", sig)
        words = signature_words(tuple(types))
        asked.append([name, words or f"? {types}", stack[-1] if stack else None, None])
        number = len(asked) - 1
        stack.append(number)
        try:
            return compile_here(self, sig)
        finally:
            stack.pop()
            asked[number][3] = sum(1 for entry in asked if entry[3] is not None)

    dispatcher.compile = compile_and_note
    return asked


def name_of(dispatcher):
    """Module and function of a kernel that is kept; None of others."""
    module, name = dispatcher.py_func.__module__, dispatcher.py_func.__qualname__
    if not module.startswith("cdpr_drake.") or dispatcher._cache.cache_path is None:
        return None
    return f"{module.removeprefix('cdpr_drake.')}:{name}"


SHORT = {
    "float64": "f8", "int64": "i8", "uint64": "u8", "int8": "i1", "bool": "b1", "complex128": "c16",
}  # fmt: skip


def signature_words(types):
    """Writes types of arguments for the list; None where it cannot hold one."""
    written = [type_words(each) for each in types]
    return None if None in written else "".join(f"{words}, " for words in written).rstrip()


def type_words(given):
    """One type as an expression of numba's names, or None."""
    kind = type(given).__name__
    if str(given) in SHORT:
        return SHORT[str(given)]
    if kind == "Array" and given.aligned:
        dtype, more = type_words(given.dtype), [":"] * (given.ndim - 1)
        if dtype is None or not given.mutable:
            words = f"Array({dtype}, {given.ndim}, {given.layout!r}, readonly=True)"
            return None if dtype is None else words
        axes = {"C": [*more, "::1"], "F": ["::1", *more], "A": [":", *more]}[given.layout]
        return f"{dtype}[{','.join(axes)}]"
    if kind in ("UniTuple", "Tuple", "NamedTuple", "NamedUniTuple"):
        inner = signature_words(tuple(given.types))
        if inner is None:
            return None
        if kind == "UniTuple":
            return f"UniTuple({type_words(given.dtype)}, {given.count})"
        if kind == "Tuple":
            return f"Tuple(({inner}))"
        where = given.instance_class
        return f"Named({where.__module__!r}, {where.__qualname__!r}, {inner})"
    if kind.endswith("Literal") and isinstance(given.literal_value, int):
        return f"literal({given.literal_value!r})"
    if kind == "Omitted" and isinstance(given.value, float):
        return f"Omitted({given.value!r})"
    return None


def kept_kernels(asked):
    """What of `recorded` can be listed: name and words of the arguments."""
    keys = {(name, words) for name, words, *_ in asked}
    return {key for key in keys if "<" not in key[0] and not key[1].startswith("?")}


def simulate():
    """The default simulation as the command does it, with its figures, with both cameras."""
    from cdpr_drake.cli.app import main

    for camera in ("projected", "rendered"):
        with tempfile.TemporaryDirectory() as folder:
            words = ["--camera", camera, "--duration", "0.1", "--out", f"{folder}/run"]
            try:
                main(["simulate", DEFAULT, *words])
            except SystemExit as ended:
                print(DEFAULT, camera, ended.code, file=sys.stderr)


WORDS = {
    "workspace": ("--grid", "5,5,5", "--workers", "1"),
    "stability": ("--grid", "3,3,3", "--workers", "1"),
    "plan": ("--waypoints", "0,0,0.2; 0.1,-0.1,0.3", "--limits", "1,60"),
    BROKEN: (
        "--kind", BROKEN.rpartition(" ")[2], "--grid", "2,1,1", "--after", "0.2", "--workers", "1",
    ),
}  # fmt: skip
"""What commands are asked with, beside a robot with pulleys; by group."""


def ask(group):
    """A command with its defaults, in this process."""
    from cdpr_drake.cli.app import main

    command = group.partition(",")[0]
    with tempfile.TemporaryDirectory() as folder:
        out = ("--out", f"{folder}/found") if group in WORDS else ()
        try:
            main([command, "acrobot_large", *WORDS.get(group, ()), *out])
        except SystemExit as ended:
            print(group, ended.code, file=sys.stderr)


def do(group):
    """What a group of kernels is for."""
    from cdpr_drake.analyses.installation import compilation_steps

    if group == DEFAULT:
        simulate()
        return
    if group in (*QUESTIONS, BROKEN):
        ask(group)
        return
    dict(compilation_steps())[group]()


def table(steps):
    """The lines of the list, of what each group has asked for."""
    calls, order, roots = {}, [], {}
    for name, asked in steps.items():
        keys = [tuple(entry[:2]) for entry in asked]
        roots[name] = {key for key, entry in zip(keys, asked, strict=True)}
        for key, entry in zip(keys, asked, strict=True):
            calls.setdefault(key, set())
            if entry[2] is not None:
                calls[keys[entry[2]]] |= {key} - {keys[entry[2]]}
        for _, key in sorted(zip([entry[3] for entry in asked], keys, strict=True)):
            if key not in order:
                order.append(key)
    can_be = kept_kernels(order)
    listed = [key for key in order if key in can_be]
    number = {key: k for k, key in enumerate(listed)}

    def below(key, seen):
        """Listed kernels that one is compiled with, through those that are not listed."""
        for called in calls[key] - seen:
            seen.add(called)
            if called not in number:
                below(called, seen)
        return {number[each] for each in seen if each in number}

    def all_below(keys):
        found, waiting = set(), set(keys)
        while waiting:
            key = waiting.pop()
            found.add(key)
            waiting |= calls[key] - found
        return found

    needed = {name: all_below(keys) for name, keys in roots.items()}
    lines = list(steps)
    for key in listed:
        groups = [str(k) for k, name in enumerate(steps) if key in needed[name]]
        called = [str(k) for k in sorted(below(key, set()))]
        lines.append("\t".join([key[0], " ".join(called), " ".join(groups), key[1]]))
    return lines


def main():
    if len(sys.argv) == 3:
        from numba.core.dispatcher import Dispatcher

        gc.disable()
        asked = recorded(Dispatcher)
        do(sys.argv[1])
        Path(sys.argv[2]).write_text(json.dumps(asked))
        return
    (folder,) = map(Path, sys.argv[1:])
    groups = {}
    for number, name in enumerate(GROUPS):
        out = folder / f"asked{number}.json"
        if not out.exists():
            print(name, flush=True)
            words = [sys.executable, "-m", "tests.record_kernels", name, str(out)]
            environment = {**os.environ, **UNOPTIMISED, "NUMBA_CACHE_DIR": str(folder)}
            subprocess.run(words, check=True, env=environment)
        groups[name] = json.loads(out.read_text())
    kernel_list.LIST.write_text("\n".join(table(groups)) + "\n")


if __name__ == "__main__":
    main()
