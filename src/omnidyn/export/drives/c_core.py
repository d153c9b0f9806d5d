"""The program as a table and functions of C99, and the receiver of commands by line: used by the sketch for Arduino."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.drives.rows import about, cells, constants
from omnidyn.export.spelling import c_comment, c_number, filled


def c_core(program: DriveProgram) -> str:
    """omnidyn_drive.h."""
    data = constants(program)
    pieces = ",\n".join(
        f"    {{{one.rows}, {{{cells(one.first, _single)}}}, {{{cells(one.step, _single)}}}}}" for one in data.pieces
    )
    legs = ",\n".join(f"    {{{leg.end}, {{{cells(leg.angle, _single)}}}}}" for leg in data.legs)
    return filled(
        _TEXT,
        ABOUT=c_comment(about(program)),
        WHEELS=str(data.wheels),
        DT=_single(data.dt),
        DEAD_MAN=str(round(1000.0 * data.dead_man)),
        X=_single(0.5 * data.area[0]),
        Y=_single(0.5 * data.area[1]),
        SUPPLY=_single(data.least_supply),
        TWIST=", ".join(f"{{{cells(row, _single)}}}" for row in data.to_twist),
        COUNT=str(len(data.pieces)),
        PIECES=pieces,
        LEGS=str(len(data.legs)),
        LEG_TABLE=legs,
    ).lstrip()


def _single(value: float) -> str:
    return c_number(value if abs(value) > 1e-30 else 0.0, single=True)


_TEXT = """
@ABOUT@
#ifndef OMNIDYN_DRIVE_H
#define OMNIDYN_DRIVE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#ifdef __AVR__
#include <avr/pgmspace.h>
#define OMNIDYN_TABLE PROGMEM
#define omnidyn_fetch memcpy_P
#else
#define OMNIDYN_TABLE
#define omnidyn_fetch memcpy
#endif

#define OMNIDYN_WHEELS @WHEELS@
#define OMNIDYN_DT @DT@           /* [s] of a row */
#define OMNIDYN_DEAD_MAN @DEAD_MAN@UL /* [ms] between two steps, or without a measurement, after which it stops */
#define OMNIDYN_LEAST_SUPPLY @SUPPLY@ /* [V] */
#define OMNIDYN_FOLLOWS 0.2f      /* of the predicted angle: a wheel that turns less in a leg does not follow */

/* rows, inputs of the first one, from row to row */
typedef struct { uint16_t rows; float first[OMNIDYN_WHEELS], step[OMNIDYN_WHEELS]; } omnidyn_piece;
/* row behind a leg, angle that each wheel must turn by in it [rad]; 0 is not judged */
typedef struct { uint16_t end; float angle[OMNIDYN_WHEELS]; } omnidyn_leg;

static const omnidyn_piece omnidyn_pieces[@COUNT@] OMNIDYN_TABLE = {
@PIECES@
};
static const omnidyn_leg omnidyn_legs[@LEGS@] OMNIDYN_TABLE = {
@LEG_TABLE@
};
/* [axis][wheel]: twist from the speeds of the wheels [rad/s] */
static const float omnidyn_to_twist[3][OMNIDYN_WHEELS] = {@TWIST@};

enum {
    OMNIDYN_WAITING, OMNIDYN_RUNNING, OMNIDYN_DONE, OMNIDYN_RELEASED = -1, OMNIDYN_LATE = -2, OMNIDYN_SILENT = -3,
    OMNIDYN_LOW_SUPPLY = -4, OMNIDYN_BORDER = -5, OMNIDYN_WHEEL = -6
};

/* All zeros at the start. status: of the enum above; what is below 0 is a stop, for good. */
typedef struct {
    int status;
    uint16_t piece, leg;
    uint32_t begun, before, heard, piece_row;
    float place[3], angles[OMNIDYN_WHEELS], leg_angles[OMNIDYN_WHEELS];
} omnidyn_drive;

static inline void omnidyn_stop(omnidyn_drive *drive, int status, float inputs[OMNIDYN_WHEELS])
{
    drive->status = status;
    memset(inputs, 0, OMNIDYN_WHEELS * sizeof(float));
}

