// The library as a program in C++17 uses it: handles in smart pointers, and the outputs of a range that is observed.
#include <shsa.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace {

struct Free {
    void operator()(shsa_model *model) const { shsa_model_free(model); }
    void operator()(shsa_engine *engine) const { shsa_engine_free(engine); }
    void operator()(char *text) const { shsa_string_free(text); }
};
using Model = std::unique_ptr<shsa_model, Free>;
using Engine = std::unique_ptr<shsa_engine, Free>;

Model load(std::string_view text) {
    shsa_model *model = nullptr;
    shsa_error error;
    if (shsa_model_load(text.data(), text.size(), "car.yaml", &model, &error) != SHSA_STATUS_OK) {
        throw std::runtime_error(std::to_string(error.line) + ":" + std::to_string(error.column) + " " + error.message);
    }
    return Model(model);
}

std::vector<shsa_range> published(shsa_engine *engine) {
    std::vector<shsa_range> values;
    shsa_output output;
    while (shsa_engine_poll(engine, &output) == SHSA_STATUS_OK) {
        if (output.kind == SHSA_OUTPUT_KIND_PUBLICATION) values.push_back(output.publication.values[0]);
    }
    return values;
}

bool holds() {
    std::string refused;
    try {
        load("shsa: 1\nvariables: [\n");
    } catch (const std::runtime_error &error) {
        refused = error.what();
    }
    if (refused.empty() || refused[0] == '0') return false;

    Model model = load("shsa: 1\nvariables: { speed: { unit: m/s } }\n"
                       "signals: { wheel: { variable: speed, unit: km/h, rate: 10 Hz } }\n"
                       "needs: { speed: { signal: healed_speed, max_age: 1 s } }\n");
    Engine engine(shsa_engine_new(model.get()));
    if (shsa_engine_observe_range(engine.get(), 0, 0, 0, 36.0, 72.0) != SHSA_STATUS_OK) return false;
    shsa_engine_advance(engine.get(), 0);
    const auto values = published(engine.get());
    if (values.size() != 1 || values[0].lo > 10.0 || values[0].lo < 9.999 || values[0].hi < 20.0) return false;
    const std::unique_ptr<char, Free> state(shsa_engine_snapshot(engine.get()));
    return std::string(state.get()).find("healed_speed") != std::string::npos;
}

}  // namespace

int main() {
    std::puts(holds() ? "all hold" : "something does not hold");
    return holds() ? 0 : 1;
}
