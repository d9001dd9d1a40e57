/* A co-simulation unit (FMI 3.0) about the functions of MODEL.h. Its steps have one length; a longer communication step
   is several, within which inputs go in a straight line from their last values to the new ones. */
#include "MODEL.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif
#if defined(FMI3_FUNCTION_PREFIX)
#define JOINED(a, b) a##b
#define WITH_PREFIX(a, b) JOINED(a, b)
#define F(type, name) EXPORTED type WITH_PREFIX(FMI3_FUNCTION_PREFIX, name)
#else
#define F(type, name) EXPORTED type name
#endif

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef uint32_t Reference;
typedef const char *String;

typedef struct {
    double time;
    double input[INPUTS], last[INPUTS]; /* command, then what blows, now and at the end of the last step */
    double parameter[PARAMETERS];       /* motion at the start, and minutes since the beginning of the log */
    double state[STATES];
    bool ready;
} Unit;

typedef void (*Log)(void *environment, Status status, String category, String message);
typedef struct {
    Unit unit; /* first, so that an instance is its unit; what follows belongs to the process, not to the state */
    void *environment;
    Log log;
} Instance;

#define QUOTED(text) #text
#define TEXT(value) QUOTED(value)

static Status get(const Unit *unit, Reference reference, double *value)
{
    if (reference == 0) *value = unit->time;
    else if (reference <= INPUTS) *value = unit->input[reference - 1];
    else if (reference <= INPUTS + PARAMETERS) *value = unit->parameter[reference - 1 - INPUTS];
    else if (reference <= INPUTS + PARAMETERS + 6)
        *value = unit->ready ? unit->state[reference - 1 - INPUTS - PARAMETERS]
                             : unit->parameter[reference - 1 - INPUTS - PARAMETERS];
    else return ERROR;
    return OK;
}

static void begin(Unit *unit)
{
    const double *input = unit->input, *parameter = unit->parameter;
    double *state = unit->state;
    (void)input;
    START;
    memcpy(unit->last, unit->input, sizeof unit->last);
    unit->ready = true;
}

static void reset(Unit *unit)
{
    static const double begun[INPUTS] = {BEGUN};
    memset(unit, 0, sizeof *unit);
    memcpy(unit->input, begun, sizeof begun);
}

F(String, fmi3GetVersion)(void) { return "3.0"; }

F(Status, fmi3SetDebugLogging)(void *unit, bool on, size_t count, const String categories[])
{
    (void)unit, (void)on, (void)count, (void)categories;
    return OK;
}

F(void *, fmi3InstantiateCoSimulation)(String name, String token, String path, bool visible, bool logs, bool events,
    bool early, const Reference required[], size_t count, void *environment, Log log, void *update)
{
    Instance *made;
    (void)name, (void)path, (void)visible, (void)logs, (void)early, (void)required, (void)count;
    (void)update;
    if (events || !token || strcmp(token, TOKEN) != 0) return NULL;
    made = (Instance *)malloc(sizeof *made);
    if (!made) return NULL;
    reset(&made->unit);
    made->environment = environment;
    made->log = log;
    return made;
}

F(void *, fmi3InstantiateModelExchange)(String name, String token, String path, bool visible, bool logs,
    void *environment, void *log)
{
    (void)name, (void)token, (void)path, (void)visible, (void)logs, (void)environment, (void)log;
    return NULL;
}

F(void *, fmi3InstantiateScheduledExecution)(String name, String token, String path, bool visible, bool logs,
    void *environment, void *log, void *clock, void *lock, void *unlock)
{
    (void)name, (void)token, (void)path, (void)visible, (void)logs, (void)environment, (void)log;
    (void)clock, (void)lock, (void)unlock;
    return NULL;
}

F(void, fmi3FreeInstance)(void *unit) { free(unit); }

F(Status, fmi3EnterInitializationMode)(void *unit, bool tolerates, double tolerance, double start, bool stops, double stop)
{
    (void)tolerates, (void)tolerance, (void)stops, (void)stop;
    ((Unit *)unit)->time = start;
    return OK;
}

F(Status, fmi3ExitInitializationMode)(void *unit) { begin((Unit *)unit); return OK; }

F(Status, fmi3Terminate)(void *unit) { (void)unit; return OK; }

F(Status, fmi3Reset)(void *unit) { reset((Unit *)unit); return OK; }

F(Status, fmi3GetFloat64)(void *unit, const Reference references[], size_t count, double values[], size_t size)
{
    size_t k;
    if (count != size) return ERROR;
    for (k = 0; k < count; k++)
        if (get((const Unit *)unit, references[k], values + k) != OK) return ERROR;
    return OK;
}

F(Status, fmi3SetFloat64)(void *given, const Reference references[], size_t count, const double values[], size_t size)
{
    Unit *unit = (Unit *)given;
    size_t k;
    if (count != size) return ERROR;
    for (k = 0; k < count; k++) {
        if (references[k] >= 1 && references[k] <= INPUTS) unit->input[references[k] - 1] = values[k];
        else if (!unit->ready && references[k] > INPUTS && references[k] <= INPUTS + PARAMETERS)
            unit->parameter[references[k] - 1 - INPUTS] = values[k];
        else return ERROR;
    }
    return OK;
}

