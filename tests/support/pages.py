"""What tests of the studio share: the same by the command line, logs, and what is done on a page and read from it."""

import contextlib
import json
import os
import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

import omnidyn
from omnidyn.cli import main
from omnidyn.document import in_clauses
from tests.support.axebot_logs import excitation


def command(*words):
    """What a command prints for machines, and its exit code."""
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main([str(word) for word in words])
    return (json.loads(out.getvalue()) if out.getvalue().startswith("{") else {}), code, err.getvalue()


def write_log(path, seconds=20.0, seed=1, change=None, robot=None):
    """A log of the axebot, or another robot: voltages and a noisy twist."""
    robot, draws = robot or omnidyn.load_robot("axebot"), np.random.default_rng(seed)
    run = omnidyn.simulate(robot, excitation(seconds, seed=seed), 0.01)
    twist = run.twist + draws.standard_normal(run.twist.shape) * (0.01, 0.01, 0.05)
    if change is not None:
        change(twist)
    omnidyn.write_run(omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist), path)
    return path


def drop(page, path):
    """Give a file to the page, as a user who clicks the place for files."""
    page.set_input_files("input[type=file] >> nth=0", str(path))


def tab(page, name):
    """Go to a tab."""
    page.get_by_role("tab", name=name).click()


def verdict(page, name="#verdict"):
    """The verdict on top, as `laid_out` writes it, without the mark before it."""
    texts = "name => (all => all.length && all.map(e => e.innerText))([...document.querySelectorAll(`${name} .text`)])"
    return "\n".join(page.wait_for_function(texts, arg=name).json_value())


def laid_out(words):
    """A verdict as a page has it: its line, then a line for each point."""
    line, clauses = in_clauses(words)
    return "\n".join((line, *clauses))


def as_flags(text):
    """Options as the command line writes them."""
    return re.sub(r"`([a-z_]+)`", lambda match: f"--{match[1].replace('_', '-')}", text)


def load_again(page):
    """Load the page anew, as a user who waits until something is there."""
    page.reload()
    page.wait_for_selector(".panels .q-tab-panel")


def pick(page, option):
    """Take an option of the list that is open, and wait until the list is gone."""
    page.get_by_role("option", name=option, exact=True).click()
    page.wait_for_function("!document.querySelector('[role=option]')")


def choose_axebot(page):
    """Choose the robot to start from."""
    tab(page, "Fit")
    page.click(".robot")
    pick(page, "axebot")


def numbers(page):
    """Key -> value of the table of a fit."""
    rows = page.locator("#numbers tbody tr").all()
    cells = [[cell.inner_text().strip() for cell in row.locator("td").all()] for row in rows]
    return {row[1]: row[2] for row in cells}


def shown(page, name):
    """Look at a tab as it is, narrow in the dark and wide in the light: nothing is wider than the page, and axe finds
    nothing.

    Pictures go to the folder OMNIDYN_PICTURES, in light as the documentation has them, and in dark.
    """
    folder, now = os.environ.get("OMNIDYN_PICTURES"), page.viewport_size
    for width, scheme in ((420, "light"), (420, "dark"), (1400, "dark"), (1400, "light")):
        if not folder and (width, scheme) not in ((420, "dark"), (1400, "light")):
            continue
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(500)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if folder:
            page.mouse.move(0, 0)
            page.evaluate("scrollTo(0, 0)")
            kind = f"{'-narrow' * (width < 1000)}{'-dark' * (scheme == 'dark')}"
            page.screenshot(path=Path(folder) / f"studio-{name}{kind}.png", full_page=True)
        assert not _faults(page)
    page.emulate_media(color_scheme="light")
    page.set_viewport_size(now)


def _faults(page):
    """What axe finds; nothing where it is not installed."""
    with contextlib.suppress(ImportError):
        from axe_playwright_python.sync_playwright import Axe

        found = Axe().run(page).response["violations"]
        return [f"{fault['id']}: {[node['html'] for node in fault['nodes']][:3]}" for fault in found]
