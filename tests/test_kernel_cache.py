"""Compiled kernels are kept outside the package, whatever the machine is like."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.messages import messages

ASK = "import cdpr_drake, os; print(os.environ['NUMBA_CACHE_DIR'])"
COMPILE = (
    "import os, numpy as np, cdpr_drake; from cdpr_drake.geometry.straight_cables import "
    "cable_lengths, length_jacobian; from pydrake.math import RigidTransform as X; "
    "length_jacobian(X(), np.ones((3, 2)), np.zeros((3, 2))); "
    "print(sum(len(f) for _, _, f in os.walk(os.environ['NUMBA_CACHE_DIR'])))"
)


def run(words, **environment):
    kept = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-c", words], capture_output=True, text=True, env={**kept, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_they_are_in_the_users_cache_folder(tmp_path):
    folder = Path(run(ASK, XDG_CACHE_HOME=str(tmp_path)))
    assert folder.parent == tmp_path / "cdpr_drake" / "kernels"
    assert int(run(COMPILE, XDG_CACHE_HOME=str(tmp_path))) >= 2


def test_the_users_own_choice_counts(tmp_path):
    assert run(ASK, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


@pytest.mark.parametrize("environment", [{"XDG_CACHE_HOME": "/proc/nowhere"}, {"HOME": ""}])
def test_without_a_cache_folder_of_ones_own_it_still_runs(environment, tmp_path):
    assert int(run(COMPILE, TMPDIR=str(tmp_path), **environment)) >= 2


def test_old_states_of_the_sources_are_forgotten(tmp_path):
    kernels = tmp_path / "cdpr_drake" / "kernels"
    for number in range(5):
        (kernels / f"state{number}").mkdir(parents=True)
        os.utime(kernels / f"state{number}", (number, number))
    used = Path(run(ASK, XDG_CACHE_HOME=str(tmp_path)))
    assert sorted(os.listdir(kernels)) == sorted(["state3", "state4", used.name])


def test_a_state_that_is_in_use_is_not_forgotten(tmp_path):
    """Another checkout's processes would compile anew what was removed under them."""
    kernels = tmp_path / "cdpr_drake" / "kernels"
    states = [f"state{number}" for number in range(5)]
    for state in states:
        (kernels / state).mkdir(parents=True)
    used = Path(run(ASK, XDG_CACHE_HOME=str(tmp_path)))
    assert sorted(os.listdir(kernels)) == sorted([*states, used.name])
    os.utime(used, (0, 0))
    run(ASK, XDG_CACHE_HOME=str(tmp_path))
    assert used.stat().st_mtime > 0.0  # each process says that it uses it


def ask(tmp_path, temporary=None):
    """The folder that is used, where there is no home: below one for temporary files."""
    kept = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    kept |= {"XDG_CACHE_HOME": "/proc/nowhere", "TMPDIR": str(temporary or tmp_path)}
    if temporary is not None:
        kept["XDG_CACHE_HOME"] = str(tmp_path)
    words = f"{ASK}; print(os.stat(os.environ['NUMBA_CACHE_DIR']).st_mode & 0o777)"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, env=kept)
    assert done.returncode == 0, done.stderr
    folder, mode = done.stdout.split()
    assert int(mode) == 0o700
    return Path(folder), messages(done.stderr)


@pytest.fixture
def predictable(tmp_path):
    """Where kernels go without a home: whoever is first has this name in /tmp."""
    return tmp_path / f"cdpr_drake-{os.getuid()}"


def plant(folder):
    """Kernels that somebody else left there, for each state that may be asked for."""
    (folder / "kernels").mkdir(parents=True)


def of_somebody_else(folder):
    plant(folder)
    if os.geteuid() != 0:
        pytest.skip("only root makes folders of others")
    os.chown(folder, 12345, 12345)


def a_link(folder):
    plant(folder.with_name("planted"))
    folder.symlink_to(folder.with_name("planted"))


def a_linked_sub_folder(folder):
    plant(folder.with_name("planted"))
    folder.mkdir()
    (folder / "kernels").symlink_to(folder.with_name("planted") / "kernels")


def somebodys_sub_folder(folder):
    plant(folder)
    if os.geteuid() != 0:
        pytest.skip("only root makes folders of others")
    os.chown(folder / "kernels", 12345, 12345)


def a_file(folder):
    folder.write_text("years")


UNTRUSTED = {
    of_somebody_else: "belongs to user 12345",
    a_link: "is a link",
    a_linked_sub_folder: "is a link",
    somebodys_sub_folder: "belongs to user 12345",
    a_file: "is no folder",
}


@pytest.mark.parametrize("make", UNTRUSTED)
def test_a_folder_that_is_not_ones_own_is_not_used_and_a_line_says_so(tmp_path, predictable, make):
    make(predictable)
    before = sorted(tmp_path.rglob("*"))
    folder, err = ask(tmp_path)
    assert folder.parent == tmp_path
    assert folder.name.startswith("cdpr_drake-kernels-")
    (line,) = err.splitlines()
    assert line.startswith("cdpr_drake: compiled kernels are not kept: ")
    assert str(predictable) in line
    assert UNTRUSTED[make] in line
    assert sorted(tmp_path.rglob("*")) == before  # the fresh folder went with the process


@pytest.mark.parametrize("make", [of_somebody_else, a_link, a_linked_sub_folder, a_file])
def test_the_users_cache_folder_is_checked_as_well(tmp_path, make):
    home, temporary = tmp_path / "home", tmp_path / "temporary"
    home.mkdir()
    temporary.mkdir()
    make(home / "cdpr_drake")
    folder, err = ask(home, temporary)
    assert folder.parent == temporary / f"cdpr_drake-{os.getuid()}" / "kernels"
    assert err == ""


@pytest.mark.parametrize("where", [".", "kernels", "state"])
def test_a_folder_that_others_could_write_to_is_closed_and_what_they_left_is_gone(
    tmp_path, predictable, where
):
    folder, _ = ask(tmp_path)
    assert folder.parent == predictable / "kernels"
    planted = folder / "rays_0123456789" / "ray_kernel.cast-12.py311.1.nbc"
    planted.parent.mkdir()
    planted.write_text("evil")
    place = folder if where == "state" else predictable / where
    place.chmod(0o777)
    assert ask(tmp_path) == (folder, "")
    assert place.stat().st_mode & 0o022 == 0
    assert planted.exists() == (where != "state")
    assert sorted(os.listdir(predictable / "kernels")) == [folder.name]


def test_kernels_are_not_kept_where_anybody_may_put_another_folder(tmp_path):
    tmp_path.chmod(0o777)
    folder, err = ask(tmp_path)
    assert folder.name.startswith("cdpr_drake-kernels-")
    assert f"{tmp_path} can be written by all users" in err
    tmp_path.chmod(0o1777)
    assert ask(tmp_path)[1] == ""
