/* The door of a pythonfmu FMU for hosts that are not Python themselves.
 *
 * pythonfmu's library leaves Python's symbols to whoever loads it, takes the first Python that it comes across, and
 * ends Python when the process ends, which crashes once scipy.linalg has been imported. This library stands in its
 * place, brings Python into the process when the first instance is made, and passes every call on:
 *
 * - it asks the interpreter in OPENPANTO_PYTHON, or python3 on PATH, where its libpython is, and makes the symbols
 *   of that library global, for numpy and scipy need them too;
 * - it initialises Python before pythonfmu does: who did not start Python does not end it either;
 * - what is missing is said in words, through the host's logger and on standard error.
 *
 * A host that is Python keeps its own: then only the last step, passing on, is done.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "probe.h" /* PROBE: the text of probe.py */

#define EXPORT __attribute__((visibility("default")))
#define LINE 4096

typedef void *Component;
typedef void *State;
typedef const char *String;
typedef unsigned int Reference;
typedef int Status; /* 0 OK, 1 warning, 2 discard, 3 error */

typedef struct {
    void (*logger)(void *environment, String instance, Status status, String category, String message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*step_finished)(void *environment, Status status);
    void *environment;
} Callbacks;

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static void *inner;
static char problem[2 * LINE];

/* What the interpreter says of itself. */
typedef struct {
    char executable[LINE], version[LINE], library[LINE], lack[LINE];
} Interpreter;

static const char *interpreter_name(void) {
    const char *named = getenv("OPENPANTO_PYTHON");
    return named && *named ? named : "python3";
}

static void read_line(FILE *from, char *line) {
    if (!fgets(line, LINE, from)) *line = 0;
    line[strcspn(line, "\r\n")] = 0;
}

static int ask(Interpreter *python) {
    static char command[sizeof PROBE + LINE];
    const char *name = interpreter_name();
    if (strlen(name) > LINE - 32 || strchr(name, '\'')) return 0;
    snprintf(command, sizeof command, "'%s' -c '%s'", name, PROBE);
    FILE *answer = popen(command, "r");
    if (!answer) return 0;
    read_line(answer, python->executable);
    read_line(answer, python->version);
    read_line(answer, python->library);
    read_line(answer, python->lack);
    pclose(answer);
    return *python->version != 0;
}

static int fail(const char *format, const char *first, const char *second) {
    snprintf(problem, sizeof problem, format, first, second);
    return 0;
}

static void *symbol(const char *name) { return dlsym(RTLD_DEFAULT, name); }

static int is_running(void) {
    int (*initialized)(void) = (int (*)(void))symbol("Py_IsInitialized");
    return initialized && initialized();
}

static int load_library(const Interpreter *python) {
    char fallback[LINE + 32];
    snprintf(fallback, sizeof fallback, "libpython%s.so.1.0", python->version);
    const char *library = *python->library ? python->library : fallback;
    if (dlopen(library, RTLD_NOW | RTLD_GLOBAL)) return 1;
    return fail("Python %s has no shared library that could be loaded (%s); install libpython, or a Python built with "
                "--enable-shared, and name it in OPENPANTO_PYTHON",
                python->version, library);
}

static int check_version(const Interpreter *python) {
    const char *(*loaded)(void) = (const char *(*)(void))symbol("Py_GetVersion");
    size_t length = strlen(python->version);
    if (!loaded) return fail("%s is not a Python library%s", python->library, "");
    if (strncmp(loaded(), python->version, length) == 0 && loaded()[length] == '.') return 1;
    return fail("the Python library in this process is %.6s, but the interpreter on PATH is %s; name the right one in "
                "OPENPANTO_PYTHON",
                loaded(), python->version);
}

static int start(const Interpreter *python) {
    wchar_t *(*decode)(const char *, size_t *) = (wchar_t * (*)(const char *, size_t *)) symbol("Py_DecodeLocale");
    void (*set_name)(const wchar_t *) = (void (*)(const wchar_t *))symbol("Py_SetProgramName");
    void (*initialize)(int) = (void (*)(int))symbol("Py_InitializeEx");
    void *(*release)(void) = (void *(*)(void))symbol("PyEval_SaveThread");
    if (!initialize || !release) return fail("%s lacks functions of Python%s", python->library, "");
    /* From the program's name Python finds its environment; the string has to stay. */
    wchar_t *name = decode ? decode(python->executable, NULL) : NULL;
    if (name && set_name) set_name(name);
    initialize(0); /* leaves the host's signal handlers alone */
    release();     /* whoever needs Python from now on takes its lock */
    return 1;
}

static int bring_python(void) {
    static Interpreter python;
    if (is_running()) return 1;
    if (!ask(&python))
        return fail("no Python 3 found: '%s' cannot be run%s; install Python 3 with numpy and scipy, put it first on "
                    "PATH or name it in OPENPANTO_PYTHON",
                    interpreter_name(), "");
    if (*python.lack)
        return fail("%s %s; install what is missing, or name another Python in OPENPANTO_PYTHON", python.executable,
                    python.lack);
    return load_library(&python) && check_version(&python) && start(&python);
}

