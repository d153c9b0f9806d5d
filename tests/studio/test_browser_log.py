"""Tabs Log and Fit in a real browser: each test ends in a number that a command prints for the same file."""

import re

import numpy as np
import pytest

import omnidyn
from omnidyn.document import in_clauses
from omnidyn.model.keys import Key, find_key
from tests.support.axebot_logs import excitation
from tests.support.pages import command, drop, laid_out, load_again, numbers, pick, shown, tab, verdict, write_log
from tests.support.pushed_logs import clean_log


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
    pick(page, option)


def choose_robot(page, name):
    """Choose the robot to start from."""
    tab(page, "Fit")
    page.click(".robot")
    pick(page, name)


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
    scale = "(p => p?.view && (p.view[1] - p.view[0]) / p.inner())(document.querySelector('omni-plot'))"
    per_pixel = page.wait_for_function(scale).json_value()  # the plot may just be drawn anew: one look, not two
    assert float(page.input_value("#offset")) == pytest.approx(100 * per_pixel, rel=0.03)
    page.click("#align")
    said = command("align", first, second, "--json")[0]
    assert said["offset"] == pytest.approx(2.345, abs=0.002)
    assert verdict(page, "#aligned") == laid_out(said["verdict"].replace(f"{tmp_path}/", ""))
    assert float(page.input_value("#offset")) == pytest.approx(said["offset"], abs=1e-6)
    page.wait_for_function(f"Math.abs(document.querySelector('omni-plot').second?.offset - {said['offset']}) < 1e-5")
    shown(page, "two-logs")
    page.get_by_text("The same by hand").first.click()
    assert page.inner_text("#align-call") == f"omnidyn align {first} {second}"
    choose_robot(page, "axebot")
    page.wait_for_selector("#fit:not([disabled])")
    page.get_by_label("use of camera.csv").get_by_text("hold out").click()
    page.click("#fit:not([disabled])")
    words = verdict(page, "#fit-verdict")
    said = command("identify", first, second, "--hold-out", second, "--robot", "axebot", "--json")[0]
    assert words == laid_out(said["verdict"])
    cells = numbers(page)
    assert all(cells[key] == f"{number['value']:.5g}" for key, number in said["parameters"].items())
    tab_plot = "[...document.querySelectorAll('omni-plot')].find((p) => p.meta?.title)"
    page.wait_for_function(f"{tab_plot}?.first?.shown")
    page.wait_for_function(f"{tab_plot}?.meta?.title === 'camera.csv (hold out)'")


def test_a_good_log_and_three_bad_ones_that_a_button_mends(browser, tmp_path):
    log = clean_log(omnidyn.load_robot("axebot"))
    good = omnidyn.Run(t=log.t, **log.channels)
    speed, plane = good.wheel_speed, (good.twist @ [1.0, 1.0j, 0.0]) * np.exp(1j * good.pose[:, 2])
    bad = {
        "exchanged": good.replace(wheel_speed=speed[:, [1, 0, 2]] * [1.0, -1.0, 1.0]),
        "rpm": good.replace(wheel_speed=speed * 60.0 / (2.0 * np.pi)),
        "room": good.replace(twist=np.column_stack([plane.real, plane.imag, good.twist[:, 2]])),
    }
    paths = {name: tmp_path / f"{name}.csv" for name in ("good", *bad)}
    for name, run in (("good", good), *bad.items()):
        omnidyn.write_run(run, paths[name])
    right = command("check", paths["good"], "--robot", "axebot", "--json")[0]["verdict"]
    studio, page = browser.start(paths["good"])
    verdict(page)
    choose_robot(page, "axebot")
    tab(page, "Log")
    page.get_by_text(in_clauses(right)[0]).first.wait_for()
    for name in bad:
        drop(page, paths[name])
        said = command("check", paths[name], "--robot", "axebot", "--json")[0]
        assert said["has_errors"]
        page.get_by_text(in_clauses(said["verdict"])[0]).first.wait_for()
        page.get_by_text("Apply this remedy").first.click()
        page.get_by_text(in_clauses(right)[0]).first.wait_for()
        saved = tmp_path / f"{name}.toml"
        link = page.locator("a[href$='/map']").first.get_attribute("href")
        saved.write_bytes(page.request.get(f"{studio.address}{link[1:]}").body())
        again = command("check", paths[name], "--robot", "axebot", "--map", saved, "--json")[0]
        assert again["verdict"] == right
        assert verdict(page) == laid_out(right)


