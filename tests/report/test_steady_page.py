"""The page of a study: whole, closed to the outside, with the numbers of the study on it."""

from pathlib import Path

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import MotorLine, SteadyState
from omnidyn.model.known.dead_zone import dead_zone
from omnidyn.model.robot_file import load_robot
from omnidyn.report.figures.motor_lines import draw_motor_lines
from omnidyn.report.figures.shapes import shape_pictures
from omnidyn.report.line_page import render_lines
from omnidyn.report.motors_page import render_motors
from omnidyn.report.steady_page import render_study
from omnidyn.run import Run
from tests.support.outputs import Reader
from tests.support.steady_logs import clean_runs, robot_with, spoiled

RECORD = {
    "omnidyn": "0.1.0",
    "command": "omnidyn identify <b>",
    "inputs": [{"role": "log", "name": f"run{k}.csv", "sha256": "ab" * 32} for k in range(24)],
}


@pytest.fixture(scope="module")
def study():
    rng = np.random.default_rng(0)
    runs = [spoiled(run, rng) for run in clean_runs(robot_with("ellipse"), range(0, 360, 30))]
    return identify(
        [*runs, *runs], load_robot("axebot"), SteadyState(), groups=["first"] * 12 + ["<second>"] * 12
    ).study


@pytest.fixture(scope="module")
def motors():
    t = np.arange(600) * 0.01
    speed = np.repeat([2.0, -3.0, 5.0, -6.0, 4.0, 1.0], 100)[:, None]
    angle = np.cumsum(np.vstack([[[0.0]], speed[:-1]]) * 0.01, axis=0)
    return identify([Run(t=t, voltage=0.5 * speed + 0.4 * np.sign(speed), wheel_angle=angle)], None, MotorLine()).study


@pytest.fixture(scope="module")
def page(study):
    return render_study(study, RECORD)


def test_it_is_whole_and_every_id_is_there_once(page):
    ids = Reader(page).all("id")
    assert len(ids) == len(set(ids))
    assert {
        "findings",
        "levels",
        "dead-zone",
        "data",
        "shapes",
        "forces",
        "warnings",
        "next",
        "made",
        "force_polar",
    } <= set(ids)


def test_it_asks_for_nothing_from_outside_and_runs_nothing(page, motors):
    for text in (page, render_motors(motors, RECORD)):
        read = Reader(text)
        links = [*read.all("src"), *read.all("href")]
        assert links
        assert all(link.startswith(("data:", "#")) for link in links)
        assert not {"script", "iframe", "object", "embed", "form"} & set(read.tags)
        assert not [name for _, name, _ in read.values if name.startswith("on") or name == "style"]


def test_each_group_has_its_dead_zone(page, study):
    text = Reader(page).text
    for estimate in study.estimates.values():
        x = dead_zone(estimate.robot).rows[0]
        assert x.scale_interval[0] < x.scale < x.scale_interval[1]
        assert f"{x.scale_interval[0]:.3f} to {x.scale_interval[1]:.3f}" in text


def test_forces_around_the_robot_look_as_its_paths_do(study):
    """The numbers on the rings stand on a ground of their own, above marks and lines."""
    polar = next(each for each in shape_pictures(study) if each.name == "force_polar").figure
    labels = polar.axes[0].get_yticklabels()
    assert labels
    assert all(label.get_bbox_patch() is not None for label in labels)


def test_names_of_groups_are_text(page):
    assert "<second>" in Reader(page).text
    assert "<second>" not in page


def test_the_numbers_of_the_study_are_on_it(study, page):
    text = Reader(page).text
    for words in (*study.statements, *study.warnings, *study.advice):
        assert str(words) in text
    for group, travel in study.travel.items():
        assert f"{travel.mean:.2f}" in text, group
    assert f"{study.choice.score.loo:.2f}" in text
    assert "24 inputs with their hashes" in text


def test_a_table_of_points_and_the_line_of_logs_have_a_page(tmp_path, capsys):
    page, table = tmp_path / "page.html", Path(__file__).parents[2] / "examples" / "table1.csv"
    assert main(["identify", str(table), "--robot", "axebot", "--rest", "line", "--report", str(page)]) == 0
    assert f"wrote {page}" in capsys.readouterr().err
    text = Reader(page.read_text("utf-8")).text
    for value in ("0.9382", "2.186", "0.9659", "1.522"):  # B and C of x and y: numpy.polyfit of the rows of the table
        assert value in text
    assert {"friction", "numbers", "warnings", "dead-zone"} <= set(Reader(page.read_text("utf-8")).all("id"))
    lines = identify(
        clean_runs(robot_with("box"), range(0, 360, 90), (0.2, 0.4)), load_robot("axebot"), SteadyState(shape="line")
    )
    assert "2.4" in Reader(render_lines(lines, RECORD)).text


def test_the_same_study_gives_the_same_page(study, page):
    assert render_study(study, RECORD) == page


def test_pictures_have_names_captions_and_both_formats(study, motors):
    pictures = [*shape_pictures(study), draw_motor_lines(motors.motors, motors.windows)]
    assert len({each.name for each in pictures}) == 4
    for each in pictures:
        assert each.caption.endswith(".")
        assert each.png.startswith(b"\x89PNG")
        assert b"<svg" in each.svg
