"""A log of a gigabyte, read in pieces, and checked: seconds and memory, for CSV and Parquet.

python -m benchmarks.logs.big_log PATH      read one file in this process, and print what it took
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from omnidyn.logs.readers.read_table import iter_tables
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

BYTES = scaled(1_000_000_000, 1_000_000)
WHEELS = (("u", "V"), ("i", "A"), ("w", "rad_s"))
COLUMNS = [
    "t_s",
    *(f"{letter}{k}_{unit}" for letter, unit in WHEELS for k in (1, 2, 3)),
    "vx_m_s",
    "vy_m_s",
    "omega_rad_s",
]
BLOCK_ROWS = 100_000
CPU_GOAL_S, MEMORY_GOAL_MB = 40.0, 1024.0
CHECK_GOAL_S, CHECK_MEMORY_MB = 60.0, 2048.0


def measure() -> Table:
    """Write such files in a temporary folder, and read each in a process of its own."""
    table = Table(
        f"big_log: {BYTES / 1e9:g} GB of CSV, {len(COLUMNS)} columns, and the same rows as Parquet",
        ["file", "MB", "rows", "cpu s", "wall s", "peak MB"],
    )
    table.notes.append(machine())
    table.notes.append("peak MB: of the whole process, Python, NumPy and omnidyn (120 MB) included")
    with tempfile.TemporaryDirectory(prefix="omnidyn-big-log-") as folder:
        csv = Path(folder) / "log.csv"
        _write_csv(csv)
        _add(table, "CSV", csv)
        _add_check(table, csv)
        parquet = csv.with_suffix(".parquet")
        if _write_parquet(csv, parquet):
            csv.unlink()
            _add(table, "Parquet", parquet)
        else:
            table.notes.append("Parquet was not measured: pyarrow is not installed")
    return table


def _add(table: Table, name: str, path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.logs.big_log", str(path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    told = json.loads(run.stdout)
    met = told["cpu s"] <= CPU_GOAL_S and told["peak MB"] <= MEMORY_GOAL_MB
    size = path.stat().st_size / 1e6
    table.add(f"<= {CPU_GOAL_S:g} s, {MEMORY_GOAL_MB:g} MB", met, file=name, MB=round(size), **told)


def _add_check(table: Table, path: Path) -> None:
    """The whole command `omnidyn check` on the file."""
    wall, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    code = (
        f"import resource, sys; from omnidyn.cli import main; c = main(['check', {str(path)!r}, '--robot', 'axebot'])"
    )
    code += "; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr); sys.exit(c)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.returncode:
        raise RuntimeError(f"omnidyn check ended with {run.returncode}: {run.stderr[-500:]}")
    table.notes.append(f"omnidyn check says: {run.stdout.splitlines()[0]}")
    told = {
        "rows": "",
        "cpu s": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
        "wall s": round(time.perf_counter() - wall, 1),
        "peak MB": round(int(run.stderr.split()[-1]) / (1e6 if sys.platform == "darwin" else 1e3)),
    }
    met = told["wall s"] <= CHECK_GOAL_S and told["peak MB"] <= CHECK_MEMORY_MB
    size = round(path.stat().st_size / 1e6)
    table.add(f"<= {CHECK_GOAL_S:g} s, {CHECK_MEMORY_MB:g} MB", met, file="CSV, checked", MB=size, **told)


def _write_csv(path: Path) -> None:
    """A day of driving at 100 Hz: one simulated run of the paper's robot with noise, again and again."""
    rng, robot = np.random.default_rng(1), load_robot("axebot")
    voltage = rng.uniform(-5.0, 5.0, (BLOCK_ROWS // 500, 3)).repeat(500, axis=0)
    run = simulate(robot, voltage, 0.01)
    noise = {"current": 0.02, "wheel_speed": 0.2, "twist": np.array([0.02, 0.02, 0.1])}
    measured = [
        getattr(run, name)[:BLOCK_ROWS] + rng.normal(0.0, 1.0, (BLOCK_ROWS, 3)) * s for name, s in noise.items()
    ]
    rows = ["".join(f",{value:.6g}" for value in row) + "\n" for row in np.column_stack([voltage, *measured]).tolist()]
    done = 0
    with open(path, "w", encoding="ascii") as stream:
        stream.write(",".join(COLUMNS) + "\n")
        while stream.tell() < BYTES:
            stream.write("".join(f"{(done + k) * 0.01:.2f}{row}" for k, row in enumerate(rows)))
            done += BLOCK_ROWS


def _write_parquet(csv: Path, path: Path) -> bool:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        return False
    schema = pa.schema([(name, pa.float64()) for name in COLUMNS])
    with parquet.ParquetWriter(path, schema, use_dictionary=False) as writer:
        for piece in iter_tables(csv):
            writer.write_table(pa.table({name: piece.columns[name] for name in COLUMNS}, schema=schema))
    return True


def read(path: str) -> dict[str, float]:
    """Read a file to its end, looking at every column once."""
    wall, rows = time.perf_counter(), 0
    for piece in iter_tables(path):
        rows += len(piece)
        assert all(np.isfinite(piece.columns[name]).all() for name in piece.names)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    peak = usage.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
    cpu = usage.ru_utime + usage.ru_stime
    return {
        "rows": rows,
        "cpu s": round(cpu, 1),
        "wall s": round(time.perf_counter() - wall, 1),
        "peak MB": round(peak),
    }


if __name__ == "__main__":
    print(json.dumps(read(sys.argv[1])))
