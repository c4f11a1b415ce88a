/* An FMU that does, in one of its functions, what it was told to.
 *
 * The folder of its resources holds the file "deed": FUNCTION KIND TIME, e.g. "fmi2DoStep crash 0.05"; before that
 * time (of the communication point, for the functions that are called while stepping) it behaves.
 */
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))

typedef void *Component;
typedef unsigned int Reference;
typedef int Status;
typedef const char *Text;
typedef void (*Logger)(void *, Text, Status, Text, Text, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, Status);
    void *environment;
} Callbacks;

enum { OK = 0, ERROR = 3 };

static char function_name[64], kind[32];
static double due = -1e300;
static double now = 0.0, sum = 0.0, input = 0.0;
static const Callbacks *known = NULL;

static void read_deed(Text resources)
{
    char path[4096];
    if (strncmp(resources, "file://", 7) == 0) resources += 7;
    snprintf(path, sizeof path, "%s/deed", resources);
    FILE *file = fopen(path, "r");
    if (file == NULL) return;
    if (fscanf(file, "%63s %31s %lf", function_name, kind, &due) < 2) function_name[0] = 0;
    fclose(file);
}

static void leave_a_child(int in_a_session_of_its_own)
{
    if (fork() == 0) {
        if (in_a_session_of_its_own) setsid();
        for (;;) pause();
    }
}

static void mark(void) /* the file that a test waits for */
{
    const char *path = getenv("HOSTILE_MARK");
    FILE *file = path == NULL ? NULL : fopen(path, "w");
    if (file != NULL) fclose(file);
}

static int is_due(Text name) { return strcmp(name, function_name) == 0 && now >= due - 1e-9; }

static Status huge_message(void) /* 64 MB */
{
    size_t length = (size_t)1 << 26;
    char *text = malloc(length + 1);
    memset(text, 'x', length);
    text[length] = 0;
    known->logger(known->environment, "bad", ERROR, "huge", "%s", text);
    free(text);
    return ERROR;
}

static Status deed(Text name)
{
    if (!is_due(name)) return OK;
    if (strcmp(kind, "crash") == 0) raise(SIGSEGV);
    if (strcmp(kind, "exit") == 0) exit(0);
    if (strcmp(kind, "_exit") == 0) _exit(0);
    if (strcmp(kind, "hang") == 0) { mark(); for (;;) pause(); }
    if (strcmp(kind, "fork") == 0) leave_a_child(0);
    if (strcmp(kind, "daemon") == 0) leave_a_child(1);
    if (strcmp(kind, "orphan") == 0) { leave_a_child(0); raise(SIGSEGV); }
    if (strcmp(kind, "error") == 0) return ERROR;
    if (strcmp(kind, "negative") == 0) return -7;
    if (strcmp(kind, "claim") == 0 && strcmp(name, "fmi2SerializedFMUstateSize") != 0) return huge_message();
    return OK;
}

static int claims(Text name) { return is_due(name) && strcmp(kind, "claim") == 0; }

EXPORT Text fmi2GetTypesPlatform(void) { return "default"; }
EXPORT Text fmi2GetVersion(void) { return "2.0"; }
EXPORT Status fmi2SetDebugLogging(Component c, int on, size_t n, const Text *categories) { return OK; }

EXPORT Component fmi2Instantiate(Text name, int type, Text guid, Text resources, const Callbacks *callbacks,
                                 int visible, int logging)
{
    read_deed(resources);
    known = callbacks;
    if (deed("fmi2Instantiate") != OK) return NULL;
    return calloc(1, 16);
}
EXPORT void fmi2FreeInstance(Component c) { deed("fmi2FreeInstance"); free(c); }
EXPORT Status fmi2SetupExperiment(Component c, int given, double tolerance, double start, int stops, double stop)
{
    now = start;
    return deed("fmi2SetupExperiment");
}
EXPORT Status fmi2EnterInitializationMode(Component c) { return deed("fmi2EnterInitializationMode"); }
EXPORT Status fmi2ExitInitializationMode(Component c) { return deed("fmi2ExitInitializationMode"); }
EXPORT Status fmi2Terminate(Component c) { return deed("fmi2Terminate"); }
EXPORT Status fmi2Reset(Component c) { return OK; }

