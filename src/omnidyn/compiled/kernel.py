"""The one way to compile a kernel: native code, without the GIL, with a disk cache that is never stale.

numba's disk cache looks only at the file in which a kernel stands: edit a formula that the kernel calls from
another file, and the old machine code is served without a word. Here every entry is stamped with a hash of all that
the kernel can reach. Where no folder is writable the kernel is compiled in memory. `parallel=True` is never used: its
thread pools break under fork and under user threads; use threads over blocks instead.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numba
from numba.core.compiler import Compiler
from numba.extending import is_jitted

from omnidyn.compiled import private
from omnidyn.compiled.hearing import told

ERROR_MODEL = "numpy"  # a division by zero gives inf or nan, as in NumPy, and needs no branch


class Announced(Compiler):
    """numba's own compiler; who listens hears that it is at work."""

    def compile_extra(self, func: Any) -> Any:
        with told(func.__qualname__):
            return super().compile_extra(func)


class OfBranches(Announced):
    """The same for code that is all branches, see linking.Branches."""

    def compile_extra(self, func: Any) -> Any:
        from omnidyn.compiled.linking import Branches

        state: Any = self.state
        state.library = Branches(state.targetctx.codegen(), func.__qualname__)
        state.library.enable_object_caching()
        return super().compile_extra(func)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point: compiled without the GIL; its cache entry belongs to all sources that it can reach."""
    return _entry_point(function, Announced)


def branching_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """An entry point to code that is all branches, in which there is nothing to vectorise: compiled in less time."""
    return _entry_point(function, OfBranches if private.used() else Announced)


def _entry_point(function: Callable[..., Any], compiler: type[Compiler]) -> Callable[..., Any]:
    options: dict[str, Any] = {"nogil": True, "error_model": ERROR_MODEL, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(pipeline_class=compiler, **options)(function)
    if compiled is not function and not private.switched_off():  # the same function: no compiler, for debuggers
        with contextlib.suppress(RuntimeError, OSError, ImportError, AttributeError):
            # No writable folder, no source, or a numba whose cache we do not know: compiled in memory.
            from omnidyn.compiled.entries import Entries

            compiled._cache = Entries(function)
    return compiled


def kept() -> list[Any]:
    """What keeps the kernels of the package that have been imported, see entries.py; nothing keeps those in memory."""
    modules = [module for name, module in tuple(sys.modules.items()) if name.startswith("omnidyn.")]
    every: dict[int, Any] = {id(value): value for each in modules for value in vars(each).values() if is_jitted(value)}
    return [each._cache for each in every.values() if hasattr(each._cache, "stamp")]


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function inside kernels: compiled into the kernels that call it, never cached by itself.

    It works in arrays that its kernel holds, and does not count who holds them: numba lets it neither make nor return
    one.
    """
    return _linked(function, counted=False)


def one_of(functions: Sequence[Callable[..., Any]]) -> Any:
    """A part that hands what it is given to one of several parts: its first argument is the number of it, from 0."""
    last = functions[-1]

    def only(number, *given):
        return last(*given)

    chosen = part(only)
    for number in reversed(range(len(functions) - 1)):
        chosen = _either(number, functions[number], chosen)
    return chosen


def _either(own: int, this: Callable[..., Any], others: Callable[..., Any]) -> Any:
    """A part that is `this` for its own number, else what others are."""

    def either(number, *given):
        if number == own:
            return this(*given)
        return others(number, *given)

    return part(either)


def plain(function: Any) -> Callable[..., Any]:
    """The Python function that was compiled: of NumPy's functions alone it takes arrays too."""
    return getattr(function, "py_func", function)


def maker(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function inside kernels that makes arrays, for kernels and other makers: a part would never let go of them."""
    return _linked(function, counted=True)


def _linked(function: Callable[..., Any], counted: bool) -> Any:
    """A function inside kernels; where numba is switched off, for debuggers, the function itself.

    numba counts who holds an array: it adds and removes one, atomically, around nearly every call that has a branch. In
    small functions of arithmetic that costs three times as much as the rest.
    """
    tried = private.used()
    options: dict[str, Any] = {"_nrt": counted} if tried else {}
    whole = numba.njit(error_model=ERROR_MODEL, **options)(function)
    if whole is function or not tried:
        return whole
    from omnidyn.compiled.linking import Linked

    return Linked(whole)
