/* A host that does what hosts should not: wrong locations by the thousand, calls without an instance, null pointers. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

static void logger(fmi2ComponentEnvironment e, fmi2String who, fmi2Status s, fmi2String category, fmi2String text, ...) {
    char line[65536];
    va_list arguments;
    (void)e, (void)s;
    va_start(arguments, text);
    vsnprintf(line, sizeof line, text, arguments); /* as careless as many hosts are */
    va_end(arguments);
    if (!*who || !*category || !*line) abort();
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
static void *library;

static void *find(const char *name) {
    void *found = dlsym(library, name);
    if (!found) abort();
    return found;
}

/* The right location with something wrong in it. */
static void spoil(char *text, size_t size, const char *right, unsigned int *seed) {
    static const char *const heads[] = {"", "file:", "file://", "file:///", "FILE://localhost", "file://x", "a:", "http://"};
    snprintf(text, size, "%s%s", heads[rand_r(seed) % 8], right);
    for (int n = 1 + rand_r(seed) % 4; n > 0; n--) {
        size_t place = rand_r(seed) % strlen(text);
        text[place] = (char)(1 + rand_r(seed) % 255);
        if (rand_r(seed) % 2) text[place] = '%';
        if (rand_r(seed) % 8 == 0 && place) text[place] = 0;
    }
}

static int refuse_all(const char *guid, const char *right) {
    fmi2InstantiateTYPE *make = find("fmi2Instantiate");
    fmi2FreeInstanceTYPE *release = find("fmi2FreeInstance");
    char text[8192];
    unsigned int seed = 1;
    int count = 0;
    for (; count < 5000; count++) {
        spoil(text, sizeof text, right, &seed);
        fmi2Component made = make(count % 3 ? "x" : NULL, count % 7 ? 1 : 0, count % 5 ? guid : NULL, text,
                                  count % 2 ? &callbacks : NULL, 0, 1);
        if (made) release(made); /* some of them lead there all the same */
    }
    return count;
}

static void call_without_an_instance(void) {
    double value = 0;
    fmi2ValueReference reference = 0;
    fmi2FMUstate state = NULL;
    size_t size = 0;
    int bad = 0;
    bad += ((fmi2SetupExperimentTYPE *)find("fmi2SetupExperiment"))(NULL, 0, 0, 0, 0, 0) != fmi2Error;
    bad += ((fmi2EnterInitializationModeTYPE *)find("fmi2EnterInitializationMode"))(NULL) != fmi2Error;
    bad += ((fmi2ExitInitializationModeTYPE *)find("fmi2ExitInitializationMode"))(NULL) != fmi2Error;
    bad += ((fmi2GetRealTYPE *)find("fmi2GetReal"))(NULL, &reference, 1, &value) != fmi2Error;
    bad += ((fmi2DoStepTYPE *)find("fmi2DoStep"))(NULL, 0, 1, 1) != fmi2Error;
    bad += ((fmi2ResetTYPE *)find("fmi2Reset"))(NULL) != fmi2Error;
    bad += ((fmi2TerminateTYPE *)find("fmi2Terminate"))(NULL) != fmi2Error;
    bad += ((fmi2CancelStepTYPE *)find("fmi2CancelStep"))(NULL) != fmi2Error;
    bad += ((fmi2GetFMUstateTYPE *)find("fmi2GetFMUstate"))(NULL, &state) != fmi2Error;
    bad += ((fmi2SerializedFMUstateSizeTYPE *)find("fmi2SerializedFMUstateSize"))(NULL, state, &size) != fmi2Error;
    bad += ((fmi2SetDebugLoggingTYPE *)find("fmi2SetDebugLogging"))(NULL, 1, 0, NULL) != fmi2Error;
    ((fmi2FreeInstanceTYPE *)find("fmi2FreeInstance"))(NULL);
    if (bad) abort();
}

/* One life, with null pointers wherever one can be passed, and calls in no good order. */
static void live(const char *guid, const char *resources) {
    fmi2Component c = ((fmi2InstantiateTYPE *)find("fmi2Instantiate"))("x", 1, guid, resources, &callbacks, 0, 0);
    fmi2FMUstate state = NULL;
    double values[4];
    fmi2ValueReference references[4] = {0, 1, 2, 4000000000u};
    if (!c) abort();
    int bad = 0;
    bad += ((fmi2DoStepTYPE *)find("fmi2DoStep"))(c, 0, 1e-3, 1) < fmi2Discard;
    bad += ((fmi2GetRealTYPE *)find("fmi2GetReal"))(c, references, 4, values) != fmi2Error;
    bad += ((fmi2GetRealTYPE *)find("fmi2GetReal"))(c, NULL, 1, values) != fmi2Error;
    bad += ((fmi2SetRealTYPE *)find("fmi2SetReal"))(c, references, 1, NULL) != fmi2Error;
    bad += ((fmi2SetFMUstateTYPE *)find("fmi2SetFMUstate"))(c, NULL) != fmi2Error;
    bad += ((fmi2GetFMUstateTYPE *)find("fmi2GetFMUstate"))(c, NULL) != fmi2Error;
    bad += ((fmi2FreeFMUstateTYPE *)find("fmi2FreeFMUstate"))(c, NULL) != fmi2OK;
    bad += ((fmi2GetStringStatusTYPE *)find("fmi2GetStringStatus"))(c, 0, NULL) != fmi2Error;
    bad += ((fmi2ResetTYPE *)find("fmi2Reset"))(c) != fmi2OK;
    bad += ((fmi2SetupExperimentTYPE *)find("fmi2SetupExperiment"))(c, 0, 0, 0, 0, 0) != fmi2OK;
    bad += ((fmi2EnterInitializationModeTYPE *)find("fmi2EnterInitializationMode"))(c) != fmi2OK;
    bad += ((fmi2ExitInitializationModeTYPE *)find("fmi2ExitInitializationMode"))(c) != fmi2OK;
    bad += ((fmi2DoStepTYPE *)find("fmi2DoStep"))(c, 0, 1e-3, 1) != fmi2OK;
    bad += ((fmi2GetFMUstateTYPE *)find("fmi2GetFMUstate"))(c, &state) != fmi2OK;
    bad += ((fmi2SetFMUstateTYPE *)find("fmi2SetFMUstate"))(c, state) != fmi2OK;
    bad += ((fmi2FreeFMUstateTYPE *)find("fmi2FreeFMUstate"))(c, &state) != fmi2OK || state;
    ((fmi2FreeInstanceTYPE *)find("fmi2FreeInstance"))(c);
    if (bad) abort();
}

int main(int count, char **words) { /* LIBRARY GUID RESOURCES */
    if (count != 4 || !(library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL))) return puts(dlerror()), 2;
    call_without_an_instance();
    printf("refused %d\n", refuse_all(words[2], words[3]));
    int lives = 0;
    for (; lives < 20; lives++) live(words[2], words[3]);
    printf("lived %d\n", lives);
    fflush(stdout);
    return 0;
}
