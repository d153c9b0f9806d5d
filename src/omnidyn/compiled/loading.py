"""Machine code from disk, without waking the compiler.

numba gets ready to compile before it loads what is compiled: 0.3 to 0.5 s of a command that compiles nothing. A kernel
needs the runtime that counts arrays, and its own object code. What the compiler would want of it, should it ever be
called by another kernel, is read when it is asked for. All of that is private to numba: tests watch.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import parse_bitcode
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.runtime.nrt import rtsys


class FromDisk(JITCodeLibrary):
    """The code of a kernel as it was saved."""

    bitcode = b""

    @classmethod
    def of(cls, codegen: Any, saved: Any, names: Any) -> FromDisk:
        """The library, ready to run. saved: as numba serialises one; names: of what it has to offer."""
        name, kind, (machine, bitcode) = saved
        if kind != "object":
            raise ValueError(kind)
        library = cls(codegen, name)
        library.bitcode = bitcode
        library.enable_object_caching()
        library._set_compiled_object(machine)
        library._finalize_final_module()
        codegen._engine._defined_symbols |= set(names)
        return library

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = parse_bitcode(self.bitcode)
        return self._shared_module


def loaded(context: Any, saved: Any) -> Any:
    """The compiled function that numba's own cache would make of the same."""
    code, fndesc, environment, signature, objectmode, lifted, annotation, reload_init, environments = saved
    rtsys.initialize(context)
    for begin in reload_init:
        begin()
    library = FromDisk.of(context.codegen(), code, (fndesc.llvm_func_name, fndesc.llvm_cpython_wrapper_name))
    result = compile_result(
        target_context=context, typing_context=context.typing_context, library=library, environment=environment,
        entry_point=context.get_executable(library, fndesc, environment), fndesc=fndesc, type_annotation=annotation,
        signature=signature, objectmode=objectmode, lifted=lifted, reload_init=reload_init,
        referenced_envs=environments,
    )  # fmt: skip
    for each in environments:
        context.codegen().set_env(each.env_name, each)
    return result
