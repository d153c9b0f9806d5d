"""A run that is derived by nothing has tables of no rows: nothing may be written there.

Compiled code does not look: it wrote beyond them, and the process died where the memory was given back. Plain Python
looks at every index.
"""

import os
import subprocess
import sys

RUN = """
import numpy as np
from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.sensitivity.late_sample import VoltageProgram, late_samples

levels = {"coulomb": (3.6, 3.7, 0.18), "breakaway": (9.1, 8.6, 0.48), "stribeck_speed": (0.037, 0.0046, 0.19)}
law = AxesFriction(viscous=(1.2, 1.4, 0.013), **levels)
axebot = load_robot("axebot")
robot = axebot.replace(friction=Friction(axes=law), body=axebot.body.replace(rotating_frame=True))
volts = np.zeros((12, 3))
volts[2:] = -9.2, -10.2, 3.6
seen, _ = late_samples(robot, VoltageProgram(0.02 * np.arange(12), volts, np.zeros(3), None), [], [0.0], 1e-3)
print(abs(seen[0].twist).max() > 0.1)
"""


def test_a_release_under_no_parameters_stays_within_its_tables():
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    found = subprocess.run([sys.executable, "-c", RUN], env=plain, capture_output=True, text=True, check=False)
    assert found.stdout.split() == ["True"], found.stderr
