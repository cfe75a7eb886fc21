"""Compiled kernels: each serial, with a parallel twin that is made when first asked for.

`@kernel` compiles a module-level function with Numba. Called plainly it runs on one thread with
the interpreter lock released, and `prange` means `range`; several worlds may step at once. Inside
`with kernel_threads():` the calling thread runs the twins instead wherever an array is LARGE, in
which `prange` spreads its iterations over threads. Small grids never start a thread, and never
wait for twins to be compiled. Kernels compute the same numbers on any number of threads as long as
an iteration of `prange` writes only what is its own; sums over all iterations are made per
iteration and added in order.

Numba's threads come from TBB where that is installed: there the calling thread does what no other
has begun, so that a busy machine slows a solve no more than it slows one thread. Elsewhere they
come from OpenMP, and sleep when they have waited as long as it takes to wake them twice, some 60
us. If they slept at once, a room's step would take six sevenths of the time of one thread, not
three quarters. If they went on, they would take the core from the thread that they wait for: a
solve of 0.5 s beside another busy process took 9 s.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar, cast

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # read when Numba loads OpenMP
os.environ.setdefault("GOMP_SPINCOUNT", "2000")  # of GNU's

import numba
import numpy as np
from numba import njit
from numba.core import event

from flowborne.kernels.linking import KernelCompiler, forget_constants

P = ParamSpec("P")
R = TypeVar("R")

ONLY_PRANGE = {
    "comprehension": False,
    "reduction": False,
    "inplace_binop": False,
    "setitem": False,
    "numpy": False,
    "stencil": False,
    "fusion": False,
    "prange": True,
}
"""Nothing but the loops that say so runs in parallel: array expressions keep their order."""

LARGE = 100_000
"""Fewest elements of a kernel's largest array for which threads are started."""

_thread = threading.local()
_started_in: list[int] = []
"""The process that started Numba's threads, once it has."""

_workqueue = threading.Lock()
"""Held by the one thread that may use Numba's own layer, which aborts the process on a second."""


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def allowed_threads() -> int:
    """Most threads that the calling thread's kernels may run on."""
    return int(getattr(_thread, "most", 1))


@contextmanager
def kernel_threads(most: int | None = None) -> Iterator[None]:
    """Within, the calling thread's kernels run on at most so many threads.

    most  at least 1, and no more than there are cores, as many as which None means. A context
          within another allows no more than that one
    """
    before = getattr(_thread, "most", None)
    wanted = cores() if most is None else min(most, cores())
    _thread.most = wanted if before is None else min(wanted, before)
    try:
        yield
    finally:
        if before is None:
            del _thread.most
        else:
            _thread.most = before


def largest_size(arguments: tuple[Any, ...]) -> int:
    """Elements of the largest of the arrays, those in tuples included."""
    most = 0
    for given in arguments:
        if isinstance(given, np.ndarray):
            most = max(most, given.size)
        elif isinstance(given, tuple):
            most = max(most, largest_size(given))
    return most


def numba_thread_count() -> int:
    """Threads that Numba would use by itself."""
    return int(numba.get_num_threads())


@cache
def numba_layer() -> str:
    """Name of the library that Numba's threads come from, started at the first call.

    Numba does not look for TBB where pip puts it, beside the environment's other libraries.
    """
    _started_in.append(os.getpid())
    with suppress(OSError):
        ctypes.CDLL(os.path.join(sys.prefix, "lib", "libtbb.so.12"))
    numba.set_num_threads(numba.get_num_threads())
    return str(numba.threading_layer())


@contextmanager
def numba_threads(count: int) -> Iterator[bool]:
    """Within, Numba spreads `prange` over `count` threads; yields False where it cannot now.

    Its layers TBB and OpenMP serve several threads of the process at once, its own only one. GNU's
    OpenMP ends a fork of a process with threads of it.
    """
    if numba_layer() == "omp" and _started_in[0] != os.getpid():
        yield False
        return
    shared = numba_layer() != "workqueue"
    before = numba.get_num_threads()
    numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
    free = shared or _workqueue.acquire(blocking=False)
    try:
        yield free
    finally:
        numba.set_num_threads(before)
        if free and not shared:
            _workqueue.release()


