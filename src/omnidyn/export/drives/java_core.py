"""The program as a class of Java without any package: used by the routines of FTC and WPILib."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.drives.rows import about, cells, constants
from omnidyn.export.spelling import filled, java_comment, number


def java_core(program: DriveProgram, package: str) -> str:
    """DriveProgram.java."""
    data = constants(program)
    pieces = ",\n".join(f"    {{{one.rows}, {cells((*one.first, *one.step))}}}" for one in data.pieces)
    legs = ",\n".join(f"    {{{leg.end}, {cells(leg.angle)}}}" for leg in data.legs)
    return java_comment(about(program)) + filled(
        _TEXT,
        PACKAGE=package,
        WHEELS=str(data.wheels),
        DT=number(data.dt),
        DEAD_MAN=number(data.dead_man),
        AREA=cells(data.area),
        SUPPLY=number(data.least_supply),
        TWIST=", ".join(f"{{{cells(row)}}}" for row in data.to_twist),
        PIECES=pieces,
        LEGS=legs,
    )


_TEXT = """package @PACKAGE@;

/** A program to drive, row by row, with its stops. Call step at least ten times a second. A stop is for good. */
public final class DriveProgram {
  public static final int WHEELS = @WHEELS@;
  public static final double DT = @DT@; // [s] of a row
  public static final double DEAD_MAN = @DEAD_MAN@; // [s] between two steps, after which it stops
  static final double[] AREA = {@AREA@}; // [m] free floor along x and y
  static final double LEAST_SUPPLY = @SUPPLY@; // [V]
  static final double FOLLOWS = 0.2; // of the predicted angle: a wheel that turns less in a leg does not follow
  // [axis][wheel]: twist from the speeds of the wheels [rad/s]
  static final double[][] TO_TWIST = {@TWIST@};
  // rows, inputs of the first, from row to row
  static final double[][] PIECES = {
@PIECES@
  };
  // row behind a leg, angle that each wheel must turn by in it [rad]; 0 is not judged
  static final double[][] LEGS = {
@LEGS@
  };

  /** What a program does now; a stop says why. */
  public enum Status { WAITING, RUNNING, DONE, RELEASED, LATE, SILENT, LOW_SUPPLY, BORDER, WHEEL }

  private Status status = Status.WAITING;
  private final double[] place = new double[3];
  private double begun, before, heard;
  private double[] angles, legAngles;
  private int leg, piece, pieceRow;

  public Status status() {
    return status;
  }

  /**
   * Inputs of the wheels at a time [s].
   *
   * @param held whether the key is held down
   * @param measured how far the wheels turned since any moment [rad]; null where nothing new was measured
   * @param supply [V]; not a number where it is not known
   */
  public double[] step(double now, boolean held, double[] measured, double supply) {
    if (status == Status.WAITING && held && measured != null) {
      status = Status.RUNNING;
      begun = before = heard = now;
      angles = measured.clone();
      legAngles = measured.clone();
    }
    if (status != Status.RUNNING) {
      return new double[WHEELS];
    }
    if (!held) {
      return stop(Status.RELEASED);
    }
    if (!(now >= before && now - before <= DEAD_MAN)) {
      return stop(Status.LATE);
    }
    if (measured != null) {
      if (!moved(now, measured.clone())) {
        return stop(Status.BORDER);
      }
    } else if (now - heard > DEAD_MAN) {
      return stop(Status.SILENT);
    }
    if (supply < LEAST_SUPPLY) {
      return stop(Status.LOW_SUPPLY);
    }
    before = now;
    int row = (int) ((now - begun) / DT + 1e-6);
    return follows(row) ? inputs(row) : stop(Status.WHEEL);
  }

  private double[] stop(Status why) {
    status = why;
    return new double[WHEELS];
  }

  /** Whether it is still inside the room, also when it has come to a stop. */
  private boolean moved(double now, double[] measured) {
    double[] way = new double[3];
    for (int axis = 0; axis < 3; axis++) {
      for (int wheel = 0; wheel < WHEELS; wheel++) {
        way[axis] += TO_TWIST[axis][wheel] * (measured[wheel] - angles[wheel]);
      }
    }
    double seconds = now - heard;
    angles = measured;
    heard = now;
    double heading = place[2] + 0.5 * way[2];
    double dx = Math.cos(heading) * way[0] - Math.sin(heading) * way[1];
    double dy = Math.sin(heading) * way[0] + Math.cos(heading) * way[1];
    place[0] += dx;
    place[1] += dy;
    place[2] += way[2];
    double ahead = seconds > 0.0 ? DEAD_MAN / seconds : 0.0;
    return Math.abs(place[0] + ahead * dx) <= 0.5 * AREA[0] && Math.abs(place[1] + ahead * dy) <= 0.5 * AREA[1];
  }

  /** Whether the wheels turned as predicted in the legs that are over. */
  private boolean follows(int row) {
    while (leg < LEGS.length && row >= LEGS[leg][0]) {
      for (int wheel = 0; wheel < WHEELS; wheel++) {
        double wanted = LEGS[leg][1 + wheel];
        if (wanted != 0.0 && (angles[wheel] - legAngles[wheel]) / wanted < FOLLOWS) {
          return false;
        }
      }
      leg++;
      legAngles = angles.clone();
    }
    return true;
  }

  /** The inputs of a row; none behind the last. */
  private double[] inputs(int row) {
    while (piece < PIECES.length && row >= pieceRow + PIECES[piece][0]) {
      pieceRow += (int) PIECES[piece][0];
      piece++;
    }
    if (piece == PIECES.length) {
      return stop(Status.DONE);
    }
    double[] inputs = new double[WHEELS];
    for (int wheel = 0; wheel < WHEELS; wheel++) {
      inputs[wheel] = PIECES[piece][1 + wheel] + (row - pieceRow) * PIECES[piece][1 + WHEELS + wheel];
    }
    return inputs;
  }
}
"""
