"""A fit does not depend on which kernels OpenBLAS takes for its matrices."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

RUN = """
import json
import numpy as np
import omnidyn

robot = omnidyn.load_robot("axebot")
rng = np.random.default_rng(11)
volts = np.repeat(rng.uniform(-5.0, 5.0, (100, 3)), 10, axis=0)
run = omnidyn.simulate(robot, volts, 0.01)
noise = rng.normal(0.0, 1.0, run.twist.shape) * [0.01, 0.01, 0.05]
log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + noise)
fit = omnidyn.identify([log], robot, quick=True).estimate
print(json.dumps([list(fit.value.values()), [fit.std[key] for key in fit.value]]))
"""


def fitted(**limits):
    """Values and standard errors of a fit in a process of its own."""
    call = [sys.executable, "-c", RUN]
    env = {**os.environ, **limits}
    told = subprocess.run(call, env=env, capture_output=True, text=True, timeout=900, check=True).stdout
    return np.array(json.loads(told))


@pytest.mark.long
@pytest.mark.parametrize("kernels", ["Sandybridge", "Prescott"])
def test_a_fit_does_not_depend_on_matrix_kernels(kernels):
    """Another order of sums changes last bits only. Without OpenBLAS, or elsewhere, both fits are the same one."""
    (value, std), (other, _) = fitted(), fitted(OPENBLAS_CORETYPE=kernels)
    assert len(value) >= 6
    assert (std > 0.0).all()
    assert (np.abs(other - value) <= 1e-9 * std).all()
