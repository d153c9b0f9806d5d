"""fmu: a co-simulation unit (FMI 2 or 3) of the step of a robot, from the same C as c-model; no Python where it runs.

The archive holds the sources, and a library for this machine where a C compiler is found: other tools compile the
sources themselves. The unit steps as far as it is told to with the volts it was given, held over the step. Its state
can be got, set and serialised. Model exchange is not offered: at rest the derivative is set-valued.
"""

from __future__ import annotations

import io
import platform
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path
from typing import Literal
from xml.sax.saxutils import quoteattr

from omnidyn.errors import InputError
from omnidyn.export.code.c_model import engine_code
from omnidyn.export.code.fmi2 import FMI2_C
from omnidyn.export.code.fmi3 import BUILD, FMI3_C, description
from omnidyn.export.code.step_c import STATUS, StepCode
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import attribute, c_number, filled, identifier
from omnidyn.files import sha256
from omnidyn.model.robot import Robot
from omnidyn.simulation.engine import LARGEST_START

OUTPUTS = ("vx_m_s", "vy_m_s", "omega_rad_s", "x_m", "y_m", "heading_rad")
_OUTPUT_UNITS = ("m/s", "m/s", "rad/s", "m", "m", "rad")
_BASE = {
    "V": 'kg="1" m="2" s="-3" A="-1"',
    "m/s": 'm="1" s="-1"',
    "rad/s": 'rad="1" s="-1"',
    "m": 'm="1"',
    "rad": 'rad="1"',
}
EPOCH = (1980, 1, 1, 0, 0, 0)  # the first moment that an archive can hold: the same robot gives the same bytes
COMPILERS = ("gcc", "clang", "cc")
SECONDS = 120  # for the compiler
PROCESSORS = {2: ("x86_64", "amd64"), 3: ("x86_64", "amd64", "aarch64", "arm64")}


def fmu(robot: Robot, compiled: bool = True, fmi: Literal[2, 3] = 2) -> Export:
    """A co-simulation unit of a robot whose wheels roll, by the engine that `simulate` chooses.

    Inputs u1_V, u2_V, ...; outputs vx_m_s, vy_m_s, omega_rad_s, x_m, y_m, heading_rad; where it starts is a parameter
    of the same name with start_ before it. compiled: whether to add a library for this machine. fmi: the version of
    the standard. Raises UnsupportedError for other robots.
    """
    if fmi not in (2, 3):
        raise InputError("no such version of FMI", got=fmi, expected="2 or 3", where="fmi")
    refuse("fmu", robot)
    code, name, omissions = engine_code(robot), identifier(robot.name), left_out("fmu", robot)
    guid = sha256(_source(code, "", fmi))[:32]
    source = _source(code, guid, fmi).encode("utf-8")
    words = "".join([f"{robot.name}: the step of omnidyn", *(f"; not in it: {omission}" for omission in omissions)])
    describe = _description if fmi == 2 else description
    about = describe(robot.name, words, name, guid, _units(), _variables(code.wheels))
    entries = {"modelDescription.xml": about.encode("utf-8"), f"sources/{name}.c": source}
    if fmi == 3:
        entries["sources/buildDescription.xml"] = BUILD.format(name=name).encode("utf-8")
    library, reason = _library(source, name, fmi) if compiled else (None, "not asked for")
    place = _platform(fmi)
    notes = (
        "the volts of a step are held all through it",
        *(
            (f"a library for {place} is in it; other systems compile sources/{name}.c",)
            if library
            else (f"sources only ({reason}): the tool that loads it compiles sources/{name}.c",)
        ),
    )
    if library is not None:
        entries[f"binaries/{place}/{name}{_suffix()}"] = library
    return Export("fmu", robot.name, {f"{name}.fmu": _archive(entries)}, omissions, notes)


def _archive(entries: dict[str, bytes]) -> bytes:
    """A zip archive without times."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue()


def _platform(fmi: int) -> str:
    """The folder of this machine's libraries."""
    machine = "aarch64" if platform.machine().lower() in ("aarch64", "arm64") else "x86_64"
    folders = {"Windows": ("win64", "windows"), "Darwin": ("darwin64", "darwin")}
    second, third = folders.get(platform.system(), ("linux64", "linux"))
    return second if fmi == 2 else f"{machine}-{third}"


