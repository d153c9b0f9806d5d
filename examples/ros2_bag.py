"""A bag as a robot of ROS 2 records it, made here: drive.mcap, for the how-to "From a ROS 2 bag to a fitted robot".

    python examples/ros2_bag.py [FOLDER]

Wheels at 100 Hz on /joint_states, odometry by another sensor at 50 Hz on /odom, the voltages of the motors when they
change, a battery at 7 Hz; each with stamps of its own. Open it in Foxglove or PlotJuggler.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import omnidyn
from omnidyn.model.wheels import wheel_speed

SECONDS, HOLD, STEP = 30.0, 1.0, 1e-3


def drive(seed: int = 1) -> omnidyn.Run:
    """Half a minute with random voltages, as sensors with noise and clocks of their own see it."""
    rng, robot = np.random.default_rng(seed), omnidyn.load_robot("axebot")
    voltage = np.repeat(rng.uniform(-6.0, 6.0, (int(SECONDS / HOLD), 3)), int(HOLD / STEP), axis=0)
    run = omnidyn.simulate(robot, voltage, STEP)
    assert run.twist is not None
    assert run.pose is not None
    rows = np.arange(len(run))

    def at(values: np.ndarray, every: int, first: int, noise: object) -> np.ndarray:
        """What a sensor says each so many rows; nothing in between."""
        seen = (rows % every == first)[:, None]
        return np.where(seen, values + rng.normal(0.0, 1.0, values.shape) * np.asarray(noise), np.nan)

    sensed = omnidyn.Run(
        t=rows / 1000,
        voltage=np.where((rows % 1000 == 0)[:, None], run.voltage, np.nan),
        wheel_speed=at(wheel_speed(robot.wheels, run.twist), 10, 0, 0.3),
        twist=at(run.twist, 20, 3, [0.02, 0.02, 0.1]),
        pose=at(run.pose, 20, 3, [0.002, 0.002, 0.004]),
        supply=at(np.full((len(run), 1), 12.0), 143, 7, 0.02)[:, 0],
        source="examples/ros2_bag.py",
    )
    told = np.flatnonzero(
        np.isfinite(np.column_stack([v.reshape(len(run), -1) for v in sensed.channels.values()])).any(1)
    )
    channels = {name: values[told] for name, values in sensed.channels.items()}
    return omnidyn.Run(t=sensed.t[told], **channels)  # pyright: ignore[reportArgumentType]


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    print(f"wrote {omnidyn.write_run(drive(), folder / 'drive.mcap', force=True)}")
