"""matplotlib, whatever backend the environment names.

A notebook hands MPLBACKEND on to what it starts, and matplotlib refuses to be imported where it does not know that
name. No picture of ours needs a backend; the user's own may, so the name stays asked for where it can be had.
"""

from __future__ import annotations

import contextlib
import os

_backend = os.environ.pop("MPLBACKEND", None)
try:
    import matplotlib
finally:
    if _backend is not None:
        os.environ["MPLBACKEND"] = _backend
if _backend:
    with contextlib.suppress(ValueError):
        matplotlib.rcParams["backend"] = _backend
