/* A host that obeys orders on standard input, one per line, and reports the status of each.
 *
 * It reads its orders as it goes: what it has not read yet lies in a buffer of the C library, which is its own.
 */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2FunctionTypes.h"

static void *library;
static fmi2Component instance;
static fmi2FMUstate state;

static void logger(fmi2ComponentEnvironment e, fmi2String who, fmi2Status s, fmi2String category, fmi2String text, ...) {
    va_list arguments;
    (void)e, (void)who, (void)s, (void)category;
    va_start(arguments, text);
    vprintf(text, arguments);
    va_end(arguments);
    putchar('\n');
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static void *find(const char *name) {
    void *found = dlsym(library, name);
    if (!found) abort();
    return found;
}

#define CALL(NAME) ((NAME##TYPE *)find(#NAME))

static int load(char *words) { /* LIBRARY GUID RESOURCES, byte 1 between */
    char *name = strtok(words, "\1"), *guid = strtok(NULL, "\1"), *resources = strtok(NULL, "\1");
    library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (!library) abort();
    instance = CALL(fmi2Instantiate)("part", fmi2CoSimulation, guid, resources, &callbacks, 0, 0);
    return instance ? fmi2OK : fmi2Error;
}

static int start(void) {
    int worst = CALL(fmi2SetupExperiment)(instance, 0, 0.0, 0.0, 0, 0.0);
    worst |= CALL(fmi2EnterInitializationMode)(instance);
    return worst | CALL(fmi2ExitInitializationMode)(instance);
}

/* Serialise into a room that is too small by so many bytes; what lies behind it must stay. */
static int serialise(size_t lack) {
    size_t size = 0;
    int status = CALL(fmi2SerializedFMUstateSize)(instance, state, &size);
    if (status != fmi2OK) return status;
    char *room = calloc(1, size);
    if (!room) abort();
    status = CALL(fmi2SerializeFMUstate)(instance, state, room, size - lack);
    for (size_t i = size - lack; i < size; i++)
        if (room[i]) abort();
    free(room);
    return status;
}

static int obey(const char *order, char *rest) {
    double value = 0.0;
    fmi2ValueReference reference = (fmi2ValueReference)strtoul(rest, NULL, 10);
    if (strcmp(order, "load") == 0) return load(rest);
    if (strcmp(order, "start") == 0) return start();
    if (strcmp(order, "step") == 0) return CALL(fmi2DoStep)(instance, atof(rest), 1e-3, fmi2True);
    if (strcmp(order, "get") == 0) return CALL(fmi2GetReal)(instance, &reference, 1, &value);
    if (strcmp(order, "get-nowhere") == 0) return CALL(fmi2GetReal)(instance, &reference, 1, NULL);
    if (strcmp(order, "cancel") == 0) return CALL(fmi2CancelStep)(instance);
    if (strcmp(order, "save") == 0) return CALL(fmi2GetFMUstate)(instance, &state);
    if (strcmp(order, "serialise") == 0) return serialise(strtoul(rest, NULL, 10));
    if (strcmp(order, "reset") == 0) return CALL(fmi2Reset)(instance);
    if (strcmp(order, "folder") == 0) return chdir(rest) == 0 ? fmi2OK : fmi2Error;
    if (strcmp(order, "rename") == 0) return rename(rest, strchr(rest, 0) + 1) == 0 ? fmi2OK : fmi2Error;
    if (strcmp(order, "free") == 0) return CALL(fmi2FreeInstance)(instance), instance = NULL, fmi2OK;
    abort();
}

int main(void) {
    char line[16384];
    while (fgets(line, sizeof line, stdin)) {
        line[strcspn(line, "\n")] = 0;
        char *rest = line + strcspn(line, " ");
        if (*rest) *rest++ = 0;
        char *separator = strcmp(line, "rename") == 0 ? strchr(rest, 1) : NULL; /* OLD, byte 1, NEW */
        if (separator) *separator = 0;
        int status = obey(line, rest); /* strtok may cut the line */
        printf("%s %d\n", line, status);
    }
    return 0;
}
