from types import SimpleNamespace

import numba

import flowborne as fb
from flowborne.coupling import compiling
from flowborne.coupling.compiling import (
    carry_small_slab,
    compile_beside,
    compile_iteration,
    solve_small_slab,
)
from flowborne.kernels import conjugate_gradients, jit
from flowborne.kernels.carry import carry
from flowborne.kernels.jit import compilation_watched
from flowborne.worlds import make_world, step
from flowborne_validation.worlds import mjcf


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


def test_another_process_compiles_unless_the_solver_is_there(tmp_path, monkeypatch):
    """Here it is put into the cache first, then asked for with that cache and with an empty one."""
    started = []
    monkeypatch.setattr(compiling.subprocess, "Popen", lambda command, **_: started.append(command))
    monkeypatch.setattr(jit, "cores", lambda: 2)
    compile_iteration()
    compile_beside.__wrapped__()
    assert started == []
    empty = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))
    monkeypatch.setattr(conjugate_gradients, "solve", SimpleNamespace(serial=empty))
    compile_beside.__wrapped__()
    assert [command[1:] for command in started] == [["-m", "flowborne.coupling.compiling"]]
    monkeypatch.setattr(jit, "cores", lambda: 1)
    compile_beside.__wrapped__()
    assert len(started) == 1


def test_the_iteration_is_compiled_for_the_types_that_a_solve_has():
    """Else the first solve would compile it once more."""
    compile_iteration()
    compiled = list(conjugate_gradients.solve.serial.signatures)
    solve_small_slab()
    assert conjugate_gradients.solve.serial.signatures == compiled


def test_the_transport_is_compiled_for_the_types_that_a_step_has():
    carry_small_slab()
    compiled = list(carry.serial.signatures)
    ball = '<body name="ball"><freejoint/><geom type="sphere" size=".2" density="1"/></body>'
    grid = fb.Grid.slab(16, 16, 0.1, (-0.8, -0.8))
    step(make_world(mjcf(ball), grid, solid_density=2.0), 0.01)
    assert carry.serial.signatures == compiled
