"""Remedies of reading: a clean log is broken, and read with the remedy of its finding holds the clean numbers again."""

import numpy as np
import pytest

import omnidyn
from omnidyn.findings.check import check_log
from omnidyn.findings.remedies import remedied
from omnidyn.logs.columns.mapping import load_map, save_map
from omnidyn.logs.read_log import LogOptions, recorded_log
from tests.support.pushed_logs import clean_log

ROBOT = omnidyn.load_robot("axebot")
ANGLE = np.radians(20.0)


@pytest.fixture(scope="module")
def clean():
    """Voltage, current, wheel speed, twist and pose of a simulated run."""
    return clean_log(ROBOT)


def swap(t, c):
    c["wheel_speed"] = c["wheel_speed"][:, [1, 0, 2]] * [1.0, -1.0, 1.0]


def turn_about(t, c):
    c["current"][:, 1] *= -1.0


def motors(t, c):
    for name in ("voltage", "current", "wheel_speed"):
        c[name] = c[name][:, [1, 0, 2]]


def mirrored(t, c):
    c["twist"] *= [1.0, -1.0, -1.0]
    c["pose"] *= [1.0, -1.0, -1.0]


def turns_a_minute(t, c):
    c["wheel_speed"] *= 60.0 / (2.0 * np.pi)


def milliamperes(t, c):
    c["current"] *= 1e3


def as_duty(t, c):
    c["voltage"] /= ROBOT.motor.voltage_limit


def without_sign(t, c):
    c["current"] = np.abs(c["current"])


def late(t, c):
    c["current"] = np.vstack([c["current"][:3], c["current"][:-3]])


def marker(t, c):
    c["pose"][:, 2] += ANGLE


def in_the_room(t, c):
    plane = (c["twist"] @ [1.0, 1.0j, 0.0]) * np.exp(1j * c["pose"][:, 2])
    c["twist"] = np.column_stack([plane.real, plane.imag, c["twist"][:, 2]])


def mounted_askew(t, c):
    plane = (c["twist"] @ [1.0, 1.0j, 0.0]) * np.exp(1j * ANGLE)
    c["twist"] = np.column_stack([plane.real, plane.imag, c["twist"][:, 2]])


CASES = {
    swap: ("swapped", "inverted"),
    turn_about: ("inverted",),
    motors: ("swapped",),
    mirrored: ("inverted", "swapped"),
    turns_a_minute: ("unit",),
    milliamperes: ("unit",),
    as_duty: ("unit",),
    without_sign: ("unsigned",),
    late: ("lag",),
    marker: ("marker_angle",),
    in_the_room: ("twist_frame",),
    mounted_askew: ("twist_frame",),
}


def broken(clean, damage, path):
    """The log with a fault, as a file."""
    t, channels = clean.t.copy(), {name: values.copy() for name, values in clean.channels.items()}
    damage(t, channels)
    omnidyn.write_run(omnidyn.Run(t=t, **channels), path)
    return path


@pytest.mark.parametrize("damage", CASES, ids=lambda damage: damage.__name__)
def test_what_a_remedy_reads_is_the_clean_log(clean, damage, tmp_path):
    path = broken(clean, damage, tmp_path / "log.csv")
    log = recorded_log(path, ROBOT)
    found = [f for f in check_log(log, ROBOT).findings if f.code in CASES[damage]]
    assert found, [(f.code, f.subject) for f in check_log(log, ROBOT).findings]
    options = remedied(found[0], LogOptions(), log.columns)
    assert options is not None, found[0]
    assert found[0].remedy_text
    if options.columns is not None:  # what a studio does: the map as a file
        options = LogOptions(columns=load_map(save_map(options.columns, tmp_path / "map.toml")))
    mended = recorded_log(path, ROBOT, options)
    left = {(f.code, f.subject, f.severity) for f in check_log(mended, ROBOT).findings}
    assert not left & {(f.code, f.subject, f.severity) for f in found}
    tolerance = 0.03 if damage in (late, marker, mounted_askew) else 1e-4  # of angles and lags as they were found
    run = mended.to_run()
    truths = dict(clean.channels)
    if damage is without_sign:
        truths["current"] = np.abs(truths["current"]) * np.sign(truths["voltage"])
    for name, truth in truths.items():
        got, factor = (
            (run.duty, ROBOT.motor.voltage_limit)
            if name == "voltage" and damage is as_duty
            else (
                getattr(run, name),
                1.0,
            )
        )
        for column, true_column in zip(factor * got.T, truth.T, strict=True):
            known = np.isfinite(column)
            again = np.interp(clean.t[20:-20], run.t[known], column[known])
            np.testing.assert_allclose(again, true_column[20:-20], atol=tolerance * np.abs(true_column).max())


def test_what_is_no_matter_of_reading_has_no_such_remedy(clean, tmp_path):
    path = broken(clean, lambda t, c: c["wheel_speed"].__setitem__((slice(900, 1200), 1), 3.0), tmp_path / "stuck.csv")
    log = recorded_log(path, ROBOT)
    findings = check_log(log, ROBOT).findings
    assert "stuck" in {f.code for f in findings}
    assert all(remedied(f, LogOptions(), log.columns) is None for f in findings)
