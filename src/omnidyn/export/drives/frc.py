"""wpilib: a Command for WPILib in Java that drives the program while a button is held, and logs it."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.contract import Export
from omnidyn.export.drives.ftc import refuse_speeds
from omnidyn.export.drives.java_core import java_core
from omnidyn.export.drives.rows import about
from omnidyn.export.spelling import filled, java_comment

PACKAGE = "frc.robot"
NOTES = (
    "make it with your subsystem, what sets the volts of each motor, and what tells its angle [rad]; bind it by "
    "whileTrue: a button that is released ends it",
    "the log is that of DataLogManager, with u1, .. and a1, ..: omnidyn reads .wpilog",
)


def frc(program: DriveProgram) -> Export:
    """DriveProgram.java and OmnidynDrive.java. Raises UnsupportedError for a robot with a speed loop."""
    refuse_speeds("wpilib", program)
    files = {
        "DriveProgram.java": java_core(program, PACKAGE),
        "OmnidynDrive.java": java_comment(about(program)[:2])
        + filled(_COMMAND, PACKAGE=PACKAGE, VOLTS="" if program.unit == "V" else " * supply"),
    }
    return Export("wpilib", program.robot.name, files, (), NOTES, folder=True)


_COMMAND = """package @PACKAGE@;

import edu.wpi.first.util.datalog.DoubleLogEntry;
import edu.wpi.first.wpilibj.DataLogManager;
import edu.wpi.first.wpilibj.RobotController;
import edu.wpi.first.wpilibj.Timer;
import edu.wpi.first.wpilibj2.command.Command;
import edu.wpi.first.wpilibj2.command.Subsystem;
import java.util.function.DoubleConsumer;
import java.util.function.DoubleSupplier;

/** Drives a plan while it is scheduled; a stop is for good: make a new one. */
public class OmnidynDrive extends Command {
  private final DoubleConsumer[] volts;
  private final DoubleSupplier[] angles;
  private final DoubleLogEntry[] voltsLog = new DoubleLogEntry[DriveProgram.WHEELS];
  private final DoubleLogEntry[] anglesLog = new DoubleLogEntry[DriveProgram.WHEELS];
  private DriveProgram program = new DriveProgram();

  /**
   * A drive.
   *
   * @param drive whose motors these are
   * @param volts sets the volts of each motor, in the order of the wheels of the robot file
   * @param angles how far each wheel turned [rad]
   */
  public OmnidynDrive(Subsystem drive, DoubleConsumer[] volts, DoubleSupplier[] angles) {
    this.volts = volts;
    this.angles = angles;
    addRequirements(drive);
  }

  @Override
  public void initialize() {
    program = new DriveProgram();
    for (int wheel = 0; wheel < DriveProgram.WHEELS; wheel++) {
      voltsLog[wheel] = new DoubleLogEntry(DataLogManager.getLog(), "u" + (wheel + 1));
      anglesLog[wheel] = new DoubleLogEntry(DataLogManager.getLog(), "a" + (wheel + 1));
    }
  }

  @Override
  public void execute() {
    double supply = RobotController.getBatteryVoltage();
    double[] turned = new double[DriveProgram.WHEELS];
    for (int wheel = 0; wheel < DriveProgram.WHEELS; wheel++) {
      turned[wheel] = angles[wheel].getAsDouble();
    }
    double[] inputs = program.step(Timer.getFPGATimestamp(), true, turned, supply);
    for (int wheel = 0; wheel < DriveProgram.WHEELS; wheel++) {
      double input = inputs[wheel]@VOLTS@;
      volts[wheel].accept(input);
      voltsLog[wheel].append(input);
      anglesLog[wheel].append(turned[wheel]);
    }
  }

  @Override
  public void end(boolean interrupted) {
    for (DoubleConsumer motor : volts) {
      motor.accept(0.0);
    }
  }

  @Override
  public boolean isFinished() {
    return program.status() != DriveProgram.Status.WAITING && program.status() != DriveProgram.Status.RUNNING;
  }
}
"""