def compiled(function: FunctionType, **options: Any) -> Any:
    """By Numba when first called. A division by 0 gives what IEEE says: loops that stop at one are
    not vectorised. There is no entry for C."""
    options |= {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    return njit(pipeline_class=KernelCompiler, **options)(function)


class Kernel(Generic[P, R]):
    """A function that is compiled when first called, once for Python, kept on disc, and once for
    other kernels: the entry from Python takes longer to compile than most functions.

    Inside a parallel twin every kernel is called by its twin.
    """

    def __init__(self, function: Callable[P, R], **options: Any) -> None:
        assert isinstance(function, FunctionType)
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self.__wrapped__ = function
        self.options = options
        self.outer = compiled(function, cache=True, **options)
        self.inner = compiled(function, no_cpython_wrapper=True, **options)
        if "forceinline" not in options:
            forget_constants(self.inner)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        count = getattr(_thread, "most", 1)
        if count == 1 or self.parallel is self or largest_size(args) < LARGE:
            return cast(R, self.outer(*args, **kwargs))
        with numba_threads(count) as free:
            version = self.parallel if free else self
            return cast(R, version.outer(*args, **kwargs))

    @property
    def _numba_type_(self) -> Any:
        """Numba's type of the function: what a call from another kernel compiles against."""
        return self.inner._numba_type_

    @cached_property
    def parallel(self) -> Kernel[P, R]:
        """The parallel twin; the kernel itself where neither it nor what it calls has a prange.

        The twin is a copy under another name, because Numba's cache on disc would take one for the
        other, and sees the twins of the kernels that it calls.
        """
        function = self.__wrapped__
        names = function.__code__.co_names
        found = {name: function.__globals__.get(name) for name in names}
        called = {name: other for name, other in found.items() if isinstance(other, Kernel)}
        twins = {name: other.parallel for name, other in called.items()}
        if "prange" not in names and twins == called:
            return self
        there, name = {**function.__globals__, **twins}, function.__name__ + "_parallel"
        copy = FunctionType(function.__code__, there, name, function.__defaults__)
        copy.__qualname__, copy.__module__ = name, function.__module__
        spread = ONLY_PRANGE if "prange" in names else False
        twin: Kernel[P, R] = Kernel(copy, **self.options, parallel=spread)
        twin.parallel = twin
        return twin


def kernel(function: Callable[P, R]) -> Kernel[P, R]:
    """Decorator of module-level functions on plain arrays; see the module."""
    return Kernel(function)


def inlined(function: Callable[..., Any]) -> Any:
    """For what is called at every cell or face: inlined by LLVM, which compiles far sooner than by
    Numba. What goes through a row or a plane is a kernel: inlined, it would be compiled anew at
    every place that calls it, and once more in all that these are called from."""
    return Kernel(function, forceinline=True)


class Undisturbed(event.Listener):
    """While a kernel compiles, no garbage is collected: searching all that Numba makes and keeps
    takes an eighth of the time. Ctrl-C and SIGTERM wait until it is compiled, because an exception
    of their handlers is lost where LLVM calls Python. One thread compiles at a time."""

    depth, collects = 0, False

    def __init__(self) -> None:
        self.handlers: dict[signal.Signals, Callable[..., Any]] = {}
        self.waiting: list[int] = []

    def on_start(self, started: object) -> None:
        if self.depth == 0:
            self.collects = gc.isenabled()
            gc.disable()
            if threading.current_thread() is threading.main_thread():
                for number in (signal.SIGINT, signal.SIGTERM):
                    if callable(handler := signal.getsignal(number)):
                        self.handlers[number] = handler
                        signal.signal(number, lambda number, frame: self.waiting.append(number))
        self.depth += 1

    def on_end(self, ended: object) -> None:
        self.depth -= 1
        if self.depth:
            return
        if self.collects:
            gc.enable()
        while self.handlers:
            signal.signal(*self.handlers.popitem())
        if self.waiting:
            number = self.waiting[0]
            self.waiting.clear()
            signal.raise_signal(number)


event.register("numba:compile", Undisturbed())


@contextmanager
def compilation_watched(notify: Callable[[int], None]) -> Iterator[None]:
    """Call `notify(n)` when the n-th kernel begins to compile.

    Kernels that come from the cache of an earlier run are not compiled, and nothing is called.
    Calls come from whichever thread compiles.
    """

    class Listener(event.Listener):
        compiled = 0

        def on_start(self, started: object) -> None:
            self.compiled += 1
            notify(self.compiled)

        def on_end(self, ended: object) -> None:
            """Nothing: only the beginning of a compilation is news."""

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
