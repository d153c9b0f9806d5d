"""Tracks, comparisons and workspaces in a real browser: each test ends in what a command prints for the same file."""

import re
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.model.keys import Key
from tests.support.pages import choose_axebot, command, laid_out, load_again, numbers, shown, tab, verdict, write_log


def choose(page, name, *options):
    """Choose of a list."""
    page.click(f".{name}:visible")
    for option in options:
        page.get_by_role("option", name=option, exact=True).click()
    if len(options) > 1:
        page.keyboard.press("Escape")
    page.wait_for_function("!document.querySelector('[role=option]')")


def rows(page, name):
    """First cell -> the other cells of a table."""
    cells = [
        [cell.inner_text().strip() for cell in row.locator("td").all()]
        for row in page.locator(f"#{name} tbody tr").all()
    ]
    return {row[0]: row[1:] for row in cells}


def assert_tracked(page, *words):
    """The table of the page has the numbers that `omnidyn track` prints, and the same verdict."""
    said, code, trouble = command("track", *words, "--json")
    assert code == 0, trouble
    shown_rows = rows(page, "tracked")
    assert list(shown_rows) == [controller["name"] for controller in said["controllers"]]
    for controller in said["controllers"]:
        cells = shown_rows[controller["name"]]
        assert cells[0] == f"{1e3 * controller['rmse_position_m']:.3f}"
        assert cells[2] == f"{1e3 * controller['worst_position_m']:.2f}"
        assert cells[4] == f"{controller['effort_V']:.2f}"
    assert verdict(page, "#track-verdict") == laid_out(said["verdict"])
    return said


def test_controllers_side_by_side(browser, tmp_path):
    studio, page = browser.start()
    tab(page, "Track")
    assert page.is_disabled("#track")
    assert page.inner_text("#why-track") == "Choose a robot first."
    choose(page, "robot", "axebot")
    page.get_by_label("size [m]").fill("0.4")
    page.click("#track:not([disabled])")
    verdict(page, "#track-verdict")
    said = assert_tracked(page, "axebot", "--path", "eight:size_m=0.4", "--controller", "pid", "--controller", "mpc")
    page.wait_for_function("document.querySelector('omni-track').motion && document.querySelector('omni-plot').frames")
    page.focus("input[name=time]")
    page.keyboard.press("End")
    run = tmp_path / "run.csv"
    run.write_bytes(page.request.get(f"{studio.address}track/run-1.csv").body())
    driven = omnidyn.read_log(run)
    x, y, _ = driven.pose[-1] - omnidyn.path("eight:size_m=0.4").at(driven.t[-1]).pose
    text = page.inner_text("omni-track .state")
    assert float(text.partition("pid ")[2].split()[0]) == pytest.approx(1e3 * np.hypot(x, y), abs=6e-4)
    page.keyboard.press("Home")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("document.querySelector('omni-track').frame > 70")
    page.get_by_role("button", name="Pause").click()
    shown(page, "track")
    page.get_by_text("The same by hand").last.click()
    call = "omnidyn track axebot --path eight:size_m=0.4 --controller pid --controller mpc"
    assert page.inner_text("#call-track") == call
    load_again(page)
    tab(page, "Track")
    assert verdict(page, "#track-verdict") == laid_out(said["verdict"])
    page.get_by_label("rounds").fill("900")
    page.click("#track:not([disabled])")
    page.get_by_text(re.compile(r"tracking with pid, [1-9]\d* %")).wait_for()
    page.click("#cancel-track", delay=500)  # as a hand does: longer than the words beside it stand
    page.wait_for_selector("#cancel-track", state="detached")
    page.wait_for_selector("#track:not([disabled])")
    assert not page.is_visible("#track-verdict")


def test_a_drawn_path_is_the_file_that_track_takes_and_a_bad_one_is_told(browser, tmp_path):
    studio, page = browser.start()
    tab(page, "Track")
    choose(page, "robot", "axebot")
    page.locator(".controllers .q-chip__icon--remove").nth(1).click()
    choose(page, "path", "drawn.csv")
    page.wait_for_selector("omni-path canvas")
    assert page.inner_text("#why-track") == "Draw a path first."
    box = page.locator("omni-path canvas").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.move(middle[0] + 120, middle[1])
    page.mouse.down()
    for angle in np.linspace(0.0, 6.0, 40):
        page.mouse.move(middle[0] + 120 * np.cos(angle), middle[1] - 120 * np.sin(angle))
    page.mouse.up()
    page.get_by_text("closed").click()
    page.click("#track:not([disabled])")
    verdict(page, "#track-verdict")
    shown(page, "track-drawn")
    path = tmp_path / "drawn.csv"
    path.write_bytes(page.request.get(f"{studio.address}track/drawn.csv").body())
    drawn = np.genfromtxt(path, delimiter=",", names=True)
    radius = 120 * 3.0 / box["width"]
    assert np.hypot(drawn["x_m"], drawn["y_m"]) == pytest.approx(radius, abs=0.01)
    assert drawn["t_s"][-1] == pytest.approx(2 * np.pi * radius / 0.3, rel=0.02)
    said, code, words = command("track", "axebot", "--path", path, "--json")
    assert code == 0, words
    assert rows(page, "tracked")["pid"][0] == f"{1e3 * said['controllers'][0]['rmse_position_m']:.3f}"
    page.get_by_role("button", name="Clear").click()
    page.focus("omni-path canvas")
    for key in ("Enter", *["ArrowRight"] * 5, "Enter", *["ArrowUp"] * 3, "Enter", "Enter", "Backspace", "Enter"):
        page.keyboard.press(key)
    page.wait_for_selector("omni-path[data-count='3']")
    page.get_by_label("speed [m/s]").fill("fast")
    page.click("#track:not([disabled])")
    page.get_by_text("expected 0.001 to 100 m/s").wait_for()
    page.get_by_label("speed [m/s]").fill("0.2")
    page.click("#track:not([disabled])")
    page.get_by_text("axebot along drawn.csv: 346 steps").wait_for()
    bad = tmp_path / "bad.csv"
    bad.write_text("t_s,x_m,y_m\n0,0,0\n1,1,1\n", "utf-8")
    page.set_input_files("omni-drop[kind=track] + input", str(bad))
    page.get_by_text("bad.csv").first.wait_for()
    page.click("#track:not([disabled])")
    page.get_by_text("no path in this file").wait_for()
    words = command("track", "axebot", "--path", bad)[2].strip().removeprefix("omnidyn: error: ").splitlines()[0]
    assert verdict(page, "#track-verdict") == laid_out(words.replace(f"{tmp_path}/", ""))


