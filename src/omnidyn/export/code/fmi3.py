"""The same unit for FMI 3: its description, and the functions of FMI 3 on top of those of FMI 2 (fmu.py)."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

from omnidyn.export.spelling import attribute

BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
 <BuildConfiguration modelIdentifier="{name}">
  <SourceFileSet language="C99"><SourceFile name="{name}.c"/></SourceFileSet>
 </BuildConfiguration>
</fmiBuildDescription>
"""


def description(
    title: str, words: str, name: str, guid: str, units: str, variables: Iterable[tuple[str, str, str]]
) -> str:
    """modelDescription.xml.

    Args:
        title: of the robot.
        words: about it.
        name: of the library.
        guid: of the unit.
        units: their definitions.
        variables: (name, causality, unit) in the order of their references, time behind them.
    """
    kinds = {
        "input": 'variability="continuous" start="0"',
        "output": 'variability="continuous" initial="calculated"',
        "parameter": 'variability="fixed" start="0"',
    }
    rows = list(variables)
    lines = [
        f'  <Float64 name={quoteattr(variable)} valueReference="{k}" causality="{kind}" {kinds[kind]} unit="{unit}"/>'
        for k, (variable, kind, unit) in enumerate(rows)
    ]
    lines.append(
        f'  <Float64 name="time" valueReference="{len(rows)}" causality="independent" variability="continuous"/>'
    )
    outputs = [k for k, (_, kind, _) in enumerate(rows) if kind == "output"]
    structure = [
        f'  <{tag} valueReference="{k}" dependencies=""/>' for tag in ("Output", "InitialUnknown") for k in outputs
    ]
    newline = "\n"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName={attribute(title)} instantiationToken="{guid}"
 description={attribute(words)} generationTool="omnidyn" variableNamingConvention="flat">
 <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"
  canSerializeFMUState="true"/>
 <UnitDefinitions>
{units}
 </UnitDefinitions>
 <DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>
 <ModelVariables>
{newline.join(lines)}
 </ModelVariables>
 <ModelStructure>
{newline.join(structure)}
 </ModelStructure>
</fmiModelDescription>
"""


FMI3_C = r"""
/* FMI 3 on top of FMI 2: what a unit for co-simulation without events, clocks and other types of variables has. */
#include <stdbool.h>
#include <stdint.h>

#if defined __GNUC__ || defined __clang__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

typedef uint32_t fmi3ValueReference;
typedef fmi2Status fmi3Status;
typedef void *fmi3Instance;
typedef const char *fmi3String;

#define WHICH fmi3Instance c, const fmi3ValueReference which[], size_t n

EXPORT const char *fmi3GetVersion(void);
EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

#define HAS(name, parameters)                                                                                         \
    EXPORT fmi3Status name parameters;                                                                                \
    EXPORT fmi3Status name parameters

#define NOTHING(name, parameters) HAS(name, parameters) { return fmi2OK; }
#define LACKS(name, parameters) HAS(name, parameters) { return fmi2Error; }
#define UNIT(name, parameters)                                                                                        \
    EXPORT fmi3Instance name parameters;                                                                              \
    EXPORT fmi3Instance name parameters
