"""Compiled kernels are kept in a private folder outside the package, whatever the machine is like;
a program that compiles them is told once."""

import atexit
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import platformdirs
import pytest

from cdpr_drake.kernel_cache.folder import use_kernel_cache
from tests.messages import messages

PROGRAM = """
import os, sys
import cdpr_drake as cdpr
robot = cdpr.load_robot("planar")
for _ in range(2):
    robot.wrench_matrix()
    print("called", file=sys.stderr, flush=True)
folder = os.environ["NUMBA_CACHE_DIR"]
print(folder, sum(len(files) for _, _, files in os.walk(folder)))
"""
FIRST_USE = "first use of Robot.wrench_matrix: compiling kernels, which are kept"
NOT_KEPT = "cdpr_drake: compiled kernels are not kept: "


def program(**environment):
    """Folder and number of files that a program ends with, and what it says on stderr."""
    own = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    inherited = {name: value for name, value in os.environ.items() if name not in own}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True,
        env=inherited | environment,
    )  # fmt: skip
    folder, count = done.stdout.split()
    return Path(folder), int(count), messages(done.stderr).splitlines()


def test_a_program_compiles_into_the_users_cache_folder_and_says_so_once_and_before(tmp_path):
    first = program(XDG_CACHE_HOME=str(tmp_path))
    assert first[0].parent == tmp_path / "cdpr_drake" / "kernels"
    assert first[1] >= 2
    assert first[2] == [FIRST_USE, "called", "called"]
    again = program(XDG_CACHE_HOME=str(tmp_path))
    assert again == (*first[:2], ["called", "called"])  # all is kept


def test_a_program_without_a_folder_of_its_own_still_runs_and_leaves_nothing(tmp_path):
    tmp_path.chmod(0o777)
    folder, count, said = program(XDG_CACHE_HOME="/proc/nowhere", TMPDIR=str(tmp_path))
    assert folder.name.startswith("cdpr_drake-kernels-")
    assert count >= 2
    assert said[0].startswith(NOT_KEPT)
    assert not folder.exists()


# The choice of a folder, in this process.


@pytest.fixture
def chosen(tmp_path, monkeypatch, caplog):
    """Chooses a folder where there is no home, or that one, and temporary files go to tmp_path.

    Returns it, the words that are said, and what removes it at the end of the process.
    """

    def choose(home="/proc/nowhere", temporary=tmp_path, own=""):
        caplog.clear()
        at_exit = []
        monkeypatch.setattr(atexit, "register", lambda *call: at_exit.append(call))
        monkeypatch.setattr(numba.config, "CACHE_DIR", "")
        monkeypatch.setattr(tempfile, "tempdir", str(temporary))
        monkeypatch.setenv("NUMBA_CACHE_DIR", own)
        monkeypatch.setenv("XDG_CACHE_HOME", str(home))
        use_kernel_cache()
        folder = Path(os.environ["NUMBA_CACHE_DIR"])
        if not own:
            assert folder.stat().st_mode & 0o777 == 0o700
            assert str(folder) == numba.config.CACHE_DIR
        return folder, [record.getMessage() for record in caplog.records], at_exit

    return choose


@pytest.fixture
def predictable(tmp_path):
    """Where kernels go without a home: whoever is first has this name in /tmp."""
    return tmp_path / f"cdpr_drake-{os.getuid()}"


def test_the_users_own_choice_counts(chosen, tmp_path):
    assert chosen(own=str(tmp_path / "mine"))[0] == tmp_path / "mine"


def test_without_a_home_they_are_below_the_folder_of_temporary_files(
    chosen, predictable, monkeypatch
):
    def no_home(*_):
        raise RuntimeError("no home")

    monkeypatch.setattr(platformdirs, "user_cache_dir", no_home)
    folder, said, _ = chosen()
    assert folder.parent == predictable / "kernels"
    assert said == []


@pytest.mark.parametrize("in_use", [False, True])
def test_old_states_of_the_sources_are_forgotten_but_not_those_in_use(chosen, tmp_path, in_use):
    """Another checkout's processes would compile anew what was removed under them."""
    kernels = tmp_path / "cdpr_drake" / "kernels"
    for number in range(5):
        (kernels / f"state{number}").mkdir(parents=True)
        if not in_use:
            os.utime(kernels / f"state{number}", (number, number))
    folder = chosen(tmp_path)[0]
    states = [f"state{number}" for number in range(0 if in_use else 3, 5)]
    assert sorted(os.listdir(kernels)) == sorted([*states, folder.name])
    os.utime(folder, (0, 0))
    chosen(tmp_path)
    assert folder.stat().st_mtime > 0.0  # each process says that it uses it


def plant(folder):
    """Kernels that somebody else left there, for each state that may be asked for."""
    (folder / "kernels").mkdir(parents=True)


def give_away(folder):
    if os.geteuid() != 0:
        pytest.skip("only root makes folders of others")
    os.chown(folder, 12345, 12345)


def of_somebody_else(folder):
    plant(folder)
    give_away(folder)


def somebodys_sub_folder(folder):
    plant(folder)
    give_away(folder / "kernels")


def a_link(folder):
    plant(folder.with_name("planted"))
    folder.symlink_to(folder.with_name("planted"))


def a_linked_sub_folder(folder):
    plant(folder.with_name("planted"))
    folder.mkdir()
    (folder / "kernels").symlink_to(folder.with_name("planted") / "kernels")


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
def test_a_folder_that_is_not_ones_own_is_not_used_and_a_line_says_so(
    make, chosen, tmp_path, predictable
):
    make(predictable)
    before = sorted(tmp_path.rglob("*"))
    folder, (line,), ((remove, *arguments),) = chosen()
    assert folder.parent == tmp_path
    assert folder.name.startswith("cdpr_drake-kernels-")
    assert line.startswith(NOT_KEPT)
    assert str(predictable) in line
    assert UNTRUSTED[make] in line
    assert len(line.splitlines()) == 1
    remove(folder, os.getpid() + 1)  # of a process that was forked
    assert folder.exists()
    remove(*arguments)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("make", [of_somebody_else, a_link, a_linked_sub_folder, a_file])
def test_the_users_cache_folder_is_checked_as_well(make, chosen, tmp_path, predictable):
    home = tmp_path / "home"
    home.mkdir()
    make(home / "cdpr_drake")
    folder, said, _ = chosen(home)
    assert folder.parent == predictable / "kernels"
    assert said == []


@pytest.mark.parametrize("where", [".", "kernels", "state"])
def test_a_folder_that_others_could_write_to_is_closed_and_what_they_left_is_gone(
    where, chosen, predictable
):
    folder = chosen()[0]
    assert folder.parent == predictable / "kernels"
    planted = folder / "rays_0123456789" / "ray_kernel.cast-12.py311.1.nbc"
    planted.parent.mkdir()
    planted.write_text("evil")
    place = folder if where == "state" else predictable / where
    place.chmod(0o777)
    assert chosen()[:2] == (folder, [])
    assert place.stat().st_mode & 0o022 == 0
    assert planted.exists() == (where != "state")
    assert sorted(os.listdir(predictable / "kernels")) == [folder.name]


def test_kernels_are_not_kept_where_anybody_may_put_another_folder(chosen, tmp_path):
    tmp_path.chmod(0o777)
    folder, (line,), _ = chosen()
    assert folder.name.startswith("cdpr_drake-kernels-")
    assert f"{tmp_path} can be written by all users" in line
    tmp_path.chmod(0o1777)
    assert chosen()[1] == []