/* Whether it is still inside the room, also when it has come to a stop. */
static inline bool omnidyn_moved(omnidyn_drive *drive, uint32_t now, const float angles[])
{
    float way[3] = {0.0f, 0.0f, 0.0f}, seconds = 1e-3f * (float)(uint32_t)(now - drive->heard), heading, dx, dy, ahead;
    int axis, wheel;
    for (axis = 0; axis < 3; axis++)
        for (wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
            way[axis] += omnidyn_to_twist[axis][wheel] * (angles[wheel] - drive->angles[wheel]);
    memcpy(drive->angles, angles, sizeof drive->angles);
    drive->heard = now;
    heading = drive->place[2] + 0.5f * way[2];
    dx = cosf(heading) * way[0] - sinf(heading) * way[1];
    dy = sinf(heading) * way[0] + cosf(heading) * way[1];
    drive->place[0] += dx;
    drive->place[1] += dy;
    drive->place[2] += way[2];
    ahead = seconds > 0.0f ? 1e-3f * (float)OMNIDYN_DEAD_MAN / seconds : 0.0f;
    return fabsf(drive->place[0] + ahead * dx) <= @X@ && fabsf(drive->place[1] + ahead * dy) <= @Y@;
}

/* Whether the wheels turned as predicted in the legs that are over. */
static inline bool omnidyn_follows(omnidyn_drive *drive, uint32_t row)
{
    omnidyn_leg leg;
    int wheel;
    while (drive->leg < @LEGS@) {
        omnidyn_fetch(&leg, &omnidyn_legs[drive->leg], sizeof leg);
        if (row < leg.end)
            return true;
        for (wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
            if (leg.angle[wheel] != 0.0f
                && (drive->angles[wheel] - drive->leg_angles[wheel]) / leg.angle[wheel] < OMNIDYN_FOLLOWS)
                return false;
        drive->leg++;
        memcpy(drive->leg_angles, drive->angles, sizeof drive->leg_angles);
    }
    return true;
}

/* Inputs of the wheels at a time [ms]; call it at least ten times a second. held: the key. angles: turned since any
   moment [rad], or 0 where nothing new was measured. supply [V]: NAN where it is not known. Returns the status. */
static inline int omnidyn_drive_step(omnidyn_drive *drive, uint32_t now, bool held, const float *angles, float supply,
                                     float inputs[OMNIDYN_WHEELS])
{
    omnidyn_piece piece;
    uint32_t row;
    int wheel;
    if (drive->status == OMNIDYN_WAITING && held && angles) {
        drive->status = OMNIDYN_RUNNING;
        drive->begun = drive->before = drive->heard = now;
        memcpy(drive->angles, angles, sizeof drive->angles);
        memcpy(drive->leg_angles, angles, sizeof drive->leg_angles);
    }
    memset(inputs, 0, OMNIDYN_WHEELS * sizeof(float));
    if (drive->status != OMNIDYN_RUNNING)
        return drive->status;
    row = (uint32_t)(1e-3f * (float)(uint32_t)(now - drive->begun) / OMNIDYN_DT + 1e-3f);
    if (!held)
        omnidyn_stop(drive, OMNIDYN_RELEASED, inputs);
    else if ((uint32_t)(now - drive->before) > OMNIDYN_DEAD_MAN)
        omnidyn_stop(drive, OMNIDYN_LATE, inputs);
    else if (angles ? !omnidyn_moved(drive, now, angles) : false)
        omnidyn_stop(drive, OMNIDYN_BORDER, inputs);
    else if ((uint32_t)(now - drive->heard) > OMNIDYN_DEAD_MAN)
        omnidyn_stop(drive, OMNIDYN_SILENT, inputs);
    else if (supply < OMNIDYN_LEAST_SUPPLY)
        omnidyn_stop(drive, OMNIDYN_LOW_SUPPLY, inputs);
    else if (!omnidyn_follows(drive, row))
        omnidyn_stop(drive, OMNIDYN_WHEEL, inputs);
    drive->before = now;
    while (drive->status == OMNIDYN_RUNNING) {
        if (drive->piece == @COUNT@) {
            drive->status = OMNIDYN_DONE;
            break;
        }
        omnidyn_fetch(&piece, &omnidyn_pieces[drive->piece], sizeof piece);
        if (row < drive->piece_row + piece.rows) {
            for (wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
                inputs[wheel] = piece.first[wheel] + (float)(row - drive->piece_row) * piece.step[wheel];
            break;
        }
        drive->piece_row += piece.rows;
        drive->piece++;
    }
    return drive->status;
}

#endif
"""
