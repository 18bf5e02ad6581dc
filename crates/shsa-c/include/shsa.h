/*
 * shsa: the engine that heals signals, for programs in C and C++. The guide is docs/c.md.
 *
 * Made by cbindgen of crates/shsa-c/src; do not edit.
 */

#ifndef SHSA_H
#define SHSA_H

#include <stddef.h>
#include <stdint.h>

// What stands where an index stands and there is no element.
#define SHSA_NO_ID UINT32_MAX

// How a call has ended.
typedef enum shsa_status {
    // It has done what it does.
    SHSA_STATUS_OK = 0,
    // There is nothing: no further output, no deadline.
    SHSA_STATUS_NOTHING = 1,
    // A pointer is null, an index is none of the model, or a text is not UTF-8. Nothing has changed.
    SHSA_STATUS_ARGUMENT = 2,
    // The model has errors; the `shsa_error` has the first one.
    SHSA_STATUS_MODEL = 3,
    // The text is no snapshot; the `shsa_error` says why. Nothing has changed.
    SHSA_STATUS_STATE = 4,
    // The library has failed within the call, which is a defect of the library. The engine of the call cannot be used any more: every
    // further call with it ends with this code, until it is freed.
    SHSA_STATUS_PANIC = 5,
} shsa_status;

// The kinds of outputs.
typedef enum shsa_output_kind {
    // A value of a need: see `publication`.
    SHSA_OUTPUT_KIND_PUBLICATION = 0,
    // A decision: see `event`.
    SHSA_OUTPUT_KIND_EVENT = 1,
} shsa_output_kind;

// Where a published value comes from.
typedef enum shsa_quality {
    // From the need's preferred source.
    SHSA_QUALITY_GOOD = 0,
    // From a substitute.
    SHSA_QUALITY_SUBSTITUTE = 1,
    // From no trusted source: the bounds hold the truth, their middle means nothing.
    SHSA_QUALITY_UNCERTAIN = 2,
} shsa_quality;

// The kinds of decisions.
typedef enum shsa_event_kind {
    // A signal may be faulty; others may be to blame instead.
    SHSA_EVENT_KIND_SUSPECTED = 0,
    // A signal is faulty, and no other explains the evidence as well.
    SHSA_EVENT_KIND_FAILED = 1,
    // A signal gives no usable value any more.
    SHSA_EVENT_KIND_SILENT = 2,
    // A need is served from another source than before, because the source was lost.
    SHSA_EVENT_KIND_SUBSTITUTED = 3,
    // A signal is trusted again, or a need has gone back to its source.
    SHSA_EVENT_KIND_RESTORED = 4,
    // No trusted source can serve a need.
    SHSA_EVENT_KIND_UNHEALABLE = 5,
    // The demands of a need, or a contract, forbid a source that would serve it.
    SHSA_EVENT_KIND_REFUSED = 6,
    // A learned variable drifts towards an end of its range.
    SHSA_EVENT_KIND_AGEING = 7,
    // A single reading of a signal is wrong; the signal is trusted as before.
    SHSA_EVENT_KIND_OUTLIER = 8,
    // A counter has begun anew; it is trusted as before.
    SHSA_EVENT_KIND_RESTARTED = 9,
} shsa_event_kind;

// What is thought of a signal.
typedef enum shsa_verdict {
    // There is no evidence.
    SHSA_VERDICT_UNKNOWN = 0,
    // Others agree with it.
    SHSA_VERDICT_HEALTHY = 1,
    // It may be faulty.
    SHSA_VERDICT_SUSPECT = 2,
    // It is faulty, or its values are none.
    SHSA_VERDICT_FAILED = 3,
    // It sends nothing.
    SHSA_VERDICT_SILENT = 4,
} shsa_verdict;

// The kinds of elements of a model that have names. Each kind is counted from 0, in the order of the file.
typedef enum shsa_element {
    // Signals.
    SHSA_ELEMENT_SIGNAL = 0,
    // Variables.
    SHSA_ELEMENT_VARIABLE = 1,
    // Relations.
    SHSA_ELEMENT_RELATION = 2,
    // Needs, by the names under which they are published.
    SHSA_ELEMENT_NEED = 3,
} shsa_element;

// An engine: observations in, published values and decisions out. It may move between threads; only one may use it at a time.
typedef struct shsa_engine shsa_engine;

// A checked model. It never changes, so any number of threads may read it.
typedef struct shsa_model shsa_model;

// What is wrong with a text. All texts are UTF-8 and end with a zero; those that are too long are cut.
typedef struct shsa_error {
    // The code that the call has returned.
    enum shsa_status status;
    // The number of errors in the text.
    size_t count;
    // The line of the first error, from 1; 0 if it is about the whole text.
    size_t line;
    // The column of the first error in characters, from 1; 0 if it is about the whole text.
    size_t column;
    // The first error.
    char message[512];
    // How to mend it; empty if that is not known.
    char help[512];
} shsa_error;

// The bounds between which a number lies.
typedef struct shsa_range {
    // The lower bound.
    double lo;
    // The upper bound.
    double hi;
} shsa_range;

// A value of a need.
typedef struct shsa_publication {
    // The need.
    uint32_t need;
    // Where the value comes from.
    enum shsa_quality quality;
    // When the value was true, in ns: from this moment
    int64_t from_ns;
    // to this one.
    int64_t to_ns;
    // The value in the unit of the need's variable: one range for a number, one for each element of a vector. Belongs to the engine,
    // and is valid until the next call with it.
    const struct shsa_range *values;
    // The number of ranges.
    size_t length;
} shsa_publication;

