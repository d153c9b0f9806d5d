"""Tabs Log and Fit in a real browser: each test ends in a number that a command prints for the same file."""

import numpy as np
import pytest

import omnidyn
from tests.support.axebot_logs import excitation
from tests.support.pages import command, shown, verdict


def cut(path, begin, every, seed):
    """A log of one drive that begins later, with rows and noise of its own."""
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), np.repeat(excitation(20.0), 10, axis=0), 0.001)
    rows, draws = slice(begin, None, every), np.random.default_rng(seed)
    twist = run.twist[rows] + draws.standard_normal(run.twist[rows].shape) * (0.01, 0.01, 0.05)
    omnidyn.write_run(omnidyn.Run(t=run.t[rows] - run.t[begin], voltage=run.voltage[rows], twist=twist), path)
    return path


def choose(page, name, option):
    """Choose of a list."""
    page.click(f"#{name}")
    page.get_by_role("option", name=option, exact=True).click()


def test_two_logs_are_put_on_one_time_axis(browser, tmp_path):
    first, second = cut(tmp_path / "robot.csv", 0, 10, 1), cut(tmp_path / "camera.csv", 2345, 20, 2)
    _, page = browser.start(second, first)
    verdict(page)
    choose(page, "other-log", "camera.csv")
    page.wait_for_function("document.querySelector('omni-plot').second?.shown")
    box = page.locator("omni-plot canvas").bounding_box()
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + 300, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 400, box["y"] + 60)
    page.mouse.up()
    page.keyboard.up("Shift")
    page.wait_for_function("+(document.querySelector('#offset')?.value || 0) !== 0")
    page.wait_for_function("document.querySelector('omni-plot').view")
    per_pixel = page.evaluate("(p => (p.view[1] - p.view[0]) / p.inner())(document.querySelector('omni-plot'))")
    assert float(page.input_value("#offset")) == pytest.approx(100 * per_pixel, rel=0.03)
    page.click("#align")
    said = command("align", first, second, "--json")[0]
    assert said["offset"] == pytest.approx(2.345, abs=0.002)
    assert verdict(page, "#aligned") == said["verdict"].replace(f"{tmp_path}/", "")
    assert float(page.input_value("#offset")) == pytest.approx(said["offset"], abs=1e-6)
    page.wait_for_function(f"Math.abs(document.querySelector('omni-plot').second.offset - {said['offset']}) < 1e-5")
    shown(page, "two-logs")
    page.get_by_text("The same by hand").first.click()
    assert page.inner_text("#align-call") == f"omnidyn align {first} {second}"
