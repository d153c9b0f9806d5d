"""A Run as a MATLAB file (version 5, which every MATLAB and Octave opens): each column of a run file is a variable."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray

HEAD, HEAD_SIZE = b"MATLAB 5.0 MAT-file, written by omnidyn", 116  # words for people, by the format


def columns_to_mat(columns: Mapping[str, FloatArray]) -> bytes:
    """Columns as variables of n rows, NaN where missing, to the last bit."""
    from scipy.io import savemat

    sink = io.BytesIO()
    savemat(sink, {name: np.ascontiguousarray(values)[:, None] for name, values in columns.items()})
    content = sink.getvalue()
    return HEAD.ljust(HEAD_SIZE) + content[HEAD_SIZE:]  # SciPy writes the time of day there
