/* The library of an FMU that its host loads: it brings Python into the process and passes every call on to pythonfmu.
 *
 * pythonfmu's own library leaves Python's symbols to whoever loads it, takes the first Python that it comes across,
 * ends it when the process ends, and crashes on resource locations, files and code that it did not expect. So it lies
 * behind this one (NAME.pythonfmu.so beside NAME.so), which
 *
 * - decodes the resource location (RFC 3986, RFC 8089, plain paths) and checks that the files are there;
 * - compares the GUID with the one in resources/openpanto.txt;
 * - finds Python: already in the process, in a runtime that came with the FMU, named by OPENPANTO_PYTHON, or python3
 *   on PATH; initialises it before pythonfmu does, because whoever did not start Python does not end it either;
 * - lets Python load the FMU's code once (fmu_opening.py), and has pythonfmu do it only if that went well;
 * - makes an error that the FMU's code has logged the status of the call in which it did.
 *
 * Whatever fails is reported in one sentence, through the host's logger and on standard error, and NULL or an error status.
 *
 * One file, longer than the others here: an FMU's loader has one door, fmi2Instantiate, every step behind it can fail in
 * the same way, and what is static can be seen by no other library in the host. What the system decides is in platform_*.c.
 *
 * To be compiled in this folder (the texts of the two Python files become part of the library); with the options in
 * loader_build.py:  cc -shared -fPIC -O2 -fvisibility=hidden -s loader.c platform_posix.c -o NAME.so -lpthread
 */
#include "platform.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#define HIDE(NAME)
#define SECTION ".section .rdata,\"dr\"\n"
#define INNER ".pythonfmu.dll"
#define COMMAND "python"
#else
#define EXPORT __attribute__((visibility("default")))
#define HIDE(NAME) ".hidden " NAME "\n"
#define SECTION ".section .rodata\n"
#define INNER ".pythonfmu.so"
#define COMMAND "python3"
#endif

