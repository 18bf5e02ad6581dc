"""Answers of `shsa` that take a whole run: detection over a recorded trace, and switching between sources."""

import json

OPERATORS = {"+", "-", "*", "/"}


def formula(tree):
    """A formula in the language of models."""
    if not isinstance(tree, list):
        return str(tree)
    parts = [formula(part) for part in tree[1:]]
    return f"({parts[0]} {tree[0]} {parts[1]})" if tree[0] in OPERATORS else f"{tree[0]}({', '.join(parts)})"


def recording(program, series):
    """The readings of all signals in the order of time."""
    rows = [(time, name, value) for name, readings in series.items() for time, value in readings]
    rows.sort(key=lambda it: it[:2])
    lines = [json.dumps({"signal": name, "time_ns": time, "received_ns": time, "value": value}) for time, name, value in rows]
    return program.write("rows.jsonl", "\n".join(lines) + "\n"), rows[0][0] / 1e9


def replay(program, model, rows, *flags):
    """The report of a replay."""
    return json.loads(program.run("replay", program.write("model.json", model), rows, "--json", *flags))


def trace(program, task):
    """The signals that were reported as failed or suspected, and when."""
    signals = {
        name: {"variable": it["variable"], "rate": f"{it['rate_hz']} Hz", "value_error": it["value_error"], "time_error": f"{it['time_error_ns']} ns"}
        for name, it in task["signals"].items()
    }
    relations = {it["name"]: f"{it['output']} = {formula(it['formula'])}" for it in task["relations"]}
    model = {"shsa": 1, "variables": task["variables"], "relations": relations, "signals": signals}
    rows, start = recording(program, task["observations"])
    found = {"failed": [], "suspected": []}
    for event in replay(program, model, rows)["events"]:
        if event["kind"] in found and event["signal"]:
            found[event["kind"]].append({"signal": event["signal"], "time_s": event["time_s"] + start})
    return found


def switching(program, task):
    """The published values, with their source, and the changes of the source."""
    signals = {
        name: {
            "variable": "x",
            "rate": f"{it['rate_hz']} Hz",
            "value_error": it["value_error"],
            "shares": it["shares"],
            "properties": {"rank": 1 - 0.01 / it["preference"]},
        }
        for name, it in task["signals"].items()
    }
    model = {
        "shsa": 1,
        "variables": {"x": {"max_rate": task["variable"]["max_rate"]}},
        "signals": signals,
        "needs": {"x": {"signal": "out", "max_age": f"{task['max_age_s']} s"}},
        "utility": {"aggregate": "product", "signal": "rank"},
    }
    rows, start = recording(program, task["observations"])
    output = str(program.folder / "out.jsonl")
    events = replay(program, model, rows, "--output", output)["events"]
    kinds = {"substituted", "restored"}
    changes = [[it["time_s"] + start, it["substitution"]] for it in events if it["kind"] in kinds and it["variable"] == "x" and it["substitution"]]
    switches = [change for before, change in zip([[0, None]] + changes, changes) if before[1] != change[1]]
    with open(output) as lines:
        values = [json.loads(line) for line in lines]
    published = []
    for it in values:
        time = it["received_ns"] / 1e9
        value = it["value"]
        low, high = (value["lo"], value["hi"]) if isinstance(value, dict) else (value, value)
        source = next((name for at, name in reversed(switches) if at <= time), None)
        published.append([time, low, high, source])
    return {"published": published, "switches": switches}
