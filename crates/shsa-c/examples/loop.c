/*
 * Beside a control loop of 1 kHz: three floats tell the level of a tank, one of them is wrong from the second second on, and the loop
 * controls with the healed level. Prints the decisions, how long the steps took, and how much they allocated.
 *
 * As a control loop does, it keeps its memory from being paged, and asks for the scheduling of real time, which root may have, and whom
 * `ulimit -r` lets. Without it, the worst step is what other work on the core makes of it.
 *
 *   cc -std=c11 -O2 loop.c $(pkg-config --cflags --libs shsa) -lm -o loop && ./loop 10
 */
#define _GNU_SOURCE
#include <malloc.h>
#include <math.h>
#include <sched.h>
#include <shsa.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

#define PERIOD_NS 1000000
#define STACK_BYTES 65536
#define HEAP_BYTES 4194304
#define PRIORITY 40
#define FLOATS 3

static const char MODEL[] =
    "shsa: 1\n"
    "variables: { level: { unit: m, range: [0, 10] } }\n"
    "signals:\n"
    "  float_1: { variable: level, unit: m, rate: 1 kHz, value_error: 0.05 }\n"
    "  float_2: { variable: level, unit: m, rate: 1 kHz, value_error: 0.05 }\n"
    "  float_3: { variable: level, unit: m, rate: 1 kHz, value_error: 0.05 }\n"
    "needs: { level: { signal: healed_level, max_age: 10 ms } }\n";

#ifdef COUNT_ALLOCATIONS
/* In place of those of the C library, for the libraries, too. */
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
static unsigned long allocations;
void *malloc(size_t bytes) { allocations++; return __libc_malloc(bytes); }
void *calloc(size_t count, size_t bytes) { allocations++; return __libc_calloc(count, bytes); }
void *realloc(void *old, size_t bytes) { allocations++; return __libc_realloc(old, bytes); }
int posix_memalign(void **place, size_t alignment, size_t bytes) {
    allocations++;
    *place = __libc_memalign(alignment, bytes);
    return *place ? 0 : 12;
}
#else
static const unsigned long allocations = 0;
#endif

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void sleep_until(int64_t due_ns) {
    struct timespec due = {.tv_sec = due_ns / 1000000000, .tv_nsec = due_ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) != 0) {}
}

/* Lets no step wait for a page or for other programs, as far as this program may; returns whether it has the scheduling of real time. */
static int be_real_time(void) {
    /* Freed memory stays with the program, so that a later allocation meets no new page. */
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);
    volatile char stack[STACK_BYTES];
    for (size_t at = 0; at < sizeof stack; at += 1024) stack[at] = 0;
    volatile char *heap = malloc(HEAP_BYTES);
    if (heap) {
        for (size_t at = 0; at < HEAP_BYTES; at += 1024) heap[at] = 0;
        free((void *)heap);
    }
    /* What is there, and not what comes: beyond what the program may lock, the latter would have no memory at all. */
    mlockall(MCL_CURRENT);
    struct sched_param wanted = {.sched_priority = PRIORITY};
    return sched_setscheduler(0, SCHED_FIFO, &wanted) == 0;
}

static int by_size(const void *one, const void *other) {
    int64_t a = *(const int64_t *)one, b = *(const int64_t *)other;
    return (a > b) - (a < b);
}

/* What the plant does, and what its sensors say of it. */
static double level_at(double second) { return 5.0 + 2.0 * sin(second); }
static double reading(int which, double second) {
    return level_at(second) + (which == 0 && second >= 2.0 ? 0.5 : 0.0);
}

/* Takes the outputs: the healed level, and decisions, whose reasons are kept to be printed. Returns the number of decisions. */
static int take_outputs(shsa_engine *engine, double *level, char *reasons, size_t room) {
    shsa_output output;
    int decisions = 0;
    size_t length = 0;
    while (shsa_engine_poll(engine, &output) == SHSA_STATUS_OK) {
        if (output.kind == SHSA_OUTPUT_KIND_PUBLICATION) {
            *level = (output.publication.values[0].lo + output.publication.values[0].hi) / 2.0;
        } else {
            decisions++;
            int more = snprintf(reasons + length, room - length, "%s\n", output.event.because);
            length = (size_t)more < room - length ? length + (size_t)more : room - 1;
        }
    }
    return decisions;
}

int main(int argc, char **argv) {
    long steps = 1000 * (argc > 1 ? atol(argv[1]) : 10);
    if (steps <= 0) return 2;
    shsa_model *model;
    shsa_error error;
    if (shsa_model_load(MODEL, strlen(MODEL), "tank.yaml", &model, &error) != SHSA_STATUS_OK) {
        fprintf(stderr, "tank.yaml:%zu:%zu: %s\n%s\n", error.line, error.column, error.message, error.help);
        return 1;
    }
    shsa_engine *engine = shsa_engine_new(model);
    uint32_t floats[FLOATS];
    const char *names[FLOATS] = {"float_1", "float_2", "float_3"};
    for (int i = 0; i < FLOATS; i++) floats[i] = shsa_model_find(model, SHSA_ELEMENT_SIGNAL, names[i]);
    shsa_model_free(model);

    int64_t *lengths_ns = calloc((size_t)steps, sizeof *lengths_ns);
    if (!engine || !lengths_ns) return 1;
    double level = NAN, worst_error = 0.0;
    int64_t worst_decided_ns = 0;
    unsigned long allocated = 0;
    static char reasons[4096];
    const char *how = be_real_time() ? "with" : "without";
    const int64_t begin = now_ns();
    for (long step = 0; step < steps; step++) {
        int64_t due = begin + step * PERIOD_NS;
        sleep_until(due);
        double second = (double)(due - begin) / 1e9;
        unsigned long before = allocations;
        int64_t start = now_ns();
        for (int i = 0; i < FLOATS; i++) {
            shsa_engine_observe(engine, floats[i], due, due, reading(i, second));
        }
        shsa_engine_advance(engine, due);
        int decisions = take_outputs(engine, &level, reasons, sizeof reasons);
        lengths_ns[step] = now_ns() - start;
        if (decisions > 0) fputs(reasons, stdout);
        if (decisions > 0 && lengths_ns[step] > worst_decided_ns) worst_decided_ns = lengths_ns[step];
        /* A signal's first value allocates what the engine keeps of it; a decision allocates its texts, and comes once in a fault. */
        if (step > 0 && decisions == 0) allocated += allocations - before;
        double off = fabs(level - level_at(second));
        if (off > worst_error) worst_error = off;
        /* Here the controller would compute its output from `level`. */
    }
    qsort(lengths_ns, (size_t)steps, sizeof *lengths_ns, by_size);
    printf("%ld steps of %d observations: median %.1f us, 99.9 %% %.1f us, worst %.1f us\n", steps, FLOATS,
           (double)lengths_ns[steps / 2] / 1e3, (double)lengths_ns[steps - 1 - steps / 1000] / 1e3,
           (double)lengths_ns[steps - 1] / 1e3);
#ifdef COUNT_ALLOCATIONS
    printf("%lu allocations in steps without a decision, after the first one\n", allocated);
#endif
    printf("worst of the steps with a decision %.1f us; %s the scheduling of real time\n", (double)worst_decided_ns / 1e3, how);
    printf("the healed level was off by %.3f m at most\n", worst_error);
    free(lengths_ns);
    shsa_engine_free(engine);
    return allocated == 0 ? 0 : 1;
}
