"""The tables of keys in robot-file.md, made from the model's own fields: `python docs/robot_keys.py` writes them anew,
and the schema of the JSON export beside them.

Tests fail where these and the model differ.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel

from omnidyn.export.robot_json import SCHEMA_FILE, json_schema
from omnidyn.model.friction.stribeck import SHAPES
from omnidyn.model.keys import TABLES, find_key, unit
from omnidyn.model.robot import Robot
from omnidyn.model.value import keys_of

PAGE = Path(__file__).with_name("robot-file.md")
PRETTY = {"kg m^2": "kg m²", "deg": "degree", "ohm": "Ω"}

# As the docstring of each shape begins: "f = exp(-p), p = ...".
FORMULAS = [(shape.__doc__ or "").removeprefix("f = ").partition(", ")[0] for shape in SHAPES.values()]
FALL = f"f of the fall: {', or '.join(FORMULAS)}"

# The descriptions in the model are notes for the margin of a robot file; these are sentences.
MEANING = {
    "body.mass_kg": "mass M",
    "body.inertia_kg_m2": "inertia I_n about the vertical axis through the centre of mass",
    "body.centre_m": "c, of mass, from the centre of the wheels: forward, to the left",
    "body.rotating_frame": "keep the terms M ω v of axes that turn with the robot",
    "body.centre_height_m": "of the centre of mass above the floor: it shifts the loads of wheels that may slip",
    "wheels.azimuth_deg": "where each wheel stands, seen from the centre, counter-clockwise from forward",
    "wheels.robot_radius_m": "b, from the centre to the wheels",
    "wheels.wheel_radius_m": "r, of the wheels",
    "wheels.roller_angle_deg": "0 for omni wheels, ±45 for mecanum wheels",
    "wheels.inertia_kg_m2": "J_w, of one wheel about its axle",
    "wheels.wheelbase_m": "of mecanum wheels, from the axles in front to those behind; what they carry depends on it",
    "wheels.traction_mu": "μ, what the floor takes of a wheel over what it carries; absent: it never slips",
    "motor.resistance_ohm": "R, of the winding, with what stands in series",
    "motor.inductance_H": "L, of the winding; needed for dynamic electrics",
    "motor.torque_constant_Nm_A": "K_t, torque per current at the motor shaft",
    "motor.emf_constant_Vs_rad": "K_v, back-EMF per speed at the motor shaft",
    "motor.gear_ratio": "l, turns of the motor per turn of the wheel",
    "motor.voltage_limit_V": "most the driver can give, of either sign",
    "motor.current_limit_A": "most the driver lets through, of either sign, eq (12)",
    "motor.voltage_drop_V": "lost in brushes and driver, against the current",
    "motor.gear_efficiency": "share of the power that comes through the gear, either way",
    "motor.rotor_inertia_kg_m2": "J, of what spins with the motor shaft; 1 g cm² = 1e-7 kg m²",
    "motor.electrical": '"dynamic" keeps L di/dt of eq (11)',
    "drive.kind": "what a command is",
    "drive.supply_V": "voltage of the battery, where it is not logged",
    "drive.off": "what a duty of 0 does: short the motor, or open it",
    "drive.kp_V_s_rad": "proportional gain, on the speed of a wheel",
    "drive.ki_V_rad": "integral gain, on the speed of a wheel",
    "drive.rate_Hz": "how often the speed loop runs; needed for it",
    "drive.dead_band_V": "of the driver: of a voltage u, (|u| - dead band)+ sgn u reaches the motor",
    "drive.latency_s": "from a command until it acts on the motors",
    "drive.voltage_map_V": "of a driver that is no line: points [asked, passed on, std or nothing] in V",
    "friction.axes.viscous": "B, per speed: along x, along y, about yaw",
    "friction.axes.coulomb": "C, whatever the speed: along x, along y, about yaw",
    "friction.axes.breakaway": "S, up to which it holds at rest; absent: as coulomb",
    "friction.axes.coulomb_backward": "C of motion backward, to the right, clockwise; absent: as coulomb",
    "friction.axes.breakaway_backward": "S backward; absent: as coulomb_backward, or else as breakaway",
    "friction.axes.law": "which law: how it rests and starts",
    "friction.axes.stribeck_speed": "v_s, over which the level falls from breakaway to coulomb",
    "friction.axes.stribeck_exponent": "d of the fall f((v/v_s)^d)",
    "friction.axes.stribeck_shape": FALL,
    "friction.axes.karnopp_speed": "Dv, below which Karnopp's law is at rest",
    "friction.axes.stiffness": "σ0 of bristles: coulomb over the way they bend before they slip",
    "friction.axes.damping": "σ1 of LuGre's bristles; absent: critical, 2 √(σ0 M) - viscous",
    "friction.axes.damping_speed": "v_d, over which σ1 fades; absent: it does not",
    "friction.axes.dahl_exponent": "a of Dahl's law: below 1 brittle, above 1 ductile",
    "friction.axes.elastic_share": "b, the share of its bend up to which an elasto-plastic bristle is a spring",
    "friction.direction.coulomb": "C along x and along y; equal for a disc",
    "friction.direction.breakaway": "S along x and along y, up to which it holds at rest; absent: as coulomb",
    "friction.direction.viscous": "B, the same in every direction",
    "friction.direction.yaw_coulomb": "C about yaw",
    "friction.direction.yaw_breakaway": "S about yaw; absent: as yaw_coulomb",
    "friction.direction.yaw_viscous": "B about yaw",
    "friction.direction.ellipse": "how its force points: (Cx² vx, Cy² vy)/D, or (Cx vx, Cy vy)/abs(v)",
    "friction.direction.law": "which law: how it rests and starts",
    "friction.direction.stribeck_speed": "v_s, over which both levels fall from breakaway to coulomb",
    "friction.direction.yaw_stribeck_speed": "the same about yaw",
    "friction.direction.stribeck_exponent": "d of the fall f((v/v_s)^d)",
    "friction.direction.stribeck_shape": FALL,
    "friction.direction.karnopp_speed": "Dv, a speed of travel below which Karnopp's law is at rest",
    "friction.direction.yaw_karnopp_speed": "the same about yaw",
    "friction.direction.stiffness": "σ0 of bristles, which turn with the body",
    "friction.direction.yaw_stiffness": "σ0 about yaw",
    "friction.direction.damping": "σ1 of LuGre's bristles; absent: critical, 2 √(σ0 M) - viscous",
    "friction.direction.yaw_damping": "σ1 about yaw; absent: critical",
    "friction.direction.damping_speed": "v_d, over which σ1 fades; absent: it does not",
    "friction.direction.yaw_damping_speed": "the same about yaw",
    "friction.direction.dahl_exponent": "a of Dahl's law: below 1 brittle, above 1 ductile",
    "friction.direction.elastic_share": "b, the share of its bend up to which an elasto-plastic bristle is a spring",
    "friction.wheels.coulomb": "c of a wheel that turns forward, at the rim",
    "friction.wheels.coulomb_backward": "c of a wheel that turns backward; absent: as coulomb",
    "friction.wheels.breakaway": "up to which a wheel resists being turned forward; absent: as coulomb",
    "friction.wheels.breakaway_backward": "the same, backward; absent: as coulomb_backward, or else as breakaway",
    "friction.wheels.viscous": "b, per speed of the rim",
    "friction.wheels.law": "which law: how it rests and starts",
    "friction.wheels.stribeck_speed": "v_s, of the rim, over which the level falls from breakaway to coulomb",
    "friction.wheels.stribeck_exponent": "d of the fall f((v/v_s)^d)",
    "friction.wheels.stribeck_shape": FALL,
    "friction.wheels.karnopp_speed": "Dv, of the rim, below which Karnopp's law is at rest",
    "friction.wheels.stiffness": "σ0 of bristles, at the rim",
    "friction.wheels.damping": "σ1 of LuGre's bristles, at the rim; absent: critical",
    "friction.wheels.damping_speed": "v_d, over which σ1 fades; absent: it does not",
    "friction.wheels.dahl_exponent": "a of Dahl's law: below 1 brittle, above 1 ductile",
    "friction.wheels.elastic_share": "b, the share of its bend up to which an elasto-plastic bristle is a spring",
    "floor.tilt_deg": "of the floor against the level",
    "floor.downhill_deg": "where it falls to, in the room, counter-clockwise from the x axis of the pose",
}


class Key(NamedTuple):
    """One key of a robot file, in words."""

    table: str
    key: str
    unit: str
    meaning: str
    default: str
    allowed: str


def all_keys() -> list[Key]:
    """Every key of every table, in the order of the file."""
    found: list[Key] = []
    for table in TABLES:
        annotation = Robot.model_fields[table].annotation
        assert isinstance(annotation, type)
        found += _keys(table, annotation)
    return found


def _keys(table: str, model: type[BaseModel]) -> Iterator[Key]:
    schema = model.model_json_schema(by_alias=True, ref_template="{model}")["properties"]
    inner: list[tuple[str, type[BaseModel]]] = []
    for key, name in keys_of(model, []).items():
        field = model.model_fields[name]
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            inner.append((f"{table}.{key}", field.annotation))
            continue
        path = f"{table}.{key}"
        unit, meaning = _unit(path, field.description or "", schema[key]), MEANING[path]
        default = "needed" if field.is_required() else _literal(field.default)
        yield Key(table, key, unit, meaning, default, _allowed(schema[key]))
    for path, each in inner:
        yield from _keys(path, each)


def _unit(key: str, words: str, schema: dict[str, Any]) -> str:
    """Of each axis, as the brackets of its description say, else that of the key; 1 for a pure number."""
    found = re.search(r"\[(.+?)\]", words)
    if found:
        return found.group(1)
    number = "number" in str(schema) and find_key(key) is not None  # a table of points is none
    return PRETTY.get(unit(key), unit(key)) or ("1" if number else "")


def _literal(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{one:g}" for one in value) + "]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def _allowed(schema: dict[str, Any]) -> str:
    """The range of a number, the words of a choice, and whether it may be a list."""
    choices = _first(schema, "enum")
    if choices:
        return ", ".join(f'"{choice}"' for choice in choices)
    low, above, high = (_first(schema, word) for word in ("minimum", "exclusiveMinimum", "maximum"))
    if high is None:
        return "true, false"
    words = f"above {above:g}, to {high:g}" if low is None else f"{low:g} to {high:g}"
    arrays = list(_arrays(schema))
    if not arrays:
        return words
    least, most = (arrays[0].get(f"{which}Items", arrays[0].get(f"{which}Length")) for which in ("min", "max"))
    if arrays[0].get("items", {}).get("type") == "array":
        return f"points of {words}, both rising"
    if least is None:
        return f"{words}; or one per wheel"
    return f"{least} × {words}" if least == most else f"{least} to {most} × {words}"


def _first(schema: Any, word: str) -> Any:
    """The first value of a keyword anywhere in a JSON schema."""
    if isinstance(schema, dict):
        if word in schema:
            return schema[word]
        schema = [each for key, each in schema.items() if key not in ("default", "description")]
    if isinstance(schema, list):
        return next((found for each in schema if (found := _first(each, word)) is not None), None)
    return None


def _arrays(schema: Any) -> Iterator[dict[str, Any]]:
    if isinstance(schema, dict):
        if schema.get("type") == "array":
            yield schema
        schema = list(schema.values())
    if isinstance(schema, list):
        for each in schema:
            yield from _arrays(each)


def as_markdown(table: str) -> str:
    """The keys of one table as a Markdown table."""
    rows = ["| key | unit | meaning | default | allowed |", "|---|---|---|---|---|"]
    for each in all_keys():
        if each.table == table:
            rows.append(f"| `{each.key}` | {each.unit} | {each.meaning} | {each.default} | {each.allowed} |")
    return "\n".join(rows) + "\n"


def filled(page: str) -> str:
    """The page with every table between its marks made anew."""

    def made(match: re.Match[str]) -> str:
        return f"{match.group(1)}{as_markdown(match.group(2))}{match.group(3)}"

    page = re.sub(r"(<!-- keys of ([a-z.]+) -->\n).*?(<!-- end -->)", made, page, flags=re.DOTALL)
    index = rf"\g<1>{index_of(page)}\g<2>"
    return re.sub(r"(<!-- index -->\n).*?(<!-- end of index -->)", index, page, flags=re.DOTALL)


def index_of(page: str) -> str:
    """The sections of the page, each with the keys that its table explains."""
    lines = ["| section | keys |", "| --- | --- |"]
    for title, body in re.findall(r"^###? (.+?)\n(.*?)(?=^###? |\Z)", page, flags=re.DOTALL | re.MULTILINE):
        keys = [f"`{key.key}`" for table in re.findall(r"<!-- keys of ([a-z.]+) -->", body) for key in keys_in(table)]
        lines.append(f"| [{title.replace('[', '').replace(']', '')}](#{anchor(title)}) | {', '.join(keys)} |")
    return "\n".join(lines) + "\n"


def keys_in(table: str) -> list[Key]:
    return [key for key in all_keys() if key.table == table]


def anchor(title: str) -> str:
    """What a link to a heading is called, on the page and where the repository is browsed."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")
    PAGE.with_name(SCHEMA_FILE).write_text(json.dumps(json_schema(), indent=1) + "\n", "utf-8")
