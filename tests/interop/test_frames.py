"""Runs there and back as data frames and Datasets; frames wherever a Run is; estimates and comparisons as tables."""

import sys

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, MissingExtraError

ROBOT = omnidyn.load_robot("axebot")
VOLTS = np.repeat([[0.0, 3.0, -3.0], [0.0, 0.0, 0.0], [-4.0, 2.0, 2.0], [2.0, 2.0, 2.0]], 60, axis=0)


def run():
    made = omnidyn.simulate(ROBOT, VOLTS, 0.01)
    return made.replace(supply=np.where(np.arange(len(made)) % 7 == 0, np.nan, 12.0), warnings=("a doubt",))


def frame_of(kind, run):
    if kind == "xarray":
        pytest.importorskip("xarray")
        return run.to_xarray()
    pytest.importorskip(kind)
    return run.to_dataframe(kind)


@pytest.mark.parametrize("kind", ["pandas", "polars", "xarray"])
def test_a_run_comes_back_to_the_last_bit(kind):
    one = run()
    again = omnidyn.interop.run_of(frame_of(kind, one))
    if kind == "polars":  # it has no place for words
        again = again.replace(source=one.source, warnings=one.warnings)
    assert again == one


@pytest.mark.parametrize("kind", ["pandas", "polars", "xarray"])
def test_frames_are_taken_wherever_a_run_is(kind, tmp_path):
    one = run()
    frame = frame_of(kind, one)
    assert omnidyn.compare(ROBOT, frame).rmse == omnidyn.compare(ROBOT, one).rmse
    assert omnidyn.compare(ROBOT, [frame, one]).rmse == omnidyn.compare(ROBOT, [one, one]).rmse
    assert str(omnidyn.check(frame, ROBOT)) == str(omnidyn.check(omnidyn.interop.run_of(frame), ROBOT))
    omnidyn.write_run(frame, tmp_path / "run.csv")
    assert np.array_equal(omnidyn.read_log(str(tmp_path / "run.csv")).twist, one.twist)
    fits = [
        omnidyn.identify(each, ROBOT, omnidyn.OutputError(free=["friction.axes.coulomb"])).estimate
        for each in (frame, one)
    ]
    assert fits[0].value == fits[1].value


def test_units_and_names_of_a_dataset():
    pytest.importorskip("xarray")
    dataset = run().to_xarray()
    assert dataset.twist.attrs["units"] == "m/s, m/s, rad/s"
    assert dataset.twist.attrs["components"] == ["vx", "vy", "omega"]
    assert dataset.voltage.dims == ("time", "wheel")
    assert dataset.wheel.values.tolist() == [1, 2, 3]
    assert dataset.supply.dims == ("time",)
    assert float(dataset.twist.sel(axis="yaw").isel(time=-1)) == run().twist[-1, 2]
    assert dataset.attrs["warnings"] == ["a doubt"]
    turned = dataset.transpose("wheel", "axis", "time")
    assert omnidyn.interop.run_of(turned) == run()


def test_units_of_a_data_frame():
    pytest.importorskip("pandas")
    units = run().to_dataframe().attrs["units"]
    assert units["w1_rad_s"] == "rad/s"
    assert units["t_s"] == "s"


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda frame: frame.rename(columns={"u1_V": "motor"}), "not the columns of a run; got motor"),
        (lambda frame: frame.drop(columns="u1_V"), "the channel voltage is not complete; .*add u1_V"),
        (lambda frame: frame.iloc[::-1], "time does not increase"),
        (lambda frame: frame.reset_index(drop=True), "got no column t_s"),
        (lambda frame: frame.assign(u1_V="words"), "not numbers"),
        (lambda frame: frame.assign(u1_V=np.inf), "an infinite value"),
        (lambda frame: frame.assign(u1_V=True), "not numbers"),
    ],
)
def test_other_frames_are_refused_in_words(change, words):
    pytest.importorskip("pandas")
    with pytest.raises(InputError, match=words):
        omnidyn.interop.run_of(change(run().to_dataframe()))


def test_another_dataset_is_refused():
    xarray = pytest.importorskip("xarray")
    with pytest.raises(InputError, match="not the variables of a run; got other"):
        omnidyn.interop.run_of(xarray.Dataset({"other": ("time", [1.0])}, {"time": [0.0]}))


@pytest.mark.parametrize("library", ["polars", "xarray"])
def test_without_the_library_it_says_what_to_install(monkeypatch, library):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"needs {library}; pip install .omnidyn\[arrays\]"):
        run().to_xarray() if library == "xarray" else run().to_dataframe(library)
    with pytest.raises(InputError, match="no such library of data frames; got arrow"):
        run().to_dataframe("arrow")


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_estimates_and_comparisons_as_tables(library):
    pytest.importorskip(library)
    fit = omnidyn.identify(run(), ROBOT, omnidyn.OutputError(free=["friction.axes.coulomb"])).estimate
    table = fit.to_dataframe(library)
    assert list(table["parameter"]) == list(fit.value)
    assert list(table["value"]) == list(fit.value.values())
    assert set(table["unit"]) == {"N", "N m"}
    found = omnidyn.compare(ROBOT, run())
    table = found.to_dataframe(library)
    assert list(table["component"]) == list(found.rmse)
    assert list(table["rmse"]) == list(found.rmse.values())
    if library == "pandas":
        assert table.attrs["units"]["fit_percent"] == "%"
        assert fit.to_dataframe().attrs["units"]["friction.axes.coulomb[2]"] == "N m"