def test_robots_and_fits_over_the_same_logs(browser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names without folders, as in the documentation
    first, second = write_log("monday.csv", 8.0), write_log("tuesday.csv", 8.0, 2)
    _, page = browser.start(first, second)
    tab(page, "Compare")
    assert page.inner_text("#why-compare") == "Choose a robot first."
    choose(page, "robot-a", "axebot")
    choose(page, "robot-b", "robotino")
    page.click("#compare:not([disabled])")
    page.wait_for_selector("#compared")
    said, code, words = command("compare", first, second, "--robot", "axebot", "--robot", "robotino", "--json")
    assert code == 0, words
    assert verdict(page, "#compare-verdict") == laid_out(said["verdict"])
    table = rows(page, "compared")
    assert list(table) == list(said["difference"])
    for name, gap in said["difference"].items():
        rmse = [f"{said['robots'][robot]['overall'][name]['rmse']:.4g}" for robot in ("axebot", "robotino")]
        assert table[name] == [said["units"][name], *rmse, gap["better"] or "cannot tell"]
    page.wait_for_function("document.querySelector('omni-plot').frames")
    page.get_by_role("button", name="tuesday.csv").click()
    page.wait_for_function("document.querySelector('omni-plot').frames > 1")
    shown(page, "compare")


def test_fits_are_compared_and_come_back_in_a_workspace(browser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names without folders, as in the documentation
    heavier = Key.parse("friction.axes.coulomb[0]").set(omnidyn.load_robot("axebot"), 3.0)
    first, second = write_log("monday.csv", 12.0), write_log("tuesday.csv", 12.0, 2, robot=heavier)
    later = Path("later.toml")
    assert command("identify", second, "--robot", "axebot", "--quick", "-o", later, "--json")[1] == 0
    studio, page = browser.start(first)
    choose_axebot(page)
    page.click("#fit:not([disabled])")
    fit_words, fit_numbers = verdict(page, "#fit-verdict"), numbers(page)
    tab(page, "Compare")
    choose(page, "robot-b", "fit-1.toml")
    page.click("#compare:not([disabled])")
    page.wait_for_selector("#compared")
    fit = Path("fit-1.toml")
    fit.write_bytes(page.request.get(f"{studio.address}robot/fit-1.toml").body())
    said = command("compare", first, "--robot", "axebot", "--robot", fit, "--json")[0]
    assert verdict(page, "#compare-verdict") == laid_out(said["verdict"])
    for name, scores in said["robots"]["axebot, fit-1"]["overall"].items():
        assert rows(page, "compared")[name][2] == f"{scores['rmse']:.4g}"
    page.set_input_files("omni-drop[kind=fit] + input", str(later))
    page.get_by_role("link", name="later.toml").wait_for()
    choose(page, "fits", "fit-1.toml", "later.toml")
    page.click("#drift:not([disabled])")
    page.wait_for_selector("#drifted")
    drift = command("drift", fit, later, "--json")[0]
    assert verdict(page, "#drift-verdict") == laid_out(drift["verdict"])
    number = drift["numbers"]["friction.axes.coulomb[0]"]
    assert number["changed"]
    cells = [row.inner_text() for row in page.locator("#drifted tbody tr").all()]
    row = next(k for k, text in enumerate(cells) if "friction.axes.coulomb[0]" in text)
    for text, name in zip(cells[row : row + 2], (fit, later), strict=True):
        assert f"{number['fits'][str(name)]['value']:.4g}" in text
    assert page.evaluate("document.querySelector('img.picture').naturalWidth") > 400
    shown(page, "drift")
    kept = Path("workspace.zip")
    kept.write_bytes(page.request.get(f"{studio.address}workspace").body())
    _, again = browser.start(kept)
    assert verdict(again).startswith("Usable for whole logs")
    tab(again, "Fit")
    assert verdict(again, "#fit-verdict") == fit_words
    assert numbers(again) == fit_numbers
    again.click("#fit:not([disabled])")
    again.get_by_text("History (2)").wait_for()
    assert numbers(again) == fit_numbers
    tab(again, "Compare")
    again.get_by_role("link", name="later.toml").wait_for()
    tab(again, "Log")
    again.wait_for_selector("#example")
    again.set_input_files("omni-drop:not([kind]) + input", str(kept))
    again.get_by_text("Drop a log here").wait_for()
    tab(again, "Fit")
    again.get_by_text(re.compile(r"monday\.csv, monday-\d+\.csv, from axebot")).wait_for()
