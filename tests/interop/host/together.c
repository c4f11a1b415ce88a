/* A host that makes instances of several FMUs at the same time, each in its own thread.
 *
 * Arguments: LIBRARY GUID RESOURCES of each. Ends with 0 if every instance was made, and initialised.
 */
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#define MOST 16

typedef struct { char **words; void *library; int is_good; } Part;

static pthread_barrier_t start;
static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};

static void *live(void *argument) {
    Part *part = argument;
    fmi2InstantiateTYPE *make = (fmi2InstantiateTYPE *)dlsym(part->library, "fmi2Instantiate");
    fmi2ExitInitializationModeTYPE *leave =
        (fmi2ExitInitializationModeTYPE *)dlsym(part->library, "fmi2ExitInitializationMode");
    fmi2FreeInstanceTYPE *release = (fmi2FreeInstanceTYPE *)dlsym(part->library, "fmi2FreeInstance");
    pthread_barrier_wait(&start);
    fmi2Component made = make("part", fmi2CoSimulation, part->words[1], part->words[2], &callbacks, 0, 0);
    part->is_good = made && leave(made) == fmi2OK;
    release(made);
    return NULL;
}

int main(int count, char **words) {
    Part parts[MOST] = {0};
    pthread_t threads[MOST];
    int whole = (count - 1) / 3, good = 0;
    if (whole > MOST) return 2;
    pthread_barrier_init(&start, NULL, (unsigned int)whole);
    for (int i = 0; i < whole; i++) {
        parts[i].words = words + 1 + 3 * i;
        parts[i].library = dlopen(parts[i].words[0], RTLD_NOW | RTLD_LOCAL);
        if (!parts[i].library) return puts(dlerror()), 2;
    }
    for (int i = 0; i < whole; i++) pthread_create(threads + i, NULL, live, parts + i);
    for (int i = 0; i < whole; i++) pthread_join(threads[i], NULL), good += parts[i].is_good;
    return good == whole ? 0 : 1;
}
