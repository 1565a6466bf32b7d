"""Processes share the compilation of kernels, and nobody waits for one that is gone."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numba
import pytest
from numba.core import event
from numba.core.dispatcher import Dispatcher

from cdpr_drake.analyses.frame.jobs import default_workers
from cdpr_drake.errors import CdprError
from cdpr_drake.kernel_cache import background
from cdpr_drake.kernel_cache import locks as locks_module
from cdpr_drake.kernel_cache.background import compile_in_background, compile_listed
from cdpr_drake.kernel_cache.kernel_list import ListedKernel, is_complete, note_complete
from cdpr_drake.kernel_cache.locks import (
    LOCK_FILE,
    CompilationLocks,
    compilation_time,
    kernel_lock,
    share_compilation,
    shared_locks,
)

HOLD = """
import sys
from pathlib import Path
from cdpr_drake.kernel_cache.locks import CompilationLocks
with CompilationLocks(Path(sys.argv[1])).held(sys.argv[2], wait=False) as mine:
    print(mine, flush=True)
    sys.stdin.read()
"""  # another process, which holds a lock until its standard input ends
GROUP = ["acrobot_pbvs_taut"]
FLOAT = (numba.float64,)


@contextmanager
def held_elsewhere(folder, name):
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder), name],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout.readline() == "True\n"
        yield process
        process.kill()


def test_processes_of_a_test_session_share_compilation_and_start_no_others_unasked():
    assert Dispatcher.compile.__name__ == "compile_once"
    assert default_workers() == 1
    assert os.environ["CDPR_COMPILE_HELPERS"] == "0"


def test_a_lock_ends_with_the_process_that_has_it(tmp_path, monkeypatch):
    locks = CompilationLocks(tmp_path)
    with held_elsewhere(tmp_path, "kernel") as other:
        with locks.held("kernel", wait=False) as mine, locks.held("another one") as free:
            assert (mine, free) == (False, True)
        with monkeypatch.context() as patch:
            patch.setattr(locks_module, "LONGEST_WAIT", 0.0)
            with locks.held("kernel") as mine:
                assert not mine  # it compiles all the same
        other.kill()
        with locks.held("kernel") as mine, locks.held("kernel") as again:
            assert mine
            assert again
            assert not locks.waits


# Kernels of which none was ever compiled.


@pytest.fixture
def small(tmp_path, monkeypatch):
    """Their module, kept in a folder of its own."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kept"))
    name = "cdpr_drake.small_kernels"
    spec = spec_from_file_location(name, Path(__file__).parent / "small_kernels.py")
    module = module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def compiled():
    """Names of kernels as they are compiled."""

    class Listener(event.Listener):
        def on_start(self, event):
            names.append(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event):
            pass

    names, listener = [], Listener()
    event.register("numba:compile", listener)
    yield names
    event.unregister("numba:compile", listener)


LISTED = [
    ListedKernel(number, f"small_kernels:{name}", frozenset(calls), frozenset([0]), "f8,")
    for number, name, calls in ((3, "half", ()), (5, "quarter", (3,)), (8, "third", ()),
                                (9, "gone", ()))
]  # fmt: skip


def test_the_last_is_compiled_first_and_what_is_kept_not_again(small, compiled):
    locks = share_compilation()
    small.third(1.0)
    compiled.clear()
    compile_listed(LISTED, locks)  # one of them does not exist: its caller will say so
    assert compiled == ["half", "quarter"]
    compiled.clear()
    assert small.quarter(3.0) == 0.75
    assert not compiled


def test_what_another_process_compiles_is_waited_for(small, compiled, monkeypatch):
    """It goes on with the others, and takes what remains when that one is gone."""
    locks, pauses = share_compilation(), []

    def pause(seconds):
        pauses.append(list(compiled))
        other.kill()
        other.wait()

    monkeypatch.setattr(background.time, "sleep", pause)
    name = kernel_lock(small.half, FLOAT)
    with held_elsewhere(os.environ["NUMBA_CACHE_DIR"], name) as other:
        compile_listed(LISTED, locks)
    assert pauses == [["third"]]
    assert compiled == ["third", "half", "quarter"]