EXPORT Status fmi2GetReal(Component c, const Reference *r, size_t n, double *values)
{
    for (size_t i = 0; i < n; i++) values[i] = r[i] == 0 ? input : sum;
    return deed("fmi2GetReal");
}
EXPORT Status fmi2SetReal(Component c, const Reference *r, size_t n, const double *values)
{
    for (size_t i = 0; i < n; i++) if (r[i] == 0) input = values[i];
    return deed("fmi2SetReal");
}
EXPORT Status fmi2GetInteger(Component c, const Reference *r, size_t n, int *values) { return OK; }
EXPORT Status fmi2SetInteger(Component c, const Reference *r, size_t n, const int *values) { return OK; }
EXPORT Status fmi2GetBoolean(Component c, const Reference *r, size_t n, int *values) { return OK; }
EXPORT Status fmi2SetBoolean(Component c, const Reference *r, size_t n, const int *values) { return OK; }
EXPORT Status fmi2GetString(Component c, const Reference *r, size_t n, Text *values) { return OK; }
EXPORT Status fmi2SetString(Component c, const Reference *r, size_t n, const Text *values) { return OK; }

EXPORT Status fmi2DoStep(Component c, double time, double step, int fixed)
{
    now = time;
    Status status = deed("fmi2DoStep");
    if (status == OK) sum += step * input;
    now = time + step;
    return status;
}
EXPORT Status fmi2CancelStep(Component c) { return OK; }
EXPORT Status fmi2GetStatus(Component c, int what, Status *value) { return OK; }

EXPORT Status fmi2GetFMUstate(Component c, void **state)
{
    if (*state == NULL) *state = malloc(sizeof sum);
    memcpy(*state, &sum, sizeof sum);
    return deed("fmi2GetFMUstate");
}
EXPORT Status fmi2SetFMUstate(Component c, void *state)
{
    memcpy(&sum, state, sizeof sum);
    return deed("fmi2SetFMUstate");
}
EXPORT Status fmi2FreeFMUstate(Component c, void **state)
{
    free(*state);
    *state = NULL;
    return OK;
}
EXPORT Status fmi2SerializedFMUstateSize(Component c, void *state, size_t *size)
{
    *size = claims("fmi2SerializedFMUstateSize") ? (size_t)1 << 40 : sizeof sum;
    return deed("fmi2SerializedFMUstateSize");
}
EXPORT Status fmi2SerializeFMUstate(Component c, void *state, char *data, size_t size)
{
    memcpy(data, state, size < sizeof sum ? size : sizeof sum);
    return deed("fmi2SerializeFMUstate");
}
EXPORT Status fmi2DeSerializeFMUstate(Component c, const char *data, size_t size, void **state)
{
    *state = malloc(sizeof sum);
    memcpy(*state, data, sizeof sum);
    return OK;
}
EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference *r, size_t n, const int *o, const double *v)
{
    return OK;
}
EXPORT Status fmi2GetRealOutputDerivatives(Component c, const Reference *r, size_t n, const int *o, double *v)
{
    return OK;
}
EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference *u, size_t nu, const Reference *k, size_t nk,
                                           const double *dk, double *du)
{
    return OK;
}
EXPORT Status fmi2GetRealStatus(Component c, int what, double *value) { return OK; }
EXPORT Status fmi2GetIntegerStatus(Component c, int what, int *value) { return OK; }
EXPORT Status fmi2GetBooleanStatus(Component c, int what, int *value) { return OK; }
EXPORT Status fmi2GetStringStatus(Component c, int what, Text *value) { return OK; }
