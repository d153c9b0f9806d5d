"""ftc: an OpMode for the FTC SDK that drives the program while a button is held, and writes the log."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.errors import UnsupportedError
from omnidyn.export.contract import Export
from omnidyn.export.drives.java_core import java_core
from omnidyn.export.drives.rows import about
from omnidyn.export.spelling import filled, java_comment
from omnidyn.logs.run_file import columns_of
from omnidyn.model.drive import SPEED

PACKAGE = "org.firstinspires.ftc.teamcode"
NOTES = (
    "put in the names of your motors, in the order of the wheels of the robot file, and the ticks in a turn of a wheel",
    "hold button A of gamepad 1 to drive; the log is /sdcard/FIRST/omnidyn-log.csv",
)


def ftc(program: DriveProgram) -> Export:
    """DriveProgram.java and OmnidynDrive.java. Raises UnsupportedError for a robot with a speed loop."""
    refuse_speeds("ftc", program)
    count = program.robot.wheels.count
    columns = ["t_s", *columns_of("voltage", count), *columns_of("wheel_angle", count), "supply_V"]
    motors = ", ".join(f'"motor{wheel + 1}"' for wheel in range(count))
    files = {
        "DriveProgram.java": java_core(program, PACKAGE),
        "OmnidynDrive.java": java_comment(about(program)[:2])
        + filled(
            _OP_MODE,
            PACKAGE=PACKAGE,
            MOTORS=motors,
            COLUMNS=",".join(columns),
            VOLTS="" if program.unit == "V" else " * supply",
            POWER=" / supply" if program.unit == "V" else "",
        ),
    }
    return Export("ftc", program.robot.name, files, (), NOTES, folder=True)


def refuse_speeds(kind: str, program: DriveProgram) -> None:
    """Raises UnsupportedError for set points of a firmware: these routines give volts."""
    if program.robot.drive.kind == SPEED:
        raise UnsupportedError(
            f"{kind} gives volts to motors", got="speeds of the wheels", expected="a plan in volts or duties"
        )


_OP_MODE = """package @PACKAGE@;

import com.qualcomm.robotcore.eventloop.opmode.LinearOpMode;
import com.qualcomm.robotcore.eventloop.opmode.TeleOp;
import com.qualcomm.robotcore.hardware.DcMotor;
import com.qualcomm.robotcore.hardware.DcMotorEx;
import com.qualcomm.robotcore.hardware.VoltageSensor;
import java.io.FileWriter;
import java.io.IOException;
import java.io.PrintWriter;
import java.util.Locale;

/** Drives a plan while button A is held; a stop is for good: press stop, and start anew. */
@TeleOp(name = "omnidyn drive", group = "omnidyn")
public class OmnidynDrive extends LinearOpMode {
  static final String[] MOTORS = {@MOTORS@}; // yours
  static final double TICKS_PER_TURN = 537.7; // of a wheel: yours
  static final String LOG = "/sdcard/FIRST/omnidyn-log.csv";

  @Override
  public void runOpMode() {
    DriveProgram program = new DriveProgram();
    DcMotorEx[] motors = new DcMotorEx[DriveProgram.WHEELS];
    for (int wheel = 0; wheel < motors.length; wheel++) {
      motors[wheel] = hardwareMap.get(DcMotorEx.class, MOTORS[wheel]);
      motors[wheel].setMode(DcMotor.RunMode.STOP_AND_RESET_ENCODER);
      motors[wheel].setMode(DcMotor.RunMode.RUN_WITHOUT_ENCODER);
      motors[wheel].setZeroPowerBehavior(DcMotor.ZeroPowerBehavior.BRAKE);
    }
    VoltageSensor battery = hardwareMap.voltageSensor.iterator().next();
    waitForStart();
    double begun = -1.0;
    try (PrintWriter log = new PrintWriter(new FileWriter(LOG))) {
      log.println("@COLUMNS@");
      while (opModeIsActive()) {
        double now = 1e-9 * System.nanoTime();
        double supply = battery.getVoltage();
        double[] angles = new double[motors.length];
        for (int wheel = 0; wheel < motors.length; wheel++) {
          angles[wheel] = motors[wheel].getCurrentPosition() * 2.0 * Math.PI / TICKS_PER_TURN;
        }
        double[] inputs = program.step(now, gamepad1.a, angles, supply);
        for (int wheel = 0; wheel < motors.length; wheel++) {
          motors[wheel].setPower(Math.max(-1.0, Math.min(1.0, inputs[wheel]@POWER@)));
        }
        if (program.status() == DriveProgram.Status.RUNNING) {
          begun = begun < 0.0 ? now : begun;
          StringBuilder row = new StringBuilder(String.format(Locale.ROOT, "%.6f", now - begun));
          for (double input : inputs) {
            row.append(String.format(Locale.ROOT, ",%.6f", input@VOLTS@));
          }
          for (double angle : angles) {
            row.append(String.format(Locale.ROOT, ",%.6f", angle));
          }
          log.println(row.append(String.format(Locale.ROOT, ",%.4f", supply)));
        }
        telemetry.addData("omnidyn", program.status());
        telemetry.update();
      }
    } catch (IOException error) {
      telemetry.addData("omnidyn", error.getMessage());
      telemetry.update();
    } finally {
      for (DcMotorEx motor : motors) {
        motor.setPower(0.0);
      }
    }
  }
}
"""