static int open_inner(void) {
    Dl_info self;
    char path[LINE];
    if (!dladdr(&mutex, &self) || strlen(self.dli_fname) > LINE - 32) return fail("where am I?%s%s", "", "");
    strcpy(path, self.dli_fname);
    char *suffix = strrchr(path, '.');
    strcpy(suffix && !strchr(suffix, '/') ? suffix : path + strlen(path), ".pythonfmu.so");
    inner = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    return inner ? 1 : fail("%s cannot be loaded: %s", path, dlerror());
}

static int ready(void) {
    pthread_mutex_lock(&mutex);
    int done = inner || (bring_python() && open_inner());
    pthread_mutex_unlock(&mutex);
    return done;
}

static void *find(const char *name) { return inner ? dlsym(inner, name) : NULL; }

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT Component fmi2Instantiate(String name, int type, String guid, String resources, const Callbacks *functions,
                                 int visible, int logging) {
    if (!ready()) {
        for (char *c = problem; *c; c++)
            if (*c == '%') *c = '?'; /* hosts take messages as formats */
        fprintf(stderr, "%s: %s\n", name, problem);
        if (functions && functions->logger)
            functions->logger(functions->environment, name, 3, "logStatusError", problem);
        return NULL;
    }
    Component (*call)(String, int, String, String, const Callbacks *, int, int) =
        (Component(*)(String, int, String, String, const Callbacks *, int, int))find("fmi2Instantiate");
    return call ? call(name, type, guid, resources, functions, visible, logging) : NULL;
}

EXPORT void fmi2FreeInstance(Component c) {
    void (*call)(Component) = (void (*)(Component))find("fmi2FreeInstance");
    if (call) call(c);
}

/* All others: a function NAME with parameters PARAMETERS, passed on as ARGUMENTS. */
#define PASS_ON(NAME, PARAMETERS, ARGUMENTS)                                     \
    EXPORT Status NAME PARAMETERS {                                              \
        static Status(*call) PARAMETERS;                                         \
        if (!call) call = (Status(*) PARAMETERS)find(#NAME);                     \
        return call ? call ARGUMENTS : 3;                                        \
    }

PASS_ON(fmi2SetDebugLogging, (Component c, int on, size_t n, const String names[]), (c, on, n, names))
PASS_ON(fmi2SetupExperiment, (Component c, int has_tolerance, double tolerance, double start, int has_stop, double stop),
        (c, has_tolerance, tolerance, start, has_stop, stop))
PASS_ON(fmi2EnterInitializationMode, (Component c), (c))
PASS_ON(fmi2ExitInitializationMode, (Component c), (c))
PASS_ON(fmi2Terminate, (Component c), (c))
PASS_ON(fmi2Reset, (Component c), (c))
PASS_ON(fmi2GetReal, (Component c, const Reference r[], size_t n, double v[]), (c, r, n, v))
PASS_ON(fmi2GetInteger, (Component c, const Reference r[], size_t n, int v[]), (c, r, n, v))
PASS_ON(fmi2GetBoolean, (Component c, const Reference r[], size_t n, int v[]), (c, r, n, v))
PASS_ON(fmi2GetString, (Component c, const Reference r[], size_t n, String v[]), (c, r, n, v))
PASS_ON(fmi2SetReal, (Component c, const Reference r[], size_t n, const double v[]), (c, r, n, v))
PASS_ON(fmi2SetInteger, (Component c, const Reference r[], size_t n, const int v[]), (c, r, n, v))
PASS_ON(fmi2SetBoolean, (Component c, const Reference r[], size_t n, const int v[]), (c, r, n, v))
PASS_ON(fmi2SetString, (Component c, const Reference r[], size_t n, const String v[]), (c, r, n, v))
PASS_ON(fmi2GetFMUstate, (Component c, State *s), (c, s))
PASS_ON(fmi2SetFMUstate, (Component c, State s), (c, s))
PASS_ON(fmi2FreeFMUstate, (Component c, State *s), (c, s))
PASS_ON(fmi2SerializedFMUstateSize, (Component c, State s, size_t *size), (c, s, size))
PASS_ON(fmi2SerializeFMUstate, (Component c, State s, char bytes[], size_t size), (c, s, bytes, size))
PASS_ON(fmi2DeSerializeFMUstate, (Component c, const char bytes[], size_t size, State *s), (c, bytes, size, s))
PASS_ON(fmi2GetDirectionalDerivative,
        (Component c, const Reference u[], size_t nu, const Reference k[], size_t nk, const double dk[], double du[]),
        (c, u, nu, k, nk, dk, du))
PASS_ON(fmi2SetRealInputDerivatives, (Component c, const Reference r[], size_t n, const int order[], const double v[]),
        (c, r, n, order, v))
PASS_ON(fmi2GetRealOutputDerivatives, (Component c, const Reference r[], size_t n, const int order[], double v[]),
        (c, r, n, order, v))
PASS_ON(fmi2DoStep, (Component c, double time, double step, int no_restore), (c, time, step, no_restore))
PASS_ON(fmi2CancelStep, (Component c), (c))
PASS_ON(fmi2GetStatus, (Component c, int kind, Status *v), (c, kind, v))
PASS_ON(fmi2GetRealStatus, (Component c, int kind, double *v), (c, kind, v))
PASS_ON(fmi2GetIntegerStatus, (Component c, int kind, int *v), (c, kind, v))
PASS_ON(fmi2GetBooleanStatus, (Component c, int kind, int *v), (c, kind, v))
PASS_ON(fmi2GetStringStatus, (Component c, int kind, String *v), (c, kind, v))
