"""MATLAB files of both kinds: the same log as CSV; structs, matrices, objects; cut, packed and false ones."""

import struct
import zlib

import numpy as np
import pytest
import scipy.io

import omnidyn
from omnidyn.errors import InputError
from omnidyn.logs.read_log import read_log, recorded_log
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.run_file import run_columns, write_run
from omnidyn.run import CHANNELS, Run

h5py = pytest.importorskip("h5py")
from tests.support.mats import mat5, mat73  # noqa: E402 - needs h5py

T = np.arange(50) / 100


WRITERS = {"5": mat5, "5 packed": lambda path, **v: mat5(path, True, **v), "7.3": mat73}


@pytest.fixture(params=list(WRITERS))
def write(request, tmp_path):
    return lambda **variables: WRITERS[request.param](tmp_path / "a.mat", **variables)


def full_run():
    rng = np.random.default_rng(0)
    sizes = {"wheel": (50, 3), "axis": (50, 3), "scalar": (50,)}
    channels = {name: np.cumsum(rng.normal(0, 0.1, sizes[kind]), axis=0) for name, kind in CHANNELS.items()}
    channels["twist"][::7] = np.nan
    return Run(t=np.cumsum(rng.integers(1, 20_000, 50)) / 1e6).replace(**channels)


def test_a_run_comes_back_to_the_last_bit(tmp_path):
    run = full_run()
    again = read_log(write_run(run, tmp_path / "a.mat"))
    assert again.replace(source="", warnings=()) == run.replace(source="", warnings=())


def test_the_columns_of_a_run_file_are_the_run(write):
    run = full_run()
    again = read_log(write(**run_columns(run)))
    assert again.replace(source="", warnings=()) == run.replace(source="", warnings=())


def test_matrices_are_one_column_per_wheel(write):
    speed = np.random.default_rng(0).normal(size=(50, 3))
    log = recorded_log(write(t=T, w=speed, u_V=3.0 * speed, gain=2.0))
    assert np.array_equal(log.channels["wheel_speed"], speed)
    assert np.array_equal(log.channels["voltage"], 3.0 * speed)
    assert np.array_equal(log.t, T)


def test_a_matrix_that_lies_on_its_side_is_turned(tmp_path):
    speed = np.random.default_rng(0).normal(size=(50, 3))
    log = recorded_log(mat5(tmp_path / "a.mat", t=T[None, :], w=speed.T))
    assert np.array_equal(log.channels["wheel_speed"], speed)


def test_structs_with_times_of_their_own_keep_them(write):
    slow = np.arange(10) / 20 + 0.003
    path = write(
        wheels={"t": T, "w": np.ones((50, 3))}, odom={"t": slow, "vx": slow, "vy": 0 * slow, "omega": 0 * slow}
    )
    log = recorded_log(path)
    known = np.isfinite(log.channels["twist"][:, 0])
    assert known.sum() == 10
    assert np.array_equal(log.t[known], np.rint(slow * 1e9) / 1e9)
    assert np.isfinite(log.channels["wheel_speed"]).all(axis=1).sum() == 50
    assert omnidyn.read_log(path).twist is not None


def test_a_structure_with_time_of_simulink(tmp_path):
    signals = np.zeros(2, dtype=[("values", object), ("label", object)])
    signals[0] = np.sin(T)[:, None], "w1_rad_s"
    signals[1] = np.cos(T)[:, None], "u1_V"
    table = read_table(mat5(tmp_path / "a.mat", ScopeData={"time": T[:, None], "signals": signals}))
    assert np.array_equal(table.numbers("w1_rad_s"), np.sin(T))
    assert np.array_equal(table.numbers("ScopeData/time"), T)


def test_an_array_of_structs_of_single_numbers_is_a_table(tmp_path):
    rows = np.zeros(20, dtype=[("t_s", object), ("w1", object)])
    for k in range(20):
        rows[k] = 0.01 * k, 2.0 * k
    log = recorded_log(mat5(tmp_path / "a.mat", log=rows))
    assert np.array_equal(log.channels["wheel_speed"][:, 0], 2.0 * np.arange(20))


def test_text_cells_and_pictures_are_passed_over_and_said(tmp_path):
    path = mat5(
        tmp_path / "a.mat",
        t_s=T,
        w1_rad_s=T,
        name="robot",
        parts=np.array(["a", 1.0], dtype=object),
        picture=np.zeros((4, 4, 3)),
    )
    table = read_table(path)
    assert set(table.names) == {"t_s", "w1_rad_s"}
    assert table.notes == ("not read: parts (cells), picture (float64, 4 x 4 x 3)",)