def test_what_is_free_is_chosen_and_a_cancelled_fit_keeps_the_best_so_far(browser, tmp_path):
    robot, draws, path = omnidyn.load_robot("mecanum"), np.random.default_rng(1), tmp_path / "mecanum.csv"
    run = omnidyn.simulate(robot, np.repeat(draws.uniform(-10.0, 10.0, (250, 4)), 40, axis=0), 0.01)
    twist = run.twist + draws.standard_normal(run.twist.shape) * (0.01, 0.01, 0.05)
    omnidyn.write_run(omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist), path)
    studio, page = browser.start(path)
    verdict(page)
    choose_robot(page, "mecanum")
    page.click(".free")
    page.get_by_role("option", name=Key.parse("body.mass_kg").words, exact=True).click()
    page.keyboard.press("Escape")
    page.click("#fit:not([disabled])")
    page.wait_for_function("document.querySelector('#fit-progress')?.innerText.includes(', step')")
    assert re.fullmatch(r"\d+ s", page.inner_text("#fit-time"))
    page.click("#cancel-fit")
    assert "interrupted" in verdict(page, "#fit-verdict")
    assert "--free body.mass_kg" in page.text_content("#call")
    saved = tmp_path / "robot.toml"
    saved.write_bytes(page.request.get(f"{studio.address}fit/robot.toml").body())
    kept, cells = omnidyn.load_robot(saved), numbers(page)
    assert "body.mass_kg" in cells
    for key, cell in ((key, cell) for key, cell in cells.items() if find_key(key)):
        assert cell == f"{Key.parse(key).get(kept):.5g}", key


def test_the_robot_is_drawn_while_its_sizes_are_typed(browser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, page = browser.start()
    tab(page, "Fit")
    assert page.inner_text("#why") == "Add a log first: tab Log."
    tab(page, "Robot")
    page.get_by_text("Describe another robot").click()
    page.get_by_label("wheels stand at").fill("45,135,225,315")
    page.get_by_label("radius of a wheel").fill("0.06")
    page.get_by_label("centre to wheel").fill("0.2,0.2,0.2,0.25")
    drawn = "document.querySelector('omni-robot').wheels"
    page.wait_for_function(f"{drawn}.length === 4 && {drawn}[3][2] === 0.25 && {drawn}[0][1] === 0.06")
    shown(page, "robot")
    page.click("#make-robot")
    page.get_by_text("my-robot.toml").first.wait_for()
    sizes = ("--azimuth=45,135,225,315", "--wheel-radius=0.06", "--robot-radius=0.2,0.2,0.2,0.25", "--mass=3")
    assert command("init", "my-robot", *sizes)[1] == 0
    wheels = omnidyn.load_robot("my-robot.toml").wheels
    made = page.evaluate(drawn)
    assert [angle for angle, _, _ in made] == pytest.approx(wheels.azimuth_deg)
    assert [radius for _, _, radius in made] == pytest.approx(np.asarray(wheels.robot_radius))


def test_nothing_moves_under_the_mouse_while_it_is_drawn_or_opened(browser, tmp_path):
    _, page = browser.start(write_log(tmp_path / "log.csv"))
    verdict(page)
    waiting = []
    page.route("**/series/*", lambda route: waiting.append(route))  # signals come late
    load_again(page)
    page.wait_for_selector("omni-plot canvas")
    heights = """name => new Promise(done => { const seen = new Set(), element = document.querySelector(name);
        new ResizeObserver(() => seen.add(element.clientHeight)).observe(element);
        setTimeout(() => done([...seen].filter(height => height)), 600); })"""
    (before,) = page.evaluate(heights, "omni-plot canvas")
    for route in waiting:
        route.continue_()
    page.wait_for_function("document.querySelector('omni-plot').frames > 0")
    assert page.evaluate(heights, "omni-plot canvas") == [before]
    body = ".box:has(.columns) .q-expansion-item__content"
    page.evaluate(f"name => {{ window.seen = ({heights})(name); }}", body)
    page.get_by_text("Columns and units").click()
    assert len(page.evaluate("window.seen")) == 1
    page.get_by_label("vx_m_s is").click()
    assert page.get_by_role("option").count() > 30  # all rows: a list that gets more of them while it is scrolled jumps
