"""What a program that drives itself is asked, moment by moment, and stubs of what its routines stand on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.driving.program import DriveProgram


class Moment(NamedTuple):
    """now [s], whether the key is held, angles of the wheels [rad] or None, supply [V]."""

    now: float
    held: bool
    angles: tuple[float, ...] | None
    supply: float


def healthy(program: DriveProgram) -> list[Moment]:
    """As predicted, from 5 s on a clock; two more moments after the last row."""
    speed = np.asarray(program.predicted.wheel_speed)
    angles = np.zeros_like(speed)
    angles[1:] = np.cumsum(0.5 * program.dt * (speed[1:] + speed[:-1]), axis=0)
    angles = np.concatenate([angles, angles[-1:]])
    return [Moment(5.0 + k * program.dt, True, tuple(row.tolist()), 12.0) for k, row in enumerate(angles)]


def faulty(program: DriveProgram, fault: str) -> list[Moment]:
    """The same with something wrong from the middle on."""
    moments, middle = healthy(program), len(program.inputs) // 2
    changed = {
        "RELEASED": lambda one: one._replace(held=False),
        "SILENT": lambda one: one._replace(angles=None),
        "LOW_SUPPLY": lambda one: one._replace(supply=1.0),
        "LATE": lambda one: one._replace(now=one.now + 0.4),
        "BORDER": lambda one: one._replace(angles=(0.0, 500.0, -500.0)),
        "WHEEL": lambda one: one._replace(angles=(*moments[middle].angles[:2], one.angles[2])),
    }[fault]
    return [*moments[:middle], *map(changed, moments[middle:])]


FAULTS = ("RELEASED", "SILENT", "LOW_SUPPLY", "LATE", "BORDER", "WHEEL")
DONE = "DONE"

_QUALCOMM = "com/qualcomm/robotcore"
_STUBS = {
    f"{_QUALCOMM}/eventloop/opmode/TeleOp": "public @interface TeleOp { String name(); String group(); }",
    f"{_QUALCOMM}/eventloop/opmode/LinearOpMode": """import com.qualcomm.robotcore.hardware.*;
public abstract class LinearOpMode {
  public HardwareMap hardwareMap; public Gamepad gamepad1; public Telemetry telemetry;
  public abstract void runOpMode() throws InterruptedException;
  public void waitForStart() {}
  public boolean opModeIsActive() { return false; }
}""",
    f"{_QUALCOMM}/hardware/Gamepad": "public class Gamepad { public volatile boolean a; }",
    f"{_QUALCOMM}/hardware/Telemetry": """public interface Telemetry {
  Object addData(String c, Object v); boolean update();
}""",
    f"{_QUALCOMM}/hardware/VoltageSensor": "public interface VoltageSensor { double getVoltage(); }",
    f"{_QUALCOMM}/hardware/DcMotor": """public interface DcMotor {
  enum RunMode { RUN_WITHOUT_ENCODER, STOP_AND_RESET_ENCODER }
  enum ZeroPowerBehavior { BRAKE, FLOAT }
  void setMode(RunMode mode); void setZeroPowerBehavior(ZeroPowerBehavior behavior);
  int getCurrentPosition(); void setPower(double power);
}""",
    f"{_QUALCOMM}/hardware/DcMotorEx": "public interface DcMotorEx extends DcMotor {}",
    f"{_QUALCOMM}/hardware/HardwareMap": """public class HardwareMap {
  public final java.util.List<VoltageSensor> voltageSensor = new java.util.ArrayList<>();
  public <T> T get(Class<? extends T> kind, String name) { return null; }
}""",
    "edu/wpi/first/util/datalog/DataLog": "public class DataLog {}",
    "edu/wpi/first/util/datalog/DoubleLogEntry": """public class DoubleLogEntry {
  public DoubleLogEntry(DataLog log, String name) {}
  public void append(double value) {}
}""",
    "edu/wpi/first/wpilibj/DataLogManager": """import edu.wpi.first.util.datalog.DataLog;
public class DataLogManager { public static DataLog getLog() { return new DataLog(); } }""",
    "edu/wpi/first/wpilibj/RobotController": """public class RobotController {
  public static double getBatteryVoltage() { return 12; }
}""",
    "edu/wpi/first/wpilibj/Timer": "public class Timer { public static double getFPGATimestamp() { return 0; } }",
    "edu/wpi/first/wpilibj2/command/Subsystem": "public interface Subsystem {}",
    "edu/wpi/first/wpilibj2/command/Command": """public abstract class Command {
  public void initialize() {}
  public void execute() {}
  public void end(boolean interrupted) {}
  public boolean isFinished() { return false; }
  public final void addRequirements(Subsystem... needed) {}
}""",
}


def write_stubs(folder):
    """Stubs of the FTC SDK and of WPILib, by the signatures of their documentation."""
    for place, text in _STUBS.items():
        path = folder / f"{place}.java"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"package {place.rpartition('/')[0].replace('/', '.')};\n{text}\n")
    return [folder / f"{place}.java" for place in _STUBS]


ARDUINO = """
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
unsigned long millis(); unsigned long micros();
inline char *dtostrf(double value, signed char width, unsigned char digits, char *text)
{ sprintf(text, "%*.*f", width, digits, value); return text; }
struct Port {
  void begin(long) {}
  int available() { return 0; }
  int read() { return -1; }
  void print(const char *) {} void print(double, int) {}
  void println() {} void println(const char *) {}
};
extern Port Serial;
"""
