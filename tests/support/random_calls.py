"""Random calls of exported C under sanitizers: what it returns, and how long the slowest call takes."""

from __future__ import annotations

import json
import subprocess
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import omnidyn
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot

SANITIZERS = ("-std=c99", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
MOST_MEANS = 1000.0  # that the slowest call may take, of the mean of valid ones
VALID, ANY = 1, 0  # finite numbers of a size that robots have; anything


class Calls(NamedTuple):
    """returned: how often each status was returned. slowest, mean: processor time of one call [ms]. kept: whether a
    call that returned an error left its state alone."""

    returned: list[int]
    slowest: float
    mean: float
    kept: bool


class Program:
    """Exported C in a program that calls it, compiled with sanitizers or other flags."""

    def __init__(self, folder: Path, sources: list[str], defines: list[str], flags: tuple[str, ...]) -> None:
        self.folder = folder
        (folder / "calls.c").write_text(CALLS)
        command = ["gcc", *flags, *defines, "-o", "calls", "calls.c", *sources, "-lm"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)

    def run(self, count: int, kind: int) -> Calls:
        """Call it `count` times. Fails where a sanitizer has something to say."""
        said = subprocess.run(["./calls", str(count), str(kind)], cwd=self.folder, capture_output=True, text=True)
        assert (said.returncode, said.stderr) == (0, ""), said.stderr[:2000]
        return Calls(**json.loads(said.stdout))


def of_step(robot: Robot, folder: Path, flags: tuple[str, ...] = SANITIZERS, **options: Any) -> Program:
    """`omnidyn_step` of a c-model."""
    made = omnidyn.export.c_model(robot, **options)
    made.write(folder)
    memory = "OMNIDYN_MEMORY" in made.files["omnidyn_step.h"]
    more = ["-DMORE=OMNIDYN_MEMORY"] if memory else ["-DMORE=3"] if robot.motor.electrical == DYNAMIC else []
    return Program(folder, ["omnidyn_step.c"], [*more, '-DHEADER="omnidyn_step.h"'], flags)


def of_fmu(robot: Robot, folder: Path) -> Program:
    """`fmi2SetReal` of all inputs and starts, then `fmi2DoStep`, of the sources of an FMU."""
    folder.mkdir()
    omnidyn.export.fmu(robot, compiled=False).write(folder / "robot.fmu")
    with zipfile.ZipFile(folder / "robot.fmu") as archive:
        (name,) = (each for each in archive.namelist() if each.endswith(".c"))
        source = archive.read(name)
        guid = archive.read("modelDescription.xml").decode().partition('guid="')[2].partition('"')[0]
    (folder / "unit.c").write_bytes(source)
    return Program(folder, [], ["-DFMU", '-DHEADER="unit.c"', f'-DID="{guid}"'], SANITIZERS)


CALLS = r"""
#define _POSIX_C_SOURCE 199309L
#include HEADER
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef FMU
typedef double omnidyn_real;
enum { OMNIDYN_WHEELS = WHEELS };
#endif
#ifdef MORE
enum { NUMBERS = 6 + MORE };
#else
enum { NUMBERS = 6 };
#endif

static uint64_t state = 88172645463325252ULL;
static const double ODD[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 0.0, -0.0, 5e-324, 1e10, 1e5, 3600.0, 1e-300, 1e9,
                             1e3, -1e3};

static uint64_t next(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    return state ^= state << 17;
}

static double uniform(double a, double b) { return a + (b - a) * (double)(next() >> 11) / 9007199254740992.0; }

static double any(double low, double high)
{
    const double size = pow(10.0, uniform(low, high));
    return next() % 25 == 0 ? ODD[next() % (sizeof(ODD) / sizeof(ODD[0]))] : next() % 2 ? size : -size;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

int main(int argc, char **argv)
{
    const long count = argc > 2 ? atol(argv[1]) : 0;
    const int valid = argc > 2 && atoi(argv[2]);
    long returned[8] = {0}, k;
    double slowest = 0.0, sum = 0.0;
    int kept = 1, i;
#ifdef FMU
    Unit *unit = fmi2Instantiate("unit", fmi2CoSimulation, ID, "", NULL, 0, 0);
    if (unit == NULL) {
        return 1;
    }
#endif
    for (k = 0; k < count; k++) {
        omnidyn_real u[OMNIDYN_WHEELS], x[NUMBERS], before[NUMBERS], h;
        double begun, took;
        int status;
        for (i = 0; i < OMNIDYN_WHEELS; i++) {
            u[i] = (omnidyn_real)(valid ? uniform(-100.0, 100.0) : any(-3.0, 3.0));
        }
        for (i = 0; i < 3; i++) {
            x[i] = (omnidyn_real)(valid ? uniform(-1e3, 1e3) * (next() % 2 ? 1.0 : 1e-3) : any(-4.0, 3.2));
            x[3 + i] = (omnidyn_real)(valid ? uniform(-100.0, 100.0) : any(-4.0, 10.0));
        }
        for (i = 6; i < NUMBERS; i++) {
            x[i] = (omnidyn_real)(valid ? uniform(-50.0, 50.0) : any(-4.0, 10.0));
        }
        h = (omnidyn_real)(valid ? (next() % 2 ? uniform(1e-6, 1.0) : 1.0) : any(-6.0, 5.0));
        h = next() % 10 || valid ? (omnidyn_real)fabs(h) : h;
        memcpy(before, x, sizeof(x));
        begun = now();
#if defined FMU
        {
            fmi2ValueReference which[VARIABLES];
            double values[VARIABLES];
            for (i = 0; i < WHEELS; i++) {
                which[i] = (fmi2ValueReference)i, values[i] = u[i];
            }
            for (i = 0; i < STATE; i++) {
                which[WHEELS + i] = (fmi2ValueReference)(WHEELS + STATE + i), values[WHEELS + i] = x[i];
            }
            status = fmi2SetReal(unit, which, WHEELS + STATE, values);
            status = status == fmi2OK ? fmi2DoStep(unit, 0.0, h, 0) : status;
        }
#elif defined MORE
        status = omnidyn_step(u, h, x, x + 3, x + 6);
#else
        status = omnidyn_step(u, h, x, x + 3);
#endif
        took = now() - begun;
        slowest = took > slowest ? took : slowest;
        sum += took;
        returned[status]++;
        kept &= status == 0 || memcmp(before, x, sizeof(x)) == 0;
    }
#ifdef FMU
    fmi2FreeInstance(unit);
#endif
    printf("{\"slowest\": %.6f, \"mean\": %.6f, \"kept\": %s, \"returned\": [", slowest, sum / (double)count,
           kept ? "true" : "false");
    for (i = 0; i < 8; i++) {
        printf("%s%ld", i ? ", " : "", returned[i]);
    }
    printf("]}\n");
    return 0;
}
"""
