"""Has my robot another friction on the second floor? Logs of both in one fit: differences with their intervals.

The logs are simulated: rough has 1.3 times the Coulomb friction of smooth, the motors are the same.
"""

import numpy as np

import omnidyn

robot = omnidyn.load_robot("axebot")
rng = np.random.default_rng(2)


def log(floor, factor):
    """8 s of driving: voltages, and speeds with noise."""
    axes = robot.friction.axes
    levels = tuple(factor * level for level in axes.coulomb)
    true = robot.replace(friction=robot.friction.replace(axes=axes.replace(coulomb=levels)))
    run = omnidyn.simulate(true, np.repeat(rng.uniform(-5.0, 5.0, (20, 3)), 40, axis=0), 0.01)
    noise = rng.normal(0.0, 1.0, run.twist.shape) * [0.01, 0.01, 0.05]
    return omnidyn.Run(t=run.t, voltage=run.voltage, twist=run.twist + noise, source=f"{floor}.csv")


logs = [log("smooth", 1.0), log("rough", 1.3)]
found = omnidyn.identify(logs, robot, groups=["smooth=smooth*", "rough=rough*"], quick=True)
print(found)
