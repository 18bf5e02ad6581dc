"""Answers of `shsa` to questions of fusion: a model with a `fusion:` section, replayed over the measurements."""

import json
from statistics import NormalDist

# The output of a filter reaches this many standard deviations to each side.
SIDES = 3.0
CONFIDENCE = 2 * NormalDist().cdf(SIDES) - 1


def fusion(program, task):
    """By the method of the task."""
    return intervals(program, task) if task["method"] == "fault-tolerant-interval" else gaussian(program, task)


def model(signals, method):
    """A model whose need is served by the fused signal alone."""
    return {
        "shsa": 1,
        "variables": {"x": {}, "y": {}},
        "signals": signals,
        "fusion": {"f": {"outputs": {"fused": {"value": "x", "variable": "y", "confidence": CONFIDENCE}}, **method}},
        "needs": {"y": {"signal": "out", "max_age": "10 s"}},
    }


def last_value(program, made, rows):
    """The bounds of the last published value; `None` without one."""
    recording = program.write("rows.jsonl", "".join(json.dumps(it) + "\n" for it in rows))
    output = program.folder / "out.jsonl"
    output.write_text("")
    program.run("replay", program.write("model.json", made), recording, "--json", "--output", str(output))
    lines = output.read_text().splitlines()
    if not lines:
        return None
    value = json.loads(lines[-1])["value"]
    return [value["lo"], value["hi"]] if isinstance(value, dict) else [value, value]


def intervals(program, task):
    """Marzullo's interval over signals that arrive at one moment."""
    names = [f"s{number}" for number in range(len(task["intervals"]))]
    method = {"method": "marzullo", "states": {"x": {"spread": 1e6}}, "inputs": dict.fromkeys(names, "x"), "faulty": task["faulty"]}
    rows, signals = [], {}
    for name, (low, high) in zip(names, task["intervals"]):
        rows.append({"signal": name, "time_ns": 10**9, "received_ns": 10**9, "value": {"lo": low, "hi": high}})
        signals[name] = {"variable": "x"}
    return {"interval": last_value(program, model(signals, method), rows)}


def gaussian(program, task):
    """A Kalman filter without a gate; each measurement has a signal of its own, for its own noise."""
    signals, inputs, rows = {}, {}, []
    for number, (time, value, sd) in enumerate(task["measurements"]):
        name = f"s{number}"
        signals[name] = {"variable": "x", "noise": sd, "value_error": 100}
        inputs[name] = "x"
        stamp = round(time * 1e9) + 10**9
        rows.append({"signal": name, "time_ns": stamp, "received_ns": stamp, "value": value})
    state = {"initial": task["initial"], "spread": task["spread"], "noise": task["walk"]}
    method = {"method": "kalman", "states": {"x": state}, "inputs": inputs, "gate": "none", "witnesses": "none"}
    low, high = last_value(program, model(signals, method), rows)
    return {"mean": (low + high) / 2, "sd": (high - low) / 2 / SIDES}
