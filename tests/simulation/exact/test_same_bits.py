"""The exact engine gives the same bits whatever vector instructions and matrix kernels it may use."""

import os
import platform
import subprocess
import sys

import pytest

RUN = """
import hashlib
import numpy as np
import omnidyn

robot = omnidyn.load_robot("axebot")
t = np.arange(800)[:, None] * 4e-3
volts = 5.0 * np.sin(2.0 * np.pi * t * [1.3, 2.1, 3.7]) * (np.arange(800)[:, None] % 300 < 200)
run = omnidyn.simulate(robot, volts, 4e-3)
batch = omnidyn.simulate_batch([robot] * 70, volts, 4e-3, pose="exact", every=10)
bits = hashlib.sha256()
for values in (run.twist, run.pose, batch.twists, batch.poses):
    bits.update(np.ascontiguousarray(values).tobytes())
print(bits.hexdigest(), bool((run.twist[1:] == 0.0).any() and np.abs(run.twist).max() > 0.1))
"""
NUMPY_WITHOUT = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4"
LIMITED = {
    "numba and NumPy without AVX-512": {"NUMBA_CPU_NAME": "haswell", "NPY_DISABLE_CPU_FEATURES": NUMPY_WITHOUT},
    "OpenBLAS for another processor": {"OPENBLAS_CORETYPE": "Sandybridge"},
}


def bits(**limits):
    """Hash of runs of a process of its own, and whether they rest and move."""
    call = [sys.executable, "-c", RUN]
    return subprocess.run(
        call, env={**os.environ, **limits}, capture_output=True, text=True, timeout=900, check=True
    ).stdout


@pytest.mark.long
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="instructions of x86-64")
@pytest.mark.parametrize("limits", LIMITED.values(), ids=LIMITED)
def test_bits_do_not_depend_on_instructions_or_matrix_kernels(limits):
    """The limits act where the processor has what they forbid; elsewhere the two runs are the same one."""
    plain = bits()
    assert plain.endswith("True\n")
    assert bits(**limits) == plain
