"""What print, a notebook and plot() give of each result; a repr stays one short line."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import omnidyn
from omnidyn.errors import InputError
from omnidyn.findings.check import check_log
from omnidyn.logs.log import Log
from tests.support.compared_logs import clean_log, coulomb_times, noisy
from tests.support.figures import shown_texts
from tests.support.outputs import Reader
from tests.support.steady_logs import clean_runs, robot_with

ROBOT = omnidyn.load_robot("axebot")
AROUND = range(0, 360, 45)


@pytest.fixture(scope="module")
def run():
    return noisy(clean_log(ROBOT, 1), 1)


@pytest.fixture(scope="module")
def results(run):
    fit = omnidyn.identify([run], ROBOT, omnidyn.OutputError(nuisances="none")).estimate
    return {
        "run": run,
        "robot": ROBOT,
        "verdict": omnidyn.check(run, ROBOT),
        "comparison": omnidyn.compare(ROBOT, run, coulomb_times(ROBOT, 1.3)),
        "estimate": fit,
        "identification": omnidyn.identify([run], ROBOT, omnidyn.OutputError(nuisances="none")),
        "motors": omnidyn.identify([run], None, omnidyn.MotorLine()).study,
        "steady": omnidyn.identify(
            clean_runs(robot_with("disc"), AROUND), ROBOT, omnidyn.SteadyState(shape="disc")
        ).study,
    }


NAMES = ["run", "robot", "verdict", "comparison", "estimate", "identification", "motors", "steady"]


@pytest.mark.parametrize("name", NAMES)
def test_print_is_the_document_and_a_notebook_has_the_same_words(results, name):
    result = results[name]
    text = str(result)
    assert text == result.document().to_text()
    assert len(text.splitlines()) > 3
    html = result._repr_html_()
    page = Reader(html)
    assert page.tags.count("table") == sum(type(part).__name__ == "Table" for part in result.document().parts)
    assert "<script" not in html


@pytest.mark.parametrize("name", NAMES)
def test_a_repr_is_one_line(results, name):
    assert repr(results[name]).startswith("<")
    assert "\n" not in repr(results[name])
    assert "array(" not in repr(results[name])


@pytest.mark.parametrize("name", NAMES)
def test_a_plot_is_a_figure_with_nothing_cut_off(results, name):
    figure = results[name].plot()
    assert isinstance(figure, Figure)
    assert figure._repr_png_().startswith(b"\x89PNG")
    page = figure.bbox
    for words, box in shown_texts(figure):
        assert page.x0 - 1 <= box.x0 <= box.x1 <= page.x1 + 1, words
        assert page.y0 - 1 <= box.y0 <= box.y1 <= page.y1 + 1, words


def test_a_run_says_its_numbers(run):
    table = run.document()["channels"]
    row = next(row for row in table.rows if row[0] == "twist")
    vx = run.twist[:, 0]
    assert row == ("twist", "x", "m/s", f"{vx.min():.4g}", f"{vx.mean():.4g}", f"{vx.max():.4g}", "")
    holes = run.replace(twist=np.where(np.arange(len(run))[:, None] < len(run) // 2, np.nan, run.twist))
    assert "50%" in str(holes)


def test_a_robot_says_where_its_numbers_come_from():
    robot = omnidyn.load_robot("robotino")
    rows = {row[0]: row for row in robot.document()["numbers"].rows}
    assert rows["body.mass_kg"][1:4] == ("8", "1", "given")
    assert rows["friction.direction.coulomb"][1:4] == ("42.5, 36.1", "0.2, 0.2", "identified")
    assert not [key for key in rows if key.startswith("friction.axes")]  # it has none


def test_texts_in_a_notebook_are_text(run):
    evil = run.replace(source="<script>alert(1)</script>", warnings=("<b>",))
    page = Reader(evil._repr_html_())
    assert not {"script", "b"} & set(page.tags)
    assert "<script>" in page.text


def test_pictures_of_a_robot_have_names():
    for what in ("layout", "dead zone", "friction"):
        assert ROBOT.plot(what).get_label()
    with pytest.raises(InputError, match="no such picture; got speed; expected layout, dead zone, friction"):
        ROBOT.plot("speed")


def test_a_fit_to_steady_points_marks_them_and_rests_are_hollow():
    table = omnidyn.read_steady_table(Path(__file__).parents[1] / "examples" / "table1.csv")
    figure = omnidyn.identify(table, ROBOT).plot()
    for axis, axes in enumerate(figure.axes):
        rows = table.axis_index == axis
        moving, rest = (line for line in axes.lines if line.get_marker() == "o")
        np.testing.assert_array_equal(moving.get_xydata().T, [table.speed[rows][1:], table.force[rows][1:]])
        np.testing.assert_array_equal(rest.get_xydata().T, [table.speed[rows][:1], table.force[rows][:1]])
        assert rest.get_markerfacecolor() == "white"


def test_points_across_several_axes_are_marked_where_friction_is_that_of_an_axis_alone(results):
    steady = results["steady"].estimates["all"]
    assert len(steady.points) == 12  # four along an axis, four diagonal ones that drive two each
    (speed, force), *_ = (part for part in _marked(results["steady"].estimates["all"].plot()) if len(part[0]))
    np.testing.assert_allclose(sorted(speed), [-0.4, 0.4], atol=0.01)
    np.testing.assert_allclose(np.abs(force), 2.0, rtol=0.02)  # the disc of tests/support/steady_logs.py
    box = omnidyn.identify(clean_runs(robot_with("box"), AROUND), ROBOT, omnidyn.SteadyState(shape="box")).study
    assert len(next(_marked(box.estimates["all"].plot()))[0]) == 6


def _marked(figure):
    """(speeds, forces) of the marks of each panel."""
    for axes in figure.axes:
        marks = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
        yield np.concatenate([np.empty((0, 2)), *marks]).T


def test_a_fit_draws_its_free_run_when_asked(results):
    figure = results["identification"].plot("runs")
    assert figure.get_label().startswith("Measured and axebot")
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["vx, m/s", "vy, m/s", "omega, rad/s"]
    with pytest.raises(InputError, match="no such picture; got paths; expected friction, runs"):
        results["identification"].plot("paths")


def test_a_robot_moves_to_scale_along_its_run(tmp_path):
    run = omnidyn.simulate(ROBOT, np.tile([0.0, 5.0, -5.0], (200, 1)), 0.01)
    moving = run.animate(ROBOT)
    moving.save(tmp_path / "run.gif")
    assert moving._repr_html_().startswith('<img alt="animation" src="data:image/gif;base64,R0lGOD')
    with Image.open(tmp_path / "run.gif") as picture:
        assert picture.n_frames == 41  # 2 s, 0.05 s each, both ends
        blue = [_blue(picture, frame) for frame in (0, 40)]
    reach, radius, way = 0.1, 0.035, run.pose[-1, 0] - run.pose[0, 0]
    scale = (480 - 2 * 16) / (way + 2 * (reach + radius))  # pixels of a metre
    assert blue[1][1] - blue[0][1] == pytest.approx(way * scale, abs=2)  # the foremost blue is that of the body
    assert blue[0][1] - blue[0][0] == pytest.approx(2 * 0.85 * reach * scale, abs=3)
    with pytest.raises(InputError, match="where it went is not in the run; got voltage"):
        omnidyn.Run(t=run.t, voltage=run.voltage).animate(ROBOT)
    with pytest.raises(InputError, match=r"ends in \.gif"):
        moving.save(tmp_path / "run.mp4")


def _blue(picture, frame):
    """The first and the last column of a frame that hold the colour of the robot, below the line of words."""
    picture.seek(frame)
    red, _, blue = np.moveaxis(np.asarray(picture.convert("RGB"), int)[20:], 2, 0)
    columns = np.flatnonzero((blue - red > 60).any(axis=0))
    return int(columns[0]), int(columns[-1])


def test_a_run_draws_the_channels_asked_for(run):
    assert len(run.plot(["twist"]).axes) == len(run.plot("twist").axes) == 1
    with pytest.raises(InputError, match="does not hold this; got current"):
        run.plot(["twist", "current"])


def test_where_a_run_went_needs_something_that_says_so(run):
    assert len(run.plot_path().axes) == 2
    wheels = omnidyn.Run(t=run.t, wheel_speed=run.wheel_speed)
    with pytest.raises(InputError, match="where it went is not in the run"):
        wheels.plot_path()
    assert len(wheels.plot_path(ROBOT).axes) == 2


def test_a_verdict_on_blocks_has_no_log_to_draw(run):
    with pytest.raises(InputError, match="checked in blocks"):
        check_log(Log.of_run(run)).plot()


def test_a_plot_starts_no_pyplot_and_leaves_the_backend_alone(tmp_path):
    script = (
        "import sys, omnidyn\nomnidyn.load_robot('axebot').plot()\n"
        "print('matplotlib.pyplot' in sys.modules, 'matplotlib' in sys.modules)"
    )
    sources = str(Path(__file__).resolve().parents[1] / "src")
    result = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env={"PYTHONPATH": sources, "HOME": str(tmp_path)},
    )
    assert result.stdout == "False True\n"


def test_printing_imports_no_matplotlib(tmp_path):
    script = "import sys, omnidyn\nprint(omnidyn.load_robot('axebot'))\nassert 'matplotlib' not in sys.modules"
    sources = str(Path(__file__).resolve().parents[1] / "src")
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, timeout=120, check=True, env={"PYTHONPATH": sources})


def test_sensors_with_clocks_of_their_own_are_drawn_at_their_own_rows(run):
    rows = np.arange(len(run))[:, None] % 4
    staggered = run.replace(
        twist=np.where(rows == 0, run.twist, np.nan), wheel_speed=np.where(rows, run.wheel_speed, np.nan)
    )
    (axes,) = staggered.plot("twist").axes
    np.testing.assert_array_equal(axes.lines[0].get_xydata().T, [run.t[::4], run.twist[::4, 0]])
