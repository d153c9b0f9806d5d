"""Machine code on disk: one file for each kernel, types of arguments and CPU, in the folder that numba would take.

A file begins with the stamp of the kernel and a hash of the rest. What was made from other sources, or is damaged, is
as good as not there: the kernel is compiled anew and the file replaced. (numba's own cache looks at the kernel's file
only, trusts what it reads, and leaves files behind whenever a kernel moves to another line.)
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from llvmlite.binding import parse_bitcode
from numba.core.caching import FunctionCache, _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import compile_result
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

from omnidyn.compiled import private
from omnidyn.compiled.stamp import stamp

SUFFIX = ".kernel"
STAMP_SIZE = 64


class Entries(_Cache):
    """What numba asks for machine code before it compiles a kernel, and gives it to afterwards.

    Raises RuntimeError where no folder is writable, OSError where there is no source to read.
    """

    def __init__(self, function: Callable[..., Any]):
        cache = FunctionCache(function)
        self._key, self._impl = cache._index_key, cache._impl
        self._folder = Path(cache.cache_path)
        self._stem = re.sub(r"[^\w.]", "", f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}")
        self._enabled = True
        self.stamp = stamp(function)
        self.asked: set[Path] = set()  # the entries that this process has needed, found or not

    @property
    def cache_path(self) -> Any:
        """The folder of the entries."""
        return str(self._folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function; None where there is none of this stamp, or none that is whole."""
        try:
            key = self._key(sig, target_context.codegen())
            file = self._file(key)
            self.asked.add(file)
            content = self.content(file) if self._enabled else None
            if content is None:
                return None
            saved_key, reduced = pickle.loads(content)
            return self._rebuilt(target_context, reduced) if saved_key == key else None
        except Exception:  # whole, but of another numba or system: whatever that means, it is compiled again
            return None

    def _rebuilt(self, target_context: Any, reduced: Any) -> Any:
        """The compiled function of what was saved."""
        if private.used():
            with contextlib.suppress(Exception):  # another numba: in its own way, which wakes its compiler
                return loaded(target_context, reduced)
        target_context.refresh()
        return self._impl.rebuild(target_context, reduced)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function. A disk or a numba that refuses is no reason to stop: it will be compiled again."""
        with contextlib.suppress(Exception):
            if self._enabled and self._impl.check_cachable(data):
                self._save(sig, data)

    def _save(self, sig: Any, data: Any) -> None:
        key = self._key(sig, data.codegen)
        content = dumps((key, self._impl.reduce(data)))
        file = self._file(key)
        unfinished = file.with_suffix(f".{os.getpid()}")
        with contextlib.suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            try:
                unfinished.write_bytes(self._head(content) + content)
                os.replace(unfinished, file)
            finally:
                unfinished.unlink(missing_ok=True)

    def enable(self) -> None:
        self._enabled = True

    def disable(self) -> None:
        self._enabled = False

    def is_there(self) -> bool:
        """Whether there is an entry of today's sources, for any types of arguments."""
        return any(self.content(file) is not None for file in self._folder.glob(f"{self._stem}-*{SUFFIX}"))

    def flush(self) -> None:
        """Drop all entries of this kernel."""
        for file in self._folder.glob(f"{self._stem}-*{SUFFIX}"):
            file.unlink(missing_ok=True)

    def _file(self, key: tuple[Any, ...]) -> Path:
        """One for each types of arguments, CPU and Python; other stamps of them replace each other."""
        kind = hashlib.sha256(repr((key[:2], sys.implementation.cache_tag)).encode()).hexdigest()
        return self._folder / f"{self._stem}-{kind[:16]}{SUFFIX}"

    def _head(self, content: bytes) -> bytes:
        return self.stamp.encode() + hashlib.sha256(content).digest()

    def content(self, file: Path) -> bytes | None:
        """What stands in an entry behind its head; None where the head is not the right one."""
        try:
            content = file.read_bytes()
        except OSError:
            return None
        size = len(self._head(b""))
        return content[size:] if content[:size] == self._head(content[size:]) else None


class Keeper(Protocol):
    """What taking stock needs to know of a kernel: its stamp, and the folder of its entries."""

    @property
    def stamp(self) -> str: ...
    @property
    def cache_path(self) -> str: ...


@dataclass(frozen=True)
class Stock:
    """What lies on disk: folders, entries of today's sources and their size [bytes], and old ones that were dropped."""

    folders: tuple[str, ...]
    entries: int
    size: int
    dropped: int


def take_stock(caches: Sequence[Keeper]) -> Stock:
    """Count the entries of all kernels, and drop those beside them that none would take.

    A kernel replaces its own entries. Those of one that has been renamed, or is no more, would stay for ever.
    """
    stamps, folders = {cache.stamp for cache in caches}, sorted({cache.cache_path for cache in caches})
    sizes, dropped = [], 0
    for file in (file for folder in folders for file in Path(folder).glob(f"*{SUFFIX}")):
        with contextlib.suppress(OSError):
            if _stamp_of(file) in stamps:
                sizes.append(file.stat().st_size)
            else:
                file.unlink()
                dropped += 1
    return Stock(tuple(folders), len(sizes), sum(sizes), dropped)


def _stamp_of(file: Path) -> str:
    """The stamp that an entry begins with. Raises OSError where it cannot be read."""
    with file.open("rb") as opened:
        return opened.read(STAMP_SIZE).decode("ascii", "replace")


# Machine code from disk, without waking the compiler
#
# numba gets ready to compile before it loads what is compiled: 0.3 to 0.5 s of a command that compiles nothing. A
# kernel needs the runtime that counts arrays, and its own object code. What the compiler would want of it, should it
# ever be called by another kernel, is read when it is asked for. All of that is private to numba: tests watch.


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
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=context.get_executable(library, fndesc, environment),
        fndesc=fndesc,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        reload_init=reload_init,
        referenced_envs=environments,
    )
    for environ in environments:
        context.codegen().set_env(environ.env_name, environ)
    return result
