"""MATLAB files of version 7.3, and plain HDF5: each dataset is a variable, a group is a struct. Needs h5py."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from omnidyn.errors import InputError, MissingExtraError
from omnidyn.files import too_large
from omnidyn.logs.readers.matlab.mat5 import MAX_EXPANSION, MIN_EXPANDED_BYTES, damaged
from omnidyn.logs.readers.matlab.variables import Variables
from omnidyn.logs.table.text_file import TOO_LARGE_REMEDY

MAX_ITEMS, MAX_DEPTH = 10_000, 16
NUMBERS = {"double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}


def import_h5py(where: str = "") -> Any:
    """h5py. Raises MissingExtraError with the line that installs it."""
    try:
        import h5py
    except ImportError:
        raise MissingExtraError(
            "MATLAB 7.3 and HDF5 files need h5py", remedy='pip install "omnidyn[logs]"', where=where
        ) from None
    return h5py


def read_hdf5(path: str | os.PathLike, size: int, variables: Variables, max_bytes: int) -> None:
    """The variables of a file. Raises InputError for one that is damaged, cut short, or grows too much."""
    h5py = import_h5py(str(path))
    try:
        with h5py.File(path, "r", locking=False) as file:
            walk = _Hdf5Walk(h5py, variables, size, max_bytes)
            walk.group(file, "", 0)
    except InputError:
        raise
    except Exception as error:  # HDF5 stumbles over broken files in a dozen ways
        raise damaged(variables.source, " ".join(str(error).split()) or type(error).__name__) from None


class _Hdf5Walk:
    def __init__(self, h5py: Any, variables: Variables, size: int, max_bytes: int):
        self.h5py, self.variables, self.size, self.max_bytes = h5py, variables, size, max_bytes
        self.items = self.expanded = 0

    def group(self, group: Any, path: str, depth: int) -> None:
        """What is in a group; links to elsewhere are not followed."""
        for name in group:
            self.items += 1
            link = group.get(name, getlink=True)
            if self.items > MAX_ITEMS or depth > MAX_DEPTH:
                raise InputError(
                    "too many variables", got=f"more than {MAX_ITEMS}, or {MAX_DEPTH} deep", where=self.variables.source
                )
            if name in ("#refs#", "#subsystem#") or not isinstance(link, self.h5py.HardLink):
                continue
            item, item_path = group[name], f"{path}/{name}" if path else name
            kind = item.attrs.get("MATLAB_class", b"")
            kind = kind.decode("utf-8", "replace") if isinstance(kind, bytes) else ""
            if isinstance(item, self.h5py.Group):
                self.group(item, item_path, depth + 1)
            elif isinstance(item, self.h5py.Dataset):
                self.dataset(item, item_path, kind)

    def dataset(self, item: Any, name: str, kind: str) -> None:
        """One variable. Raises InputError before it is read, where it is too large."""
        if kind == "char" or "MATLAB_empty" in item.attrs or item.dtype.kind in "SU":
            return
        if item.dtype.kind not in "fiub" or item.ndim > 2 or (kind and kind not in NUMBERS) or item.is_virtual:
            description = "an object" if kind not in ("", "cell", "struct", *NUMBERS) else kind or str(item.dtype)
            self.variables.passed[name] = description
            return
        self.expanded += 8 * item.size
        if self.expanded > max(MAX_EXPANSION * self.size, MIN_EXPANDED_BYTES):
            raise InputError(
                "the file would grow too much",
                got=f"{self.expanded} bytes from {self.size}",
                expected=f"at most {MAX_EXPANSION} times its size",
                where=self.variables.source,
                remedy="a log does not shrink that much: save it again from its source",
            )
        if self.expanded > max(self.max_bytes, MIN_EXPANDED_BYTES):
            raise too_large(self.variables.source, self.max_bytes, TOO_LARGE_REMEDY)
        values = np.asarray(item[()])
        self.variables.add(name, values.T if kind and values.ndim == 2 else values)
