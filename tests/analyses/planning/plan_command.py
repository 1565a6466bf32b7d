"""`cdpr plan` in this process."""

import pytest

from cdpr_drake.cli.app import main
from tests.messages import printed


def run(capsys, *words):
    """Exit code, stdout and stderr of a command line after `cdpr plan`."""
    with pytest.raises(SystemExit) as end:
        main(["plan", *words])
    out, err = printed(capsys)
    return end.value.code, out, err
