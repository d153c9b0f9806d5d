"""arduino: the program as a table of C, the receiver of `omnidyn drive --to serial:PORT`, and a sketch for either."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.contract import Export
from omnidyn.export.drives.c_core import c_core
from omnidyn.export.drives.rows import about
from omnidyn.export.spelling import c_comment, filled

NOTES = (
    "fill in four functions at the top of the sketch: motor, angle, supply and held",
    "OMNIDYN_BY_LINE 1: the board takes commands of `omnidyn drive` (`to` serial:PORT); 0: it drives the table by "
    "itself, and prints the log",
)


def arduino(program: DriveProgram) -> Export:
    """omnidyn_drive.ino with two headers, in a folder that the Arduino IDE opens."""
    comment = c_comment(about(program)[:2])
    unit = {"V": "volts", "duty": "-1 to 1", "rad/s": "rad/s"}[program.unit]
    letter = {"V": "u%d_V", "duty": "d%d_duty", "rad/s": "w%d_cmd_rad_s"}[program.unit]
    files = {
        "omnidyn_drive.ino": filled(_SKETCH, ABOUT=comment, UNIT=unit, COLUMN=letter).lstrip(),
        "omnidyn_drive.h": c_core(program),
        "omnidyn_line.h": filled(_LINE, ABOUT=comment).lstrip(),
    }
    return Export("arduino", program.robot.name, files, (), NOTES, folder=True)


_LINE = """
@ABOUT@
#ifndef OMNIDYN_LINE_H
#define OMNIDYN_LINE_H

/* Commands by line, C,SESSION,NUMBER,SENT_US,HOLD_US,INPUT,..*HH, with the dead-man stop: a command acts until its hold
   is over, counted from when it was sent. All fields zero but session, which is -1, at the start. */

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define OMNIDYN_LONGEST 120

typedef struct {
    int32_t session, number;
    uint32_t difference, end, taken; /* [us] */
    bool acts;
    float inputs[OMNIDYN_WHEELS];
    char text[OMNIDYN_LONGEST];
    uint8_t length;
} omnidyn_line;

static inline void omnidyn_off(omnidyn_line *line)
{
    line->acts = false;
    memset(line->inputs, 0, sizeof line->inputs);
}

/* Whether the check behind the star is that of the text before it; the star is cut off. */
static inline bool omnidyn_checked(char *text)
{
    uint8_t check = 0;
    char *star = strrchr(text, '*');
    if (!star)
        return false;
    *star = 0;
    for (const char *letter = text; *letter; letter++)
        check ^= (uint8_t)*letter;
    return strtoul(star + 1, 0, 16) == check;
}

/* Take a whole line; now: micros(). Whether it was taken. */
static inline bool omnidyn_take(omnidyn_line *line, uint32_t now, char *text)
{
    float inputs[OMNIDYN_WHEELS];
    uint32_t fields[4], difference;
    char *next = text + 1;
    int k;
    if (!omnidyn_checked(text))
        return false;
    if (text[0] == 'S') {
        omnidyn_off(line);
        return true;
    }
    if (text[0] != 'C')
        return false;
    for (k = 0; k < 4; k++) {
        if (*next != ',')
            return false;
        fields[k] = (uint32_t)strtoul(next + 1, &next, 10);
    }
    for (k = 0; k < OMNIDYN_WHEELS; k++) {
        if (*next != ',')
            return false;
        inputs[k] = (float)strtod(next + 1, &next);
    }
    if (*next)
        return false;
    difference = now - fields[2];
    if (fields[1] == 0 && (int32_t)fields[0] != line->session) {
        line->session = (int32_t)fields[0];
        line->difference = difference;
    }
    if ((int32_t)fields[0] != line->session || (fields[1] != 0 && (int32_t)fields[1] <= line->number))
        return false;
    if ((int32_t)(difference - line->difference) < 0)
        line->difference = difference;
    if (fields[1] == 0) {
        line->number = 0;
        omnidyn_off(line);
        return true;
    }
    if (difference - line->difference >= fields[3])
        return false; /* too late */
    line->number = (int32_t)fields[1];
    line->end = fields[2] + line->difference + fields[3];
    line->taken = now;
    line->acts = true;
    memcpy(line->inputs, inputs, sizeof inputs);
    return true;
}

