"""What only other kernels call becomes machine code with them, once.

Numba optimises every function with all that it calls and makes machine code of both, so that what
is at the end of a chain of five calls goes through LLVM five times. It compiles a function once
more for each constant that it is called with, and its own, as `np.empty`, once more for each set of
options of the function that calls.
"""

from __future__ import annotations

from functools import cached_property
from types import FunctionType, SimpleNamespace
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.types.misc import unliteral


class Linked(JITCodeLibrary):
    """Code of a function for its callers; it has no address and cannot be run by itself.

    inlined  into every caller: optimised before, else counts of references to arrays do not cancel
             (`subtract_gradient` took 197 us for 9)
    """

    inlined = False

    @property
    def codegen(self) -> Any:
        """Takes the function's environment, which belongs to machine code: see `Linking`."""
        return SimpleNamespace(set_env=lambda name, environment: None)

    def _optimize_final_module(self) -> None:
        if self.inlined:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0, a symbol that is not defined."""
        return 0


OF_KERNELS = "no_cpython_wrapper", "forceinline"
"""Options in which kernels differ, which what they call does not get."""


class KernelFlags(Flags):
    """Options of a kernel, the same as another's where what they call gets the same ones."""

    @cached_property
    def given(self) -> tuple[Any, ...]:
        """Values of those options. They stay while the kernel is compiled."""
        return tuple(getattr(self, name) for name in self.options if name not in OF_KERNELS)

    def __hash__(self) -> int:
        return hash(KernelFlags)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KernelFlags) and self.given == other.given


def forget_constants(dispatcher: Any) -> None:
    """Let a function be compiled for all numbers where another calls it with a constant. What is
    inlined keeps constants: a loop from a place that may be below 0 is not vectorised."""
    template = dispatcher.get_call_template

    def without(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return template(tuple(map(unliteral, args)), kws)

    dispatcher.get_call_template = without


class Linking(Compiler):
    """Numba's own, but for functions without an entry from Python."""

    def compile_extra(self, func: FunctionType) -> Any:
        """Compile the function. The environments of what it calls hold what these print, or raise
        with values."""
        state = self.state
        state.flags = KernelFlags(state.flags)
        if state.flags.no_cpython_wrapper:
            state.library = Linked(state.targetctx.codegen(), func.__qualname__)
            state.library.inlined = state.flags.forceinline
            return super().compile_extra(func)
        result = super().compile_extra(func)
        for environment in result._find_referenced_environments():
            result.library.codegen.set_env(environment.env_name, environment)
        return result


PARTS = "_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals"
"""Methods of Numba's that `Linked` replaces or calls, in 0.61 to 0.68."""

KernelCompiler: type[Compiler] = (
    Linking if all(hasattr(JITCodeLibrary, part) for part in PARTS) else Compiler
)
"""A Numba of other parts compiles as it does by itself: the same code, later."""