def _suffix() -> str:
    return {"Windows": ".dll", "Darwin": ".dylib"}.get(platform.system(), ".so")


def _library(source: bytes, name: str, fmi: int) -> tuple[bytes | None, str]:
    """The compiled source, or None and why not. Only for a processor that the standard has a folder for."""
    compiler = next((path for command in COMPILERS if (path := shutil.which(command))), None)
    if compiler is None:
        return None, "no C compiler here"
    if platform.machine().lower() not in PROCESSORS[fmi]:
        return None, f"FMI {fmi} knows no folder for {platform.machine()}"
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder, f"{name}.c"), Path(folder, f"{name}{_suffix()}")
        path.write_bytes(source)
        command = [compiler, "-std=c99", "-O2", "-shared", "-fPIC", "-s", "-o", out.name, path.name, "-lm"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=SECONDS)
        except (OSError, subprocess.SubprocessError):
            return None, "the C compiler failed"
        return out.read_bytes(), ""


def _source(code: StepCode, guid: str, fmi: int) -> str:
    return filled(
        FMI2_C + (FMI3_C if fmi == 3 else ""),
        STATUS=STATUS,
        STEP=code.text,
        WHEELS=str(code.wheels),
        GUID=guid,
        TWIST=c_number(LARGEST_START["twist"]),
        POSE=c_number(LARGEST_START["pose"]),
        MEMORY=str(code.size + code.lost),
        PASSED="unit->memory, unit->memory + 3" if code.state and code.lost else "unit->memory",
    ).lstrip()


def _units() -> str:
    return "\n".join(f"  <Unit name={quoteattr(unit)}><BaseUnit {_BASE[unit]}/></Unit>" for unit in _BASE)


def _variables(wheels: int) -> list[tuple[str, str, str]]:
    """(name, causality, unit) of the variables in the order of their references: volts, outputs, where it starts."""
    outputs = list(zip(OUTPUTS, _OUTPUT_UNITS, strict=True))
    return [
        *((f"u{k + 1}_V", "input", "V") for k in range(wheels)),
        *((name, "output", unit) for name, unit in outputs),
        *((f"start_{name}", "parameter", unit) for name, unit in outputs),
    ]


def _description(
    title: str, words: str, name: str, guid: str, units: str, variables: list[tuple[str, str, str]]
) -> str:
    """modelDescription.xml, as `description` of fmi3.py."""
    kinds = {
        "input": ('variability="continuous"', ' start="0"'),
        "output": ('variability="continuous" initial="calculated"', ""),
        "parameter": ('variability="fixed"', ' start="0"'),
    }
    lines = "\n".join(
        f'  <ScalarVariable name="{variable}" valueReference="{k}" causality="{kind}" {kinds[kind][0]}>'
        f'<Real unit="{unit}"{kinds[kind][1]}/></ScalarVariable>'
        for k, (variable, kind, unit) in enumerate(variables)
    )
    # Each output hangs on nothing of the same moment: the step has gone by when it is read.
    places = [k + 1 for k, (_, kind, _) in enumerate(variables) if kind == "output"]
    outputs = "\n".join(f'   <Unknown index="{place}" dependencies=""/>' for place in places)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={attribute(title)} guid="{guid}" description={attribute(words)}
 generationTool="omnidyn" variableNamingConvention="flat" numberOfEventIndicators="0">
 <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
  canSerializeFMUstate="true" canNotUseMemoryManagementFunctions="true">
  <SourceFiles><File name="{name}.c"/></SourceFiles>
 </CoSimulation>
 <UnitDefinitions>
{units}
 </UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>
 <ModelVariables>
{lines}
 </ModelVariables>
 <ModelStructure>
  <Outputs>
{outputs}
  </Outputs>
  <InitialUnknowns>
{outputs}
  </InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""
