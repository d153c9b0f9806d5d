"""fmu: an FMI 2 co-simulation unit of the exact step, from the same C as c-model; no Python where it runs.

The archive holds the sources, and a library for this machine where a C compiler is found: other tools compile the
sources themselves. The unit steps as far as it is told to with the volts it was given: held over the step, which is
then exact whatever its length. Model exchange is not offered: at rest the derivative is set-valued.
"""

from __future__ import annotations

import io
import platform
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

from omnidyn.export.code.fmi2 import FMI2_C
from omnidyn.export.code.step_c import STATUS, StepCode, step_code
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.spelling import attribute, c_number, filled, identifier
from omnidyn.files import sha256
from omnidyn.model.robot import Robot
from omnidyn.simulation.engine import FARTHEST

OUTPUTS = ("vx_m_s", "vy_m_s", "omega_rad_s", "x_m", "y_m", "heading_rad")
_OUTPUT_UNITS = ("m/s", "m/s", "rad/s", "m", "m", "rad")
_BASE = {
    "V": 'kg="1" m="2" s="-3" A="-1"', "m/s": 'm="1" s="-1"', "rad/s": 'rad="1" s="-1"', "m": 'm="1"', "rad": 'rad="1"',
}  # fmt: skip
EPOCH = (1980, 1, 1, 0, 0, 0)  # the first moment that an archive can hold: the same robot gives the same bytes
COMPILERS = ("gcc", "clang", "cc")
SECONDS = 120  # for the compiler


def fmu(robot: Robot, compiled: bool = True) -> Export:
    """An FMI 2 co-simulation unit of a robot that has an exact step, winding inductance included.

    Inputs u1_V, u2_V, ...; outputs vx_m_s, vy_m_s, omega_rad_s, x_m, y_m, heading_rad; where it starts is a parameter
    of the same name with start_ before it. compiled: whether to add a library for this machine.
    Raises UnsupportedError for other robots.
    """
    refuse("fmu", robot)
    code, name, missing = step_code(robot), identifier(robot.name), left_out("fmu", robot)
    guid = sha256(_source(code, ""))[:32]
    entries: dict[str, bytes] = {
        "modelDescription.xml": _description(robot, name, code, guid, missing).encode("utf-8"),
        f"sources/{name}.c": _source(code, guid).encode("utf-8"),
    }
    library, why = _library(entries[f"sources/{name}.c"], name) if compiled else (None, "not asked for")
    notes = (
        "the volts of a step are held all through it: the step is exact, however long",
        *(
            (f"a library for {_platform()} is in it; other systems compile sources/{name}.c",)
            if library
            else (f"sources only ({why}): the tool that loads it compiles sources/{name}.c",)
        ),
    )
    if library is not None:
        entries[f"binaries/{_platform()}/{name}{_suffix()}"] = library
    return Export("fmu", robot.name, {f"{name}.fmu": _archive(entries)}, missing, notes)


def _archive(entries: dict[str, bytes]) -> bytes:
    """A zip archive without times."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue()


def _platform() -> str:
    """The folder of this machine's libraries, by FMI 2."""
    system = {"Linux": "linux", "Windows": "win", "Darwin": "darwin"}.get(platform.system(), "linux")
    return f"{system}64"


def _suffix() -> str:
    return {"win64": ".dll", "darwin64": ".dylib"}.get(_platform(), ".so")


def _library(source: bytes, name: str) -> tuple[bytes | None, str]:
    """The compiled source, or None and why not. Only for the processor that FMI 2 has a folder for."""
    compiler = next((path for each in COMPILERS if (path := shutil.which(each))), None)
    if compiler is None:
        return None, "no C compiler here"
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return None, f"FMI 2 knows no folder for {platform.machine()}"
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder, f"{name}.c"), Path(folder, f"{name}{_suffix()}")
        path.write_bytes(source)
        command = [compiler, "-std=c99", "-O2", "-shared", "-fPIC", "-s", "-o", out.name, path.name, "-lm"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=SECONDS)
        except (OSError, subprocess.SubprocessError):
            return None, "the C compiler failed"
        return out.read_bytes(), ""


def _source(code: StepCode, guid: str) -> str:
    return filled(
        FMI2_C, STATUS=STATUS, STEP=code.text, WHEELS=str(code.wheels), GUID=guid, TWIST=c_number(FARTHEST["twist"]),
        POSE=c_number(FARTHEST["pose"]), FORCE="unit->force, " if code.inductance else "",
    ).lstrip()  # fmt: skip


def _variables(wheels: int) -> list[str]:
    """The variables in the order of their references: volts, outputs, where it starts."""
    real = (
        '  <ScalarVariable name="{}" valueReference="{}" causality="{}" variability="{}"{}>'
        '<Real unit="{}"{}/></ScalarVariable>'
    )
    lines = [real.format(f"u{k + 1}_V", k, "input", "continuous", "", "V", ' start="0"') for k in range(wheels)]
    for k, (name, unit) in enumerate(zip(OUTPUTS, _OUTPUT_UNITS, strict=True)):
        lines.append(real.format(name, wheels + k, "output", "continuous", ' initial="calculated"', unit, ""))
    for k, (name, unit) in enumerate(zip(OUTPUTS, _OUTPUT_UNITS, strict=True)):
        reference = wheels + len(OUTPUTS) + k
        lines.append(real.format(f"start_{name}", reference, "parameter", "fixed", "", unit, ' start="0"'))
    return lines


def _description(robot: Robot, name: str, code: StepCode, guid: str, missing: tuple[str, ...]) -> str:
    """modelDescription.xml."""
    units = "\n".join(f"  <Unit name={quoteattr(each)}><BaseUnit {_BASE[each]}/></Unit>" for each in _BASE)
    # Each output hangs on nothing of the same moment: the step has gone by when it is read.
    outputs = [f'   <Unknown index="{code.wheels + k + 1}" dependencies=""/>' for k in range(len(OUTPUTS))]
    words = f"{robot.name}: the exact step of omnidyn" + "".join(f"; not in it: {each}" for each in missing)
    lines = "\n".join(_variables(code.wheels))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName={attribute(robot.name)} guid="{guid}" description={attribute(words)}
 generationTool="omnidyn" variableNamingConvention="flat" numberOfEventIndicators="0">
 <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="false"
  canNotUseMemoryManagementFunctions="true">
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
{chr(10).join(outputs)}
  </Outputs>
  <InitialUnknowns>
{chr(10).join(outputs)}
  </InitialUnknowns>
 </ModelStructure>
</fmiModelDescription>
"""