def test_a_file_without_columns_lists_what_it_holds(tmp_path):
    with pytest.raises(InputError, match=r"no columns of numbers; got parts: cells; .*save\('log.mat', 't_s'"):
        read_table(mat5(tmp_path / "a.mat", parts=np.array(["a", 1.0], dtype=object)))


def test_an_object_of_matlab_is_refused_with_the_way_out(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        data = file.create_dataset("T", data=np.zeros((1, 6), dtype=np.uint32))
        data.attrs["MATLAB_class"] = np.bytes_("table")
        data.attrs["MATLAB_object_decode"] = 3
    with pytest.raises(InputError, match=r"got T: an object; .*table2struct\(T, 'ToScalar', true\)"):
        read_table(tmp_path / "a.mat")


def test_a_time_without_a_unit_is_asked_for(tmp_path):
    with pytest.raises(InputError, match=r"a\.mat, b/t: a time without a unit; got rows 5e\+07 apart; .*b/t_ms"):
        read_table(mat5(tmp_path / "a.mat", a={"t": T, "w1": T}, b={"t": 5e7 * np.arange(9.0), "vx": np.ones(9)}))


# ---- damage ---------------------------------------------------------------------------------------------


def test_a_packed_variable_that_grows_too_much_is_refused_before_it_is_held(tmp_path):
    import resource

    packer = zlib.compressobj()
    head = struct.pack("<IIII", 14, 300 * 2**20, 6, 8)
    data = b"".join([packer.compress(head), *(packer.compress(bytes(2**20)) for _ in range(300)), packer.flush()])
    bomb = tmp_path / "bomb.mat"
    bomb.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + struct.pack("<II", 15, len(data)) + data)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=r"would grow too much; got more than 67108864 bytes; expected at most 200"):
        read_table(bomb)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def test_a_struct_of_a_billion_elements_in_a_hundred_bytes_takes_no_time(tmp_path):
    """Found by the fuzzer: with no fields there is nothing to read; with some, each needs a tag at least."""

    def struct_of(fields):
        part = struct.pack("<IIII", 6, 8, 2, 0) + struct.pack("<IIii", 5, 8, 2**30, 3)  # flags, shape
        part += struct.pack("<HH4s", 1, 1, b"s") + struct.pack("<HHI", 5, 4, 8)  # name, length of a field's name
        part += struct.pack("<II", 1, 8 * len(fields)) + b"".join(name.ljust(8, b"\0") for name in fields)
        return struct.pack("<II", 14, len(part)) + part

    path = mat5(tmp_path / "a.mat", t_s=T, w1_rad_s=T)
    whole = path.read_bytes()
    path.write_bytes(whole + struct_of([]))
    assert set(read_table(path).names) == {"t_s", "w1_rad_s"}
    path.write_bytes(whole + struct_of([b"w", b"u"]))
    with pytest.raises(InputError, match=r"damaged or cut short; got s says 3221225472 structs of 2 fields"):
        read_table(path)


def test_a_packed_dataset_that_grows_too_much_is_refused_before_it_is_read(tmp_path):
    with h5py.File(tmp_path / "bomb.h5", "w") as file:
        file.create_dataset("w1", shape=(10**8,), dtype="f8", chunks=(10**6,), compression="gzip")
    with pytest.raises(InputError, match=r"would grow too much; got 800000000 bytes from \d+; expected at most 200"):
        read_table(tmp_path / "bomb.h5")


def test_links_to_other_files_are_not_followed(tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["w1_rad_s"] = T
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t_s"] = T
        file["w1_rad_s"] = h5py.ExternalLink("other.h5", "w1_rad_s")
    assert read_table(tmp_path / "a.h5").names == ("t_s",)


def test_an_infinite_number_is_refused_with_its_row(tmp_path):
    values = T.copy()
    values[3] = np.inf
    with pytest.raises(InputError, match=r"a\.mat:4, column w1_rad_s: not a finite number"):
        read_table(mat5(tmp_path / "a.mat", t_s=T, w1_rad_s=values))


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"])
def test_numbers_of_every_kind_are_those_of_scipy(tmp_path, kind, packed):
    values = (np.arange(12).reshape(6, 2) % 7).astype(kind)
    path = mat5(tmp_path / "a.mat", packed, t_s=np.arange(6) / 10, x=values, c=np.arange(6) * 1j, e=np.zeros((0, 2)))
    table, theirs = read_table(path), scipy.io.loadmat(path)
    for k in (1, 2):
        assert np.array_equal(table.numbers(f"x{k}"), theirs["x"][:, k - 1].astype(float))
    assert table.notes == ("not read: c (complex numbers)",)
