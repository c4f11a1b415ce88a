/* See platform.h. */
#include "platform.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>

#include <psapi.h>

#define ANSWER 65536 /* most bytes of an answer */
#define SECONDS 120  /* longest wait for one */

static HANDLE lock;

/* One for the process, not for each FMU's loader: they all start the same Python. */
void platform_lock(void) {
    wchar_t name[64];
    wsprintfW(name, L"Local\\openpanto-loader-%lu", (unsigned long)GetCurrentProcessId());
    if (!lock) lock = CreateMutexW(NULL, FALSE, name); /* by whichever thread: the name makes it the same one */
    if (lock) WaitForSingleObject(lock, INFINITE);
}

void platform_unlock(void) {
    if (lock) ReleaseMutex(lock);
}

wchar_t *platform_wide(const char *text) {
    int size = MultiByteToWideChar(CP_UTF8, 0, text, -1, NULL, 0);
    wchar_t *wide = size > 0 ? malloc((size_t)size * sizeof *wide) : NULL;
    if (wide) MultiByteToWideChar(CP_UTF8, 0, text, -1, wide, size);
    return wide;
}

static char *narrow(const wchar_t *wide) {
    int size = WideCharToMultiByte(CP_UTF8, 0, wide, -1, NULL, 0, NULL, NULL);
    char *text = size > 0 ? malloc((size_t)size) : NULL;
    if (text) WideCharToMultiByte(CP_UTF8, 0, wide, -1, text, size, NULL, NULL);
    return text;
}

/* Slashes as Windows has them: LoadLibrary wants no others. */
static wchar_t *wide_path(const char *path) {
    wchar_t *wide = platform_wide(path);
    for (wchar_t *c = wide; c && *c; c++)
        if (*c == L'/') *c = L'\\';
    return wide;
}

void *platform_open(const char *path, int is_global, char *why, size_t size) {
    (void)is_global; /* symbols are looked up in the library that they are in */
    wchar_t *wide = wide_path(path);
    HMODULE library = wide ? LoadLibraryExW(wide, NULL, LOAD_WITH_ALTERED_SEARCH_PATH) : NULL;
    if (!library) snprintf(why, size, "%s cannot be loaded, Windows error %lu", path, (unsigned long)GetLastError());
    free(wide);
    return library;
}

void *platform_find(void *library, const char *name) {
    enum { MOST = 1024 };
    HMODULE modules[MOST];
    DWORD bytes = 0;
    if (library) return (void *)GetProcAddress(library, name);
    if (!K32EnumProcessModules(GetCurrentProcess(), modules, sizeof modules, &bytes)) return NULL;
    DWORD count = bytes / sizeof *modules < MOST ? bytes / sizeof *modules : MOST;
    for (DWORD i = 0; i < count; i++) {
        void *found = (void *)GetProcAddress(modules[i], name);
        if (found) return found;
    }
    return NULL;
}

char *platform_self(int is_resolved) {
    (void)is_resolved;
    enum { LONGEST = 32768 };
    HMODULE self;
    wchar_t *path = malloc(LONGEST * sizeof *path);
    DWORD how = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
    int found = path && GetModuleHandleExW(how, (LPCWSTR)&lock, &self);
    DWORD length = found ? GetModuleFileNameW(self, path, LONGEST) : 0;
    char *text = length > 0 && length < LONGEST ? narrow(path) : NULL;
    free(path);
    return text;
}

static DWORD attributes(const char *path) {
    wchar_t *wide = wide_path(path);
    DWORD found = wide ? GetFileAttributesW(wide) : INVALID_FILE_ATTRIBUTES;
    free(wide);
    return found;
}

int platform_is_file(const char *path) {
    DWORD found = attributes(path);
    return found != INVALID_FILE_ATTRIBUTES && !(found & FILE_ATTRIBUTE_DIRECTORY);
}

int platform_is_folder(const char *path) {
    DWORD found = attributes(path);
    return found != INVALID_FILE_ATTRIBUTES && (found & FILE_ATTRIBUTE_DIRECTORY);
}

