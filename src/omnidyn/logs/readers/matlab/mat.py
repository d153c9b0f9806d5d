"""MATLAB files and HDF5 as readers of logs."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator

from omnidyn.files import default_max_bytes, growth, open_regular, pieces
from omnidyn.logs.readers.matlab.hdf5 import read_hdf5
from omnidyn.logs.readers.matlab.mat5 import read_mat5
from omnidyn.logs.readers.matlab.variables import Variables, tables_of
from omnidyn.logs.readers.reader import Reader, ReadOptions
from omnidyn.logs.table.table import FileTable

MAT5 = b"MATLAB 5.0 MAT-file"


def read_variables(path: str | os.PathLike, options: ReadOptions) -> Variables:
    """What a file holds. Raises InputError where it cannot be read, MissingExtraError without h5py."""
    limit = options.max_bytes if options.max_bytes is not None else default_max_bytes()
    digest, variables = hashlib.sha256(), Variables(str(path))
    with open_regular(path) as stream:
        size, start = os.fstat(stream.fileno()).st_size, stream.read(len(MAT5))
        stream.seek(0)
        for block in pieces(stream, size):
            digest.update(block)
        if start == MAT5:
            read_mat5(stream, size, variables, limit)
        else:
            read_hdf5(path, size, variables, limit)
        variables.said = growth(stream, size)
    variables.sha256 = digest.hexdigest()
    return variables.chosen(options.variables)


def _tables(path: str | os.PathLike, rows: int, options: ReadOptions) -> Iterator[FileTable]:
    yield from tables_of(read_variables(path, options), rows)


MAT = Reader("mat", "a MATLAB file", (".mat",), _tables, whole=True, variables=True)
HDF5 = Reader("hdf5", "an HDF5 file", (".h5", ".hdf5"), _tables, whole=True, variables=True)
