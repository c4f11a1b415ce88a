/* What the loader wants from the operating system: platform_posix.c answers for Linux.
 *
 * Texts are UTF-8. What is returned as char * belongs to the caller, who frees it; NULL says that it failed.
 */
#ifndef OPENPANTO_PLATFORM_H
#define OPENPANTO_PLATFORM_H

#include <stddef.h>
#include <stdio.h>

/* Locks out other threads, other FMUs' among them, while Python is brought into the process. */
void platform_lock(void);
void platform_unlock(void);

/* Open a library; its symbols serve libraries opened later if is_global. Writes why it failed. */
void *platform_open(const char *path, int is_global, char *why, size_t size);

/* Find a symbol in a library, or in the whole process for NULL. */
void *platform_find(void *library, const char *name);

/* The path of this library, absolute: by the name that the host loaded it by, or where links lead. */
char *platform_self(int is_resolved);

int platform_is_file(const char *path);
int platform_is_folder(const char *path);
FILE *platform_read(const char *path);
char *platform_absolute(const char *path);

/* Turn the path of a file URI ("/tmp/x") into one of this system. */
void platform_fit_uri_path(char *path);

/* Run `program -c text` without a shell; what it writes to standard output, NULL if it cannot be run or is silent. */
char *platform_ask(const char *program, const char *text);

/* Another name for a folder, in ASCII, good while the handle is open; for paths that pythonfmu cannot take. */
char *platform_alias(const char *folder, int *handle);
void platform_close_alias(int handle);

/* Remember how the process takes an interrupt from the keyboard, and make it so again. */
void platform_keep_interrupt(void);
void platform_restore_interrupt(void);

/* Decode UTF-8 for functions of Python that want wide characters; never freed, as Python keeps it. */
wchar_t *platform_wide(const char *text);

#endif
