from types import SimpleNamespace

import numba

from flowborne.kernels import conjugate_gradients, jit
from flowborne.kernels.compilation import compilation_watched
from flowborne.solvers import compiling
from flowborne.solvers.compiling import (
    compile_iteration,
    compile_solver,
    compile_solver_beside,
    solve_small_slab,
)


def test_kernels_are_counted_once_and_only_while_watching():
    @numba.njit
    def double(x):
        return 2 * x

    seen = []
    with compilation_watched(seen.append):
        double(1)
        double(2)
        double(1.0)
    double(1j)
    assert seen == [1, 2]


def test_another_process_compiles_the_solver_unless_it_is_there(tmp_path, monkeypatch):
    """Here it is put into the cache first, then asked for with that cache and with an empty one."""
    started = []
    monkeypatch.setattr(compiling.subprocess, "Popen", lambda command, **_: started.append(command))
    monkeypatch.setattr(jit, "cores", lambda: 2)
    compile_solver()
    compile_solver_beside.__wrapped__()
    assert started == []
    empty = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))
    monkeypatch.setattr(conjugate_gradients, "solve", SimpleNamespace(serial=empty))
    compile_solver_beside.__wrapped__()
    assert [command[1:] for command in started] == [["-m", "flowborne.solvers.compiling"]]
    monkeypatch.setattr(jit, "cores", lambda: 1)
    compile_solver_beside.__wrapped__()
    assert len(started) == 1


def test_the_iteration_is_compiled_for_the_types_that_a_solve_has():
    """Else the first solve would compile it once more."""
    compile_iteration()
    compiled = list(conjugate_gradients.solve.serial.signatures)
    solve_small_slab()
    assert conjugate_gradients.solve.serial.signatures == compiled