def test_kernels_are_compiled_without_an_entry_for_c_and_their_time_is_counted(small):
    """An entry that nobody calls; kernels of others have one."""
    share_compilation()
    before = compilation_time()

    @numba.njit
    def other(number):
        return 0.5 * number

    for kernel, has_one in ((small.half, False), (other, True)):
        assert kernel(3.0) == 1.5
        result = kernel.get_compile_result(kernel.nopython_signatures[0])
        entry = result.fndesc.llvm_cfunc_wrapper_name
        assert (entry in result.library.get_llvm_str()) == has_one
    spent = compilation_time()
    assert spent > before
    assert small.half(4.0) == 2.0
    assert compilation_time() == spent


def test_kernels_of_others_are_left_alone(small, monkeypatch):
    """Of another package, not kept, and without a module, such as one that a cell of text
    defines."""
    assert kernel_lock(small.half, FLOAT)
    monkeypatch.setattr(small.half.py_func, "__module__", "somebody.else")
    assert kernel_lock(small.half, FLOAT) is None
    for module in ("cdpr_drake.tests", None):
        other = numba.njit(lambda number: number)
        other.py_func.__module__ = module
        assert kernel_lock(other, FLOAT) is None


# Processes in the background.


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """An empty cache folder and two processors; groups for which processes are started."""
    started = []
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "")
    monkeypatch.setattr(locks_module, "_locks", None)
    monkeypatch.setattr(background, "_processors", lambda: 2)
    monkeypatch.setattr(background, "_start", started.append)
    return started


def test_a_process_in_the_background_ends_with_its_parent(tmp_path):
    """The parent starts it and is killed at once."""
    words = (
        "import os; from cdpr_drake.kernel_cache import background; "
        "background._processors = lambda: 2; "
        f"background.compile_in_background({GROUP}); "
        "print(background._started[0].pid, flush=True); os.kill(os.getpid(), 9)"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "CDPR_COMPILE_HELPERS": ""}
    done = subprocess.run(
        [sys.executable, "-c", words], stdout=subprocess.PIPE, check=False, env=environment
    )
    assert done.returncode == -9
    folder = Path(f"/proc/{int(done.stdout)}")
    while folder.exists() and "kernel_cache" in (folder / "cmdline").read_text():
        time.sleep(0.02)


def test_nothing_is_started_where_it_is_of_no_use(fresh, monkeypatch):
    for helpers, groups, count in (
        ("", GROUP, 1), ("0", GROUP, 0), ("5", GROUP, 1), ("5", [], 0)
    ):  # fmt: skip
        monkeypatch.setenv("CDPR_COMPILE_HELPERS", helpers)  # one processor is this process's own
        assert compile_in_background(groups) == count, (helpers, groups)
    assert not is_complete(GROUP)
    note_complete(GROUP)
    assert compile_in_background(GROUP) == 0
    assert len(fresh) == 2
    monkeypatch.setattr(background, "_processors", lambda: 1)
    assert compile_in_background(["another one"]) == 0


def test_a_number_of_processes_that_is_none_is_refused(monkeypatch):
    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "many")
    with pytest.raises(CdprError, match="CDPR_COMPILE_HELPERS: found 'many'; accepted: a whole"):
        compile_in_background(GROUP)


def linked_locks(path):
    path.with_name("thesis.tex").write_text("years")
    path.symlink_to("thesis.tex")


def second_name(path):
    path.with_name("thesis.tex").write_text("years")
    os.link(path.with_name("thesis.tex"), path)


def of_somebody_else(path):
    if os.geteuid() != 0:
        pytest.skip("only root makes files of others")
    path.touch()
    os.chown(path, 12345, 12345)


@pytest.mark.parametrize("make", [linked_locks, second_name, os.mkfifo, of_somebody_else])
def test_a_file_of_locks_that_is_not_ones_own_is_not_used(make, fresh, tmp_path):
    """Each process compiles for itself."""
    make(tmp_path / LOCK_FILE)
    with pytest.raises(OSError, match=r"found no plain file|symbolic links"):
        CompilationLocks(tmp_path)
    assert shared_locks() is None
    assert compile_in_background(GROUP) == 0


def test_where_nothing_can_be_kept_nothing_is_started(fresh, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        CompilationLocks(tmp_path / "file")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "below"))
    assert shared_locks() is None
    assert compile_in_background(GROUP) == 0
    assert fresh == []
