/* Faults of a host, loaded with LD_PRELOAD into the process under test, which alone sees them.
 *
 * QUADFRINGE_HOST_FAULTS names a file with two int64: nanoseconds by which UTC is off, and nanoseconds that every write to
 * a recording (a file whose name ends in .h5) takes. The file is mapped, so that a test changes them at any time.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const volatile int64_t *faults;

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("QUADFRINGE_HOST_FAULTS");
    int file = path ? open(path, O_RDONLY) : -1;
    void *map = file < 0 ? MAP_FAILED : mmap(NULL, 16, PROT_READ, MAP_SHARED, file, 0);
    if (map == MAP_FAILED) {
        fprintf(stderr, "QUADFRINGE_HOST_FAULTS: expected a file of 16 bytes\n");
        _exit(1);
    }
    close(file);
    faults = map;
}

int clock_gettime(clockid_t clock, struct timespec *time) {
    static int (*next)(clockid_t, struct timespec *);
    if (!next) next = dlsym(RTLD_NEXT, "clock_gettime");
    int status = next(clock, time);
    if (!status && faults && clock == CLOCK_REALTIME) {
        int64_t ns = time->tv_sec * INT64_C(1000000000) + time->tv_nsec + faults[0];
        time->tv_sec = ns / 1000000000;
        time->tv_nsec = ns % 1000000000;
    }
    return status;
}

int gettimeofday(struct timeval *restrict time, void *restrict zone) {
    struct timespec now;
    (void)zone;
    int status = clock_gettime(CLOCK_REALTIME, &now);
    if (!status) time->tv_sec = now.tv_sec, time->tv_usec = now.tv_nsec / 1000;
    return status;
}

static void wait_for(int file) {
    char link[32], name[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, name, sizeof name);
    if (length < 3 || memcmp(name + length - 3, ".h5", 3)) return;
    int64_t ns = faults[1];
    struct timespec pause = {ns / 1000000000, ns % 1000000000};
    nanosleep(&pause, NULL);
}

/* HDF5 writes with one of these two. */
ssize_t pwrite(int file, const void *bytes, size_t count, off_t place) {
    static ssize_t (*next)(int, const void *, size_t, off_t);
    if (!next) next = dlsym(RTLD_NEXT, "pwrite");
    wait_for(file);
    return next(file, bytes, count, place);
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t place) {
    static ssize_t (*next)(int, const void *, size_t, off64_t);
    if (!next) next = dlsym(RTLD_NEXT, "pwrite64");
    wait_for(file);
    return next(file, bytes, count, place);
}
