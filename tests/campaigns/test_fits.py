"""Identification campaigns: logs of a robot that omnidyn does not move; the table is what `omnidyn identify` says."""

import json
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

from omnidyn.campaigns.results import load_campaign
from omnidyn.campaigns.spec import parse_spec
from omnidyn.campaigns.sweep import sweep
from omnidyn.cli import main
from omnidyn.errors import InputError
from omnidyn.files import sha256
from omnidyn.logs.run_file import write_run
from omnidyn.report.figures.campaign import draw_campaign
from tests.support import plain_robot
from tests.support.codes import codes
from tests.support.figures import shown_texts

FLOORS = {"gray": 1.0, "blue": 1.4}  # name -> dry friction, times that of the file
AXES = ("friction.axes.viscous", "friction.axes.coulomb")


@cache
def log_on(factor, seed):
    """A log of a floor."""
    return plain_robot.log(seed, coulomb=factor * plain_robot.COULOMB)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A robot file, two logs of each of two floors, a file that is none, and one without volts; the test runs there."""
    monkeypatch.chdir(tmp_path)
    plain_robot.robot(tmp_path)
    for floor, factor in FLOORS.items():
        (tmp_path / floor).mkdir()
        for k in range(2):
            write_run(run := log_on(factor, k), tmp_path / floor / f"day{k}.csv")
    (tmp_path / "blue" / "day0a.csv").write_text("to do: charge the battery\n")
    write_run(run.replace(voltage=None), tmp_path / "blue" / "day0b.csv")
    return tmp_path


@pytest.fixture
def identified(capsys):
    """What `omnidyn identify ... --json` says."""

    def call(*arguments):
        code = main(["identify", *arguments, "--robot", "plain.toml", "--json", "--quick"])
        said = json.loads(capsys.readouterr().out)
        assert code == (0 if said["ok"] else 4)
        return said

    return call


def spec(folder, vary=None, **identify):
    """A spec, its paths absolute."""
    table = {"logs": [str(folder / "gray"), str(folder / "blue")], "quick": True} | identify
    return {"schema": 1, "robot": str(folder / "plain.toml"), "identify": table, "vary": vary or {}}


def run(made, folder):
    """The frame of a campaign, and it."""
    with ThreadPoolExecutor(1) as threads:
        campaign = sweep(made, folder / "out", executor=threads)
    return campaign.to_dataframe(), campaign


def test_a_row_for_each_log_is_what_identify_says(folder, identified):
    vary = {"identify.loss": {"values": ["gaussian", "student-t"]}}
    frame, campaign = run(spec(folder, vary, nuisances="none"), folder)
    names = ["gray/day0.csv", "gray/day1.csv", *(f"blue/day{name}.csv" for name in ("0", "0a", "0b", "1"))]
    assert frame.log.tolist() == [name for name in names for _ in range(2)]
    for _, row in frame[frame.ok].iterrows():
        floor, loss = row["log"].partition("/")[0], row["identify.loss"]
        said = identified(row["log"], "--nuisance", "none", "--loss", loss)
        assert len(said["parameters"]) == 6
        for key, number in said["parameters"].items():  # to the digit
            ends = row[f"fit.{key}"], [row[f"fit.{key}.low"], row[f"fit.{key}.high"]]
            assert ends == (number["value"], number["ci95"])
        for component, score in said["validation"]["fitted"]["components"].items():
            assert row[f"rmse.{component}"] == score["rmse"]
            assert score["rmse"] == pytest.approx(plain_robot.NOISE, rel=0.1)
        for name, truths in zip(AXES, (plain_robot.VISCOUS, FLOORS[floor] * plain_robot.COULOMB), strict=True):
            for k, truth in enumerate(truths):  # what moved the robot, within two half-widths
                low, high = row[f"fit.{name}[{k}].low"], row[f"fit.{name}[{k}].high"]
                assert abs(row[f"fit.{name}[{k}]"] - truth) < high - low
    bad = frame[~frame.ok]
    assert bad.log.tolist() == [name for name in ("blue/day0a.csv", "blue/day0b.csv") for _ in range(2)]
    assert bad.verdict.tolist() == ["log_not_read"] * 2 + ["log_not_fitted"] * 2
    assert bad["fit.friction.axes.coulomb[0]"].isna().all()
    assert "no rows" in bad.words.iloc[0]
    assert "voltage" in bad.words.iloc[2]
    text = campaign.document().to_text()
    assert "log_not_read" in text
    assert all(f"- blue/day0{k} cannot be" in text for k in ("a.csv", "b.csv"))  # why, of the first of each
    grid = campaign.to_xarray()["fit.friction.axes.coulomb[0]"]
    assert grid.sel({"log": "gray/day1.csv", "identify.loss": "gaussian"}) == frame["fit.friction.axes.coulomb[0]"][2]
    assert campaign.document().data["verdicts"]["log_not_read"] == 2
    picture = draw_campaign(campaign, "fit.friction.axes.coulomb[0]")
    assert {*names} <= {words for words, _ in shown_texts(picture.figure)}
    assert main(["sweep", "merge", "out", "-o", "fits.csv"]) == 0
    rows = [line.split('","') for line in (folder / "fits.csv").read_text().splitlines()]
    assert len(rows) == 1 + len(frame)
    assert rows[0][1:3] == ["log", "identify.loss"]
    assert main(["sweep", "merge", "out", "-o", "fits.csv"]) == 3


def test_a_log_that_ends_too_early_is_not_ok_and_what_is_known_is_counted(folder, capsys):
    whole = (folder / "gray" / "day0.csv").read_text().rstrip()
    (folder / "gray" / "day0.csv").write_text(whole[: whole.rindex(",")])
    (folder / "fits.toml").write_text(
        'schema = 1\nrobot = "plain.toml"\n[identify]\nquick = true\n'
        'logs = ["gray", "blue/day0.csv", "blue/day0a.csv"]\n'
    )
    assert main(["sweep", "fits.toml", "-o", "out", "--workers", "1"]) == 4
    said = capsys.readouterr()
    assert "2 of 4 fits do not stand" in said.err
    frame = load_campaign("out").to_dataframe().set_index("log")
    cut = frame.loc["gray/day0.csv"]
    assert (cut.ok, cut.verdict) == (False, "fit_of_part")
    assert "ends in the middle of a row" in cut.words
    assert cut["fit.friction.axes.coulomb[0]"] == pytest.approx(
        frame.loc["gray/day1.csv"]["fit.friction.axes.coulomb[0]"], rel=0.1
    )
    assert frame.ok.tolist() == [False, True, True, False]
    assert frame.known_share.tolist()[:3] == [1.0, 1.0, 1.0]
    assert np.isnan(frame.known_share.iloc[3])
    assert main(["sweep", "merge", "out"]) == 0


@pytest.mark.long
def test_shapes_of_friction_are_compared_log_by_log(folder, identified):
    for k in range(2):
        write_run(plain_robot.log(k, levels=30, held=100), folder / f"held{k}.csv")
    vary = {"identify.shape": {"values": ["box", "disc"]}}
    frame, _ = run(spec(folder, vary, logs=str(folder / "held*.csv"), method="steady-state"), folder)
    assert frame["shape"].tolist() == ["box", "disc"] * 2
    for _, row in frame.iterrows():
        said = identified(row["log"], "--method", "steady-state", "--shape", row["identify.shape"])
        (group,) = said["groups"].values()
        for key, number in group["parameters"].items():
            assert [row[f"fit.{key}"], row[f"fit.{key}.low"]] == [number["value"], number["ci95"][0]]
    errors = frame.pivot(index="log", columns="shape", values="left_out_rmse_N")
    assert (errors["box"] < errors["disc"]).all()  # its friction is a box


def test_any_cut_gives_the_same_table_and_a_log_that_changed_is_refused(folder):
    made = spec(folder, logs=str(folder / "blue" / "*"), outputs="wheel_speed")
    _, campaign = run(made, folder)
    whole = sha256(campaign.folder.merge().read_bytes())
    with ThreadPoolExecutor(1) as threads:
        cut = sweep(made | {"shard_rows": 2}, folder / "cut", executor=threads)
        assert sha256(cut.folder.merge().read_bytes()) == whole
        (folder / "cut" / "shards" / "00001.parquet").unlink()
        log = folder / "blue" / "day1.csv"
        log.write_text(log.read_text().replace("0.", "0.1", 1))
        for again in (made, None):
            with pytest.raises(InputError, match=r"day1\.csv has changed"):
                sweep(again, folder / "cut", executor=threads)
        log.unlink()
        with pytest.raises(InputError, match="no such file"):
            sweep(None, folder / "cut", executor=threads)
        with pytest.raises(InputError, match="the folder holds another campaign"):
            sweep(made, folder / "cut", executor=threads)


def test_logs_of_a_set_are_fitted_together_and_those_held_out_are_predicted(folder, identified):
    for name in ("day0a.csv", "day0b.csv"):
        (folder / "blue" / name).unlink()
    sets = {floor: str(folder / floor) for floor in FLOORS}
    frame, _ = run(spec(folder, logs=sets, hold_out=str(folder / "*" / "day1.csv")), folder)
    assert frame.log.tolist() == [*FLOORS]
    for _, row in frame.iterrows():
        name = row["log"]
        said = identified(name, "--hold-out", "day1.csv")["validation"]["held_out"]
        assert [log["rmse"] for log in said["components"].values()] == [row[f"held_out_rmse.w{k}"] for k in (1, 2, 3)]
    alone, _ = run(spec(folder, hold_out=str(folder / "gray" / "day1.csv")), folder / "alone")
    assert alone.log.tolist() == ["gray/day0.csv", "blue/day0.csv", "blue/day1.csv"]
    far = alone.set_index("log")["held_out_rmse.w1"]
    assert far["blue/day0.csv"] > 2.0 * far["gray/day0.csv"]  # another floor does not predict it


def test_where_fits_start_may_vary(folder):
    write_run(plain_robot.log(5), folder / "log.csv")
    plain_robot.robot(folder / "gray")
    other = folder / "gray" / "plain.toml"
    other.write_text(other.read_text().replace("coulomb = [2.0", "coulomb = [3.0"))
    vary = {
        "robot": {"values": [str(folder / "plain.toml"), str(other)]},
        "body.mass_kg": {"factor": [0.8, 1.1], "steps": 2},
        "identify.free": {"values": ["friction", "friction, body.mass_kg"]},
    }
    frame, _ = run(spec(folder, vary, logs=str(folder / "log.csv")), folder)
    assert len(frame) == 8
    assert np.allclose(frame["body.mass_kg"].unique(), [0.8, 1.1])
    fitted = frame["fit.body.mass_kg"]
    assert fitted.isna().tolist() == [True, False] * 4
    assert fitted.dropna().to_numpy() == pytest.approx(plain_robot.MASS, rel=0.03)  # from wherever it starts
    first = frame[frame["identify.free"] != "friction"]["fit.friction.axes.coulomb[0]"].to_numpy()
    assert first == pytest.approx(plain_robot.COULOMB[0], rel=0.05)


def test_logs_are_read_as_asked(folder, identified):
    """Columns of other names and units, in a file without a header that says so; rows whose time goes back."""
    run_ = plain_robot.log(7)
    rows = np.column_stack([1e3 * run_.t, run_.voltage, run_.wheel_speed * 30.0 / np.pi])
    rows[[40, 41]] = rows[[41, 40]]
    np.savetxt(folder / "raw.csv", rows, delimiter=",", fmt="%.17g")
    names = {"t": "c1:ms"} | {f"u{k}": f"c{k + 1}:V" for k in (1, 2, 3)} | {f"w{k}": f"c{k + 4}:rpm" for k in (1, 2, 3)}
    read = {"columns": names, "header": False, "sort": True}
    frame, _ = run(spec(folder, logs=str(folder / "raw.csv"), read=read), folder)
    flags = [part for name, text in names.items() for part in ("--column", f"{name}={text}")]
    said = identified("raw.csv", "--no-header", "--sort", *flags)
    assert (frame.ok[0], frame.verdict[0], said["ok"]) == (False, "log_not_usable", False)  # it was sorted, and fitted
    assert {key: frame[f"fit.{key}"][0] for key in said["parameters"]} == {
        key: number["value"] for key, number in said["parameters"].items()
    }


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"read": {"colums": {}}}, r"unknown key; got colums; did you mean columns"),
        ({"logs": "absent/*.csv"}, r"no such log; got absent/\*\.csv"),
        ({"logs": []}, "no logs; expected a file"),
        ({"logs": 3}, "not a file or several"),
        ({"hold_out": "absent.csv"}, "no such log; got absent.csv"),
        ({"lost": "gaussian"}, "a fit has no such option.*did you mean loss"),
        ({"loss": "gausian"}, "unknown loss; got gausian"),
        ({"shape": "line", "loss": "gaussian"}, "no method has all these options"),
        ({"method": "steady-state", "loss": "gaussian"}, "steady-state has all these options"),
        ({"free": "body.mas_kg"}, "did you mean body.mass_kg"),
        ({"map": "absent.toml"}, "no such file"),
    ],
)
def test_what_is_wrong_is_named_before_any_work(folder, changes, words):
    with pytest.raises(InputError, match=words):
        run(spec(folder, **changes), folder)
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"sampling": "sobol", "samples": 4}, "leave out sampling"),
        ({"samples": 4}, "a grid has no samples to draw"),
        ({"vary": {"track.delay": {"values": [1]}}}, r"no \[track\] that could be varied"),
        ({"vary": {"identify.lost": {"values": ["a"]}}}, "did you mean loss"),
        ({"vary": {"log": {"values": ["a"]}}}, "the logs vary already"),
        ({"metrics": ["ok"]}, "a fit keeps all its numbers"),
        ({"track": {"path": "circle"}}, "two tasks"),
    ],
)
def test_what_does_not_go_with_fits_is_named(folder, changes, words):
    with pytest.raises(InputError, match=words):
        run(spec(folder) | changes, folder)


def test_a_spec_of_fits_comes_back_from_its_tables(folder):
    from omnidyn.campaigns.spec import spec_tables

    made = parse_spec(spec(folder, free=["friction"], window=[0.2, 0.9], quick=False))
    assert parse_spec(spec_tables(made)) == made


def test_a_log_that_changes_meanwhile_fails_its_shard(folder, monkeypatch):
    """Between the start of a campaign and the fit."""
    from omnidyn.campaigns import fits

    made = spec(folder, logs=str(folder / "gray"))
    run(made, folder)
    (folder / "out" / "shards" / "00000.parquet").unlink()
    hashed, changed = fits.file_sha256, []

    def later(path):
        changed.append(path)
        return hashed(path) if len(changed) <= 2 else "0"

    monkeypatch.setattr(fits, "file_sha256", later)
    _, campaign = run(None, folder)
    assert "the log has changed since the campaign began" in campaign.status.failed[0]
    assert codes([campaign.verdict]) == ["campaign_failed"]