#define NO_UNIT(name, parameters) UNIT(name, parameters) { return NULL; }
#define NO_TYPE(name, type)                                                                                           \
    HAS(fmi3Get##name, (WHICH, type values[], size_t count)) { return n == 0 ? fmi2OK : fmi2Error; }                  \
    HAS(fmi3Set##name, (WHICH, const type values[], size_t count)) { return n == 0 ? fmi2OK : fmi2Error; }

UNIT(fmi3InstantiateCoSimulation, (fmi3String name, fmi3String token, fmi3String place, bool visible, bool logging,
                                   bool events, bool early, const fmi3ValueReference required[], size_t n,
                                   void *environment, void (*message)(void *, fmi3Status, fmi3String, fmi3String),
                                   void (*update)(void *, double, bool, bool, bool, bool, bool *, double *)))
{
    return fmi2Instantiate(name, fmi2CoSimulation, token, place, NULL, visible, logging);
}

NO_UNIT(fmi3InstantiateModelExchange, (fmi3String name, fmi3String token, fmi3String place, bool visible, bool logging,
                                       void *environment, void (*message)(void)))
NO_UNIT(fmi3InstantiateScheduledExecution,
        (fmi3String name, fmi3String token, fmi3String place, bool visible, bool logging, void *environment,
         void (*message)(void), void (*update)(void), void (*lock)(void), void (*unlock)(void)))

EXPORT void fmi3FreeInstance(fmi3Instance c);
EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

HAS(fmi3EnterInitializationMode,
    (fmi3Instance c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop))
{
    return fmi2SetupExperiment(c, has_tolerance, tolerance, start, has_stop, stop);
}

HAS(fmi3ExitInitializationMode, (fmi3Instance c)) { return fmi2ExitInitializationMode(c); }
HAS(fmi3Reset, (fmi3Instance c)) { return fmi2Reset(c); }
HAS(fmi3GetFMUState, (fmi3Instance c, void **state)) { return fmi2GetFMUstate(c, state); }
HAS(fmi3SetFMUState, (fmi3Instance c, void *state)) { return fmi2SetFMUstate(c, state); }
HAS(fmi3FreeFMUState, (fmi3Instance c, void **state)) { return fmi2FreeFMUstate(c, state); }
HAS(fmi3SerializedFMUStateSize, (fmi3Instance c, void *state, size_t *size))
{
    return fmi2SerializedFMUstateSize(c, state, size);
}

HAS(fmi3SerializeFMUState, (fmi3Instance c, void *state, uint8_t bytes[], size_t size))
{
    return fmi2SerializeFMUstate(c, state, (fmi2Byte *)bytes, size);
}

HAS(fmi3DeserializeFMUState, (fmi3Instance c, const uint8_t bytes[], size_t size, void **state))
{
    return fmi2DeSerializeFMUstate(c, (const fmi2Byte *)bytes, size, state);
}

HAS(fmi3GetFloat64, (WHICH, double values[], size_t count))
{
    size_t k;
    for (k = 0; k < n; k++) {
        const fmi2ValueReference v = which[k];
        if (v == VARIABLES) {
            values[k] = ((Unit *)c)->time;
        } else if (fmi2GetReal(c, &v, 1, values + k) != fmi2OK) {
            return fmi2Error;
        }
    }
    return count == n ? fmi2OK : fmi2Error;
}

HAS(fmi3SetFloat64, (WHICH, const double values[], size_t count))
{
    size_t k;
    for (k = 0; k < n; k++) {
        const fmi2ValueReference v = which[k];
        if (fmi2SetReal(c, &v, 1, values + k) != fmi2OK) {
            return fmi2Error;
        }
    }
    return count == n ? fmi2OK : fmi2Error;
}

HAS(fmi3DoStep, (fmi3Instance c, double now, double length, bool final, bool *event, bool *terminate, bool *early,
                 double *last))
{
    const fmi3Status status = fmi2DoStep(c, now, length, final);
    *event = *terminate = *early = false;
    *last = ((Unit *)c)->time;
    return status;
}

NOTHING(fmi3SetDebugLogging, (fmi3Instance c, bool on, size_t n, const fmi3String categories[]))
NOTHING(fmi3Terminate, (fmi3Instance c))
NOTHING(fmi3EnterStepMode, (fmi3Instance c))
NOTHING(fmi3EnterConfigurationMode, (fmi3Instance c))
NOTHING(fmi3ExitConfigurationMode, (fmi3Instance c))
NO_TYPE(Float32, float)
NO_TYPE(Int8, int8_t)
NO_TYPE(UInt8, uint8_t)
NO_TYPE(Int16, int16_t)
NO_TYPE(UInt16, uint16_t)
NO_TYPE(Int32, int32_t)
NO_TYPE(UInt32, uint32_t)
NO_TYPE(Int64, int64_t)
NO_TYPE(UInt64, uint64_t)
NO_TYPE(Boolean, bool)
NO_TYPE(String, fmi3String)
LACKS(fmi3GetBinary, (WHICH, size_t sizes[], const uint8_t *values[], size_t count))
LACKS(fmi3SetBinary, (WHICH, const size_t sizes[], const uint8_t *const values[], size_t count))
LACKS(fmi3GetClock, (WHICH, bool values[]))
LACKS(fmi3SetClock, (WHICH, const bool values[]))
LACKS(fmi3GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference v, size_t *count))
LACKS(fmi3GetVariableDependencies, (fmi3Instance c, fmi3ValueReference v, size_t of[], fmi3ValueReference which[],
                                    size_t at[], int kinds[], size_t count))
LACKS(fmi3GetDirectionalDerivative, (WHICH, const fmi3ValueReference known[], size_t many, const double seed[],
                                     size_t seeds, double values[], size_t count))
LACKS(fmi3GetAdjointDerivative, (WHICH, const fmi3ValueReference known[], size_t many, const double seed[],
                                 size_t seeds, double values[], size_t count))
LACKS(fmi3GetOutputDerivatives, (WHICH, const int32_t orders[], double values[], size_t count))
LACKS(fmi3EnterEventMode, (fmi3Instance c))
LACKS(fmi3EvaluateDiscreteStates, (fmi3Instance c))
LACKS(fmi3UpdateDiscreteStates, (fmi3Instance c, bool *a, bool *b, bool *d, bool *e, bool *f, double *next))
LACKS(fmi3GetIntervalDecimal, (WHICH, double intervals[], int qualifiers[]))
LACKS(fmi3GetIntervalFraction, (WHICH, uint64_t counters[], uint64_t resolutions[], int qualifiers[]))
LACKS(fmi3GetShiftDecimal, (WHICH, double shifts[]))
LACKS(fmi3GetShiftFraction, (WHICH, uint64_t counters[], uint64_t resolutions[]))
LACKS(fmi3SetIntervalDecimal, (WHICH, const double intervals[]))
LACKS(fmi3SetIntervalFraction, (WHICH, const uint64_t counters[], const uint64_t resolutions[]))
LACKS(fmi3SetShiftDecimal, (WHICH, const double shifts[]))
LACKS(fmi3SetShiftFraction, (WHICH, const uint64_t counters[], const uint64_t resolutions[]))
LACKS(fmi3EnterContinuousTimeMode, (fmi3Instance c))
LACKS(fmi3CompletedIntegratorStep, (fmi3Instance c, bool final, bool *event, bool *terminate))
LACKS(fmi3SetTime, (fmi3Instance c, double time))
LACKS(fmi3SetContinuousStates, (fmi3Instance c, const double states[], size_t n))
LACKS(fmi3GetContinuousStateDerivatives, (fmi3Instance c, double values[], size_t n))
LACKS(fmi3GetEventIndicators, (fmi3Instance c, double values[], size_t n))
LACKS(fmi3GetContinuousStates, (fmi3Instance c, double values[], size_t n))
LACKS(fmi3GetNominalsOfContinuousStates, (fmi3Instance c, double values[], size_t n))
LACKS(fmi3GetNumberOfEventIndicators, (fmi3Instance c, size_t *n))
LACKS(fmi3GetNumberOfContinuousStates, (fmi3Instance c, size_t *n))
LACKS(fmi3ActivateModelPartition, (fmi3Instance c, fmi3ValueReference clock, double time))
"""
