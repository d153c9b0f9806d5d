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
from llvmlite.binding import Linkage
from numba.core import compiler, typed_passes, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.extending import is_jitted

from omnidyn.compiled import private
from omnidyn.compiled.listeners import told

ERROR_MODEL = "numpy"  # a division by zero gives inf or nan, as in NumPy, and needs no branch


class Announced(Compiler):
    """numba's own compiler; who listens hears that it is at work."""

    def compile_extra(self, func: Any) -> Any:
        with told(func.__qualname__):
            return super().compile_extra(func)


class OfBranches(Announced):
    """The same for code that is all branches, see linking.Branches."""

    def compile_extra(self, func: Any) -> Any:

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


def machine_code(kernel: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """What numba calls for arguments of these types, without asking at each call what they are: 1 to 3 us less.

    For loops whose arguments keep their types, down to whether an array is contiguous and writable: none is checked.
    """
    if not is_jitted(kernel):  # numba is switched off
        return kernel
    compiled: Any = kernel
    signature = tuple(numba.typeof(argument) for argument in arguments)
    compiled.compile(signature)
    return compiled.get_overload(signature)


def kept() -> list[Any]:
    """What keeps the kernels of the package that have been imported, see entries.py; nothing keeps those in memory."""
    modules = [module for name, module in tuple(sys.modules.items()) if name.startswith("omnidyn.")]
    kernels: dict[int, Any] = {
        id(value): value for module in modules for value in vars(module).values() if is_jitted(value)
    }
    return [kernel._cache for kernel in kernels.values() if hasattr(kernel._cache, "stamp")]


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function inside kernels: compiled into the kernels that call it, never cached by itself.

    It works in arrays that its kernel holds, and does not count who holds them: numba lets it neither make nor return
    one.
    """
    return _linked(function, counted=False)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """A part whose code stands in the kernel itself, however large that is: its loops see what the kernel knows of its
    arrays, and become vector instructions without a check at each call."""
    return _linked(function, counted=False, forceinline=True)


def one_of(functions: Sequence[Callable[..., Any]]) -> Any:
    """A part that hands what it is given to one of several parts: its first argument is the number of it, from 0."""
    last = functions[-1]

    def only(number, *arguments):
        return last(*arguments)

    choice = part(only)
    for number in reversed(range(len(functions) - 1)):
        choice = _either(number, functions[number], choice)
    return choice


def _either(position: int, function: Callable[..., Any], fallback: Callable[..., Any]) -> Any:
    """A part that is `function` for its own number, else what others are."""

    def either(number, *arguments):
        if number == position:
            return function(*arguments)
        return fallback(number, *arguments)

    return part(either)


def plain(function: Any) -> Callable[..., Any]:
    """The Python function that was compiled: of NumPy's functions alone it takes arrays too."""
    return getattr(function, "py_func", function)


def maker(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function inside kernels that makes arrays, for kernels and other makers: a part would never let go of them."""
    return _linked(function, counted=True)


def _linked(function: Callable[..., Any], counted: bool, **options: Any) -> Any:
    """A function inside kernels; where numba is switched off, for debuggers, the function itself.

    numba counts who holds an array: it adds and removes one, atomically, around nearly every call that has a branch. In
    small functions of arithmetic that costs three times as much as the rest.
    """
    supported = private.used()
    if supported:
        options["_nrt"] = counted
    dispatcher: Any = numba.njit(error_model=ERROR_MODEL, **options)(function)
    if dispatcher is function or not supported:
        return dispatcher

    return Linked(dispatcher)


# Parts of kernels: code to link, optimised once, in the kernel that calls it
#
# numba makes wrappers and machine code of every function, and to that end optimises each together with all that it
# calls: a formula at the bottom once for every function above it. Only kernels are ever called from outside. A linked
# function therefore stays as it was written until a kernel takes it: a first run takes a third of the time, with the
# same numbers to the last bit. Compilers of one's own are open to users of numba, the library of code is private to it:
# tests watch.


class Linked(CPUDispatcher):
    """A function that kernels link; called from Python, which only tests do, it is compiled for itself as well."""

    def __init__(self, dispatcher: Any):
        options = dispatcher.targetoptions | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        super().__init__(dispatcher.py_func, targetoptions=options, pipeline_class=LinkedCompiler)
        self.whole = dispatcher

    def __call__(self, *arguments: Any, **names: Any) -> Any:
        return self.whole(*arguments, **names)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """How a caller sees it: numba would compile it once more for every constant that somebody hands in."""
        return super().get_call_template([types.unliteral(arg) for arg in args], kws)

    def add_overload(self, cres: Any) -> None:
        """Remember it for kernels; numba would note it for callers from Python, too."""
        self.overloads[tuple(cres.signature.args)] = cres


class LinkedLibrary(JITCodeLibrary):
    """The code of a linked function as it was written, which is optimised where it is linked."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Nothing more will come. What is called is not linked here: it would be again in every caller."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """The function and all that it calls, each once: asked for by the kernels that call it, by no other."""
        self._ensure_finalized()
        if self._shared_module is None:
            module = self._final_module.clone()
            for library in self._below({}):
                final = library._final_module if isinstance(library, LinkedLibrary) else None
                module.link_in(final or library._get_module_for_linking(), preserve=True)
            for function in module.functions:
                if not function.is_declaration and function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"  # there may be the same code from another one
            self._shared_module = module
        return self._shared_module

    def _below(self, libraries: dict[Any, None]) -> dict[Any, None]:
        """All libraries that this one needs, itself left out, in the order in which they are met."""
        for library in self._linking_libraries:
            if library not in libraries:
                libraries[library] = None
                if isinstance(library, LinkedLibrary):
                    library._below(libraries)
        return libraries


class Branches(JITCodeLibrary):
    """The code of a kernel that is all branches: optimised in one go, nothing vectorised.

    That saves an eighth of the time to compile it, and the engines run as fast, to the last bit the same.
    """

    def _optimize_final_module(self) -> None:
        try:
            passes, builder = self._codegen._module_pass_manager(opt=2, loop_vectorize=False, slp_vectorize=False)
        except (TypeError, ValueError, AttributeError):  # an older numba asks for them otherwise
            super()._optimize_final_module()
        else:
            passes.run(self._final_module, builder)


@register_pass(mutates_CFG=False, analysis_only=False)
class _IntoALibrary(LoweringPass):
    """Before a function is lowered: the library that takes its code."""

    _name = "omnidyn_into_a_library"

    def __init__(self):
        super().__init__()

    def run_pass(self, state: Any) -> Any:
        state.library = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return True


@register_pass(mutates_CFG=False, analysis_only=False)
class _KnownToCallers(LoweringPass):
    """After it has been lowered: callers find it. Its name is an object: there is no machine code to point to."""

    _name = "omnidyn_known_to_callers"

    def __init__(self):
        super().__init__()

    def run_pass(self, state: Any) -> Any:
        lowered = state["cr"]._replace(cfunc=object())
        state.targetctx.insert_user_function(lowered.cfunc, lowered.fndesc, [state.library])
        state["cr"] = lowered
        return True


class LinkedCompiler(compiler.CompilerBase):
    """numba's own compiler with these two passes."""

    def define_pipelines(self) -> list[Any]:
        passes = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_IntoALibrary, typed_passes.AnnotateTypes)
        passes.add_pass_after(_KnownToCallers, typed_passes.NativeLowering)
        passes.finalize()
        return [passes]


def processor_compiled_for() -> tuple[bool, str]:
    """(whether a function compiled here gives the right number, the name of the processor). Raises what numba does."""
    from llvmlite import binding

    return bool(numba.njit(lambda x: 2.0 * x)(1.0) == 2.0), str(binding.get_host_cpu_name())
