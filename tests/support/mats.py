"""MATLAB files made by script: of version 5 by scipy, of 7.3 as MATLAB writes them."""

import h5py
import numpy as np
import scipy.io


def mat5(path, packed=False, **variables):
    scipy.io.savemat(path, variables, do_compression=packed)
    return path


def mat73(path, **variables):
    """As MATLAB writes it: a text of 512 bytes, then HDF5 with arrays turned around and their class beside."""
    with h5py.File(path, "w", userblock_size=512) as file:
        _store(file, variables)
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def _store(group, variables):
    for name, value in variables.items():
        if isinstance(value, dict):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            _store(inner, value)
            continue
        array = np.atleast_2d(np.asarray(value))
        array = array.T if array.shape[0] == 1 else array
        data = group.create_dataset(name, data=array.T, chunks=True, compression="gzip")
        data.attrs["MATLAB_class"] = np.bytes_("double")
