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
"""
"""Another process, which holds a lock until its standard input ends."""


@contextmanager
def held_elsewhere(folder, name):
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder), name],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout.readline() == "True\n"
        yield process
        process.kill()


def test_a_lock_ends_with_the_process_that_has_it(tmp_path, monkeypatch):
    locks = CompilationLocks(tmp_path)
    with held_elsewhere(tmp_path, "kernel") as other:
        with locks.held("kernel", wait=False) as mine:
            assert not mine
        with locks.held("another one") as mine:
            assert mine
        monkeypatch.setattr("cdpr_drake.kernel_cache.locks.LONGEST_WAIT", 0.0)
        with locks.held("kernel") as mine:
            assert not mine  # it compiles all the same
        monkeypatch.undo()
        other.kill()
        with locks.held("kernel") as mine, locks.held("kernel") as again:
            assert mine
            assert again
            assert not locks.waits


def test_without_a_folder_that_can_be_written_there_are_no_locks(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        CompilationLocks(tmp_path / "file")


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A module of kernels of which none was ever compiled, kept in a folder of its own."""
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


def listed(number, name, *calls):
    return ListedKernel(number, f"small_kernels:{name}", frozenset(calls), frozenset([0]), "f8,")


LISTED = [listed(3, "half"), listed(5, "quarter", 3), listed(8, "third"), listed(9, "gone")]


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
    locks = share_compilation()
    name = kernel_lock(small.half, (numba.float64,))
    pauses = []

    def pause(seconds):
        pauses.append(list(compiled))
        other.kill()
        other.wait()

    monkeypatch.setattr("cdpr_drake.kernel_cache.background.time.sleep", pause)
    with held_elsewhere(os.environ["NUMBA_CACHE_DIR"], name) as other:
        compile_listed(LISTED, locks)
    assert pauses == [["third"]]
    assert compiled == ["third", "half", "quarter"]


def test_kernels_are_compiled_without_an_entry_for_c(small):
    """Which nobody calls; those of others have one."""
    share_compilation()
    before = compilation_time()

    @numba.njit
    def other(number):
        return 0.5 * number

    for kernel, has_one in ((small.half, False), (other, True)):
        assert kernel(3.0) == 1.5
        compiled = kernel.get_compile_result(kernel.nopython_signatures[0])
        entry = compiled.fndesc.llvm_cfunc_wrapper_name
        assert (entry in compiled.library.get_llvm_str()) == has_one
    spent = compilation_time()
    assert spent > before
    assert small.half(4.0) == 2.0
    assert compilation_time() == spent


def test_kernels_of_others_are_left_alone(small, monkeypatch):
    assert kernel_lock(small.half, (numba.float64,))
    monkeypatch.setattr(small.half.py_func, "__module__", "somebody.else")
    assert kernel_lock(small.half, (numba.float64,)) is None

    @numba.njit
    def not_kept(number):
        return number

    not_kept.py_func.__module__ = "cdpr_drake.tests"
    assert kernel_lock(not_kept, (numba.float64,)) is None


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """An empty cache folder and two processors."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "")
    monkeypatch.setattr("cdpr_drake.kernel_cache.locks._locks", None)
    monkeypatch.setattr("cdpr_drake.kernel_cache.background._processors", lambda: 2)
    return tmp_path


GROUP = ["acrobot_pbvs_taut"]


def test_a_function_without_a_module_is_of_others():
    """Such as one that a cell of text defines."""
    defined = {}
    exec("def twice(x):\n    return 2 * x", defined)
    twice = numba.njit(defined["twice"])
    twice.py_func.__module__ = None
    assert kernel_lock(twice, (numba.float64,)) is None


def test_a_process_in_the_background_ends_with_its_parent(fresh):
    """The parent starts it and is killed at once."""
    words = (
        "import os; from cdpr_drake.kernel_cache import background; "
        "background._processors = lambda: 2; "
        f"background.compile_in_background({GROUP}); "
        "print(background._started[0].pid, flush=True); os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", words], stdout=subprocess.PIPE, check=False)
    assert done.returncode == -9
    folder = Path(f"/proc/{int(done.stdout)}")
    while folder.exists() and "kernel_cache" in (folder / "cmdline").read_text():
        time.sleep(0.02)


def test_nothing_is_started_where_it_is_of_no_use(fresh, monkeypatch):
    def start(groups):
        started.append(groups)

    started = []
    monkeypatch.setattr("cdpr_drake.kernel_cache.background._start", start)
    assert compile_in_background(GROUP) == 1
    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "0")
    assert compile_in_background(GROUP) == 0
    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "5")
    assert compile_in_background(GROUP) == 1  # one processor is this process's own
    assert compile_in_background([]) == 0
    assert not is_complete(GROUP)
    note_complete(GROUP)
    assert compile_in_background(GROUP) == 0
    assert len(started) == 2
    monkeypatch.setattr("cdpr_drake.kernel_cache.background._processors", lambda: 1)
    assert compile_in_background(["another one"]) == 0


def test_where_nothing_can_be_kept_nothing_is_started(fresh, monkeypatch):
    (fresh / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(fresh / "file" / "below"))
    assert shared_locks() is None
    assert compile_in_background(GROUP) == 0


def test_a_number_of_processes_that_is_none_is_refused(monkeypatch):
    from cdpr_drake.errors import CdprError

    monkeypatch.setenv("CDPR_COMPILE_HELPERS", "many")
    with pytest.raises(CdprError, match="CDPR_COMPILE_HELPERS: found 'many'; accepted: a whole"):
        compile_in_background(GROUP)


def linked_locks(path):
    path.with_name("thesis.tex").write_text("years")
    path.symlink_to("thesis.tex")


def second_name(path):
    path.with_name("thesis.tex").write_text("years")
    os.link(path.with_name("thesis.tex"), path)


def pipe(path):
    os.mkfifo(path)


def of_somebody_else(path):
    if os.geteuid() != 0:
        pytest.skip("only root makes files of others")
    path.touch()
    os.chown(path, 12345, 12345)


@pytest.mark.parametrize("make", [linked_locks, second_name, pipe, of_somebody_else])
def test_a_file_of_locks_that_is_not_ones_own_is_not_used(tmp_path, monkeypatch, make):
    make(tmp_path / LOCK_FILE)
    with pytest.raises(OSError, match=r"found no plain file|symbolic links"):
        CompilationLocks(tmp_path)
    monkeypatch.setattr(locks_module, "_locks", None)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert shared_locks() is None  # each process compiles for itself
    assert compile_in_background(["acrobot_pbvs"]) == 0
