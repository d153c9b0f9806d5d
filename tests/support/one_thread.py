"""A thread a process, for there is a process per core: two that both want all cores mostly wait for each other.

Loaded by pytest before anything imports NumPy, see pyproject.toml; the commands that tests start inherit it.
"""

import os

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