// A decision. What does not apply is `SHSA_NO_ID`, null or not-a-number. The texts belong to the engine, and are valid until the next
// call with it.
typedef struct shsa_event {
    // What was decided.
    enum shsa_event_kind kind;
    // The signal that the decision is about.
    uint32_t signal;
    // The variable that the decision is about.
    uint32_t variable;
    // The need that the decision is about.
    uint32_t need;
    // The relation that is accused or cleared.
    uint32_t relation;
    // How probable the accusation is, from 0 to 1.
    double probability;
    // How the signal misbehaves: `bias`, `stuck`, ...
    const char *symptom;
    // The common cause that is blamed.
    const char *cause;
    // The evidence, as a sentence.
    const char *because;
    // What serves the need now.
    const char *substitution;
} shsa_event;

// An output of the engine.
typedef struct shsa_output {
    // Which of the two parts is filled.
    enum shsa_output_kind kind;
    // When it was decided or computed, in ns.
    int64_t time_ns;
    // The published value.
    struct shsa_publication publication;
    // The decision.
    struct shsa_event event;
} shsa_output;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the library, such as `0.1.0`.
const char *shsa_version(void);

// Reads and checks a model: YAML or JSON, UTF-8, of `length` bytes. `name` is what errors call the text; it may be null.
//
// `*model` is the model, to be freed with `shsa_model_free`, or null. Ends with `SHSA_STATUS_MODEL` where the text has errors; then
// `*error` has the first one. `error` may be null.
enum shsa_status shsa_model_load(const char *text,
                                 size_t length,
                                 const char *name,
                                 struct shsa_model **model,
                                 struct shsa_error *error);

// Frees a model; null is allowed. Engines made of it go on.
void shsa_model_free(struct shsa_model *model);

// The number of elements of a kind, an `shsa_element`; 0 for an unknown kind.
uint32_t shsa_model_count(const struct shsa_model *model, uint32_t element);

// The index of an element of a kind, an `shsa_element`, by its name; `SHSA_NO_ID` where none has it. A need is also found by its
// variable, if it is the only one of it. Takes time in proportion to the number of elements: ask once, before the loop.
uint32_t shsa_model_find(const struct shsa_model *model,
                         uint32_t element,
                         const char *name);

// The name of an element of a kind, an `shsa_element`; null for an unknown one. It is valid until the model is freed.
const char *shsa_model_name(const struct shsa_model *model,
                            uint32_t element,
                            uint32_t index);

// An engine for a model, to be freed with `shsa_engine_free`; null if `model` is. All memory that observations need is allocated here.
struct shsa_engine *shsa_engine_new(const struct shsa_model *model);

// Frees an engine; null is allowed.
void shsa_engine_free(struct shsa_engine *engine);

// Takes an observation of a signal: a number in the signal's unit, with the time stamp that its source gave it and the time at which
// it was received, in ns of one clock. Not-a-number is a value that the sensor could not measure. Allocates nothing
// after the first value of each signal.
//
// Time never goes back: what is received before something else that was taken counts as received at the same moment.
enum shsa_status shsa_engine_observe(struct shsa_engine *engine,
                                     uint32_t signal,
                                     int64_t stamp_ns,
                                     int64_t received_ns,
                                     double value);

// As `shsa_engine_observe`, for a value that brings its own bounds.
enum shsa_status shsa_engine_observe_range(struct shsa_engine *engine,
                                           uint32_t signal,
                                           int64_t stamp_ns,
                                           int64_t received_ns,
                                           double lo,
                                           double hi);

// As `shsa_engine_observe`, for a signal of a vector of `length` numbers, such as a scan. The numbers are copied, for which memory is
// allocated and freed again.
enum shsa_status shsa_engine_observe_vector(struct shsa_engine *engine,
                                            uint32_t signal,
                                            int64_t stamp_ns,
                                            int64_t received_ns,
                                            const double *values,
                                            size_t length);

// Lets time pass until now, after all observations that were received until now: what they mean comes out, and silence is noticed.
// Allocates nothing, except where something is decided.
enum shsa_status shsa_engine_advance(struct shsa_engine *engine,
                                     int64_t now_ns);

// The next output, the oldest first; ends with `SHSA_STATUS_NOTHING` when there is none. The pointers within `*output` are valid until
// the next call with the engine. Published numbers allocate nothing; decisions allocate their texts.
enum shsa_status shsa_engine_poll(struct shsa_engine *engine,
                                  struct shsa_output *output);

// When `shsa_engine_advance` is due at the latest, if nothing is observed before, in ns; ends with `SHSA_STATUS_NOTHING` when nothing is
// waited for.
enum shsa_status shsa_engine_next_deadline(struct shsa_engine *engine,
                                           int64_t *due_ns);

// What is thought of a signal now; of an unknown signal, `SHSA_VERDICT_UNKNOWN`.
enum shsa_verdict shsa_engine_verdict(struct shsa_engine *engine, uint32_t signal);

// The state that outlasts the process, as JSON that ends with a zero, to be freed with `shsa_string_free`; null where the engine is null
// or broken.
char *shsa_engine_snapshot(struct shsa_engine *engine);

// Takes over a state that `shsa_engine_snapshot` has given, of `length` bytes without the zero, before the first observation. The model
// may have changed since: what is the same goes on. Ends with `SHSA_STATUS_STATE` where the text is no state; then `*error` says why.
// `error` may be null.
enum shsa_status shsa_engine_restore(struct shsa_engine *engine,
                                     const char *text,
                                     size_t length,
                                     int64_t now_ns,
                                     struct shsa_error *error);

// Frees a text that the library has made; null is allowed.
void shsa_string_free(char *text);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SHSA_H */
