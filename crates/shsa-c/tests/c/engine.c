/* The library as a program in C11 uses it. Ends with the number of the line of the first check that does not hold. */
#include <math.h>
#include <shsa.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(holds)                                                     \
    do {                                                                 \
        if (!(holds)) {                                                  \
            fprintf(stderr, "line %d: " #holds "\n", __LINE__);          \
            exit(1);                                                     \
        }                                                                \
    } while (0)

static const char TANK[] =
    "shsa: 1\n"
    "variables: { level: { unit: cm, range: [0, 10 m] } }\n"
    "signals:\n"
    "  float_1: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }\n"
    "  float_2: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }\n"
    "  float_3: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }\n"
    "needs: { level: { signal: healed_level, max_age: 1 s } }\n";

static const char SCAN[] =
    "shsa: 1\n"
    "variables: { distances: { unit: m, shape: vector }, nearest: { unit: m } }\n"
    "relations: { least: nearest = min(distances) }\n"
    "signals: { scan: { variable: distances, unit: m, rate: 10 Hz, value_error: 0.1 } }\n"
    "needs:\n"
    "  nearest: { signal: healed_nearest, max_age: 1 s }\n"
    "  distances: { signal: healed_distances, max_age: 1 s }\n";

static shsa_model *loaded(const char *text) {
    shsa_model *model = NULL;
    shsa_error error;
    CHECK(shsa_model_load(text, strlen(text), "tank.yaml", &model, &error) == SHSA_STATUS_OK);
    CHECK(model != NULL && error.status == SHSA_STATUS_OK && error.count == 0);
    return model;
}

static void wrong_models_have_a_place_and_a_remedy(void) {
    const char *text = "shsa: 1\nvariables: { level: }\nsignals: { wheel: { variable: levl } }\n";
    shsa_model *model = (shsa_model *)&model;
    shsa_error error;
    CHECK(shsa_model_load(text, strlen(text), "tank.yaml", &model, &error) == SHSA_STATUS_MODEL);
    CHECK(model == NULL);
    CHECK(error.status == SHSA_STATUS_MODEL && error.count == 1 && error.line == 3 && error.column == 31);
    CHECK(strstr(error.message, "levl") && strstr(error.help, "level"));
    CHECK(shsa_model_load(text, strlen(text), NULL, &model, NULL) == SHSA_STATUS_MODEL);
    CHECK(shsa_model_load("\xff", 1, NULL, &model, &error) == SHSA_STATUS_ARGUMENT);
    CHECK(strstr(error.message, "byte 0"));
}

static void null_pointers_are_told(void) {
    shsa_model *model = NULL;
    shsa_output output;
    shsa_error error;
    int64_t due;
    CHECK(shsa_model_load(NULL, 0, NULL, &model, &error) == SHSA_STATUS_ARGUMENT && error.count == 1);
    CHECK(shsa_model_load(TANK, strlen(TANK), NULL, NULL, NULL) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_model_count(NULL, SHSA_ELEMENT_SIGNAL) == 0);
    CHECK(shsa_model_name(NULL, SHSA_ELEMENT_SIGNAL, 0) == NULL);
    CHECK(shsa_model_find(NULL, SHSA_ELEMENT_SIGNAL, "x") == SHSA_NO_ID);
    CHECK(shsa_engine_new(NULL) == NULL);
    CHECK(shsa_engine_observe(NULL, 0, 0, 0, 1.0) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_engine_advance(NULL, 0) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_engine_poll(NULL, &output) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_engine_next_deadline(NULL, &due) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_engine_verdict(NULL, 0) == SHSA_VERDICT_UNKNOWN);
    CHECK(shsa_engine_snapshot(NULL) == NULL);
    CHECK(shsa_engine_restore(NULL, "{}", 2, 0, &error) == SHSA_STATUS_ARGUMENT);
    shsa_model_free(NULL);
    shsa_engine_free(NULL);
    shsa_string_free(NULL);
}

static void elements_have_names_and_numbers(void) {
    shsa_model *model = loaded(TANK);
    CHECK(shsa_model_count(model, SHSA_ELEMENT_SIGNAL) == 3);
    CHECK(shsa_model_count(model, SHSA_ELEMENT_RELATION) == 0 && shsa_model_count(model, 9) == 0);
    CHECK(shsa_model_find(model, SHSA_ELEMENT_SIGNAL, "float_2") == 1);
    CHECK(shsa_model_find(model, SHSA_ELEMENT_SIGNAL, "float_4") == SHSA_NO_ID);
    CHECK(shsa_model_find(model, SHSA_ELEMENT_NEED, "healed_level") == 0);
    CHECK(shsa_model_find(model, SHSA_ELEMENT_NEED, "level") == 0);
    CHECK(strcmp(shsa_model_name(model, SHSA_ELEMENT_VARIABLE, 0), "level") == 0);
    CHECK(strcmp(shsa_model_name(model, SHSA_ELEMENT_NEED, 0), "healed_level") == 0);
    CHECK(shsa_model_name(model, SHSA_ELEMENT_SIGNAL, 3) == NULL);
    shsa_model_free(model);
}

static int64_t at(int step) { return (int64_t)step * 200000000; }

/* One step of the tank: the first float is wrong from 10 s on. */
static void give(shsa_engine *engine, int step) {
    double level = 5.0 + 2.0 * sin(step / 50.0);
    for (uint32_t i = 0; i < 3; i++) {
        double value = level + (i == 0 && step >= 50 ? 0.5 : 0.0);
        CHECK(shsa_engine_observe(engine, i, at(step), at(step), value) == SHSA_STATUS_OK);
    }
    CHECK(shsa_engine_advance(engine, at(step)) == SHSA_STATUS_OK);
}

/* Checks that a value in cm is close to the level, and returns the number of published values. */
static int take(shsa_engine *engine, int step, int *failed, int *substituted, shsa_quality *quality) {
    shsa_output output;
    int published = 0;
    shsa_status status;
    while ((status = shsa_engine_poll(engine, &output)) == SHSA_STATUS_OK) {
        CHECK(output.time_ns <= at(step));
        if (output.kind == SHSA_OUTPUT_KIND_PUBLICATION) {
            double middle = (output.publication.values[0].lo + output.publication.values[0].hi) / 2.0;
            CHECK(output.publication.length == 1 && output.publication.need == 0);
            CHECK(fabs(middle - 100.0 * (5.0 + 2.0 * sin(step / 50.0))) < 60.0);
            CHECK(output.publication.from_ns <= output.publication.to_ns);
            *quality = output.publication.quality;
            published++;
        } else if (output.event.kind == SHSA_EVENT_KIND_FAILED) {
            CHECK(output.event.signal == 0 && output.event.relation == SHSA_NO_ID);
            CHECK(output.event.probability > 0.9 && strstr(output.event.because, "float_1"));
            CHECK(output.event.cause == NULL && output.event.substitution == NULL);
            ++*failed;
        } else if (output.event.kind == SHSA_EVENT_KIND_SUBSTITUTED) {
            CHECK(output.event.need == 0 && output.event.signal == SHSA_NO_ID);
            CHECK(strstr(output.event.substitution, "float_") && isnan(output.event.probability));
            ++*substituted;
        }
    }
    CHECK(status == SHSA_STATUS_NOTHING);
    return published;
}

static void a_wrong_float_is_named_and_replaced(void) {
    shsa_model *model = loaded(TANK);
    shsa_engine *engine = shsa_engine_new(model), *next = shsa_engine_new(model);
    shsa_model_free(model);
    int64_t due = 0;
    CHECK(shsa_engine_next_deadline(engine, &due) == SHSA_STATUS_NOTHING);
    int failed = 0, substituted = 0, published = 0;
    shsa_quality quality = SHSA_QUALITY_UNCERTAIN;
    for (int step = 0; step < 100; step++) {
        give(engine, step);
        published += take(engine, step, &failed, &substituted, &quality);
        if (step == 40) CHECK(quality == SHSA_QUALITY_GOOD);
        if (step == 40) CHECK(shsa_engine_verdict(engine, 0) == SHSA_VERDICT_HEALTHY);
    }
    CHECK(failed == 1 && substituted == 1 && published >= 95);
    CHECK(quality == SHSA_QUALITY_SUBSTITUTE);
    CHECK(shsa_engine_verdict(engine, 0) == SHSA_VERDICT_FAILED);
    CHECK(shsa_engine_verdict(engine, 1) == SHSA_VERDICT_HEALTHY);
    CHECK(shsa_engine_verdict(engine, 9) == SHSA_VERDICT_UNKNOWN);
    CHECK(shsa_engine_next_deadline(engine, &due) == SHSA_STATUS_OK && due > at(99));
    CHECK(shsa_engine_observe(engine, 3, at(100), at(100), 1.0) == SHSA_STATUS_ARGUMENT);

    /* Another engine goes on with the state: it trusts the first float no more. */
    char *state = shsa_engine_snapshot(engine);
    shsa_error error;
    CHECK(shsa_engine_restore(next, "{\n \"state\": 5}", 14, at(100), &error) == SHSA_STATUS_STATE);
    CHECK(error.line == 2 && error.message[0] != 0);
    CHECK(shsa_engine_restore(next, state, strlen(state), at(100), &error) == SHSA_STATUS_OK);
    CHECK(error.status == SHSA_STATUS_OK);
    shsa_string_free(state);
    give(next, 100);
    take(next, 100, &failed, &substituted, &quality);
    CHECK(shsa_engine_verdict(next, 0) == SHSA_VERDICT_FAILED && quality == SHSA_QUALITY_SUBSTITUTE);

    /* Silence is noticed by time that passes. */
    CHECK(shsa_engine_advance(engine, at(150)) == SHSA_STATUS_OK);
    CHECK(shsa_engine_verdict(engine, 1) == SHSA_VERDICT_SILENT);
    shsa_engine_free(next);
    shsa_engine_free(engine);
}

static void vectors_go_in_and_out(void) {
    shsa_model *model = loaded(SCAN);
    shsa_engine *engine = shsa_engine_new(model);
    const double scan[] = {3.0, 1.5, 2.0};
    uint32_t nearest = shsa_model_find(model, SHSA_ELEMENT_NEED, "nearest");
    shsa_model_free(model);
    CHECK(shsa_engine_observe_vector(engine, 0, 0, 0, scan, 3) == SHSA_STATUS_OK);
    CHECK(shsa_engine_observe_vector(engine, 0, 0, 0, NULL, 3) == SHSA_STATUS_ARGUMENT);
    CHECK(shsa_engine_advance(engine, 0) == SHSA_STATUS_OK);
    shsa_output output;
    int numbers = 0, vectors = 0;
    while (shsa_engine_poll(engine, &output) == SHSA_STATUS_OK) {
        if (output.kind != SHSA_OUTPUT_KIND_PUBLICATION) continue;
        if (output.publication.need == nearest) {
            CHECK(output.publication.length == 1 && fabs(output.publication.values[0].lo - 1.4) < 1e-9);
            numbers++;
        } else {
            CHECK(output.publication.length == 3 && fabs(output.publication.values[2].hi - 2.1) < 1e-9);
            vectors++;
        }
    }
    CHECK(numbers == 1 && vectors == 1);
    shsa_engine_free(engine);
}

int main(void) {
    CHECK(strlen(shsa_version()) >= 5);
    wrong_models_have_a_place_and_a_remedy();
    null_pointers_are_told();
    elements_have_names_and_numbers();
    a_wrong_float_is_named_and_replaced();
    vectors_go_in_and_out();
    puts("all hold");
    return 0;
}
