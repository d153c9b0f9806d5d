"""Jobs of the tab Log without a page: what they say is what the command says, and what they draw is what was logged."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.logs.columns.mapping import load_map
from omnidyn.studio.log import job
from omnidyn.studio.series import Series
from tests.support.axebot_logs import excitation


@pytest.fixture
def log(tmp_path):
    """A log of the axebot, 20 s."""
    draws = np.random.default_rng(1)
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), excitation(20.0), 0.01)
    twist = run.twist + draws.standard_normal(run.twist.shape) * (0.01, 0.01, 0.05)
    omnidyn.write_run(omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist), tmp_path / "log.csv")
    return tmp_path / "log.csv"


def checked(path, folder, **more):
    """What the job says, and what it told on the way."""
    messages = []
    request = {"path": str(path), "robot": "", "map": "", "unsigned": False, "folder": str(folder), **more}
    return job.check(request, lambda kind, value: messages.append((kind, value)), None), messages


def test_a_log_in_blocks_is_drawn_whole_and_checked_as_the_command_does(log, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "BLOCK", 300)
    said, messages = checked(log, tmp_path / "series")
    assert len(messages) > 5
    assert str(messages[0][1]["text"]) == "reading log.csv"
    assert [k for k, (_, value) in enumerate(messages) if value.get("drawn")] == [
        k for k, (_, value) in enumerate(messages) if value["text"] == "checking"
    ][:1]
    run, series = omnidyn.read_log(log), Series(tmp_path / "series")
    np.testing.assert_array_equal(series._t, run.t)
    np.testing.assert_allclose(series._values, np.hstack([run.voltage, run.twist]).T, rtol=1e-6)
    from omnidyn.findings.check import check_blocks
    from omnidyn.logs.read_log import iter_logs

    verdict = check_blocks(iter_logs(log, rows=300))
    assert said["verdict"] == verdict.verdict
    assert said["rows"] == len(run)
    assert len(said["findings"]) == len(verdict.findings)


def test_a_log_that_memory_cannot_hold_is_refused(log, tmp_path, monkeypatch):
    monkeypatch.setattr(job, "default_max_bytes", lambda: 1000)
    with pytest.raises(InputError, match=r"too large; got more than 1000 bytes.*cut it into pieces"):
        checked(log, tmp_path / "series")


def test_a_table_of_columns_keeps_what_it_does_not_show(log, tmp_path):
    said, _ = checked(log, tmp_path / "series")
    rows = [dict(row) for row in said["columns"]]
    for row in rows:
        row |= {
            "latency": 0.02 if row["component"] == "vx" else 0.0,
            "frame": "room" if row["component"][0] == "v" else "",
        }
    job.save_columns({"rows": rows, "path": str(tmp_path / "map.toml")}, lambda kind, value: None, None)
    columns = load_map(tmp_path / "map.toml").columns
    assert columns["vx"].latency == 0.02
    assert columns["vy"].frame == "room"
    assert columns["u1"].latency == 0.0


def test_two_logs_are_aligned_as_the_library_does(log, tmp_path):
    run = omnidyn.read_log(log)
    late = tmp_path / "late.csv"
    omnidyn.write_run(run.replace(t=run.t + 0.37), late)
    said = job.align(
        {"logs": [{"path": str(late), "name": "late"}, {"path": str(log), "name": "log"}], "robot": ""},
        lambda kind, value: None,
        None,
    )
    assert said["offset"] == omnidyn.align(omnidyn.read_log(late), run).offset
    assert said["severity"] == "note"
