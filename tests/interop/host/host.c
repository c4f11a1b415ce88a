/* A small FMI 2.0 host in plain C, which drives FMUs as a tool does that is not Python.
 *
 * It reads a plan on standard input, one order a line:
 *     fmu LIBRARY GUID RESOURCES          the next FMU; byte 1 between, for paths hold anything else
 *     refuse LIBRARY GUID RESOURCES       an FMU that is to make no instance ("-": NULL); says what it made, twice
 *     parameter FMU REFERENCE VALUE
 *     connect FMU OUTPUT FMU INPUT        FMUs count from 0
 *     observe FMU REFERENCE
 *     run STEPS STEP
 * then runs the coupled system (all exchange, then all step) in several ways, which must all give the same bits:
 * two systems side by side, parameters set in each phase that allows it, states saved, restored, serialised and
 * taken over by the other system, instances reset. It prints the observed values of every step as hexadecimal numbers.
 */
#include <dlfcn.h>
#include <locale.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

#define MOST 256
#define EXCHANGES 6

enum phase { INSTANTIATED, SET_UP, INITIALIZING, PHASES };

typedef struct {
    fmi2InstantiateTYPE *instantiate;
    fmi2FreeInstanceTYPE *free;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2TerminateTYPE *terminate;
    fmi2ResetTYPE *reset;
    fmi2GetRealTYPE *get;
    fmi2SetRealTYPE *set;
    fmi2DoStepTYPE *step;
    fmi2GetFMUstateTYPE *save;
    fmi2SetFMUstateTYPE *restore;
    fmi2FreeFMUstateTYPE *release;
    fmi2SerializedFMUstateSizeTYPE *size;
    fmi2SerializeFMUstateTYPE *serialise;
    fmi2DeSerializeFMUstateTYPE *deserialise;
    char guid[128], resources[4096];
} Fmu;

typedef struct { int fmu; fmi2ValueReference reference; double value; } Parameter;
typedef struct { int from; fmi2ValueReference output; int to; fmi2ValueReference input; } Wire;
typedef struct { int fmu; fmi2ValueReference reference; } Place;
typedef struct { fmi2Component part[8]; double value[MOST]; } System;

static Fmu fmus[8];
static Parameter parameters[MOST];
static Wire wires[MOST];
static Place places[MOST];
static int fmu_count, parameter_count, wire_count, place_count, steps;
static double step_size;

static void die(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    exit(1);
}

static void check(fmi2Status status, const char *what) {
    if (status > fmi2Warning) die("%s: status %d", what, status);
}

