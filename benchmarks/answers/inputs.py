"""What the cases of answers.py are run on: robot files, command files and logs, the same whenever they are made.

Logs are simulated with noise of fixed seeds and written with 9 digits; files that a reader must refuse are among them.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import omnidyn

ROOT = Path(__file__).resolve().parents[2]
STEP = 0.01  # [s] of all logs

ROBOT = """schema = 1
name = "{name}"
[body]
mass_kg = 1.5
inertia_kg_m2 = 0.025
{body}
[wheels]
azimuth_deg = [180.0, -60.0, 60.0]
robot_radius_m = 0.1
wheel_radius_m = 0.035
[motor]
torque_constant_Nm_A = 0.0059
emf_constant_Vs_rad = 0.0059
gear_ratio = 19.0
voltage_limit_V = 6.0
{motor}
{drive}
{friction}
"""
PLAIN, COIL = "resistance_ohm = 1.69", "resistance_ohm = 1.69\ninductance_H = 0.02\nelectrical = 'dynamic'"
BOX = "[friction.axes]\nviscous = [0.94, 0.96, 0.01]\ncoulomb = [2.2, 1.5, 0.099]"
STICKY = f"{BOX}\nbreakaway = [2.8, 2.0, 0.14]"
ROUGH = BOX.replace("2.2", "2.6")
GUESS = "[friction.axes]\nviscous = [0.6, 0.6, 0.02]\ncoulomb = [1.6, 1.9, 0.07]"
DISC = "[friction.direction]\ncoulomb = [2.0, 2.0]\nviscous = 0.5\nyaw_coulomb = 0.099\nyaw_viscous = 0.01"
ELLIPSE = DISC.replace("[2.0, 2.0]", "[2.4, 1.6]\nbreakaway = [2.6, 1.9]")
WHEELS = "[friction.wheels]\ncoulomb = [0.7, 0.9, 0.8]\ncoulomb_backward = 1.0\nviscous = 0.3"
PRIOR = BOX.replace("2.2", "{ value = 2.0, std = 0.1, source = 'datasheet' }")
DRIVER = "current_limit_A = 2.5\nvoltage_drop_V = 0.3\ngear_efficiency = 0.8"
LIMITS = f"{PLAIN}\n{DRIVER}"
UNEQUAL = "resistance_ohm = [1.69, 1.8, 1.6]"
DUTY = "[drive]\nkind = 'duty'\nsupply_V = 6.0\noff = '{}'"
LOOP = "[drive]\nkind = 'speed'\nkp_V_s_rad = 0.3\nki_V_rad = 2.0\nrate_Hz = 200.0"
TURNING = "rotating_frame = true"
ROBOTS: dict[str, tuple[str, str, str, str]] = {  # body, motor, drive, friction
    "box": ("", PLAIN, "", BOX),
    "rough": ("", PLAIN, "", ROUGH),
    "guess": ("", PLAIN, "", GUESS),
    "sticky": ("", PLAIN, "", STICKY),
    "prior": ("", PLAIN, "", PRIOR),
    "disc": ("", PLAIN, "", DISC),
    "ellipse": (TURNING, PLAIN, "", ELLIPSE),
    "wheels": ("", PLAIN, "", WHEELS),
    "mixed": (TURNING, LIMITS, "", f"{DISC}\n{WHEELS}"),
    "unequal": ("", UNEQUAL, "", BOX),
    "limits": ("", LIMITS, "", BOX),
    "duty": ("", PLAIN, DUTY.format("brake"), BOX),
    "coast": ("", PLAIN, DUTY.format("coast"), BOX),
    "loop": ("", PLAIN, LOOP, BOX),
    "loopdisc": ("", PLAIN, LOOP, DISC),
    "looprough": ("", PLAIN, LOOP, DISC.replace("2.0", "2.6")),
    "dynamic": ("", COIL, "", BOX),
    "dynamicmixed": ("", f"{COIL}\n{DRIVER}", "", DISC),
    "free": ("", PLAIN, "", ""),
    "weak": ("", f"{PLAIN}\nvoltage_drop_V = 5.5", "", BOX),
    "bad_key": ("weight = 1.0", PLAIN, "", BOX),
    "bad_range": ("", "resistance_ohm = -1.0", "", BOX),
    "bad_text": ("", "resistance_ohm = 'much'", "", BOX),
    "bad_toml": ("= 3", PLAIN, "", BOX),
    "bad_law": ("", PLAIN, "", f"{BOX}\nlaw = 'stribeck'"),
    "bad_level": ("", PLAIN, "", f"{BOX}\nbreakaway = [1,1,1]"),
    "bad_loop": ("", PLAIN, "[drive]\nkind = 'speed'", BOX),
    "bad_coil": ("", COIL.replace("inductance_H = 0.02", ""), "", BOX),
}

TEXTS = {
    "u.csv": "t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n0.5,0,0,0\n1,1,1,1\n1.5,-4,2,2.5\n",
    "low.csv": "t_s,u1_V,u2_V,u3_V\n0,0,0.6,-0.6\n1,0,0,0\n",
    "high.csv": "t_s,u1_V,u2_V,u3_V\n0,0,30,-30\n1,0,0,0\n",
    "u4.csv": "t_s,u1_V,u2_V,u3_V,u4_V\n0,3,3,-3,-3\n0.5,0,0,0,0\n1,1,1,1,1\n",
    "d.csv": "t_s,d1_duty,d2_duty,d3_duty\n0,0,0.5,-0.5\n0.5,0,0,0\n1,0.3,0.3,0.3\n",
    "ds.csv": "t_s,d1_duty,d2_duty,d3_duty,supply_V\n0,0,0.5,-0.5,6\n0.5,0,0,0,5.8\n1,0.3,0.3,0.3,5.5\n",
    "w.csv": "t_s,w1_cmd_rad_s,w2_cmd_rad_s,w3_cmd_rad_s\n0,0,5,-5\n1,3,3,3\n2,0,0,0\n",
    "c.csv": "t_s,vx_cmd_m_s,vy_cmd_m_s,omega_cmd_rad_s\n0,0.3,0,0\n1,0,0.2,0.5\n2,0,0,0\n",
    "one.csv": "t_s,u1_V,u2_V,u3_V\n0,1,1,1\n",
    "empty.csv": "",
    "nan.csv": "t_s,u1_V,u2_V,u3_V\n0,nan,3,-3\n1,0,0,0\n",
    "inf.csv": "t_s,u1_V,u2_V,u3_V\n0,1e400,3,-3\n1,0,0,0\n",
    "cells.csv": "t_s,u1_V,u2_V,u3_V\n0,1,2\n1,0,0,0\n",
    "back.csv": "t_s,u1_V,u2_V,u3_V\n1,0,3,-3\n0,0,0,0\n",
    "twice.csv": "t_s,u1_V,u2_V,u3_V\n1,0,3,-3\n1,0,0,0\n",
    "names.csv": "t_s,u1_V,u2_V,wind\n1,0,3,-3\n2,0,0,0\n",
    "few.csv": "axis,speed,force\nx,0.4,2.5\nx,0.7,2.8\n",
    "badtable.csv": "axis,speed,force\nz,0.4,2.5\nx,0.7,2.8\n",
    "stds.csv": "axis,speed,force,speed_std,force_std\nx,0.4,2.5,0.01,0.1\nx,0.7,2.9,0.01,0.1\nx,1,3.1,0.02,0.1\n"
    "v_n,0.4,1.9,0.01,0.05\nv_n,-0.7,-2.1,0.01,0.05\nv_n,1,2.5,0.01,0.05\n",
    "noequal.csv": "axis,speed,force\nx,0.4,-2.5\nx,0.7,-2.8\nx,0.9,-3.5\n",
    "places.toml": "schema = 1\n"
    + "".join(
        f"[{n}]\ncolumn = '{column}'\nunit = '{unit}'\n"
        for n, column, unit in (
            ("t", "count", "ms"),
            ("w1", "front", "rad/s"),
            ("w2", "left", "rad/s"),
            ("w3", "right", "rad/s"),
            ("vx", "vx_m_s", "m/s"),
            ("vy", "vy_m_s", "m/s"),
            ("omega", "omega_rad_s", "rad/s"),
        )
    ),
    "log.json": '{"t": [1, 2]}',
    "words.txt": "these are words\nand no numbers\n",
}

COLUMNS = {
    "voltage": "u{}_V",
    "duty": "d{}_duty",
    "current": "i{}_A",
    "wheel_angle": "a{}_rad",
    "wheel_speed": "w{}_rad_s",
    "wheel_speed_command": "w{}_cmd_rad_s",
    "twist": ("vx_m_s", "vy_m_s", "omega_rad_s"),
    "twist_command": ("vx_cmd_m_s", "vy_cmd_m_s", "omega_cmd_rad_s"),
    "pose": ("x_m", "y_m", "heading_rad"),
    "supply": ("supply_V",),
}
NOISE: dict[str, Any] = {
    "twist": np.array([0.02, 0.02, 0.1]),
    "wheel_speed": 0.3,
    "current": 0.03,
    "pose": np.array([2e-3, 2e-3, 5e-3]),
    "wheel_angle": 0.002,
}
Table = dict[str, Any]  # name of a column -> its cells


def write(name: str, table: Mapping[str, Any], separator: str = ",", point: str = ".", head: str = "") -> None:
    """A text table; numbers with 9 digits, NaN as an empty cell."""
    rows = [separator.join(table)] if not head.startswith("!") else []
    for row in zip(*table.values(), strict=True):
        cells = (x if isinstance(x, str) else "" if np.isnan(x) else f"{x:.9g}".replace(".", point) for x in row)
        rows.append(separator.join(cells))
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(head.lstrip("!") + "\n".join(rows) + "\n", "utf-8")


def levels(seconds: float, seed: int, size: float = 4.5) -> np.ndarray:
    """Voltages [V], shape (n, 3): a rest, then levels held 0.2 to 0.6 s in changing directions, and ramps."""
    rng = np.random.default_rng(seed)
    pattern = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [0.5, 0.5, 0.5]])
    n, row, out = round(seconds / STEP), 20, np.zeros((round(seconds / STEP), 3))
    while row < n:
        end = min(n, row + int(rng.uniform(20, 60)))
        level = (rng.uniform(-1.0, 1.0, 3) * (rng.random(3) < 0.6)) @ pattern * size
        out[row:end] = level * (np.linspace(0.0, 1.0, end - row)[:, None] if rng.random() < 0.3 else 1.0)
        row = end
    return np.clip(out, -6.0, 6.0).round(4)


def table_of(run: Any, channels: Sequence[str], seed: int, quiet: float = 1.0) -> Table:
    """Time and these channels of a Run as instruments with noise record them."""
    rng, table = np.random.default_rng(1000 + seed), {"t_s": run.t}
    for channel in channels:
        turned = channel == "wheel_angle"  # not simulated: what the speeds add up to
        values = run.wheel_speed if turned else getattr(run, channel)
        if turned:
            values = np.cumsum(np.vstack([0.0 * values[:1], (values[1:] + values[:-1]) / 2.0]), axis=0) * STEP
        values = values + quiet * NOISE.get(channel, 0.0) * rng.normal(size=values.shape)
        names = COLUMNS[channel]
        values = values[:, None] if values.ndim == 1 else values
        for k, column in enumerate(values.T):
            table[names.format(k + 1) if isinstance(names, str) else names[k]] = column
    return table


def drive(robot: str, seconds: float, seed: int, **options: Any) -> Any:
    return omnidyn.simulate(omnidyn.load_robot(f"{robot}.toml"), levels(seconds, seed), STEP, **options)


def write_logs() -> None:
    """Clean logs of many robots."""
    for k, name in enumerate(("smooth1", "smooth2", "rough1", "rough2")):
        run = drive("box" if name.startswith("smooth") else "rough", 6.0, k)
        write(f"floor/{name}.csv", table_of(run, ("voltage", "twist"), k))
    for robot in ("sticky", "disc", "ellipse", "wheels", "mixed", "unequal", "limits", "dynamic", "dynamicmixed"):
        write(f"{robot}.csv", table_of(drive(robot, 3.0, 11), ("voltage", "twist"), 11))
    for k in range(6):
        write(f"boot/{k}.csv", table_of(drive("box", 2.0, 20 + k), ("voltage", "twist"), k))
    run = drive("box", 6.0, 1)
    for channels in ("pose", "wheel_speed", "current", "wheel_angle"):
        write(f"{channels}.csv", table_of(run, ("voltage", channels), 2))
    write("inputless.csv", table_of(run, ("wheel_speed",), 2))
    counts = table_of(run, ("voltage", "wheel_angle", "twist"), 2)
    write(
        "counts.csv",
        {
            f"m{n[1]}pos" if n[0] == "a" else n: np.floor(x * 19 * 25 / 2 / np.pi) if n[0] == "a" else x
            for n, x in counts.items()
        },
    )
    rest = omnidyn.simulate(omnidyn.load_robot("axebot"), np.full((200, 3), 0.05), STEP)
    write("rest.csv", table_of(rest, ("voltage", "twist"), 3))
    share = (levels(5.0, 4) / 6.0).round(3)
    supply = 6.0 - 0.5 * np.abs(share).max(axis=1)
    for name in ("duty", "coast"):
        run = omnidyn.simulate(omnidyn.load_robot(f"{name}.toml"), None, STEP, duty=share, supply=supply)
        write(f"{name}.csv", table_of(run, ("duty", "supply", "twist"), 4))
        write(f"{name}only.csv", table_of(run, ("duty", "twist"), 4))
    wheel = np.repeat(np.random.default_rng(5).uniform(-8, 8, (9, 3)).round(3), 50, axis=0)
    wheel[:50] = 0.0
    run = omnidyn.simulate(omnidyn.load_robot("loop.toml"), None, STEP, wheel_speed_command=wheel)
    write("loop.csv", table_of(run, ("wheel_speed_command", "wheel_speed"), 5, 0.3))
    write("loopvolts.csv", table_of(run, ("voltage", "wheel_speed_command", "wheel_speed", "current"), 5))


def write_steady() -> None:
    """Two floors driven at constant speed in twelve directions, and motors on a bench."""
    for name in ("loopdisc", "looprough"):
        robot = omnidyn.load_robot(f"{name}.toml")
        for k in range(12):
            angle = 2.0 * np.pi * k / 12
            twist = np.tile([0.4 * np.cos(angle), 0.4 * np.sin(angle), 0.0], (150, 1)).round(9)
            run = omnidyn.simulate(robot, None, STEP, twist_command=twist, tol=1e-4)
            table = table_of(run, ("voltage", "current", "wheel_speed", "twist_command"), k)
            write(f"{'smooth' if name == 'loopdisc' else 'rough'}/run{k:02d}.csv", table)
            if name == "loopdisc":
                write(f"unsigned/run{k:02d}.csv", {n: np.abs(x) if n[0] == "i" else x for n, x in table.items()})
    rng = np.random.default_rng(0)
    for log in (1, 2):  # w' = (u - 0.4 sgn w - 0.5 w)/0.025, by small steps of Euler's
        level, speed = np.repeat(rng.uniform(-4.0, 4.0, 32).round(4), 25), [0.0]
        for u in level:
            now = speed[-1]
            for _ in range(100):
                side = np.sign(now) or (np.sign(u) if abs(u) > 0.4 else 0.0)
                new = now + 1e-4 * (u - 0.4 * side - 0.5 * now) / 0.025 if side else 0.0
                now = new if new * side > 0.0 else 0.0
            speed.append(now)
        w = np.array(speed) + 0.05 * rng.standard_normal(len(speed))
        write(f"bench{log}.csv", {"t_s": np.arange(len(w)) * STEP, "u1_V": np.append(level, level[-1]), "w1_rad_s": w})
    speed = np.repeat(np.tile([2.0, -3.0, 5.0, -6.0, 4.0], 8), 50)
    table: Table = {"t_s": np.arange(2000) * STEP}
    for k, w in enumerate((speed, 0.9 * speed), start=1):
        table |= {f"u{k}_V": 0.5 * w + 0.4 * np.sign(w), f"a{k}_rad": np.cumsum(np.append(0.0, w[:-1])) * STEP}
    write("bench3.csv", table)


def write_faults() -> None:
    """The log of all channels as it is, and with one fault each."""
    run = drive("box", 6.0, 1)
    full = table_of(run, ("voltage", "current", "wheel_speed", "twist", "pose"), 1)
    write("full.csv", full)
    t, n, rows = full["t_s"], len(full["t_s"]), np.arange(len(full["t_s"]))
    swap = {"w1_rad_s": full["w2_rad_s"], "w2_rad_s": full["w1_rad_s"]}
    hold = np.where((rows > 250) & (rows < 400), full["w1_rad_s"][250], full["w1_rad_s"])
    spike = np.where(rows % 97 == 5, 900.0, full["w2_rad_s"])
    slip = np.where((rows > 300) & (rows < 520), 0.5, 1.0)
    faults: dict[str, Table] = {
        "swapped": full | swap,
        "inverted": full | {"w1_rad_s": -full["w1_rad_s"]},
        "inverted_u": full | {"u2_V": -full["u2_V"]},
        "rpm": full | {f"w{k}_rad_s": full[f"w{k}_rad_s"] * 30 / np.pi for k in (1, 2, 3)},
        "gear": full | {f"w{k}_rad_s": full[f"w{k}_rad_s"] * 1.2 for k in (1, 2, 3)},
        "late": full | {f"w{k}_rad_s": np.roll(full[f"w{k}_rad_s"], 6) for k in (1, 2, 3)},
        "stuck": full | {"w1_rad_s": hold},
        "dead": full | {"i2_A": 0.0 * t},
        "spikes": full | {"w2_rad_s": spike},
        "placeholder": full | {"i1_A": np.where(rows % 50 == 7, -999.0, full["i1_A"])},
        "wrapped": full | {"i1_A": np.where(full["i1_A"] < 0, full["i1_A"] + 65536.0, full["i1_A"])},
        "slip": full | {name: full[name] * slip for name in ("vx_m_s", "vy_m_s", "omega_rad_s")},
        "gap": {name: x[(rows < 200) | (rows > 260)] for name, x in full.items()},
        "repeats": full | {"t_s": np.where(rows % 60 == 9, t - STEP, t)},
        "backwards": full | {"t_s": np.where((rows > 300) & (rows < 320), t - 0.5, t)},
        "jitter": full | {"t_s": t + 0.004 * np.sin(rows * 12.9898)},
        "missing": full | {"vx_m_s": np.where(rows % 3 == 0, np.nan, full["vx_m_s"])},
        "nans": full | {name: np.where(rows % 41 == 3, np.nan, x) for name, x in full.items() if name != "t_s"},
        "unsigned": full | {f"i{k}_A": np.abs(full[f"i{k}_A"]) for k in (1, 2, 3)},
        "saturated": full | {f"u{k}_V": np.clip(full[f"u{k}_V"], -2.0, 2.0) for k in (1, 2, 3)},
        "wild": full | {"vx_m_s": full["vx_m_s"] + np.where(rows % 37 == 4, 1.0, 0.0)},
        "short": {name: x[:3] for name, x in full.items()},
        "odd": {"t_s": t, "foo": t * 3, "bar": rows * 1.0},
        "text": full | {"i1_A": [f"{x:.9g}" if k != 70 else "#N/A" for k, x in enumerate(full["i1_A"])]},
        "infinite": full | {"i1_A": [f"{x:.9g}" if k != 70 else "inf" for k, x in enumerate(full["i1_A"])]},
        "fullduty": {
            n.replace("u", "d").replace("V", "duty") if n[0] == "u" else n: x / 6.0 if n[0] == "u" else x
            for n, x in full.items()
        },
    }
    for name, table in faults.items():
        write(f"bad/{name}.csv", table)
    write_dialects({name: x[:200] for name, x in full.items() if name[0] in "tuwvo"}, n)


def write_dialects(table: Table, rows: int) -> None:
    """One log as other programs would have written it."""
    t = table["t_s"]
    write("dialect/semicolon.csv", table, ";", ",")
    write("dialect/tabs.tsv", table, "\t")
    write("dialect/blanks.txt", table, "  ")
    write("dialect/comments.csv", table, head=f"# made by a robot\n# {rows} rows\n")
    write("dialect/headless.csv", table, head="!")
    write(
        "dialect/units.csv",
        {"t": ["ms", *map(str, range(0, 2000, 10))]}
        | {
            n.split("_")[0]: [
                "rpm" if n[0] == "w" else "V" if n[0] == "u" else n.split("_", 1)[1].replace("_", "/"),
                *(f"{x * (30 / np.pi if n[0] == 'w' else 1):.9g}" for x in col),
            ]
            for n, col in table.items()
            if n != "t_s"
        },
    )
    write(
        "dialect/dates.csv",
        {"time": [f"2026-01-01T10:00:{x:09.6f}Z" for x in t]} | {n: x for n, x in table.items() if n != "t_s"},
    )
    write(
        "dialect/stamp.csv",
        {"stamp.sec": np.floor(t) + 100, "stamp.nanosec": (t % 1) * 1e9}
        | {n: x for n, x in table.items() if n != "t_s"},
    )
    write(
        "dialect/motor.csv",
        {
            "millis": t * 1e3,
            **{f"motor_{k}_volts": table[f"u{k}_V"] for k in (1, 2, 3)},
            **{f"m{k}vel": table[f"w{k}_rad_s"] * 19 * 30 / np.pi for k in (1, 2, 3)},
        },
    )
    turned = {f"m{k}pos": np.cumsum(table[f"w{k}_rad_s"]) * STEP * 19 * 2000 / 2 / np.pi for k in (1, 2, 3)}
    write(
        "dialect/ticks.csv",
        {
            "t": t,
            **{f"u{k}": table[f"u{k}_V"] for k in (1, 2, 3)},
            **{n: np.floor(x) % 65536 for n, x in turned.items()},
        },
    )
    write(
        "dialect/change.csv",
        {
            n: x if n[0] == "t" or n[0] == "v" else np.where(np.arange(200) % 4 == 0, x, np.nan)
            for n, x in table.items()
        },
    )
    body = {n: x for n, x in table.items() if n in COLUMNS["twist"]}
    wheels = {"front": "w1_rad_s", "left": "w2_rad_s", "right": "w3_rad_s"}
    write("dialect/places.csv", {"count": t * 1e3, **body, **{n: table[old] for n, old in wheels.items()}})
    Path("dialect/utf16.csv").write_bytes(Path("dialect/semicolon.csv").read_text("utf-8").encode("utf-16"))
    Path("dialect/uneven.csv").write_text(Path("dialect/tabs.tsv").read_text("utf-8") + "1\t2\t3\n", "utf-8")


def write_init_logs() -> None:
    """Body and wheels of a robot with wheels at 60, 180, 300 degrees and a gear of 16."""
    twist = np.random.default_rng(4).normal(size=(50, 3)) * 0.2
    phi = np.radians([60.0, 180.0, 300.0])
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi)) + 0.125 * twist[:, 2:]
    table = {"t_s": np.arange(50) * STEP, **dict(zip(COLUMNS["twist_command"], twist.T, strict=True))}
    for gear, name in ((1.0, "init1.csv"), (16.0, "init16.csv")):
        write(name, table | {f"w{k + 1}_cmd_rad_s": gear * rim[:, k] / 0.04 for k in range(3)})
    write(
        "noturn.csv",
        table | {"omega_cmd_rad_s": np.full(50, np.nan)} | {f"w{k + 1}_cmd_rad_s": rim[:, k] / 0.04 for k in range(3)},
    )


def copy_real() -> list[str]:
    """Copy logs of real robots here; the names of folders that are not there."""
    data = Path(os.environ.get("OMNIDYN_DATA", ROOT.parent / "shared" / "data"))
    shutil.copytree(ROOT / "examples", "examples")
    wanted = {
        "odrive": ("odrive_umn/demo_data/", ("step1.csv", "step2.csv", "chirp1.csv")),
        "udea": (
            "udea_three_omni/",
            (
                "motor_tests/stage1_1.txt",
                "motor_tests/stage1_2.txt",
                "rotation_tests/stage2_1.txt",
                "sensor_data/exp1.txt",
            ),
        ),
        "gray": ("robotino/one_surface_type/gray_surface/", tuple(f"exp{n:02d}.csv" for n in range(0, 72, 6))),
        "green": ("robotino/one_surface_type/green_surface/", tuple(f"exp{n:02d}.csv" for n in range(0, 72, 6))),
        "motors": ("robotino/dc_motor_model_identification/", ("validation_data.csv",)),
    }
    for folder, (place, names) in wanted.items():
        for name in names if (data / place).is_dir() else ():
            Path("real", folder).mkdir(parents=True, exist_ok=True)
            shutil.copy(data / place / name, Path("real", folder, Path(name).name))
    return [f"real/{folder}" for folder, (place, _) in wanted.items() if not (data / place).is_dir()]


def make_inputs() -> list[str]:
    """Write everything into the current folder; what a name must not contain where the real logs are missing."""
    for name, (body, motor, drive_, friction) in ROBOTS.items():
        text = ROBOT.format(name=name, body=body, motor=motor, drive=drive_, friction=friction)
        Path(f"{name}.toml").write_text(text, "utf-8")
    for name, text in TEXTS.items():
        Path(name).write_text(text, "utf-8")
    Path("log.npy").write_bytes(b"\x93NUMPY\x01\x00")
    Path("log.zip").write_bytes(b"PK\x03\x04" + bytes(60))
    write_logs()
    write_steady()
    write_faults()
    write_init_logs()
    return copy_real()
