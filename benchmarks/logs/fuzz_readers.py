"""Every reader on mutated and random bytes: whatever a file holds, only an OmnidynError may leave a reader.

    python -m benchmarks.logs.fuzz_readers [SECONDS] [READER ...] [--seed N]

Each reader runs in a process of its own, so that a crash of a library below is seen as well. The seeds are small
tables of every kind, and the real logs in OMNIDYN_DATA where they are. A file that breaks a reader is kept.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import io
import json
import os
import random
import re
import resource
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.errors import OmnidynError
from omnidyn.logs.command_file import read_commands
from omnidyn.logs.info import read_info
from omnidyn.logs.read_log import read_log
from omnidyn.logs.readers.read_table import iter_tables, read_table
from omnidyn.logs.run_file import read_run, run_to_csv, run_to_parquet
from omnidyn.logs.steady_table import read_steady_table
from omnidyn.run import CHANNELS, Run

SECONDS = float(scaled(60))
ROOT = Path(__file__).resolve().parents[2]
SLOW_S, MAX_MB = float(os.environ.get("OMNIDYN_FUZZ_SLOW", "2")), 2048
START_S = 300.0  # to load the libraries and make the seeds, on a machine that is busy
HANG_S = float(
    os.environ.get("OMNIDYN_FUZZ_HANG", "60")
)  # a reader that is no further by then is ended, wherever it hangs, and the file kept
MAX_SEED_BYTES = 6000

PIECES = [
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r",
    b'"',
    b"#",
    b"%",
    b"nan",
    b"inf",
    b"1e400",
    b"-",
    b"0",
    b"1e308",
    b"1e-320",
    b"1,5",
    b"1,500",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xfe\xff",
    b"\x00",
    b"\xb5",
    b"x",
    b"_",
    b" ",
    b"\x85",
    b"\x0b",
    b"\xe2\x80\xa8",
    b"[rad/s]",
    b"sep=;\n",
    b"9" * 400,
    b"PAR1",
    b"\x80\x04",
    b"PK\x03\x04",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"\x00\x00\x00\x80",
]


def _run() -> Run:
    draw = np.random.default_rng(0).normal
    sizes = {"wheel": (9, 3), "axis": (9, 3), "scalar": (9,)}
    return Run(t=np.arange(9) * 0.1, **{name: draw(size=sizes[kind]) for name, kind in CHANNELS.items()})


def _table_seeds() -> list[bytes]:
    """Small tables of every kind that is read, and the heads of real logs."""
    seeds = [
        run_to_csv(_run()).encode(),
        b"Time;Speed;\nms;rad/s;\nt;w1;\n0;1,5;\n10;2,5;\n",
        b"%Motor\r\n%t,u\r\n%[#],[V]\r\n0,1;\r\nnan,nan;\r\n",
        b't_s,"mode",u1_V,u2_V,u3_V\n0,"go",1,,3\n# c\n0.1,stop,1,2,\n',
        b"axis,speed,force\nx,0.1,2.4\ny,-0.3,-1.8\nyaw,5,0.15\n",
        b"t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.5,0,0,0\n1.5,1,1,1\n",
        "t_s\tDrehmoment [N·m]\n0\t1,5\n0,1\t2,5\n".encode("latin-1"),
        "t_s,u1 [V],w1 (rpm)\n0,1,2\n1,2,3\n".encode("utf-16"),
    ]
    data = Path(os.environ.get("OMNIDYN_DATA", ROOT.parent / "shared" / "data"))
    for pattern in ("robotino/**/exp00.csv", "odrive_umn/**/step1.csv", "udea_three_omni/**/exp1.txt"):
        seeds += [path.read_bytes()[:MAX_SEED_BYTES] for path in sorted(data.glob(pattern))[:1]]
    return seeds


def _parquet_seeds() -> list[bytes]:
    """Files of every kind of column, encoding and compression."""
    import pyarrow as pa
    from pyarrow import parquet

    n = 40
    table = pa.table(
        {
            "t": pa.array(np.arange(n), pa.timestamp("ms")),
            "u1_V": np.random.default_rng(0).normal(size=n),
            "n": pa.array([None if k % 7 == 0 else k for k in range(n)]),
            "word": ["go" if k % 3 else "stop" for k in range(n)],
            "on": [k % 2 == 0 for k in range(n)],
        }
    )
    seeds = [run_to_parquet(_run())]
    for options in (
        {},
        {"compression": "zstd"},
        {"use_dictionary": False, "compression": "none"},
        {"data_page_version": "2.0", "compression": "gzip"},
        {"row_group_size": 7},
    ):
        sink = io.BytesIO()
        parquet.write_table(table, sink, **options)
        seeds.append(sink.getvalue())
    return seeds


def _bag_maker(ros1: bool = False) -> Any:
    from tests.support.bags import BagMaker, drive

    return drive(BagMaker(ros1=ros1), 0.05, (100.0, 40.0, 25.0))


def _made(write: Callable[[Path], Any]) -> bytes:
    """The bytes of a file that a writer makes."""
    with tempfile.TemporaryDirectory() as folder:
        made = write(Path(folder) / "seed")
        return (next(made.glob("*.db3")) if made.is_dir() else made).read_bytes()


def _mcap_seeds() -> list[bytes]:
    from tests.support.bags import write_mcap

    maker = _bag_maker()
    return [_made(lambda path, kind=kind: write_mcap(maker, path, kind, 500)) for kind in ("none", "lz4", "zstd")]


def _db3_seeds() -> list[bytes]:
    from tests.support.bags import write_ros2

    return [_made(lambda path: write_ros2(_bag_maker(), path))]


def _bag_seeds() -> list[bytes]:
    from tests.support.bags import write_ros1

    maker = _bag_maker(ros1=True)
    return [_made(lambda path, kind=kind: write_ros1(maker, path, kind)) for kind in ("", "bz2", "lz4")]


def _wpilog_seeds() -> list[bytes]:
    """A log of every kind of entry, written here."""

    def record(entry: int, stamp: int, value: bytes) -> bytes:
        return b"\x70" + bytes([entry, len(value)]) + stamp.to_bytes(8, "little") + value

    def text(words: str) -> bytes:
        return len(words).to_bytes(4, "little") + words.encode()

    entries = [
        ("w1_rad_s", "double", struct.pack("<d", 1.5)),
        ("u1_V", "float", struct.pack("<f", 2.0)),
        ("n", "int64", struct.pack("<q", 3)),
        ("on", "boolean", b"\x01"),
        ("mode", "string", b"auto"),
        ("i", "double[]", struct.pack("<3d", 1.0, 2.0, 3.0)),
        ("pose", "struct:Pose2d", struct.pack("<3d", 1, 2, 3)),
        ("/.schema/struct:Two", "structschema", b"double a;int8 b[2]"),
        ("two", "struct:Two[]", bytes(20)),
    ]
    content = b"WPILOG\x00\x01\x00\x00\x00\x00"
    for number, (name, kind, _) in enumerate(entries, 1):
        content += record(0, 0, b"\x00" + number.to_bytes(4, "little") + text(name) + text(kind) + text(""))
    for k in range(6):
        content += b"".join(record(number, 20_000 * k, each[2]) for number, each in enumerate(entries, 1))
    return [content]


def _mat_seeds() -> list[bytes]:
    from scipy.io import savemat

    seeds = []
    variables = {"t_s": np.arange(9) / 10, "w": np.ones((9, 3)), "s": {"t": np.arange(5.0), "vx": np.arange(5.0)}}
    for packed in (False, True):
        sink = io.BytesIO()
        savemat(sink, variables, do_compression=packed)
        seeds.append(b"MATLAB 5.0 MAT-file".ljust(116) + sink.getvalue()[116:])  # its text holds the time of day
    return seeds


def _hdf5_seeds() -> list[bytes]:
    import h5py

    sink = io.BytesIO()
    with h5py.File(sink, "w") as file:
        file["t_s"], file["s/vx"] = np.arange(9) / 10, np.arange(9.0)
        file.create_dataset("w", data=np.ones((3, 9)), chunks=True, compression="gzip")
    return [sink.getvalue()]


READERS: dict[str, tuple[Callable[[], list[bytes]], Callable[[str], Any]]] = {
    "read_table, text": (_table_seeds, read_table),
    "read_table, options": (_table_seeds, lambda path: read_table(path, header=False, skip_bad_rows=True)),
    "iter_tables, text": (_table_seeds, lambda path: list(iter_tables(path, 3, skip_bad_rows=True))),
    "read_log": (_table_seeds, read_log),
    "read_run, text": (_table_seeds, read_run),
    "read_commands": (_table_seeds, lambda path: read_commands(path, 3)),
    "read_steady_table": (_table_seeds, read_steady_table),
    "read_table, Parquet": (_parquet_seeds, read_table),
    "iter_tables, Parquet": (_parquet_seeds, lambda path: list(iter_tables(path, 3, skip_bad_rows=True))),
    "read_run, Parquet": (_parquet_seeds, read_run),
    "read_log, MCAP": (_mcap_seeds, read_log),
    "read_log, ROS 2 db3": (_db3_seeds, read_log),
    "read_log, ROS 1": (_bag_seeds, read_log),
    "read_log, wpilog": (_wpilog_seeds, read_log),
    "read_log, MAT": (_mat_seeds, read_log),
    "read_log, HDF5": (_hdf5_seeds, read_log),
    "info": (lambda: [*_mcap_seeds(), *_wpilog_seeds(), *_bag_seeds()], read_info),
}


# None of ours: it hangs in C, for the test of what ends such a reader.
HANGS = "hangs"
_SLOW_WORD = "a" * 60 + "b"
_ALL: dict[str, tuple[Callable[[], list[bytes]], Callable[[str], Any]]] = {
    **READERS,
    HANGS: (lambda: [b"x"], lambda _: re.match(r"(a+)+$", _SLOW_WORD)),
}

# What reads each format: a minute of a format is shared by these.
FORMATS = {
    "text": [name for name in READERS if "text" in name or (name.startswith("read_") and ", " not in name)]
    + ["read_table, options"],
    "Parquet": [name for name in READERS if name.endswith("Parquet")],
    **{name.partition(", ")[2]: [name] for name in READERS if name.startswith("read_log, ")},
    "info": ["info"],
}


def mutated(rng: random.Random, seeds: list[bytes]) -> bytes:
    """A seed with a few edits; or cut short; or noise."""
    kind = rng.random()
    if kind < 0.03:
        return rng.randbytes(rng.randrange(300))
    if kind < 0.08:
        return b"".join(rng.choices(PIECES, k=rng.randrange(40)))
    content = bytearray(rng.choice(seeds))
    for _ in range(rng.choice([1, 1, 2, 3, 8])):
        place = rng.randrange(len(content) + 1)
        if rng.random() < 0.5 and content:
            content[min(place, len(content) - 1)] = rng.randrange(256)
        else:
            content[place : place + rng.choice([0, 0, 1, 4])] = rng.choice(PIECES)
    if rng.random() < 0.1:
        del content[rng.randrange(len(content) + 1) :]
    return bytes(content)


def fuzz(reader: str, seconds: float, seed: int, folder: Path) -> dict[str, Any]:
    """Fuzz one reader in this process; the file at work is always `current`, for the case of a crash."""
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (MAX_MB * 4 * 2**20,) * 2)
    seeds, read = _ALL[reader][0](), _ALL[reader][1]
    rng, end = random.Random(seed), time.monotonic() + seconds
    told: dict[str, Any] = {"files": 0, "read": 0, "refused": 0, "slow": 0, "escaped": []}
    path = folder / "current"
    while time.monotonic() < end:
        content = mutated(rng, seeds)
        path.write_bytes(content)
        start = time.process_time()  # of the reader alone: the machine may be busy with other work
        told["files"] += 1
        faulthandler.dump_traceback_later(HANG_S, exit=True)  # a thread of its own: C code cannot stop it
        try:
            read(str(path))
            told["read"] += 1
        except OmnidynError:
            told["refused"] += 1
        except Exception:
            kept = folder / f"escaped-{len(told['escaped'])}"
            kept.write_bytes(content)
            told["escaped"].append([str(kept), traceback.format_exc().splitlines()[-1][:200]])
        faulthandler.cancel_dump_traceback_later()
        if time.process_time() - start > SLOW_S:
            (folder / f"slow-{told['slow']}").write_bytes(content)
            told["slow"] += 1
    told["peak MB"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
    return told


def measure(seconds: float = SECONDS, readers: list[str] | None = None, seed: int = 0) -> Table:
    """Each reader for so many seconds, in a process of its own."""
    table = Table(
        f"fuzz_readers: {seconds:g} s each, mutated and random files, seed {seed}",
        ["reader", "files", "read", "refused", "escaped", "slow", "peak MB"],
    )
    table.notes += [
        machine(),
        f"slow: longer than {SLOW_S:g} s of the processor; escaped: any error but omnidyn's, or a crash",
    ]
    folder = Path(tempfile.mkdtemp(prefix="omnidyn-fuzz-"))
    for reader in readers or list(READERS):
        request = json.dumps([reader, seconds, seed, str(folder)])
        command = [sys.executable, "-m", "benchmarks.logs.fuzz_readers", "--child", request]
        try:
            child = subprocess.run(
                command, capture_output=True, text=True, cwd=ROOT, timeout=seconds + HANG_S + START_S, check=False
            )
        except subprocess.TimeoutExpired:
            child = subprocess.CompletedProcess(command, 1, "", "it never ended")
        if child.returncode:
            kept = folder / f"crash-{reader.replace(', ', '-')}"
            with contextlib.suppress(OSError):
                os.replace(folder / "current", kept)
            table.add("0 escaped", False, reader=reader, escaped=1)
            table.notes.append(f"{reader}: the process died ({child.returncode}) on {kept}: {child.stderr[:600]}")
            continue
        told = json.loads(child.stdout)
        escaped = told.pop("escaped")
        table.add("0 escaped, 0 slow", not escaped and not told["slow"], reader=reader, escaped=len(escaped), **told)
        table.notes += [f"{reader}: {path}: {error}" for path, error in escaped[:5]]
    with contextlib.suppress(OSError):
        (folder / "current").unlink()
        folder.rmdir()
    return table


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=SECONDS)
    parser.add_argument("readers", nargs="*", help=", ".join(READERS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.child:
        name, budget, number, place = json.loads(asked.child)
        print(json.dumps(fuzz(name, budget, number, Path(place))))
    else:
        print(measure(asked.seconds, asked.readers, asked.seed).as_text())
