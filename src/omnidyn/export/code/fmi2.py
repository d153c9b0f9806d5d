"""The C around the step that makes it an FMI 2 co-simulation unit: the functions that the standard asks for.

Written from the standard (FMI 2.0.4, modelica.org); no header of it is included, so that the file compiles alone.
"""

from __future__ import annotations

FMI2_C = r"""
/* A library of it: gcc -std=c99 -O2 -shared -fPIC -o NAME.so NAME.c -lm, or cl /O2 /LD NAME.c on Windows. It belongs
   into binaries/linux64, win64 or darwin64 of the FMU; for FMI 3 into x86_64-linux, aarch64-linux and so on. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32 || defined __CYGWIN__
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

@STATUS@

@STEP@

enum { WHEELS = @WHEELS@, STATE = 6, VARIABLES = WHEELS + 2 * STATE, MEMORY = @MEMORY@ };

/* values: volts, then twist and pose, then where both start; memory: what a step leaves to the next one. */
typedef struct {
    double values[VARIABLES], memory[MEMORY], time;
} Unit;

static void begin(Unit *unit)
{
    int k;
    for (k = 0; k < STATE; k++) {
        unit->values[WHEELS + k] = unit->values[WHEELS + STATE + k];
    }
    memset(unit->memory, 0, sizeof(unit->memory));
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                                     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name, (void)place, (void)functions, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || guid == NULL || strcmp(guid, "@GUID@") != 0) {
        return NULL;
    }
    return calloc(1, sizeof(Unit));
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Unit *)c)->time = start;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    begin(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    memset(c, 0, sizeof(Unit));
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, fmi2Real values[])
{
    size_t k;
    for (k = 0; k < n; k++) {
        if (which[k] >= VARIABLES) {
            return fmi2Error;
        }
        values[k] = ((Unit *)c)->values[which[k]];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Real values[])
{
    size_t k;
    for (k = 0; k < n; k++) {
        const fmi2ValueReference v = which[k];
        const double most = v < WHEELS ? DBL_MAX : v < WHEELS + STATE + 3 ? @TWIST@ : @POSE@;
        if (v >= VARIABLES || (v >= WHEELS && v < WHEELS + STATE) || !all_within(values + k, 1, most)) {
            return fmi2Error;
        }
        ((Unit *)c)->values[which[k]] = values[k];
        if (which[k] >= WHEELS + STATE) { /* where it starts is seen at once */
            begin(c);
        }
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real length, fmi2Boolean final)
{
    Unit *unit = c;
    (void)final;
    if (!(length >= 0.0) || !isfinite(length)) {
        return fmi2Error;
    }
    if (length > 0.0 && omnidyn_advance(unit->values, length, unit->values + WHEELS, unit->values + WHEELS + 3,
                                        @PASSED@) != OMNIDYN_STEP_OK) {
        return fmi2Error;
    }
    unit->time = now + length;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    (void)c;
    return fmi2Error;
}

EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = ((Unit *)c)->time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state == NULL && (*state = malloc(sizeof(Unit))) == NULL) {
        return fmi2Error;
    }
    memcpy(*state, c, sizeof(Unit));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Unit));
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Unit);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(Unit)) {
        return fmi2Error;
    }
    memcpy(bytes, state, sizeof(Unit));
    return fmi2OK;
}

/* A state that another unit has written is one of numbers: a step says whether they make sense. */
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size != sizeof(Unit) || fmi2GetFMUstate(c, state) != fmi2OK) {
        return fmi2Error;
    }
    memcpy(*state, bytes, sizeof(Unit));
    return fmi2OK;
}

/* What the unit does not have: other types of variables, derivatives. */
#define NONE(name, ...)                                                                                               \
    EXPORT fmi2Status name(__VA_ARGS__);                                                                              \
    EXPORT fmi2Status name(__VA_ARGS__)

#define MANY(name, type)                                                                                              \
    NONE(name, fmi2Component c, const fmi2ValueReference which[], size_t n, type values[])                            \
    {                                                                                                                 \
        (void)c, (void)which, (void)values;                                                                           \
        return n == 0 ? fmi2OK : fmi2Error;                                                                           \
    }

MANY(fmi2GetInteger, fmi2Integer)
MANY(fmi2GetBoolean, fmi2Boolean)
MANY(fmi2GetString, fmi2String)
MANY(fmi2SetInteger, const fmi2Integer)
MANY(fmi2SetBoolean, const fmi2Boolean)
MANY(fmi2SetString, const fmi2String)

#define STATUS(name, type)                                                                                            \
    NONE(name, fmi2Component c, const fmi2StatusKind kind, type *value)                                               \
    {                                                                                                                 \
        (void)c, (void)kind, (void)value;                                                                             \
        return fmi2Discard;                                                                                           \
    }

STATUS(fmi2GetStatus, fmi2Status)
STATUS(fmi2GetIntegerStatus, fmi2Integer)
STATUS(fmi2GetBooleanStatus, fmi2Boolean)
STATUS(fmi2GetStringStatus, fmi2String)

NONE(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference unknown[], size_t many,
     const fmi2ValueReference known[], size_t n, const fmi2Real change[], fmi2Real values[])
{
    (void)c, (void)unknown, (void)many, (void)known, (void)n, (void)change, (void)values;
    return fmi2Error;
}

NONE(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference which[], size_t n,
     const fmi2Integer order[], const fmi2Real values[])
{
    (void)c, (void)which, (void)n, (void)order, (void)values;
    return fmi2Error;
}

NONE(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference which[], size_t n,
     const fmi2Integer order[], fmi2Real values[])
{
    (void)c, (void)which, (void)n, (void)order, (void)values;
    return fmi2Error;
}
"""
