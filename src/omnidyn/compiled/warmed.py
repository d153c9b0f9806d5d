"""What `omnidyn warm` made, remembered beside the entries: to see that all is still there, no kernel need be loaded.

It is believed for the sources, numba and CPU that it was made with, and where every entry is whole. Anything else is
as good as nothing remembered: the first runs are made again, and whatever is missing is compiled by them.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.registry import cpu_target

from omnidyn.compiled.entries import Entries
from omnidyn.compiled.stamp import PACKAGE, tools
from omnidyn.errors import OmnidynError
from omnidyn.files import sha256, write_atomic

NAME = "warmed.json"
SOURCES = (".py", ".toml")  # the presets too: which kernels a first run needs follows from its robot


@dataclass(frozen=True)
class Remembered:
    """A kernel when all had been made: its stamp, the folder of its entries, entry -> SHA-256 of those that it took."""

    stamp: str
    cache_path: str
    files: dict[str, str]

    def still_there(self) -> bool:
        """Whether its entries are the same to the last bit. Raises OSError where one is gone."""
        return all(sha256(Path(file).read_bytes()) == digest for file, digest in self.files.items())


def remember(caches: Sequence[Entries], made_with: str) -> None:
    """These kernels are all; what they were asked for is there now, unless a disk refused: then nothing is noted.

    made_with: `circumstances()` before they were imported; "" notes nothing.
    """
    if not made_with or any(cache.content(file) is None for cache in caches for file in cache.asked):
        return
    with contextlib.suppress(OSError, RuntimeError, OmnidynError):
        kernels = [
            Remembered(cache.stamp, cache.cache_path, {str(file): sha256(file.read_bytes()) for file in cache.asked})
            for cache in caches
        ]
        file = place()
        file.parent.mkdir(parents=True, exist_ok=True)
        content = {"made_with": made_with, "kernels": [asdict(kernel) for kernel in kernels]}
        write_atomic(file, json.dumps(content), force=True)


def recalled(made_with: str) -> list[Remembered]:
    """The kernels of the last `remember`; none where one of their entries, or what they were made with, is another."""
    try:
        record: Any = json.loads(place().read_bytes())
        kernels = [Remembered(**kernel) for kernel in record["kernels"]]
        unchanged = record["made_with"] == made_with and all(kernel.still_there() for kernel in kernels)
    except (OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError):  # not there, or not ours
        return []
    return kernels if unchanged else []


def place() -> Path:
    """Where it lies: with the entries of this folder, had it any. Raises RuntimeError where no folder is writable."""
    return Path(FunctionCache(remember).cache_path) / NAME


def circumstances() -> str:
    """SHA-256 of all sources, of the compiler and its settings, and of the CPU; "" where there are no sources."""
    context: Any = cpu_target.target_context
    cpu, switched_off = context.codegen().magic_tuple(), getattr(config, "DISABLE_JIT", None)
    digest = hashlib.sha256(f"{tools()} {switched_off} {cpu}\n".encode())
    try:
        for file in sorted(path for path in Path(PACKAGE).rglob("*") if path.suffix in SOURCES):
            digest.update(f"{file.relative_to(PACKAGE)} {sha256(file.read_bytes())}\n".encode())
    except OSError:
        return ""
    return digest.hexdigest()
