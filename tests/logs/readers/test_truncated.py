"""A small file of every format, cut at every byte: what is left is read and counted, or refused in a sentence."""

import os

import numpy as np
import pytest

from benchmarks.logs.fuzz_readers import READERS
from omnidyn.errors import InputError, OmnidynError
from omnidyn.logs.info import read_info
from omnidyn.logs.readers.read_table import read_table
from tests.support.sampling import spread

T = np.arange(4) / 100


def odometry(ros1=False):
    """Three messages of one topic."""
    pytest.importorskip("rosbags")
    from tests.support.bags import BagMaker

    maker = BagMaker(ros1=ros1)
    for k in range(3):
        maker.numbers(0.1 * k, [1.0, 2.0], "/w")
    return maker


def mcap(folder, packing):
    pytest.importorskip("mcap")
    from tests.support.bags import write_mcap

    return write_mcap(odometry(), folder / "a.mcap", packing, chunk=1 if packing == "zstd" else 2**20)


def db3(folder):
    from tests.support.bags import write_ros2

    return next(write_ros2(odometry(), folder / "bag").glob("*.db3"))


def ros1(folder):
    from tests.support.bags import write_ros1

    return write_ros1(odometry(ros1=True), folder / "a.bag")


def mat(folder, kind):
    pytest.importorskip("h5py")
    from tests.support.mats import mat5, mat73

    make = mat73 if kind == "7.3" else mat5
    return make(folder / "a.mat", **({"packed": True} if kind == "packed" else {}), t_s=T, w1_rad_s=T)


def parquet(folder):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet as files

    files.write_table(pyarrow.table({"t_s": T, "w1_rad_s": T}), folder / "a.parquet")
    return folder / "a.parquet"


def written(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return path


NOTHING = {"no topic holds numbers that can be read"}
CUT = {"the recording is damaged or cut short", *NOTHING}
MAT = {"the MATLAB file is damaged or cut short", "the file holds no columns of numbers"}
# how it is made; from where on it is told by its first bytes; what may be said; how many messages may be salvaged
FORMATS = {
    "text": (lambda f: written(f, "a.csv", b"t_s,w1_rad_s\n0,1\n0.1,2\n0.2,3\n"), 0, None, {None}),
    "MCAP": (lambda f: mcap(f, "none"), 8, CUT, {0, 1, 2, 3}),
    "MCAP, zstd": (lambda f: mcap(f, "zstd"), 8, CUT, {0, 1, 2, 3}),
    "db3": (db3, 16, {"the bag is damaged or cut short"}, set()),
    "ROS 1": (ros1, 13, CUT, {0, 1, 2, 3}),
    "wpilog": (
        lambda f: written(f, "a.wpilog", READERS["read_log, wpilog"][0]()[0][:700]),
        6,
        {"the data log is damaged or cut short", *NOTHING},
        {None, *range(60)},
    ),
    "MAT 5": (lambda f: mat(f, "5"), 19, MAT, {None}),
    "MAT 5, packed": (lambda f: mat(f, "packed"), 19, MAT, {None}),
    "MAT 7.3": (lambda f: mat(f, "7.3"), 19, MAT, set()),
    "Parquet": (parquet, 4, {"the Parquet file is damaged or cut short"}, set()),
}


@pytest.mark.parametrize("name", list(FORMATS))
def test_every_byte_at_which_a_file_may_end_gives_a_salvage_or_a_sentence(tmp_path, name, draws):
    make, known, sentences, counts = FORMATS[name]
    path = make(tmp_path)
    whole = len(read_table(path))
    said, salvaged, bytes_there = set(), set(), os.path.getsize(path)
    for size in sorted(spread(bytes_there, draws(bytes_there)), reverse=True):
        os.truncate(path, size)
        try:
            assert len(read_table(path)) <= whole
            salvaged.add(read_info(path).salvaged)
        except InputError as error:
            if size >= known:
                said.add((error.what, error.where == str(path)))
        except OmnidynError as error:
            pytest.fail(f"{size} bytes: {error!r}")
    if sentences is not None:
        assert said
        assert said <= {(words, True) for words in sentences}
    assert salvaged <= counts
    if 3 in counts and name != "wpilog":
        assert {1, 2, 3} <= salvaged
