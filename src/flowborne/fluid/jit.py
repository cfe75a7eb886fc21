"""Compiled kernels: each serial, with a parallel twin that is made when first asked for.

`@kernel` compiles a module-level function with Numba. Called plainly it runs on one thread with
the interpreter lock released, and `prange` means `range`; several worlds may step at once. Inside
`with parallel_kernels():` the calling thread runs the twins instead, in which `prange` spreads its
iterations over the machine. Only one thread of a process may do so at a time: Numba's own threads
cannot be shared. Kernels compute the same numbers either way as long as an iteration of `prange`
writes only what is its own; sums over all iterations are made per iteration and added in order.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar

from numba import njit

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

_thread = threading.local()


class Kernel(Generic[P, R]):
    """A function compiled twice: serial, and parallel when first asked for.

    Other kernels may call it. Inside a parallel twin every kernel is called by its twin.
    """

    def __init__(self, function: Callable[P, R]) -> None:
        assert isinstance(function, FunctionType)
        self.__doc__ = function.__doc__
        self.__name__ = function.__name__
        self.__wrapped__ = function
        self.serial: Any = njit(nogil=True, cache=True)(function)
        self._twin: Any = None

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        chosen = self.parallel if getattr(_thread, "parallel", False) else self.serial
        result: R = chosen(*args, **kwargs)
        return result

    @property
    def _numba_type_(self) -> Any:
        """Numba's type of the serial version: what a call from another kernel compiles against."""
        return self.serial._numba_type_

    @property
    def parallel(self) -> Any:
        """The parallel twin; the serial version where neither it nor what it calls has a prange.

        The twin is a copy under another name, because Numba's cache on disc would take one for the
        other, and sees the twins of the kernels that it calls.
        """
        if self._twin is None:
            function = self.__wrapped__
            names = function.__code__.co_names
            called = {
                name: function.__globals__[name]
                for name in names
                if isinstance(function.__globals__.get(name), Kernel)
            }
            twins = {name: other.parallel for name, other in called.items()}
            changed = any(twins[name] is not called[name].serial for name in twins)
            if "prange" not in names and not changed:
                self._twin = self.serial
            else:
                name = function.__name__ + "_parallel"
                copy = FunctionType(function.__code__, {**function.__globals__, **twins}, name)
                copy.__qualname__ = name
                copy.__module__ = function.__module__
                option = ONLY_PRANGE if "prange" in names else False
                self._twin = njit(nogil=True, cache=True, parallel=option)(copy)
        return self._twin


def kernel(function: Callable[P, R]) -> Kernel[P, R]:
    """Decorator of module-level functions on plain arrays; see the module."""
    return Kernel(function)


@contextmanager
def parallel_kernels(wanted: bool = True) -> Iterator[None]:
    """Within, the calling thread's kernels run on all of the machine's cores when `wanted`."""
    before = getattr(_thread, "parallel", False)
    _thread.parallel = wanted
    try:
        yield
    finally:
        _thread.parallel = before
