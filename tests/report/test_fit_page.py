"""The page of a fit: verdict, pictures, tables; duty is called duty; measured lines lie above the model's."""

from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn.findings.finding import Finding
from omnidyn.identification.fit_document import number_table, verdict_table
from omnidyn.logs.log import Log
from omnidyn.report.figures.correlations import draw_correlation
from omnidyn.report.figures.residuals import draw_residuals
from omnidyn.report.fit_page import _noise, render_fit
from omnidyn.statement import ERROR
from tests.support.axebot_logs import excitation
from tests.support.compared_logs import clean_log, noisy
from tests.support.figures import shown_texts
from tests.support.outputs import Reader

ROBOT = omnidyn.load_robot("axebot")
RECORD = {"omnidyn": "0.1.0", "command": "omnidyn identify", "inputs": []}


def duty_log(seed):
    run = noisy(clean_log(ROBOT, seed), seed).replace(source=f"drive{seed}.csv")
    return run.replace(duty=run.voltage / 6.0, voltage=None, supply=np.full(len(run), 6.0))


@pytest.fixture(scope="module")
def found():
    runs = [duty_log(seed) for seed in (1, 2)]
    logs = [Log.of_run(run) for run in runs]
    return omnidyn.identify(
        runs, ROBOT, omnidyn.OutputError(nuisances=("latency", "dead_band")), check=logs, hold_out="drive2.csv"
    )


@pytest.fixture(scope="module")
def page(found):
    return render_fit(found, RECORD)


def test_numbers_and_a_picture_stand_on_the_first_screen(page):
    keys = ["warnings", "next", "runs", "friction", "path", "findings", "residuals", "correlation", "numbers", "scores"]
    places = [page.index(f'<section id="{key}">') for key in keys]
    assert places == sorted(places)
    assert page.index('<div class="beside">') < page.index("</table>") < page.index("</figure>") < places[0]


def test_every_id_is_there_once(page):
    ids = Reader(page).all("id")
    assert len(ids) == len(set(ids))
    assert {"friction_speed", "where_it_went"} <= set(ids)


def test_a_logged_duty_is_called_duty(page, found):
    text = Reader(page).text
    drive = found.estimate.robot.drive
    assert f"the logged duty times the logged supply, behind a dead band of {drive.dead_band:.3g} V" in text
    assert drive.dead_band > 0.0
    assert "the logged voltage" not in text
    validation = next(iter(found.validations.values()))
    assert list(validation.fitted.applied) == ["axebot"]


def test_the_first_words_are_the_verdict_and_the_log_s_own_numbers_are_in_the_table_only(page, found):
    findings = page[page.index('<section id="findings">') : page.index('<section id="dead-zone">')]
    said = next(iter(found.validations.values())).statement()
    assert str(said) in Reader(findings).text
    assert "latency" not in findings
    assert "latency.twist" in page[page.index('<section id="numbers">') :]


def test_labels_of_correlations_are_whole_however_long(found):
    figure = draw_correlation(found.estimate.correlation).figure
    for words, box in shown_texts(figure):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, words
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, words


def test_the_measured_line_lies_above_and_is_thinner(found):
    axes = next(iter(found.validations.values())).fitted.plot().axes[0]
    measured, model = axes.lines[:2]
    assert (measured.get_label(), model.get_label()) == ("measured", "axebot")
    assert measured.get_zorder() > model.get_zorder()
    assert measured.get_linewidth() < 0.5 * model.get_linewidth()
    assert model.get_alpha() < 1.0


@pytest.fixture(scope="module")
def counted():
    """A fit to counts of 2048 a turn, without other noise."""
    run = omnidyn.simulate(ROBOT, excitation(20.0, seed=5), 0.01)
    tick = 2.0 * np.pi / 2048
    angle = np.cumsum(np.vstack([np.zeros(3), 0.5 * (run.wheel_speed[1:] + run.wheel_speed[:-1]) * 0.01]), axis=0)
    kept = omnidyn.Run(t=run.t, voltage=run.voltage, wheel_angle=np.floor(angle / tick) * tick, source="counts.csv")
    return omnidyn.identify([kept], ROBOT, omnidyn.OutputError(nuisances="none"))


def test_labels_of_residuals_are_whole_and_rounding_is_part_of_the_noise_of_counts(counted):
    """The names of the rows were cut, and errors of a tick were drawn as outliers of the noise before rounding."""
    validation = next(iter(counted.validations.values()))
    (fit,) = counted.fits.values()
    noise = _noise(fit, validation.scores["fitted"], validation.fitted)
    rounding = 2.0 * np.pi / 2048 / np.sqrt(12.0)
    assert all(0.9 * rounding < noise[key] < 2.0 * rounding for key in ("a1", "a2", "a3"))
    figure = draw_residuals(validation.fitted, noise).figure
    for words, box in shown_texts(figure):
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, words
        assert figure.bbox.y0 <= box.y0 <= box.y1 <= figure.bbox.y1, words


def test_numbers_have_their_plain_names_beside_their_keys(found):
    rows = {row[1]: row[0] for row in number_table(found.estimate).rows}
    assert rows["friction.axes.coulomb[0]"] == "Coulomb friction forward"


def test_of_many_logs_the_table_shows_the_gravest(found):
    """250 logs were 250 rows."""
    first, fatal = found.verdicts[0], Finding("dead", ERROR, "w1")
    many = [replace(first, source=f"{k}.csv", findings=(fatal,) if k == 40 else ()) for k in range(50)]
    table = verdict_table(many)
    assert len(table.rows) == 20
    assert table.rows[0][0] == "40.csv"
    assert table.rows[-1][0] == "and 31 more"
    assert table.rows[-1][-1].endswith("of all 50 logs, 49 have no error or warning")
    assert len(verdict_table(many[:20]).rows) == 20