/* A file's text as a string of this library. */
#define INCLUDE_TEXT(NAME, FILE)                                                                                     \
    extern const char NAME[];                                                                                        \
    __asm__(SECTION ".globl " #NAME "\n" HIDE(#NAME) #NAME ":\n.incbin \"" FILE "\"\n.byte 0\n.text\n")

INCLUDE_TEXT(openpanto_probe, "python_probe.py");
INCLUDE_TEXT(openpanto_opening, "fmu_opening.py");

#define TEXT 2048 /* longest sentence */
#define LINES 64  /* most lines of a list of settings */
#define MARK "openpanto_probe:" /* the line before the answers of python_probe.py */

typedef void *Component;
typedef void *State;
typedef const char *String;
typedef unsigned int Reference;
typedef int Status;

enum { OK, WARNING, DISCARD, ERROR, FATAL };

typedef struct {
    void (*logger)(void *environment, String instance, Status status, String category, String message, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*step_finished)(void *environment, Status status);
    void *environment;
} Callbacks;

/* What a host holds: pythonfmu's component and what has to last as long as it. */
typedef struct {
    Component inner;
    Callbacks host, own;
    char *name, *path;
    int alias, logging;
    Status worst; /* of the messages logged during the present call */
} Instance;

/* Where a call may fail: its one sentence. */
typedef struct {
    char text[TEXT];
} Problem;

static void *inner;
static int (*is_initialized)(void);

static int fail(Problem *problem, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(problem->text, sizeof problem->text, format, arguments);
    va_end(arguments);
    return 0;
}

/* ---- Texts ---------------------------------------------------------------------------------------------------- */

static char *copy(const char *text) {
    size_t size = strlen(text) + 1;
    char *made = malloc(size);
    return made ? memcpy(made, text, size) : NULL;
}

static char *join(const char *folder, const char *separator, const char *name) {
    size_t size = strlen(folder) + strlen(separator) + strlen(name) + 1;
    char *made = malloc(size);
    if (made) snprintf(made, size, "%s%s%s", folder, separator, name);
    return made;
}

/* The length of the UTF-8 character at text, 0 if there is none. */
static int character(const unsigned char *text) {
    if (*text < 0x80) return 1;
    int length = *text >= 0xc2 && *text < 0xe0 ? 2 : (*text & 0xf0) == 0xe0 ? 3 : *text >= 0xf0 && *text < 0xf5 ? 4 : 0;
    for (int i = 1; i < length; i++)
        if ((text[i] & 0xc0) != 0x80) return 0;
    if ((*text == 0xe0 && text[1] < 0xa0) || (*text == 0xed && text[1] >= 0xa0)) return 0;
    if ((*text == 0xf0 && text[1] < 0x90) || (*text == 0xf4 && text[1] >= 0x90)) return 0;
    return length;
}

static int is_utf8(const char *text) {
    for (const unsigned char *c = (const unsigned char *)text; *c; c += character(c))
        if (!character(c)) return 0;
    return 1;
}

/* Make a text fit for hosts that take messages as formats, and for those that want UTF-8 on one line. */
static void clean(char *text) {
    for (unsigned char *c = (unsigned char *)text; *c;) {
        int length = character(c);
        if (*c == '%' || !length) *c = '?';
        if (*c < 0x20 || *c == 0x7f) *c = ' ';
        c += length ? length : 1;
    }
}

/* ---- Reporting ------------------------------------------------------------------------------------------------ */

static void report(const Callbacks *host, String name, Status status, String category, String message) {
    if (!host || !host->logger) return;
    const char *fallback = status >= ERROR ? "logStatusError" : status == WARNING ? "logStatusWarning" : "logAll";
    host->logger(host->environment, name, status, category && *category ? category : fallback, message);
}

static void *refuse(const Callbacks *host, String name, Problem *problem) {
    clean(problem->text);
    fprintf(stderr, "%s: %s\n", name, problem->text);
    fflush(stderr);
    report(host, name, ERROR, NULL, problem->text);
    return NULL;
}

static Status complain(const Instance *instance, const char *format, ...) {
    Problem problem;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(problem.text, sizeof problem.text, format, arguments);
    va_end(arguments);
    refuse(&instance->host, instance->name, &problem);
    return ERROR;
}

/* The words of an exception out of pythonfmu's report of it: "Fatal py exception ...\nAdapterError('words')". */
static void unwrap(char *text) {
    static const char start[] = "Fatal py exception encountered";
    char *words = strncmp(text, start, sizeof start - 1) == 0 ? strchr(text, '(') : NULL;
    size_t length = words ? strlen(words) : 0;
    if (length < 5 || (words[1] != '\'' && words[1] != '"') || words[length - 1] != ')') return;
    memmove(text, words + 2, length - 4);
    text[length - 4] = 0;
}

/* pythonfmu's logger: its environment is the instance. */
static void pass_message(void *environment, String name, Status status, String category, String message, ...) {
    Instance *instance = environment;
    char *text = copy(message ? message : "");
    if (!text) return;
    unwrap(text);
    clean(text);
    if (status == FATAL) status = ERROR; /* other instances are not touched by it */
    if (status > instance->worst) instance->worst = status;
    if (instance->logging || status >= ERROR) report(&instance->host, name, status, category, text);
    free(text);
}

/* ---- Files ---------------------------------------------------------------------------------------------------- */

/* Lines "key=value" of a file. */
typedef struct {
    char *text, *keys[LINES], *values[LINES];
    int count;
} Settings;

static char *read_text(const char *path) {
    enum { MOST = 1 << 16 };
    FILE *file = platform_read(path);
    char *text = file ? calloc(1, MOST) : NULL;
    if (text && fread(text, 1, MOST - 1, file) == 0) free(text), text = NULL;
    if (file) fclose(file);
    return text;
}

static int read_settings(Settings *settings, const char *path) {
    memset(settings, 0, sizeof *settings);
    char *rest = settings->text = read_text(path);
    while (rest && *rest && settings->count < LINES) {
        char *line = rest, *end = line + strcspn(line, "\r\n");
        rest = *end ? end + 1 : end;
        *end = 0;
        char *value = strchr(line, '=');
        if (!value) continue;
        *value = 0;
        settings->keys[settings->count] = line;
        settings->values[settings->count++] = value + 1;
    }
    return settings->text != NULL;
}

static const char *setting(const Settings *settings, const char *key) {
    for (int i = 0; i < settings->count; i++)
        if (strcmp(settings->keys[i], key) == 0) return settings->values[i];
    return "";
}

/* ---- The resource location ------------------------------------------------------------------------------------ */

static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* Decode escapes in place; 0 if one stands for the byte 0, that no path has. What is no escape stays. */
static int decode(char *text) {
    char *to = text;
    for (const char *from = text; *from; to++) {
        int high = *from == '%' ? digit(from[1]) : -1;
        int low = high >= 0 ? digit(from[2]) : -1;
        *to = low >= 0 ? (char)(16 * high + low) : *from;
        from += low >= 0 ? 3 : 1;
        if (!*to) return 0;
    }
    *to = 0;
    return 1;
}

static int same_letters(const char *text, const char *lower, size_t length) {
    for (size_t i = 0; i < length; i++)
        if ((text[i] >= 'A' && text[i] <= 'Z' ? text[i] + 32 : text[i]) != lower[i]) return 0;
    return 1;
}

/* The length of a URI's scheme, 0 if there is none; one letter is a drive. */
static size_t scheme(const char *location) {
    size_t length = strspn(location, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.");
    return length > 1 && location[length] == ':' ? length : 0;
}

/* The path in a file URI, still escaped; NULL if it is on another machine. */
static const char *path_in_uri(const char *uri) {
    const char *path = uri + strlen("file:");
    if (strncmp(path, "//", 2) != 0) return path;
    const char *authority = path + 2, *end = authority + strcspn(authority, "/");
    size_t length = (size_t)(end - authority);
    int is_local = length == 0 || (length == 9 && same_letters(authority, "localhost", 9));
    return is_local ? end : NULL;
}

/* Take double and trailing slashes out: pythonfmu would look for a scheme before them. */
static void tidy(char *path) {
    char *to = path;
    for (const char *from = path; *from; from++)
        if (*from != '/' || to == path || to[-1] != '/') *to++ = *from;
    if (to > path + 1 && to[-1] == '/') to--;
    *to = 0;
}

static char *find_folder(const char *location, Problem *problem) {
    size_t length = scheme(location);
    int is_uri = length == 4 && same_letters(location, "file", 4);
    if (length && !is_uri && !platform_is_folder(location))
        return fail(problem, "the resource location '%.400s' is not a file URI", location), NULL;
    const char *written = is_uri ? path_in_uri(location) : location;
    if (!written) return fail(problem, "the resource location '%.400s' names another machine", location), NULL;
    char *plain = copy(written), *decoded = copy(written);
    if (!plain || !decoded) return free(plain), free(decoded), fail(problem, "out of memory"), NULL;
    int has_decoded = decode(decoded);
    if (is_uri) platform_fit_uri_path(plain), platform_fit_uri_path(decoded);
    tidy(plain), tidy(decoded);
    /* As the standards say first; then as the others say, for hosts that mix up the two. */
    char *first = is_uri ? decoded : plain, *second = is_uri ? plain : decoded;
    int is_first = (first == plain || has_decoded) && platform_is_folder(first);
    int is_second = !is_first && (second == plain || has_decoded) && platform_is_folder(second);
    char *found = is_first ? first : is_second ? second : NULL;
    /* Absolute: the host may work in another folder by the time it resets the instance. */
    char *absolute = found ? platform_absolute(found) : NULL;
    if (!absolute) fail(problem, "the resource location '%.400s' is not a folder that exists", location);
    free(plain), free(decoded);
    return absolute;
}

/* ---- The FMU -------------------------------------------------------------------------------------------------- */

static char *read_script_name(const char *folder, Problem *problem) {
    char *path = join(folder, "/", "slavemodule.txt");
    char *name = path ? read_text(path) : NULL;
    free(path);
    if (name) name[strcspn(name, "\r\n")] = 0;
    char *file = name && *name && !strpbrk(name, "/\\") ? join(folder, "/", name) : NULL;
    char *script = file ? join(file, "", ".py") : NULL;
    int is_there = script && platform_is_file(script);
    free(file), free(script);
    if (is_there) return name;
    free(name);
    fail(problem, "the FMU's resources in '%.400s' are incomplete: slavemodule.txt, or the script that it names, is missing; "
                  "unpack the FMU again, or rebuild it", folder);
    return NULL;
}

static int check_guid(const char *folder, String guid, Problem *problem) {
    Settings about;
    char *path = join(folder, "/", "openpanto.txt");
    int is_read = path && read_settings(&about, path);
    free(path);
    if (!is_read) return fail(problem, "the FMU's resources in '%.400s' are incomplete: openpanto.txt is missing", folder);
    const char *own = setting(&about, "guid");
    int same = guid && *own && strcmp(own, guid) == 0;
    if (!same)
        fail(problem, "the GUID %.100s is not that of the FMU in '%.400s', which is %.100s: its model description belongs to "
                      "another build", guid ? guid : "(none)", folder, *own ? own : "not known");
    free(about.text);
    return same;
}

/* ---- Python --------------------------------------------------------------------------------------------------- */

/* What an interpreter says of itself (python_probe.py). */
typedef struct {
    char *text;
    const char *executable, *version, *library, *lack;
} Interpreter;

/* PyStatus and the beginnings of PyPreConfig and PyConfig, the same from Python 3.9 on; the rest is room. */
typedef struct {
    int type;
    const char *function, *message;
    int exit_code;
} PythonStatus;

typedef union {
    struct {
        int kind, parse_argv, isolated, use_environment, configure_locale, coerce_c_locale, coerce_c_locale_warn;
#ifdef _WIN32
        int legacy_windows_fs_encoding;
#endif
        int utf8_mode;
    };
    char room[1024];
} PreConfig;

typedef union {
    struct {
        int kind, isolated, use_environment, dev_mode, install_signal_handlers;
    };
    char room[16384];
    void *alignment;
} Config;

static void *find_in_process(const char *name) { return platform_find(NULL, name); }

static int python_is_running(void) {
    int (*call)(void) = (int (*)(void))find_in_process("Py_IsInitialized");
    if (!call || !call()) return 0;
    is_initialized = call;
    return 1;
}

static const char *interpreter_name(void) {
    const char *named = getenv("OPENPANTO_PYTHON");
    return named && *named ? named : COMMAND;
}

static char *next_line(char **rest) {
    char *line = *rest, *end = line + strcspn(line, "\r\n");
    *rest = *end ? end + 1 : end;
    *end = 0;
    return line;
}

static int ask(Interpreter *python, Problem *problem) {
    char *rest = python->text = platform_ask(interpreter_name(), openpanto_probe);
    char *start = rest ? strstr(rest, MARK) : NULL; /* what a site's own code prints comes before */
    rest = start ? start + strlen(MARK) : rest;
    if (start) next_line(&rest);
    if (start) {
        python->executable = next_line(&rest);
        python->version = next_line(&rest);
        python->library = next_line(&rest);
        python->lack = next_line(&rest);
        if (!*python->executable) python->executable = interpreter_name(); /* without PATH it does not know its place */
    }
    if (!start || !*python->version)
        return fail(problem, "no Python 3 found: '%s' cannot be run; install Python 3 with numpy and scipy, put it "
                             "first on PATH or name it in OPENPANTO_PYTHON", interpreter_name());
    if (*python->lack)
        return fail(problem, "%s %s; install what is missing, or name another Python in OPENPANTO_PYTHON",
                    python->executable, python->lack);
    return 1;
}

static int load_python(const Interpreter *python, Problem *problem) {
    char why[TEXT / 2] = "";
    if (find_in_process("Py_GetVersion")) return 1; /* loaded, not started */
    if (*python->library && platform_open(python->library, 1, why, sizeof why)) return 1;
    char fallback[64];
    snprintf(fallback, sizeof fallback, "libpython%.8s.so.1.0", python->version);
    if (!*python->library && platform_open(fallback, 1, why, sizeof why)) return 1;
    return fail(problem, "%s, Python %s, has no shared library that could be loaded (%s); install libpython, or a "
                         "Python built with --enable-shared, and name it in OPENPANTO_PYTHON",
                python->executable, python->version, why);
}

static int check_version(const char *version, const char *whose, Problem *problem) {
    const char *(*loaded)(void) = (const char *(*)(void))find_in_process("Py_GetVersion");
    size_t length = strlen(version);
    if (!loaded) return fail(problem, "what %s names as Python's library is not one", whose);
    if (strncmp(loaded(), version, length) == 0 && (loaded()[length] == '.' || loaded()[length] == ' ')) return 1;
    return fail(problem, "the Python library in this process is %.6s, but %s is %s; name the right one in "
                         "OPENPANTO_PYTHON", loaded(), whose, version);
}

/* Initialise Python; home NULL means that executable tells where its modules are. */
static int start_python(const char *executable, const char *home, Problem *problem) {
    void (*prepare)(PreConfig *) = (void (*)(PreConfig *))find_in_process(
        home ? "PyPreConfig_InitIsolatedConfig" : "PyPreConfig_InitPythonConfig");
    PythonStatus (*preinitialize)(const PreConfig *) =
        (PythonStatus(*)(const PreConfig *))find_in_process("Py_PreInitialize");
    void (*configure)(Config *) =
        (void (*)(Config *))find_in_process(home ? "PyConfig_InitIsolatedConfig" : "PyConfig_InitPythonConfig");
    PythonStatus (*initialize)(const Config *) =
        (PythonStatus(*)(const Config *))find_in_process("Py_InitializeFromConfig");
    void (*clear)(Config *) = (void (*)(Config *))find_in_process("PyConfig_Clear");
    int (*is_exception)(PythonStatus) = (int (*)(PythonStatus))find_in_process("PyStatus_Exception");
    void (*set_name)(const wchar_t *) = (void (*)(const wchar_t *))find_in_process("Py_SetProgramName");
    void (*set_home)(const wchar_t *) = (void (*)(const wchar_t *))find_in_process("Py_SetPythonHome");
    void *(*release)(void) = (void *(*)(void))find_in_process("PyEval_SaveThread");
    void *(*import)(const char *) = (void *(*)(const char *))find_in_process("PyImport_ImportModule");
    if (!prepare || !preinitialize || !configure || !initialize || !clear || !is_exception || !set_name || !set_home ||
        !release || !import)
        return fail(problem, "the Python library of %s lacks functions that the FMU needs; take Python 3.11 to 3.14",
                    executable);
    PreConfig before;
    memset(&before, 0, sizeof before);
    prepare(&before);
    /* File names are UTF-8 whatever the host's locale is, and that locale stays. */
    before.configure_locale = before.coerce_c_locale = before.coerce_c_locale_warn = 0;
    before.utf8_mode = 1;
    PythonStatus status = preinitialize(&before);
    if (is_exception(status))
        return fail(problem, "Python does not start: %s", status.message ? status.message : "no reason given");
    wchar_t *name = platform_wide(executable), *place = home ? platform_wide(home) : NULL;
    if (!name || (home && !place)) return fail(problem, "out of memory");
    set_name(name); /* from it Python finds its environment */
    if (home) set_home(place);
    Config config;
    memset(&config, 0, sizeof config);
    configure(&config);
    config.install_signal_handlers = 0; /* they are the host's */
    platform_keep_interrupt();
    /* With this setting Python takes the buffers from the host's standard streams, and what is in them. */
    char *unbuffered = getenv("PYTHONUNBUFFERED"), kept = unbuffered ? *unbuffered : 0;
    if (unbuffered) *unbuffered = 0; /* an empty setting is none */
    status = initialize(&config);
    if (unbuffered) *unbuffered = kept;
    clear(&config);
    /* This module takes SIGINT as it is first imported, whatever was configured; so that is now. */
    if (!is_exception(status)) import("_signal");
    platform_restore_interrupt();
    if (is_exception(status))
        return fail(problem, "Python does not start: %s", status.message ? status.message : "no reason given");
    release(); /* whoever needs Python from now on takes its lock */
    return python_is_running() || fail(problem, "Python was started, but does not run");
}

/* ---- A runtime that came with the FMU ------------------------------------------------------------------------- */

static int open_parts(const char *folder, const char *list, Problem *problem) {
    char *names = copy(list), why[TEXT / 2];
    int good = names != NULL;
    for (char *name = names ? strtok(names, ":") : NULL; good && name; name = strtok(NULL, ":")) {
        char *path = join(folder, "/", name);
        good = path && platform_open(path, 1, why, sizeof why);
        if (!good) fail(problem, "the Python that came with the FMU is incomplete: %s (%s)", path ? path : name, why);
        free(path);
    }
    free(names);
    return good;
}

/* The entries of sys.path, one a line. */
static char *runtime_places(const char *folder, const char *list) {
    char *names = copy(list), *places = copy("");
    for (char *name = names ? strtok(names, ":") : NULL; places && name; name = strtok(NULL, ":")) {
        char *path = join(folder, "/", name), *longer = path ? join(places, *places ? "\n" : "", path) : NULL;
        free(path), free(places);
        places = longer;
    }
    free(names);
    return places;
}

static int call_opening(const char *function, const char *first, const char *second, char *answer, size_t size);

static int start_runtime(const char *folder, const Settings *about, Problem *problem) {
    char version[16], answer[TEXT / 2];
    int major = 0, minor = 0;
    if (strcmp(setting(about, "format"), "1") != 0 || sscanf(setting(about, "python"), "%d.%d", &major, &minor) != 2)
        return fail(problem, "%s/runtime.txt is not of a kind that this FMU knows", folder);
    snprintf(version, sizeof version, "%d.%d", major, minor);
    if (!open_parts(folder, setting(about, "preload"), problem)) return 0;
    if (!find_in_process("Py_GetVersion") && !open_parts(folder, setting(about, "libpython"), problem)) return 0;
    if (!check_version(version, "the one that came with the FMU", problem)) return 0;
    char *home = join(folder, "/", setting(about, "home")), *name = join(folder, "/", "python");
    char *places = runtime_places(folder, setting(about, "path"));
    int good = home && name && places ? start_python(name, home, problem) : fail(problem, "out of memory");
    if (good && !call_opening("set_paths", places, setting(about, "content"), answer, sizeof answer))
        good = fail(problem, "the Python that came with the FMU in %s does not work: %s", folder, answer);
    free(home), free(name), free(places);
    return good;
}

/* 1 if a runtime was found and started, 0 if it was found and failed, -1 if there is none. */
static int try_runtime(const char *folder, Problem *problem) {
    Settings about;
    char *path = join(folder, "/", "runtime.txt");
    int is_there = path && read_settings(&about, path);
    free(path);
    if (!is_there) return -1;
    int done = start_runtime(folder, &about, problem);
    free(about.text);
    return done;
}

static int bring_runtime(const char *resources, Problem *problem) {
    char *own = join(resources, "/", "runtime");
    int done = own ? try_runtime(own, problem) : -1;
    free(own);
    const char *named = getenv("OPENPANTO_RUNTIME");
    if (done >= 0 || !named || !*named) return done;
    done = try_runtime(named, problem);
    return done >= 0 ? done : fail(problem, "OPENPANTO_RUNTIME names '%s', which holds no runtime.txt", named);
}

/* ---- Bringing it together ------------------------------------------------------------------------------------- */

static int bring_python(const char *resources, Problem *problem) {
    if (python_is_running()) return 1;
    int done = bring_runtime(resources, problem);
    if (done >= 0) return done;
    Interpreter python = {0};
    done = ask(&python, problem) && load_python(&python, problem) &&
           (python_is_running() || /* it was there, hidden from us */
            (check_version(python.version, python.executable, problem) &&
             start_python(python.executable, NULL, problem)));
    free(python.text);
    return done;
}

/* The name of pythonfmu's library beside this one; NULL if this one's name has no suffix. */
static char *inner_name(int is_resolved) {
    char *path = platform_self(is_resolved), *suffix = path ? strrchr(path, '.') : NULL;
    if (suffix) *suffix = 0;
    char *name = suffix && !strchr(suffix + 1, '/') ? join(path, "", INNER) : NULL;
    free(path);
    return name;
}

static int open_inner(Problem *problem) {
    char why[TEXT / 2] = "it is not there";
    /* Where this library is a link, the other one lies beside the link or beside the file. */
    char *name = inner_name(0);
    if (!name || !platform_is_file(name)) free(name), name = inner_name(1);
    inner = name ? platform_open(name, 0, why, sizeof why) : NULL;
    if (!inner)
        fail(problem, "pythonfmu's library beside the FMU's own cannot be loaded: %s%s", why,
             strstr(why, "version `G") ? "; this system is older than the FMU needs" : "");
    free(name);
    return inner != NULL;
}

static int ready(const char *resources, Problem *problem) {
    platform_lock();
    int done = bring_python(resources, problem) && (inner || open_inner(problem));
    platform_unlock();
    return done;
}

static void *find(const char *name) { return inner ? platform_find(inner, name) : NULL; }

/* Python's functions, as far as they are called here. */
typedef struct {
    int (*lock)(void);
    void (*unlock)(int);
    void *(*compile)(const char *, const char *, int);
    void *(*evaluate)(void *, void *, void *);
    void *(*module)(const char *);
    void *(*names)(void *);
    void *(*get)(void *, const char *);
    int (*set)(void *, const char *, void *);
    void *(*builtins)(void);
    void *(*call)(void *, const char *, ...);
    const char *(*text)(void *);
    void (*release)(void *);
    void (*forget_error)(void);
} Python;

static int find_python(Python *python) {
    void *found[] = {
        python->lock = (int (*)(void))find_in_process("PyGILState_Ensure"),
        python->unlock = (void (*)(int))find_in_process("PyGILState_Release"),
        python->compile = (void *(*)(const char *, const char *, int))find_in_process("Py_CompileString"),
        python->evaluate = (void *(*)(void *, void *, void *))find_in_process("PyEval_EvalCode"),
        python->module = (void *(*)(const char *))find_in_process("PyImport_AddModule"),
        python->names = (void *(*)(void *))find_in_process("PyModule_GetDict"),
        python->get = (void *(*)(void *, const char *))find_in_process("PyDict_GetItemString"),
        python->set = (int (*)(void *, const char *, void *))find_in_process("PyDict_SetItemString"),
        python->builtins = (void *(*)(void))find_in_process("PyEval_GetBuiltins"),
        python->call = (void *(*)(void *, const char *, ...))find_in_process("PyObject_CallFunction"),
        python->text = (const char *(*)(void *))find_in_process("PyUnicode_AsUTF8"),
        python->release = (void (*)(void *))find_in_process("Py_DecRef"),
        python->forget_error = (void (*)(void))find_in_process("PyErr_Clear"),
    };
    for (size_t i = 0; i < sizeof found / sizeof *found; i++)
        if (!found[i]) return 0;
    return 1;
}

/* The name that fmu_opening.py has in sys.modules: another loader in the process may carry another text. */
static void name_opening(char *name, size_t size) {
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (const char *c = openpanto_opening; *c; c++) hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    snprintf(name, size, "openpanto_opening_%016llx", (unsigned long long)hash);
}

/* A function of fmu_opening.py, which is run once and stays among the modules; what is returned is borrowed. */
static void *opening_function(const Python *python, const char *function) {
    enum { FILE_INPUT = 257 }; /* Py_file_input */
    char name[64];
    name_opening(name, sizeof name);
    void *module = python->module(name), *names = module ? python->names(module) : NULL;
    void *found = names ? python->get(names, function) : NULL;
    if (!names || found) return found;
    void *code = python->compile(openpanto_opening, "fmu_opening.py", FILE_INPUT);
    int is_ready = code && python->set(names, "__builtins__", python->builtins()) == 0;
    void *done = is_ready ? python->evaluate(code, names, names) : NULL;
    if (code) python->release(code);
    if (done) python->release(done);
    return done ? python->get(names, function) : NULL;
}

/* Call a function of fmu_opening.py; 1 and what it returns, or 0 and why it could not be called. */
static int call_opening(const char *function, const char *first, const char *second, char *answer, size_t size) {
    Python python;
    snprintf(answer, size, "Python lacks functions that the FMU needs");
    if (!find_python(&python)) return 0;
    int lock = python.lock();
    void *called = opening_function(&python, function);
    void *result = called ? python.call(called, "ss", first, second) : NULL;
    const char *text = result ? python.text(result) : NULL;
    snprintf(answer, size, "%s", text ? text : result ? "" : "Python cannot run the loader's own code");
    if (!text) python.forget_error();
    if (result) python.release(result);
    python.unlock(lock);
    return result != NULL;
}

/* ---- Instances ------------------------------------------------------------------------------------------------ */

typedef Component Instantiate(String, int, String, String, const Callbacks *, int, int);

/* Let Python load the FMU's code from the folder, by another name of it where Python needs one. */
static int open_code(Instance *instance, const char *folder, const char *script, Problem *problem) {
    char answer[TEXT / 2] = "alias";
    int is_fit = is_utf8(folder) && !strstr(folder, "%20") && !strstr(folder, "file://");
    int is_asked = 1;
    if (is_fit) is_asked = call_opening("problem", instance->path = copy(folder), script, answer, sizeof answer);
    if (is_asked && strcmp(answer, "alias") == 0) {
        free(instance->path);
        instance->path = platform_alias(folder, &instance->alias);
        if (!instance->path)
            return fail(problem, "the path '%.400s' cannot be handed to Python; unpack the FMU somewhere else", folder);
        is_asked = call_opening("problem", instance->path, script, answer, sizeof answer);
    }
    return is_asked && !*answer ? 1 : fail(problem, "%s", answer);
}

static Component make_inner(Instance *instance, Problem *problem) {
    char answer[TEXT];
    Instantiate *make = (Instantiate *)find("fmi2Instantiate");
    instance->worst = OK;
    Component made = make ? make(instance->name, 1, "", instance->path, &instance->own, 0, 1) : NULL;
    call_opening("forget", instance->path, "", answer, sizeof answer);
    /* "": it was reported by whoever knew why */
    if (!made) fail(problem, "%s", instance->worst < ERROR ? "pythonfmu made no instance of the FMU" : "");
    return made;
}

static void drop(Instance *instance) {
    if (!instance) return;
    platform_close_alias(instance->alias);
    free(instance->name), free(instance->path), free(instance);
}

/* Say so if the FMU brought a Python of other versions than the one that was in the process before. */
static void compare_versions(const Instance *instance, const char *folder) {
    Settings about;
    char answer[TEXT / 2], wanted[128], *path = join(folder, "/", "runtime/runtime.txt");
    int is_there = path && read_settings(&about, path);
    free(path);
    if (!is_there) return;
    snprintf(wanted, sizeof wanted, "%s %s %s", setting(&about, "python"), setting(&about, "numpy"),
             setting(&about, "scipy"));
    if (call_opening("other_versions", wanted, setting(&about, "content"), answer, sizeof answer) && *answer) {
        clean(answer);
        fprintf(stderr, "%s: %s\n", instance->name, answer);
        report(&instance->host, instance->name, WARNING, NULL, answer);
    }
    free(about.text);
}

static Instance *prepare(String name, const Callbacks *host, int logging) {
    Instance *instance = calloc(1, sizeof *instance);
    if (!instance) return NULL;
    instance->name = copy(name);
    instance->alias = -1;
    instance->logging = logging;
    if (host) instance->host = *host;
    instance->own = (Callbacks){pass_message, calloc, free, NULL, instance};
    return instance->name ? instance : (drop(instance), NULL);
}

static int open_fmu(Instance *instance, int type, String guid, String location, Problem *problem) {
    if (type != 1) return fail(problem, "the FMU is for co-simulation only, not for model exchange");
    if (!location || !*location) return fail(problem, "the host did not say where the FMU's resources are");
    char *folder = find_folder(location, problem);
    char *script = folder ? read_script_name(folder, problem) : NULL;
    int good = script && check_guid(folder, guid, problem) && ready(folder, problem) &&
               open_code(instance, folder, script, problem);
    if (good) compare_versions(instance, folder);
    free(folder), free(script);
    return good;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT Component fmi2Instantiate(String name, int type, String guid, String location, const Callbacks *functions,
                                 int visible, int logging) {
    Problem problem = {"out of memory"};
    Instance *instance = prepare(name ? name : "FMU", functions, logging);
    (void)visible; /* there is nothing to be seen */
    if (!instance) return refuse(functions, name ? name : "FMU", &problem);
    clean(instance->name);
    if (!open_fmu(instance, type, guid, location, &problem)) {
        refuse(functions, instance->name, &problem);
        return drop(instance), NULL;
    }
    instance->inner = make_inner(instance, &problem);
    if (instance->inner) return instance;
    if (*problem.text) refuse(functions, instance->name, &problem);
    return drop(instance), NULL;
}

/* Whether calls can be passed on: the host, if it is Python, may be ending. */
static int is_alive(const Instance *instance) { return instance && is_initialized && is_initialized(); }

EXPORT void fmi2FreeInstance(Component c) {
    Instance *instance = c;
    void (*call)(Component) = (void (*)(Component))find("fmi2FreeInstance");
    if (call && is_alive(instance)) call(instance->inner);
    drop(instance);
}

/* Whether the FMU's code can still be loaded; pythonfmu would not survive that it is gone. */
static int is_still_there(const Instance *instance, Problem *problem) {
    char answer[TEXT / 2] = "", *script = read_script_name(instance->path, problem);
    int is_asked = script && call_opening("problem", instance->path, script, answer, sizeof answer);
    free(script);
    if (!script || (is_asked && !*answer)) return script != NULL;
    return fail(problem, "%s", answer);
}

/* A new instance in place of the old one: pythonfmu's own reset does not survive a failure. */
EXPORT Status fmi2Reset(Component c) {
    Instance *instance = c;
    Problem problem;
    void (*release)(Component) = (void (*)(Component))find("fmi2FreeInstance");
    if (!is_alive(instance) || !release) return ERROR;
    Component fresh = is_still_there(instance, &problem) ? make_inner(instance, &problem) : NULL;
    if (!fresh) return *problem.text ? complain(instance, "it cannot be reset: %s", problem.text) : ERROR;
    release(instance->inner);
    instance->inner = fresh;
    return OK;
}

EXPORT Status fmi2SetDebugLogging(Component c, int on, size_t count, const String categories[]) {
    Instance *instance = c;
    (void)count, (void)categories; /* there are none of our own */
    if (!instance) return ERROR;
    instance->logging = on;
    return OK;
}

/* All others: a function OUTER with parameters PARAMETERS, passed on to pythonfmu's NAME as ARGUMENTS if GOOD holds. */
#define PASS(OUTER, NAME, PARAMETERS, GOOD, ARGUMENTS)                                                               \
    Status OUTER PARAMETERS {                                                                                        \
        static Status(*call) PARAMETERS;                                                                             \
        Instance *instance = c;                                                                                      \
        if (!is_alive(instance)) return ERROR;                                                                       \
        if (!(GOOD)) return complain(instance, "%s was called with a null pointer", #NAME);                          \
        if (!call) call = (Status(*) PARAMETERS)find(#NAME);                                                         \
        if (!call) return ERROR;                                                                                     \
        instance->worst = OK;                                                                                        \
        c = instance->inner;                                                                                         \
        Status status = call ARGUMENTS;                                                                              \
        if (status == FATAL || (status < DISCARD && instance->worst >= ERROR)) return ERROR;                         \
        return status;                                                                                               \
    }
#define PASS_ON(NAME, PARAMETERS, GOOD, ARGUMENTS) EXPORT PASS(NAME, NAME, PARAMETERS, GOOD, ARGUMENTS)
#define ARE(POINTERS) (n == 0 || (POINTERS))

PASS_ON(fmi2SetupExperiment, (Component c, int has_tolerance, double tolerance, double start, int has_stop, double stop),
        1, (c, has_tolerance, tolerance, start, has_stop, stop))
PASS_ON(fmi2EnterInitializationMode, (Component c), 1, (c))
PASS_ON(fmi2ExitInitializationMode, (Component c), 1, (c))
PASS_ON(fmi2Terminate, (Component c), 1, (c))
PASS_ON(fmi2GetReal, (Component c, const Reference r[], size_t n, double v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2GetInteger, (Component c, const Reference r[], size_t n, int v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2GetBoolean, (Component c, const Reference r[], size_t n, int v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2GetString, (Component c, const Reference r[], size_t n, String v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2SetReal, (Component c, const Reference r[], size_t n, const double v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2SetInteger, (Component c, const Reference r[], size_t n, const int v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2SetBoolean, (Component c, const Reference r[], size_t n, const int v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2SetString, (Component c, const Reference r[], size_t n, const String v[]), ARE(r && v), (c, r, n, v))
PASS_ON(fmi2GetFMUstate, (Component c, State *s), s != NULL, (c, s))
PASS_ON(fmi2SetFMUstate, (Component c, State s), s != NULL, (c, s))
PASS_ON(fmi2SerializedFMUstateSize, (Component c, State s, size_t *size), s && size, (c, s, size))
PASS_ON(fmi2DeSerializeFMUstate, (Component c, const char bytes[], size_t size, State *s), bytes && s,
        (c, bytes, size, s))
PASS_ON(fmi2DoStep, (Component c, double time, double step, int no_restore), 1, (c, time, step, no_restore))
PASS_ON(fmi2GetRealStatus, (Component c, int kind, double *v), v != NULL, (c, kind, v))

static PASS(write_state, fmi2SerializeFMUstate, (Component c, State s, char bytes[], size_t size), s && bytes,
            (c, s, bytes, size))

/* pythonfmu cuts what does not fit, and says that all is well. */
EXPORT Status fmi2SerializeFMUstate(Component c, State s, char bytes[], size_t size) {
    size_t needed = 0;
    if (!s || !bytes) return write_state(c, s, bytes, size);
    Status status = fmi2SerializedFMUstateSize(c, s, &needed);
    if (status > WARNING) return status;
    if (size < needed) return complain(c, "the state has %zu bytes, the host has room for %zu", needed, size);
    return write_state(c, s, bytes, size);
}

EXPORT Status fmi2FreeFMUstate(Component c, State *s) {
    Instance *instance = c;
    Status (*call)(Component, State *) = (Status(*)(Component, State *))find("fmi2FreeFMUstate");
    if (!s || !*s) return OK; /* as the standard has it */
    if (!is_alive(instance) || !call) return ERROR;
    Status status = call(instance->inner, s);
    *s = NULL;
    return status;
}

/* What the model description declares to be absent. */
static Status have_not(Instance *instance, const char *name) {
    if (!instance) return ERROR;
    return complain(instance, "the FMU has no %s, and says so in its model description", name);
}

#define HAVE_NOT(NAME, PARAMETERS)                                                                                   \
    EXPORT Status NAME PARAMETERS { return have_not(c, #NAME); }

HAVE_NOT(fmi2GetDirectionalDerivative, (Component c, const Reference u[], size_t nu, const Reference k[], size_t nk,
                                        const double dk[], double du[]))
HAVE_NOT(fmi2SetRealInputDerivatives, (Component c, const Reference r[], size_t n, const int order[], const double v[]))
HAVE_NOT(fmi2GetRealOutputDerivatives, (Component c, const Reference r[], size_t n, const int order[], double v[]))
HAVE_NOT(fmi2CancelStep, (Component c))
HAVE_NOT(fmi2GetStatus, (Component c, int kind, Status *v))
HAVE_NOT(fmi2GetIntegerStatus, (Component c, int kind, int *v))
HAVE_NOT(fmi2GetBooleanStatus, (Component c, int kind, int *v))
HAVE_NOT(fmi2GetStringStatus, (Component c, int kind, String *v))