static int is_drive(const char *path) {
    return ((*path >= 'A' && *path <= 'Z') || (*path >= 'a' && *path <= 'z')) && path[1] == ':';
}

char *platform_absolute(const char *path) {
    wchar_t *wide = platform_wide(path), *whole = wide ? _wfullpath(NULL, wide, 0) : NULL;
    char *made = whole ? narrow(whole) : NULL;
    free(wide), free(whole);
    for (char *c = made; c && *c; c++)
        if (*c == '\\') *c = '/';
    return made;
}

FILE *platform_read(const char *path) {
    wchar_t *wide = wide_path(path);
    FILE *file = wide ? _wfopen(wide, L"rb") : NULL;
    free(wide);
    return file;
}

/* "/C:/folder" is C:/folder. */
void platform_fit_uri_path(char *path) {
    if (*path == '/' && is_drive(path + 1)) memmove(path, path + 1, strlen(path));
}

/* The command line `"program" -c "text"`: quotation marks in the text are escaped, other backslashes it has none. */
static wchar_t *command_line(const char *program, const char *text) {
    char *line = malloc(strlen(program) + 2 * strlen(text) + 16), *to = line;
    if (!line) return NULL;
    to += sprintf(line, "\"%s\" -c \"", program);
    for (; *text; *to++ = *text++)
        if (*text == '"') *to++ = '\\';
    *to++ = '"', *to = 0;
    wchar_t *wide = platform_wide(line);
    free(line);
    return wide;
}

static int start(PROCESS_INFORMATION *process, const char *program, const char *text, HANDLE to) {
    STARTUPINFOW how = {.cb = sizeof how, .dwFlags = STARTF_USESTDHANDLES, .hStdOutput = to};
    how.hStdError = GetStdHandle(STD_ERROR_HANDLE);
    wchar_t *line = command_line(program, text);
    int done = line && CreateProcessW(NULL, line, NULL, NULL, TRUE, CREATE_NO_WINDOW, NULL, NULL, &how, process);
    free(line);
    return done;
}

char *platform_ask(const char *program, const char *text) {
    SECURITY_ATTRIBUTES inherited = {.nLength = sizeof inherited, .bInheritHandle = TRUE};
    PROCESS_INFORMATION process;
    HANDLE from, to;
    char *answer = calloc(1, ANSWER);
    /* The pipe takes the whole answer, so that it can be read when the process has ended. */
    if (!answer || !CreatePipe(&from, &to, &inherited, ANSWER)) return free(answer), NULL;
    SetHandleInformation(from, HANDLE_FLAG_INHERIT, 0);
    int is_running = start(&process, program, text, to);
    CloseHandle(to);
    int is_done = is_running && WaitForSingleObject(process.hProcess, 1000 * SECONDS) == WAIT_OBJECT_0;
    if (is_running && !is_done) TerminateProcess(process.hProcess, 1);
    DWORD length = 0;
    is_done = is_done && ReadFile(from, answer, ANSWER - 1, &length, NULL) && length > 0;
    if (is_running) CloseHandle(process.hProcess), CloseHandle(process.hThread);
    CloseHandle(from);
    if (!is_done) return free(answer), NULL;
    return answer;
}

char *platform_alias(const char *folder, int *handle) {
    wchar_t *wide = wide_path(folder), shorter[MAX_PATH];
    DWORD length = wide ? GetShortPathNameW(wide, shorter, MAX_PATH) : 0;
    *handle = -1;
    free(wide);
    if (length == 0 || length >= MAX_PATH) return NULL;
    for (wchar_t *c = shorter; *c; c++)
        if (*c > 0x7e) return NULL; /* this drive has no short names */
    return narrow(shorter);
}

void platform_close_alias(int handle) { (void)handle; }

static void (*interrupt)(int);

void platform_keep_interrupt(void) {
    interrupt = signal(SIGINT, SIG_IGN);
    platform_restore_interrupt();
}

void platform_restore_interrupt(void) {
    if (interrupt != SIG_ERR) signal(SIGINT, interrupt);
}
