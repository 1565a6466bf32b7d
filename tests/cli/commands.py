"""Commands in this process, and one that is killed in a process of its own."""

import json

import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed


def ended(*words):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main([*map(str, words)])
    return end.value.code


def run(capsys, *words):
    """Exit code, stdout and stderr of a command, without lines of progress."""
    code = ended(*words)
    return code, *printed(capsys)


def answer(capsys, *words, code=0):
    """What a command prints that ends with a code."""
    found, out, err = run(capsys, *words)
    assert found == code, err
    return out


def told(capsys, *words, code=0):
    """The same as JSON; `--json` is added."""
    return json.loads(answer(capsys, *words, "--json", code=code))


def refuse(capsys, *words):
    """The one line that a command says when it refuses, apart from warnings of the scenario."""
    code, _, err = run(capsys, *words)
    assert code == 2
    said = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert len(said) == 1, err
    assert said[0].startswith("cdpr: ")
    assert len(said[0]) <= 500
    return said[0]


def write_log(path, columns):
    """A log with these columns; NaN becomes an empty cell."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join("" if value != value else f"{value:.12g}" for value in row) for row in rows]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return str(path)


def killed_after(count, method, setup=""):
    """The program of a command whose process is killed after so many calls of a method.

    Args:
        count: How many.
        method: Such as `package.module.Class.method`.
        setup: Lines before it starts.
    """
    module, owner, name = method.rsplit(".", 2)
    return f"""
import os, signal, sys
from {module} import {owner}
from cdpr_drake.cli.app import main
{setup}
method, left = {owner}.{name}, list(range({count}))

def some(*arguments):
    method(*arguments)
    left.pop()
    if not left:
        os.kill(os.getpid(), signal.SIGKILL)

{owner}.{name} = some
if __name__ == "__main__":
    main(sys.argv[1:])
"""


STORE_ARRAYS = "cdpr_drake.analyses.frame.folder.Folder.write_arrays"
"""Keeps a chunk of a grid."""