/* A letter from the line. */
static inline void omnidyn_letter(omnidyn_line *line, uint32_t now, char letter)
{
    if (letter != '\\n' && letter != '\\r') {
        line->text[line->length < OMNIDYN_LONGEST - 1 ? line->length++ : OMNIDYN_LONGEST - 1] = letter;
        return;
    }
    line->text[line->length] = 0;
    if (line->length > 0 && line->length < OMNIDYN_LONGEST - 1)
        omnidyn_take(line, now, line->text);
    line->length = 0;
}

/* What the motors get now: off where the command that acts is over. */
static inline const float *omnidyn_acting(omnidyn_line *line, uint32_t now)
{
    if (line->acts && (uint32_t)(now - line->taken) >= (uint32_t)(line->end - line->taken))
        omnidyn_off(line);
    return line->inputs;
}

#endif
"""

_SKETCH = """
@ABOUT@
#define OMNIDYN_BY_LINE 1 /* 1: commands come by line; 0: the table is driven, and the log printed */

#include "omnidyn_drive.h"
#include "omnidyn_line.h"

/* Yours: what the motors take (@UNIT@), how far the wheels turned [rad], the supply [V] or NAN, the key. */
static void motor(int wheel, float input) { (void)wheel; (void)input; }
static float angle(int wheel) { (void)wheel; return 0.0f; }
static float supply() { return NAN; }
#if !OMNIDYN_BY_LINE
static bool held() { return false; }
static omnidyn_drive drive;
#endif
static omnidyn_line line;
static uint32_t printed;

void setup()
{
    Serial.begin(115200);
    line.session = -1;
#if !OMNIDYN_BY_LINE
    Serial.print("t_s");
    for (int wheel = 1; wheel <= OMNIDYN_WHEELS; wheel++) {
        char name[24];
        snprintf(name, sizeof name, ",@COLUMN@,a%d_rad", wheel, wheel);
        Serial.print(name);
    }
    Serial.println();
#endif
}

#if OMNIDYN_BY_LINE
static uint8_t check;

static void put(const char *text)
{
    for (const char *letter = text; *letter; letter++)
        check ^= (uint8_t)*letter;
    Serial.print(text);
}

/* M,T_US,SESSION,NUMBER,a1_rad=..,supply_V=..*HH */
static void measured(uint32_t now)
{
    char text[32], digits[16];
    check = 0;
    snprintf(text, sizeof text, "M,%lu,%ld", (unsigned long)now, (long)line.session);
    put(text);
    snprintf(text, sizeof text, ",%ld", (long)line.number);
    put(text);
    for (int wheel = 0; wheel < OMNIDYN_WHEELS; wheel++) {
        dtostrf(angle(wheel), 1, 5, digits);
        snprintf(text, sizeof text, ",a%d_rad=%s", wheel + 1, digits);
        put(text);
    }
    if (!isnan(supply())) {
        dtostrf(supply(), 1, 3, digits);
        snprintf(text, sizeof text, ",supply_V=%s", digits);
        put(text);
    }
    snprintf(text, sizeof text, "*%02X", check);
    Serial.println(text);
}

void loop()
{
    while (Serial.available())
        omnidyn_letter(&line, micros(), (char)Serial.read());
    const float *inputs = omnidyn_acting(&line, micros());
    for (int wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
        motor(wheel, inputs[wheel]);
    if ((uint32_t)(millis() - printed) >= (uint32_t)(1000.0f * OMNIDYN_DT)) {
        printed = millis();
        measured(micros());
    }
}
#else
void loop()
{
    float inputs[OMNIDYN_WHEELS], angles[OMNIDYN_WHEELS];
    uint32_t now = millis();
    for (int wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
        angles[wheel] = angle(wheel);
    int status = omnidyn_drive_step(&drive, now, held(), angles, supply(), inputs);
    for (int wheel = 0; wheel < OMNIDYN_WHEELS; wheel++)
        motor(wheel, inputs[wheel]);
    if (status == OMNIDYN_RUNNING && (uint32_t)(now - printed) >= (uint32_t)(1000.0f * OMNIDYN_DT)) {
        printed = now;
        Serial.print(1e-3f * (float)(uint32_t)(now - drive.begun), 3);
        for (int wheel = 0; wheel < OMNIDYN_WHEELS; wheel++) {
            Serial.print(",");
            Serial.print(inputs[wheel], 4);
            Serial.print(",");
            Serial.print(angles[wheel], 5);
        }
        Serial.println();
    }
}
#endif
"""
