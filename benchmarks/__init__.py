"""Benchmarks of omnidyn: accuracy, speed and rest, each measured beside a goal and, where there is one, a rival.

    python -m benchmarks            # what there is
    python -m benchmarks simulate   # one of them; --json for machines
    python -m benchmarks all

In folders by subject: simulation, batch; logs; identification, blind, ten_robots, twins, wrong_worlds; real; control,
control_real; export; skins. house counts the source, answers compares two states of it, results are published tables.

A ratio counts only inside one run: same inputs, same machine, same minute. Every time stands beside an error.
"""

import os

for _name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):  # before NumPy is imported: one thread each
    os.environ[f"{_name}_NUM_THREADS"] = "1"
