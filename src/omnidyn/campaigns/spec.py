"""Spec: what a campaign varies and what it does with each sample. A TOML file, or the same tables in Python.

    schema = 1
    robot = "axebot"
    samples = 1024

    [vary]
    "wheels.wheel_radius_m" = { factor = [0.98, 1.02] }
    "friction" = { factor = [0.5, 1.5] }
    "path.period_s" = { values = [6.0, 8.0] }

    [correlation]
    keys = ["wheels.wheel_radius_m", "friction"]
    matrix = [[1.0, 0.5], [0.5, 1.0]]

    [track]
    path = "eight"
    controller = "pid"

A key of [vary] is a key of the robot file, a key of [sensors] there, an option of the path ("path.period_s") or of the
controller ("controller.faster"), a key of the table of the task ("track.noise_m_s"), or "path" and "controller". With
[identify] it is a key of the robot file that fits start from, "robot" itself, or an option ("identify.loss").
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, Strict, ValidationError, model_validator

from omnidyn.arguments import unknown_option
from omnidyn.control.circumstances import MOST_DELAY, SKIP
from omnidyn.control.feedforward import DT
from omnidyn.errors import InputError
from omnidyn.files import MAX_TOML_BYTES, parse_toml, read_text
from omnidyn.identification.methods import AUTO, FRICTION_METHODS, OUTPUT_ERROR, STEADY_STATE, Method, takes_names
from omnidyn.model.correlation import KeyCorrelation
from omnidyn.model.value import FieldType, Flag, Text, Value, from_validation, number, to_list, word_of

SCHEMA = 1
INPUTS = "inputs/"  # before the name of a file that a campaign has copied
RANDOM, LATIN, SOBOL, GRID = "random", "latin", "sobol", "grid"
MOST_SAMPLES, MOST_SEED = 10**9, 2**63 - 1
LINEAR, LOG = "linear", "log"


def whole(low: int, high: int) -> FieldType:
    """A whole number from low to high."""
    return FieldType(Annotated[int, Strict(), Field(ge=low, le=high), BeforeValidator(to_list)])


Real = Annotated[float, number(-1e12, 1e12)]
Positive = Annotated[float, number(0.0, 1e12, above=True)]
Pair = Annotated[tuple[Real, Real], BeforeValidator(to_list)]


class Variable(Value):
    """How a number is varied, by exactly one of four.

    range: from low to high, even, or even in the logarithm (scale = "log"). factor: the same, of what the file says.
    values: numbers or words, each as often. std: normal about what the file says. steps: of a range on a grid.
    """

    range: Pair | None = None
    factor: Pair | None = None
    values: (
        Annotated[
            tuple[bool | int | Real | Text, ...], BeforeValidator(to_list), Field(min_length=1, max_length=10_000)
        ]
        | None
    ) = None
    std: Positive | None = None
    scale: Annotated[str, word_of(LINEAR, LOG)] = LINEAR
    steps: Annotated[int, whole(1, 10_000)] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Variable:
        kinds = [name for name in ("range", "factor", "values", "std") if getattr(self, name) is not None]
        if len(kinds) != 1:
            raise ValueError(
                f"{' and '.join(kinds) or 'nothing'} says how it varies; expected exactly one of range, factor, values "
                "and std"
            )
        low, high = self.ends or (0.0, 1.0)
        if not low <= high:
            raise ValueError(f"[{low:g}, {high:g}] runs backwards; expected [low, high]")
        if self.scale == LOG and (self.ends is None or not low > 0.0):
            raise ValueError("scale = 'log' needs a range or factor above 0")
        return self

    @property
    def ends(self) -> tuple[float, float] | None:
        """Of a range or factor."""
        return self.range or self.factor


class TrackTask(Value):
    """[track]: a controller made for the robot of the file drives each sample along a path; see `omnidyn.track`.

    seed: of the noise; without it each sample has noise of its own. sensors: as for track, "" those of the robot file.
    settling [m]: distance from the path that counts as settled.
    """

    path: Annotated[Text, Field(description="as for track: a name with options, or a file")]
    controller: Text = "pid"
    dt: Annotated[Positive, Field(alias="dt_s")] = DT
    duration: Annotated[Positive | None, Field(alias="duration_s")] = None
    skip: Annotated[Annotated[float, number(0.0, 1e6)], Field(alias="skip_s")] = SKIP
    noise: Annotated[Annotated[float, number(0.0, 100.0)], Field(alias="noise_m_s")] = 0.0
    delay: Annotated[int, whole(0, MOST_DELAY)] = 0
    seed: Annotated[int, whole(0, MOST_SEED)] | None = None
    sensors: Text = ""
    settling: Annotated[Positive, Field(alias="settling_m")] = 0.005


class SimulateTask(Value):
    """[simulate]: each sample moves under given commands; see `omnidyn.simulate`.

    voltages: a command file. voltage [V]: one row, held for all the duration, in its place. scale: of all commands.
    """

    voltages: Text = ""
    voltage: Annotated[tuple[Real, ...] | None, BeforeValidator(to_list), Field(alias="voltage_V")] = None
    dt: Annotated[Positive, Field(alias="dt_s")] = 1e-3
    duration: Annotated[Positive | None, Field(alias="duration_s")] = None
    scale: Real = 1.0

    @model_validator(mode="after")
    def _one_input(self) -> SimulateTask:
        if bool(self.voltages) == (self.voltage is not None):
            raise ValueError("cannot tell what to apply; expected either voltages = 'file.csv' or voltage_V = [..]")
        if self.voltage is not None and self.duration is None:
            raise ValueError("voltage_V needs duration_s")
        return self


def _texts(value: Any) -> tuple[str, ...]:
    """A text or several. Raises ValueError for what is neither."""
    texts = (value,) if isinstance(value, str) else value
    if not isinstance(texts, list | tuple) or not all(isinstance(text, str) and text for text in texts):
        raise ValueError("not a file or several; expected text, or a list of texts")
    return tuple(texts)


def _sets(value: Any) -> Any:
    """Files, or files by the name of their set."""
    if not value:
        raise ValueError("no logs; expected a file, a list of files, or such by name")
    return {str(name): _texts(files) for name, files in value.items()} if isinstance(value, Mapping) else _texts(value)


class Reading(Value):
    """[identify.read]: how logs are read; each as of `omnidyn.read_log`. columns: component -> "COLUMN:UNIT"."""

    columns: dict[str, Text] = Field(default_factory=dict)
    assume: dict[str, Text] = Field(default_factory=dict)
    latency: dict[str, Real] = Field(default_factory=dict)
    sort: Flag = False
    header: Flag = True
    skip_bad_rows: Flag = False
    current_unsigned: Flag = False
    variables: Annotated[tuple[str, ...], BeforeValidator(_texts)] = ()
    rate: Positive | None = None


class IdentifyTask(Value):
    """[identify]: a fit to each log, or to each set of logs together; see `omnidyn.identify`.

    logs: files, folders and globs, a fit to each log; or the same by name, {gray = "gray/*.csv"}, a fit to each set.
    hold_out: logs that are predicted and not fitted: by the fit of their set, or where there are none by every fit.
    map: which column is what (TOML). read: how logs are read. method, quick: as of the command. options: of the method;
    in a file they stand in [identify] itself, and several names may be one text, "body.mass_kg, friction".
    """

    logs: Annotated[Any, BeforeValidator(_sets)]
    hold_out: Annotated[tuple[str, ...], BeforeValidator(_texts)] = ()
    map: Text = ""
    read: Reading = Field(default_factory=Reading)
    method: Annotated[str, word_of(AUTO, OUTPUT_ERROR, STEADY_STATE)] = AUTO
    quick: Flag = False
    options: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _of_method(cls, tables: Any) -> Any:
        """Moves what is no key of this table to the options of the method. Raises InputError for one that none has."""
        if not isinstance(tables, Mapping):
            return tables
        options = {**tables.get("options", {}), **{key: v for key, v in tables.items() if key not in cls.model_fields}}
        option_names = {option.name for kind in FRICTION_METHODS for option in fields(kind)} - {"per_free"}
        for name in options:
            if name not in option_names:
                raise unknown_option(
                    "a fit", name, sorted({*option_names, *cls.model_fields} - {"options"}), "[identify]"
                )
        return {key: v for key, v in tables.items() if key in cls.model_fields} | {"options": options}

    def method_asked(self) -> Method | None:
        """The method with its options; None where robot and logs choose it. Raises InputError for what none takes."""
        if not self.options and self.method == AUTO:
            return None
        named = [kind for kind in FRICTION_METHODS if self.method in (AUTO, kind.name)]
        for kind in named:
            option_by_name = {option.name: option for option in fields(kind)}
            if option_by_name.keys() >= self.options.keys():
                return kind(**{name: _names(value, option_by_name[name]) for name, value in self.options.items()})
        raise InputError(
            f"{named[0].name if len(named) == 1 else 'no method'} has all these options",
            got=", ".join(self.options),
            expected=f"those of {' or '.join(kind.name for kind in named)}",
            where="[identify]",
        )


def _names(value: Any, option: Any) -> Any:
    """The value of an option; names in one text as several."""
    if isinstance(value, str) and takes_names(option):
        return tuple(name.strip() for name in value.split(","))
    return value


class Spec(Value):
    """A campaign. samples: how many; a grid counts its own. sampling: how they are drawn. seed: of the draws.

    robot_draws: whether each sample is a draw from the std and correlations of the robot file, before what [vary] says.
    correlation: of the normals behind what varies (a Gaussian copula), by keys of [vary]; of stds that of the numbers.
    shard_rows: samples in a shard; by default as many as take a second. metrics: those that are kept; all by default.
    """

    name: Text = ""
    robot: Text
    samples: Annotated[int, whole(1, MOST_SAMPLES)] | None = None
    sampling: Annotated[str, word_of(SOBOL, LATIN, RANDOM, GRID)] = SOBOL
    seed: Annotated[int, whole(0, MOST_SEED)] = 0
    robot_draws: Flag = False
    shard_rows: Annotated[int, whole(1, MOST_SAMPLES)] | None = None
    metrics: Annotated[tuple[Text, ...], BeforeValidator(to_list)] = ()
    vary: dict[str, Variable] = Field(default_factory=dict)
    correlation: KeyCorrelation | None = None
    track: TrackTask | None = None
    simulate: SimulateTask | None = None
    identify: IdentifyTask | None = None

    @model_validator(mode="before")
    @classmethod
    def _of_logs(cls, tables: Any) -> Any:
        """Fits are made of every log with everything that varies: a grid."""
        if isinstance(tables, Mapping) and tables.get("identify") is not None:
            return {"sampling": GRID, **tables}
        return tables

    @model_validator(mode="after")
    def _hangs_together(self) -> Spec:
        if not self.vary and not self.robot_draws and self.identify is None:
            raise ValueError("nothing varies; expected a table [vary], or robot_draws = true")
        if sum(task is not None for task in (self.track, self.simulate, self.identify)) > 1:
            raise ValueError("two tasks; expected one of [track], [simulate] and [identify]")
        if self.identify is not None and self.sampling != GRID:
            raise ValueError("[identify] fits every log with all that varies; leave out sampling")
        if self.correlation is not None:
            self._check_correlation(self.correlation)
        if self.sampling == GRID:
            self._check_grid()
        elif self.samples is None:
            raise ValueError("samples is missing; expected how many, such as samples = 1024")
        return self

    def _check_correlation(self, correlation: KeyCorrelation) -> None:
        if self.sampling == GRID:
            raise ValueError("a grid takes every combination; leave out [correlation], or take another sampling")
        if correlation.std is not None:
            raise ValueError("[correlation] has std; expected keys and matrix: a std stands in [vary]")
        for key in correlation.keys:
            if key not in self.vary:
                raise ValueError(f"[correlation] of what does not vary; got {key}; expected keys of [vary]")
            if self.vary[key].values is not None:
                raise ValueError(f"{key} has values, which are not correlated; expected a range, a factor or a std")

    def _check_grid(self) -> None:
        if self.samples is not None or self.robot_draws:
            raise ValueError("a grid has no samples to draw; leave out samples and robot_draws")
        for key, variable in self.vary.items():
            if variable.std is not None or (variable.ends is not None and variable.steps is None):
                raise ValueError(f"{key} has no steps; a grid needs values, or a range or factor with steps")

    @property
    def levels(self) -> tuple[int, ...]:
        """Of a grid: values of each variable."""
        return tuple(
            len(variable.values) if variable.values else variable.steps or 1 for variable in self.vary.values()
        )


def load_spec(path: str | os.PathLike) -> tuple[Spec, Path]:
    """A spec from its file, and the folder that names in it are relative to. Raises InputError, which names the key."""
    text = read_text(path, MAX_TOML_BYTES)
    return parse_spec(parse_toml(text, os.fspath(path)), os.fspath(path)), Path(path).parent


def parse_spec(document: Mapping[str, Any], where: str = "spec") -> Spec:
    """A spec from its tables. Raises InputError, which names the nearest key for one that is unknown."""
    tables = dict(document)
    if type(schema := tables.pop("schema", None)) is not int or schema != SCHEMA:
        got = "none" if schema is None else schema
        raise InputError("unknown schema", got=got, expected=f"schema = {SCHEMA}", where=where)
    try:
        return Spec.model_validate(tables, by_alias=True, by_name=False)
    except ValidationError as error:
        raise from_validation(error, Spec).at(where) from None


def spec_tables(spec: Spec) -> dict[str, Any]:
    """The tables of a spec, as JSON can hold them: `parse_spec` gives the same spec back."""
    return {"schema": SCHEMA, **spec.model_dump(mode="json", by_alias=True, exclude_defaults=True)}