F(Status, fmi3DoStep)(void *given, double time, double length, bool kept, bool *event, bool *terminate, bool *early,
    double *reached)
{
    Unit *unit = (Unit *)given;
    const double steps = floor(length / STEP + 0.5);
    const double *parameter = unit->parameter;
    double input[INPUTS], after[STATES], *state = unit->state;
    long k;
    int j;
    (void)kept, (void)parameter;
    *event = *terminate = *early = false;
    *reached = unit->time;
    if (!(steps >= 1.0) || fabs(length - steps * STEP) > 1e-6 * STEP) {
        const Instance *instance = (const Instance *)given;
        if (instance->log)
            instance->log(instance->environment, ERROR, "logStatusError",
                "fmi3DoStep: expected a communication step of " TEXT(STEP) " s or a multiple of it");
        return ERROR;
    }
    for (k = 1; k <= (long)steps; k++) {
        const double share = (double)k / steps;
        const double minutes = CLOCK + (time + (double)(k - 1) * STEP) / 60.0;
        (void)minutes;
        for (j = 0; j < INPUTS; j++) input[j] = unit->last[j] + share * (unit->input[j] - unit->last[j]);
        NEXT;
        memcpy(state, after, sizeof after);
    }
    memcpy(unit->last, unit->input, sizeof unit->last);
    unit->time = *reached = time + length;
    return OK;
}

F(Status, fmi3GetFMUState)(void *unit, void **copy)
{
    if (!*copy) *copy = malloc(sizeof(Unit));
    if (!*copy) return ERROR;
    memcpy(*copy, unit, sizeof(Unit));
    return OK;
}

F(Status, fmi3SetFMUState)(void *unit, void *copy) { memcpy(unit, copy, sizeof(Unit)); return OK; }

F(Status, fmi3FreeFMUState)(void *unit, void **copy) { (void)unit; free(*copy); *copy = NULL; return OK; }

F(Status, fmi3SerializedFMUStateSize)(void *unit, void *copy, size_t *size)
{
    (void)unit, (void)copy;
    *size = sizeof(Unit);
    return OK;
}

F(Status, fmi3SerializeFMUState)(void *unit, void *copy, uint8_t bytes[], size_t size)
{
    (void)unit;
    if (size != sizeof(Unit)) return ERROR;
    memcpy(bytes, copy, size);
    return OK;
}

F(Status, fmi3DeserializeFMUState)(void *unit, const uint8_t bytes[], size_t size, void **copy)
{
    (void)unit;
    if (size != sizeof(Unit)) return ERROR;
    if (!*copy) *copy = malloc(size);
    if (!*copy) return ERROR;
    memcpy(*copy, bytes, size);
    return OK;
}

/* What a unit without other types, clocks, events and derivatives is never asked. */
#define NEVER(name) F(Status, name)(void *unit) { (void)unit; return ERROR; }
NEVER(fmi3EnterEventMode) NEVER(fmi3EnterStepMode) NEVER(fmi3EnterConfigurationMode) NEVER(fmi3ExitConfigurationMode)
NEVER(fmi3GetFloat32) NEVER(fmi3GetInt8) NEVER(fmi3GetUInt8) NEVER(fmi3GetInt16) NEVER(fmi3GetUInt16) NEVER(fmi3GetInt32)
NEVER(fmi3GetUInt32) NEVER(fmi3GetInt64) NEVER(fmi3GetUInt64) NEVER(fmi3GetBoolean) NEVER(fmi3GetString)
NEVER(fmi3GetBinary) NEVER(fmi3GetClock) NEVER(fmi3SetFloat32) NEVER(fmi3SetInt8) NEVER(fmi3SetUInt8)
NEVER(fmi3SetInt16) NEVER(fmi3SetUInt16) NEVER(fmi3SetInt32) NEVER(fmi3SetUInt32) NEVER(fmi3SetInt64)
NEVER(fmi3SetUInt64) NEVER(fmi3SetBoolean) NEVER(fmi3SetString) NEVER(fmi3SetBinary) NEVER(fmi3SetClock)
NEVER(fmi3GetNumberOfVariableDependencies) NEVER(fmi3GetVariableDependencies) NEVER(fmi3GetDirectionalDerivative)
NEVER(fmi3GetAdjointDerivative) NEVER(fmi3GetIntervalDecimal) NEVER(fmi3GetIntervalFraction)
NEVER(fmi3GetShiftDecimal) NEVER(fmi3GetShiftFraction) NEVER(fmi3SetIntervalDecimal) NEVER(fmi3SetIntervalFraction)
NEVER(fmi3SetShiftDecimal) NEVER(fmi3SetShiftFraction) NEVER(fmi3EvaluateDiscreteStates)
NEVER(fmi3UpdateDiscreteStates) NEVER(fmi3EnterContinuousTimeMode) NEVER(fmi3CompletedIntegratorStep)
NEVER(fmi3SetTime) NEVER(fmi3SetContinuousStates) NEVER(fmi3GetContinuousStateDerivatives)
NEVER(fmi3GetEventIndicators) NEVER(fmi3GetContinuousStates) NEVER(fmi3GetNominalsOfContinuousStates)
NEVER(fmi3GetNumberOfEventIndicators) NEVER(fmi3GetNumberOfContinuousStates) NEVER(fmi3GetOutputDerivatives)
NEVER(fmi3ActivateModelPartition)