static void logger(fmi2ComponentEnvironment e, fmi2String who, fmi2Status s, fmi2String category, fmi2String text, ...) {
    va_list arguments;
    (void)e, (void)category;
    fprintf(stderr, "[%s, status %d] ", who, s);
    va_start(arguments, text);
    vfprintf(stderr, text, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static void *find(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (!found) die("%s is missing", name);
    return found;
}

static void load(Fmu *fmu, const char *path) {
    void *l = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!l) die("%s", dlerror());
    if (strcmp(((fmi2GetVersionTYPE *)find(l, "fmi2GetVersion"))(), "2.0")) die("not FMI 2.0");
    if (strcmp(((fmi2GetTypesPlatformTYPE *)find(l, "fmi2GetTypesPlatform"))(), "default")) die("another platform");
    fmu->instantiate = find(l, "fmi2Instantiate");
    fmu->free = find(l, "fmi2FreeInstance");
    fmu->setup = find(l, "fmi2SetupExperiment");
    fmu->enter = find(l, "fmi2EnterInitializationMode");
    fmu->leave = find(l, "fmi2ExitInitializationMode");
    fmu->terminate = find(l, "fmi2Terminate");
    fmu->reset = find(l, "fmi2Reset");
    fmu->get = find(l, "fmi2GetReal");
    fmu->set = find(l, "fmi2SetReal");
    fmu->step = find(l, "fmi2DoStep");
    fmu->save = find(l, "fmi2GetFMUstate");
    fmu->restore = find(l, "fmi2SetFMUstate");
    fmu->release = find(l, "fmi2FreeFMUstate");
    fmu->size = find(l, "fmi2SerializedFMUstateSize");
    fmu->serialise = find(l, "fmi2SerializeFMUstate");
    fmu->deserialise = find(l, "fmi2DeSerializeFMUstate");
}

static void refuse(Fmu *f) {
    const char *guid = strcmp(f->guid, "-") ? f->guid : NULL;
    const char *resources = strcmp(f->resources, "-") ? f->resources : NULL;
    fmi2Component made = f->instantiate("part", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2False);
    puts(made ? "an instance" : "NULL");
    if (made) f->free(made);
}

static void read_plan(void) {
    char line[8192], path[4096];
    while (fgets(line, sizeof line, stdin)) {
        Fmu *f = &fmus[fmu_count];
        Parameter *p = &parameters[parameter_count];
        Wire *w = &wires[wire_count];
        Place *o = &places[place_count];
        if (sscanf(line, "fmu\1%4095[^\1]\1%127[^\1]\1%4095[^\n]", path, f->guid, f->resources) == 3)
            load(f, path), fmu_count++;
        else if (sscanf(line, "refuse\1%4095[^\1]\1%127[^\1]\1%4095[^\n]", path, f->guid, f->resources) == 3)
            load(f, path), refuse(f), refuse(f), exit(0);
        else if (sscanf(line, "parameter %d %u %lf", &p->fmu, &p->reference, &p->value) == 3) parameter_count++;
        else if (sscanf(line, "connect %d %u %d %u", &w->from, &w->output, &w->to, &w->input) == 4) wire_count++;
        else if (sscanf(line, "observe %d %u", &o->fmu, &o->reference) == 2) place_count++;
        else if (sscanf(line, "run %d %lf", &steps, &step_size) != 2) die("what is '%s'?", line);
    }
}

static void make(System *s) {
    for (int i = 0; i < fmu_count; i++) {
        Fmu *f = &fmus[i];
        s->part[i] = f->instantiate("part", fmi2CoSimulation, f->guid, f->resources, &callbacks, fmi2False, fmi2True);
        if (!s->part[i]) die("FMU %d cannot be instantiated", i);
    }
}

static void set_parameters(System *s, int fmu) {
    for (int i = 0; i < parameter_count; i++) {
        Parameter *p = &parameters[i];
        if (p->fmu == fmu) check(fmus[fmu].set(s->part[fmu], &p->reference, 1, &p->value), "setting a parameter");
    }
}

static void gather(System *s) {
    for (int i = 0; i < wire_count; i++)
        check(fmus[wires[i].from].get(s->part[wires[i].from], &wires[i].output, 1, &s->value[i]), "reading an output");
}

static void tell(System *s) {
    for (int i = 0; i < wire_count; i++)
        check(fmus[wires[i].to].set(s->part[wires[i].to], &wires[i].input, 1, &s->value[i]), "setting an input");
}

static void begin(System *s, enum phase when) {
    for (int i = 0; i < fmu_count; i++) {
        if (when == INSTANTIATED) set_parameters(s, i);
        check(fmus[i].setup(s->part[i], fmi2False, 0.0, 0.0, fmi2False, 0.0), "setting up");
        if (when == SET_UP) set_parameters(s, i);
        check(fmus[i].enter(s->part[i]), "entering initialization");
        if (when == INITIALIZING) set_parameters(s, i);
    }
    for (int n = 0; n < EXCHANGES; n++) gather(s), tell(s);
    for (int i = 0; i < fmu_count; i++) check(fmus[i].leave(s->part[i]), "leaving initialization");
}

static void step(System *s, int n) {
    gather(s);
    tell(s);
    for (int i = 0; i < fmu_count; i++)
        check(fmus[i].step(s->part[i], n * step_size, step_size, fmi2True), "a step");
}

static void observe(System *s, double *row) {
    for (int i = 0; i < place_count; i++)
        check(fmus[places[i].fmu].get(s->part[places[i].fmu], &places[i].reference, 1, &row[i]), "observing");
}

static void advance(System *s, int first, int last, double *table) {
    for (int n = first; n < last; n++) {
        step(s, n);
        observe(s, table + n * place_count);
    }
}

static void same(const double *one, const double *other, int first, int last, const char *what) {
    size_t start = (size_t)first * place_count, count = (size_t)(last - first) * place_count;
    if (memcmp(one + start, other + start, count * sizeof *one)) die("%s: other numbers", what);
    fprintf(stderr, "same bits: %s\n", what);
}

static void finish(System *s) {
    for (int i = 0; i < fmu_count; i++) {
        check(fmus[i].terminate(s->part[i]), "terminating");
        fmus[i].free(s->part[i]);
    }
}

static void reset(System *s) {
    for (int i = 0; i < fmu_count; i++) check(fmus[i].reset(s->part[i]), "a reset");
}

/* Hand the state of one system to another as bytes. */
static void hand_over(System *from, System *to) {
    for (int i = 0; i < fmu_count; i++) {
        fmi2FMUstate state = NULL, copy = NULL;
        size_t size = 0;
        check(fmus[i].save(from->part[i], &state), "saving");
        check(fmus[i].size(from->part[i], state, &size), "asking for a state's size");
        char *bytes = malloc(size);
        check(fmus[i].serialise(from->part[i], state, bytes, size), "serialising");
        check(fmus[i].release(from->part[i], &state), "freeing a state");
        check(fmus[i].deserialise(to->part[i], bytes, size, &copy), "deserialising");
        free(bytes);
        check(fmus[i].restore(to->part[i], copy), "taking over a state");
        check(fmus[i].release(to->part[i], &copy), "freeing a copied state");
    }
}

static void save(System *s, fmi2FMUstate *states) {
    for (int i = 0; i < fmu_count; i++) states[i] = NULL, check(fmus[i].save(s->part[i], &states[i]), "saving");
}

static void restore(System *s, fmi2FMUstate *states) {
    for (int i = 0; i < fmu_count; i++) check(fmus[i].restore(s->part[i], states[i]), "restoring");
}

static void release(System *s, fmi2FMUstate *states) {
    for (int i = 0; i < fmu_count; i++) check(fmus[i].release(s->part[i], &states[i]), "freeing a state");
}

/* What a library may not change in its host. */
static void check_host(const struct sigaction *before) {
    struct sigaction interrupt;
    sigaction(SIGINT, NULL, &interrupt);
    if (interrupt.sa_handler != before->sa_handler) die("the host's handler of SIGINT was replaced");
    if (strcmp(setlocale(LC_ALL, NULL), "C")) die("the host's locale was changed to %s", setlocale(LC_ALL, NULL));
}

int main(void) {
    System one, two;
    fmi2FMUstate states[8];
    struct sigaction before;
    sigaction(SIGINT, NULL, &before);
    read_plan();
    double *table = calloc((size_t)steps * place_count, sizeof *table);
    double *again = calloc((size_t)steps * place_count, sizeof *again);
    int half = steps / 2;

    make(&one), make(&two); /* side by side */
    begin(&one, INITIALIZING), begin(&two, INSTANTIATED);
    for (int n = 0; n < half; n++) advance(&one, n, n + 1, table), advance(&two, n, n + 1, again);
    same(table, again, 0, half, "parameters set when instantiated");

    save(&one, states);
    hand_over(&two, &two);
    advance(&one, half, steps, table);
    advance(&two, half, steps, again);
    same(table, again, half, steps, "own state as bytes");
    restore(&one, states);
    advance(&one, half, steps, again);
    same(table, again, half, steps, "state restored");
    restore(&one, states);
    release(&one, states);

    reset(&two);
    begin(&two, SET_UP);
    advance(&two, 0, half / 2, again);
    same(table, again, 0, half / 2, "after a reset, parameters set after setting up");
    hand_over(&one, &two);
    advance(&two, half, steps, again);
    same(table, again, half, steps, "another system's state as bytes");

    finish(&one), finish(&two);
    make(&one), begin(&one, SET_UP); /* once more after all were freed */
    advance(&one, 0, 2, again);
    same(table, again, 0, 2, "instances made after the first ones were freed");
    finish(&one);
    if (getenv("HOST_STAYS")) check_host(&before);
    for (int n = 0; n < steps * place_count; n++) printf("%a\n", table[n]);
    return 0;
}
