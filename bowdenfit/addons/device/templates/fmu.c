/*
$about
 *
 * FMI 2.0 for co-simulation, as a wrapper of bowden.h, which is compiled in. Each communication step is one step of the play
 * operator, with the inputs at the beginning of the step.
 */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "bowden.h"

#define GUID "$guid"

#ifdef _WIN32
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif

/* Types of the standard FMI 2.0.4, sections 2.1 and 4.2. */
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

/* Value references, as in modelDescription.xml. */
enum { INPUT_FORCE, PLACE, SPEED, WANTED_FORCE, OUTPUT_FORCE, PULLING, RETURNING, NEEDED_PULLING, NEEDED_RETURNING, N_REAL };
enum { LEVEL, FLAGS };

typedef struct {
    double set[WANTED_FORCE + 1];
    double output;
    int level, flags;
} Values;

typedef struct {
    Values now;
    const fmi2CallbackFunctions *functions;
    char name[128];
} Instance;

static void start(Instance *it)
{
    const Values first = {{0.0, $first_place, BOWDEN_REFERENCE_SPEED, 0.0}, NAN, BOWDEN_Q50, 0};

    it->now = first;
}

static fmi2Status failed(const Instance *it, fmi2String words)
{
    if (it->functions && it->functions->logger) {
        it->functions->logger(it->functions->componentEnvironment, it->name, fmi2Error, "logStatusError", words);
    }
    return fmi2Error;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

FMI2_EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                          const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Instance *it;

    (void)resources, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || !guid || strcmp(guid, GUID) != 0) {
        return NULL;
    }
    it = functions && functions->allocateMemory ? functions->allocateMemory(1, sizeof *it) : calloc(1, sizeof *it);
    if (it) {
        it->functions = functions;
        strncpy(it->name, name ? name : "", sizeof it->name - 1);
        start(it);
    }
    return it;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    Instance *it = c;

    if (it && it->functions && it->functions->freeMemory) {
        it->functions->freeMemory(it);
    } else {
        free(it);
    }
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start_time,
                                           fmi2Boolean has_stop, fmi2Real stop)
{
    (void)c, (void)has_tolerance, (void)tolerance, (void)start_time, (void)has_stop, (void)stop;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    start(c);
    return fmi2OK;
}

static double real(const Instance *it, fmi2ValueReference which)
{
    const double *set = it->now.set;
    const int level = it->now.level;
    double middle = NAN;

    switch (which) {
    case OUTPUT_FORCE: /* before the first step: the initial force */
        return isnan(it->now.output) ? bowden_step(level, set[PLACE], set[SPEED], set[INPUT_FORCE], &middle, NULL)
                                     : it->now.output;
    case PULLING:
        return bowden_output(level, set[PLACE], set[SPEED], set[INPUT_FORCE], 1, NULL);
    case RETURNING:
        return bowden_output(level, set[PLACE], set[SPEED], set[INPUT_FORCE], -1, NULL);
    case NEEDED_PULLING:
        return bowden_input(level, set[PLACE], set[SPEED], set[WANTED_FORCE], 1, NULL);
    case NEEDED_RETURNING:
        return bowden_input(level, set[PLACE], set[SPEED], set[WANTED_FORCE], -1, NULL);
    default:
        return set[which];
    }
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, fmi2Real values[])
{
    size_t i;

    for (i = 0; i < n; i++) {
        if (which[i] >= N_REAL) {
            return failed(c, "there is no such real variable");
        }
        values[i] = real(c, which[i]);
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Real values[])
{
    Instance *it = c;
    size_t i;

    for (i = 0; i < n; i++) {
        if (which[i] > WANTED_FORCE) {
            return failed(it, "only the inputs can be set");
        }
        if (isnan(values[i])) {
            return failed(it, "an input is not a number");
        }
        it->now.set[which[i]] = values[i];
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference which[], size_t n, fmi2Integer values[])
{
    const Instance *it = c;
    size_t i;

    for (i = 0; i < n; i++) {
        if (which[i] > FLAGS) {
            return failed(it, "there is no such integer variable");
        }
        values[i] = which[i] == LEVEL ? it->now.level : it->now.flags;
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Integer values[])
{
    Instance *it = c;
    size_t i;

    for (i = 0; i < n; i++) {
        if (which[i] != LEVEL || values[i] < 0 || values[i] >= BOWDEN_LEVELS) {
            return failed(it, "there is no such level of friction");
        }
        it->now.level = values[i];
    }
    return fmi2OK;
}

/* The model has no Boolean and no string variables. */
#define NOT_THERE(name, ...)                                                                      \
    FMI2_EXPORT fmi2Status name(fmi2Component c, const fmi2ValueReference which[], size_t n, __VA_ARGS__) \
    {                                                                                             \
        (void)which, (void)values;                                                                \
        return n ? failed(c, "there is no such variable") : fmi2OK;                               \
    }
NOT_THERE(fmi2GetBoolean, fmi2Boolean values[])
NOT_THERE(fmi2SetBoolean, const fmi2Boolean values[])
NOT_THERE(fmi2GetString, fmi2String values[])
NOT_THERE(fmi2SetString, const fmi2String values[])
#define NOT_DERIVED(name, ...)                                                                    \
    FMI2_EXPORT fmi2Status name(fmi2Component c, const fmi2ValueReference which[], size_t n, const fmi2Integer order[], __VA_ARGS__) \
    {                                                                                             \
        (void)which, (void)order, (void)values;                                                   \
        return n ? failed(c, "derivatives are not known") : fmi2OK;                               \
    }
NOT_DERIVED(fmi2SetRealInputDerivatives, const fmi2Real values[])
NOT_DERIVED(fmi2GetRealOutputDerivatives, fmi2Real values[])

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                                    const fmi2ValueReference known[], size_t m, const fmi2Real by[],
                                                    fmi2Real values[])
{
    (void)unknown, (void)known, (void)m, (void)by, (void)values;
    return n ? failed(c, "derivatives are not known") : fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    const Instance *it = c;

    if (!*state) {
        *state = malloc(sizeof it->now);
    }
    if (!*state) {
        return failed(it, "no memory is left");
    }
    memcpy(*state, &it->now, sizeof it->now);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Instance *it = c;

    memcpy(&it->now, state, sizeof it->now);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Values);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (size < sizeof(Values)) {
        return failed(c, "there is no room for the state");
    }
    memcpy(bytes, state, sizeof(Values));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size < sizeof(Values)) {
        return failed(c, "that is no state");
    }
    if (!*state) {
        *state = malloc(sizeof(Values));
    }
    if (!*state) {
        return failed(c, "no memory is left");
    }
    memcpy(*state, bytes, sizeof(Values));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real at, fmi2Real step, fmi2Boolean keeps_state)
{
    Instance *it = c;
    const double *set = it->now.set;

    (void)at, (void)step, (void)keeps_state;
    it->now.flags = 0;
    bowden_step(it->now.level, set[PLACE], set[SPEED], set[INPUT_FORCE], &it->now.output, &it->now.flags);
    return it->now.flags & BOWDEN_INVALID ? failed(it, "an input is not a number") : fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    return failed(c, "steps are done at once");
}

#define NO_STATUS(name, kind)                                             \
    FMI2_EXPORT fmi2Status name(fmi2Component c, const fmi2StatusKind asked, kind *value) \
    {                                                                     \
        (void)c, (void)asked, (void)value;                                \
        return fmi2Discard;                                               \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, fmi2Real)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)
