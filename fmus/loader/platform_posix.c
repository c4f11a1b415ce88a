/* See platform.h. */
#define _GNU_SOURCE
#include "platform.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define ANSWER 65536 /* most bytes of an answer */
#define SECONDS 120  /* longest wait for one */

#if defined(__linux__) && defined(__x86_64__) && defined(__GLIBC__)
/* glibc 2.34 moved these; under their first version they are found by older ones as well. */
__asm__(".symver dlopen, dlopen@GLIBC_2.2.5");
__asm__(".symver dlsym, dlsym@GLIBC_2.2.5");
__asm__(".symver dlerror, dlerror@GLIBC_2.2.5");
__asm__(".symver dladdr, dladdr@GLIBC_2.2.5");
#endif

extern char **environ;

/* One for the process, not for each FMU's loader: they all start the same Python. Of a unique symbol the dynamic linker
 * takes the first for all, however the libraries are opened. All zeros is PTHREAD_MUTEX_INITIALIZER. */
#if defined(__linux__) && defined(__GLIBC__)
__asm__(".pushsection .bss\n.balign 64\n.globl openpanto_loader_mutex\n.type openpanto_loader_mutex, @gnu_unique_object\n"
        ".size openpanto_loader_mutex, 64\nopenpanto_loader_mutex: .zero 64\n.popsection");
extern __attribute__((visibility("default"))) pthread_mutex_t openpanto_loader_mutex;
_Static_assert(sizeof(pthread_mutex_t) <= 64, "room for the mutex");
#define mutex openpanto_loader_mutex
#else
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
#endif
static char *self, *resolved_self;

/* Asked when the library is loaded: later the working folder, to which its path may be relative, can be another. */
__attribute__((constructor)) static void find_self(void) {
    Dl_info info;
    if (!dladdr(&self, &info) || !info.dli_fname) return;
    self = platform_absolute(info.dli_fname);
    resolved_self = realpath(info.dli_fname, NULL);
}

void platform_lock(void) { pthread_mutex_lock(&mutex); }

void platform_unlock(void) { pthread_mutex_unlock(&mutex); }

void *platform_open(const char *path, int is_global, char *why, size_t size) {
    void *library = dlopen(path, RTLD_NOW | (is_global ? RTLD_GLOBAL : RTLD_LOCAL));
    if (!library) {
        const char *text = dlerror();
        snprintf(why, size, "%s", text ? text : "no reason given");
    }
    return library;
}

void *platform_find(void *library, const char *name) { return dlsym(library ? library : RTLD_DEFAULT, name); }

char *platform_self(int is_resolved) {
    const char *path = is_resolved ? resolved_self : self;
    return path ? strdup(path) : NULL;
}

int platform_is_file(const char *path) { return !platform_is_folder(path) && access(path, R_OK) == 0; }

int platform_is_folder(const char *path) { /* without stat, which would need glibc 2.33 */
    int handle = open(path, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (handle >= 0) close(handle);
    return handle >= 0;
}

char *platform_absolute(const char *path) { /* without realpath: a link is to stay one, it may be moved */
    char *here = *path == '/' ? strdup("") : getcwd(NULL, 0);
    size_t size = here ? strlen(here) + strlen(path) + 2 : 0;
    char *made = here ? malloc(size) : NULL;
    if (made) snprintf(made, size, "%s%s%s", here, *here ? "/" : "", path);
    free(here);
    return made;
}

FILE *platform_read(const char *path) { return fopen(path, "rbe"); }

void platform_fit_uri_path(char *path) { (void)path; }

/* Read until the other end closes, the answer is too long or the time is over; 1 for the first. */
static int read_all(int from, char *answer) {
    size_t length = 0;
    time_t end = time(NULL) + SECONDS;
    for (;;) {
        struct pollfd wait = {from, POLLIN, 0};
        int left = (int)(end - time(NULL));
        int ready = left > 0 ? poll(&wait, 1, 1000 * left) : 0;
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) return 0;
        ssize_t count = read(from, answer + length, ANSWER - 1 - length);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0 || length + (size_t)count >= ANSWER - 1) return 0;
        answer[length += (size_t)count] = 0;
        if (count == 0) return 1;
    }
}

static int spawn(pid_t *child, const char *program, const char *text, int to) {
    char *const arguments[] = {(char *)program, "-c", (char *)text, NULL};
    posix_spawn_file_actions_t actions;
    if (posix_spawn_file_actions_init(&actions) != 0) return 0;
    int failed = posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0) ||
                 posix_spawn_file_actions_adddup2(&actions, to, 1) ||
                 posix_spawnp(child, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    return !failed;
}

char *platform_ask(const char *program, const char *text) {
    int ends[2], status;
    pid_t child;
    char *answer = calloc(1, ANSWER);
    if (!answer || pipe2(ends, O_CLOEXEC) != 0) return free(answer), NULL;
    int is_running = spawn(&child, program, text, ends[1]);
    close(ends[1]);
    int is_done = is_running && read_all(ends[0], answer);
    close(ends[0]);
    if (is_running && !is_done) kill(child, SIGKILL);
    while (is_running && waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    if (!is_done || !*answer) return free(answer), NULL;
    return answer;
}

char *platform_alias(const char *folder, int *handle) {
    char name[64];
    *handle = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
    snprintf(name, sizeof name, "/proc/self/fd/%d", *handle);
    return *handle >= 0 && platform_is_folder(name) ? strdup(name) : NULL;
}

void platform_close_alias(int handle) {
    if (handle >= 0) close(handle);
}

static struct sigaction interrupt;

void platform_keep_interrupt(void) { sigaction(SIGINT, NULL, &interrupt); }

void platform_restore_interrupt(void) { sigaction(SIGINT, &interrupt, NULL); }

wchar_t *platform_wide(const char *text) {
    /* By hand: what mbstowcs makes of it depends on the locale, which is the host's. Bytes that are no UTF-8 become
     * what Python calls surrogate escapes. */
    const unsigned char *from = (const unsigned char *)text;
    wchar_t *wide = malloc((strlen(text) + 1) * sizeof *wide), *to = wide;
    while (wide && *from) {
        int more = *from < 0x80 ? 0 : *from >= 0xc2 && *from < 0xe0 ? 1 : (*from & 0xf0) == 0xe0 ? 2 : 3;
        unsigned int code = more ? *from & (0x3fu >> more) : *from;
        int good = *from < 0x80 || (*from >= 0xc2 && *from < 0xf5);
        for (int i = 1; good && i <= more; i++) {
            good = (from[i] & 0xc0) == 0x80;
            code = code << 6 | (from[i] & 0x3fu);
        }
        *to++ = (wchar_t)(good ? code : 0xdc00u + *from);
        from += good ? more + 1 : 1;
    }
    if (wide) *to = 0;
    return wide;
}
