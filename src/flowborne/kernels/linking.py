"""What only other kernels call becomes machine code with them, once.

Numba optimises every function with all that it calls and makes machine code of both, so that what
is at the end of a chain of five calls goes through LLVM five times.
"""

from __future__ import annotations

from types import FunctionType, SimpleNamespace
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


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


class Linking(Compiler):
    """Numba's own, but for functions without an entry from Python."""

    def compile_extra(self, func: FunctionType) -> Any:
        """Compile the function. The environments of what it calls hold what these print, or raise
        with values."""
        state = self.state
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
