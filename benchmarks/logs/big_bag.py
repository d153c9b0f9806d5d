"""A long MCAP recording, made by script: processor time and memory of reading it, beside rosbags and mcap.

    python -m benchmarks.logs.big_bag [MEGABYTES]

Joints at 1 kHz, odometry at 100 Hz, and pictures, which nobody needs. Each reader in a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine

MEGABYTES = scaled(2000, 10)
PICTURE = 50_000

OURS = """
from omnidyn.logs.readers.reader import Options
from omnidyn.logs.readers.ros.bags import read_bag
start = time.process_time()
found = read_bag(path, Options())
count = sum(len(track.stamps) for track in found.tracks)
"""
ROSBAGS = """
from pathlib import Path
from rosbags.highlevel import AnyReader
start = time.process_time()
count = 0
with AnyReader([Path(path)]) as reader:
    wanted = [each for each in reader.connections if each.topic != "/camera"]
    for connection, _, data in reader.messages(wanted):
        reader.deserialize(data, connection.msgtype)
        count += 1
"""
MCAP = """
from mcap.reader import make_reader
start = time.process_time()
count = 0
with open(path, "rb") as stream:
    for _ in make_reader(stream).iter_messages(topics=["/joint_states", "/odom"]):
        count += 1
"""
BLOCKS = """
from omnidyn.logs.readers.read_table import iter_tables
start = time.process_time()
count = 0
for table in iter_tables(path):
    count += sum(int((column == column).sum()) for name, column in table.columns.items() if name in ONE_EACH)
"""
ONE_EACH = ("/joint_states/wheel_1/velocity", "/odom/vx")  # of each topic
READERS = {
    "omnidyn": OURS,
    "omnidyn, in blocks": BLOCKS.replace("ONE_EACH", repr(ONE_EACH)),
    "rosbags": ROSBAGS,
    "mcap (no decoding)": MCAP,
}
CHILD = """
import json, resource, sys, time
path = sys.argv[1]
{body}
spent = time.process_time() - start
print(json.dumps([spent, count, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3]))
"""


def write(path: Path, megabytes: float) -> int:
    """A recording of about so many megabytes, lz4; the number of messages of wheels and odometry."""
    from mcap.writer import CompressionType, Writer

    from omnidyn.logs.cdr import Packer
    from omnidyn.logs.readers.ros.definitions import definition_of

    rng, count, row = np.random.default_rng(0), 0, 0
    names = [f"wheel_{k}" for k in (1, 2, 3, 4)]
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4)
        writer.start("ros2", "benchmark")

        def channel(topic: str, kind: str, text: str) -> int:
            return writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text.encode()))

        joints = channel("/joint_states", "sensor_msgs/msg/JointState", definition_of("sensor_msgs/JointState"))
        odom = channel("/odom", "nav_msgs/msg/Odometry", definition_of("nav_msgs/Odometry"))
        camera = channel("/camera", "sensor_msgs/msg/CompressedImage", "uint8[] data\n")
        picture = rng.integers(0, 256, PICTURE, dtype=np.uint8).tobytes()
        while stream.tell() < megabytes * 1e6:
            stamp = 1_700_000_000 * 10**9 + row * 10**6
            values = rng.normal(size=8).tolist()
            data = Packer().header(stamp).texts(names).array(values[:4]).array(values[4:]).array(())
            writer.add_message(joints, stamp, bytes(data), stamp)
            count += 1
            if row % 10 == 0:
                data = Packer().header(stamp, "odom").text("base_link").numbers("d", *rng.normal(size=7), *[0.0] * 36)
                writer.add_message(odom, stamp, bytes(data.numbers("d", *rng.normal(size=6), *[0.0] * 36)), stamp)
                count += 1
            if row % 200 == 0:
                writer.add_message(camera, stamp, picture, stamp)
            row += 1
        writer.finish()
    return count


def measure(megabytes: float = MEGABYTES) -> Table:
    """Time, rate and memory of each reader."""
    table = Table(
        f"big_bag: an MCAP of {megabytes:g} MB, two topics of three",
        ["reader", "seconds", "MB/s", "messages/s", "peak MB"],
    )
    table.notes.append(machine())
    with tempfile.TemporaryDirectory(prefix="omnidyn-bag-") as folder:
        path = Path(folder) / "big.mcap"
        start = time.perf_counter()
        count = write(path, megabytes)
        size = path.stat().st_size / 1e6
        table.notes.append(f"{count} messages wanted, {size:.0f} MB, written in {time.perf_counter() - start:.0f} s")
        for name, body in READERS.items():
            script = CHILD.format(body=body)
            done = subprocess.run(
                [sys.executable, "-c", script, str(path)], capture_output=True, text=True, env=os.environ, check=False
            )
            if done.returncode:
                table.notes.append(f"{name}: {done.stderr.strip().splitlines()[-1][:200]}")
                continue
            spent, seen, peak = json.loads(done.stdout)
            row = {"reader": name, "seconds": round(spent, 1), "MB/s": round(size / spent), "peak MB": round(peak)}
            row["messages/s"] = round(seen / spent)
            if name.startswith("omnidyn"):
                table.add("all messages, within 1 GiB", seen == count and peak < 1074, **row)
            else:
                table.add("", True, **row)
    return table


if __name__ == "__main__":
    print(measure(float(sys.argv[1]) if len(sys.argv) > 1 else MEGABYTES).as_text())
