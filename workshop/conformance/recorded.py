#!/usr/bin/env python3
"""Judges recorded answers of other programs by the definitions of this suite, and prints a table.

    recorded.py SEARCH.json MONITOR.json TREE.json..

The forms are `shsa-search-golden-1`, `shsa-monitor-golden-1` and `shsa-tree-model-1`: graphs, inputs and trees with what a program
answered. The expected answers are computed here, as for the cases.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "make"))

import monitor
import search

import verdicts


def task_of(graph, goal):
    """A recorded graph as a task."""
    variables = graph["variables"]
    relations = [
        {"name": name, "outputs": it["out"], "inputs": it["in"], **({"cost": it["cost"]} if "cost" in it else {})} for name, it in graph["relations"].items()
    ]
    return {
        "goal": goal,
        "variables": list(variables),
        "relations": relations,
        "signals": {name: [name] for name, it in variables.items() if it["provided"]},
        "accuracies": {name: it["accuracy"] for name, it in variables.items() if "accuracy" in it},
        "utility": "norm",
    }


def searches(recorded):
    """Counts by program: roots whose answer is right, and all roots."""
    counts = {name: [0, 0] for name in ("DFS, all answers", "SH-PGSA, first answer", "SH-PGSA, all answers", "ORR, first answer")}

    def count(name, right):
        counts[name][0] += bool(right)
        counts[name][1] += 1

    for model in recorded["models"].values():
        for goal, answers in model["roots"].items():
            expected = {"substitutions": search.every_substitution(task_of(model["graph"], goal))}
            best = max((it["utility"] for it in expected["substitutions"]), default=None)
            count("DFS, all answers", answers["dfs"] is not None and whole(expected, answers["dfs"]))
            sequences = [variant["sequence"] for variant in answers["shpgsa"]]
            count("SH-PGSA, first answer", all(first(best, sequence) for sequence in sequences))
            count("SH-PGSA, all answers", all(whole(expected, sequence) for sequence in sequences))
            count("ORR, first answer", all(first(best, [it] if it["result"] == "found" else []) for it in answers["orr"]))
    return counts


def whole(expected, found):
    """Whether these are all answers, the best first."""
    return verdicts.search({}, expected, {"substitutions": found}) is None


def first(best, found):
    """Whether the first answer is the best one, or absent where there is none."""
    return verdicts.best_alone(best, found) is None


def trees(models):
    """Trees whose first answer is the best, of those that were answered."""
    counts = {"SH-PGSA, first answer in trees": [0, 0], "ORR, first answer in trees": [0, 0]}
    for model in models:
        expected = model["expected"]
        best = search.best_of_tree(tree_task(model))
        assert verdicts.close(best, expected["best_utility"]), model["experiment"]
        for name, key in (("SH-PGSA, first answer in trees", "shpgsa_first_utility"), ("ORR, first answer in trees", "orr_utility")):
            answer = expected[key]
            if answer is not None:
                counts[name][0] += verdicts.close(answer, best)
                counts[name][1] += 1
    return counts


def tree_task(model):
    """A tree as a task towards its root."""
    names = [f"n{at}" for at in range(len(model["parent"]))]
    relations, children = [], {}
    for at, parent in enumerate(model["parent"]):
        children.setdefault(parent, []).append(at)
    for at, (parent, kind) in enumerate(zip(model["parent"], model["provided"])):
        if kind == "-":
            cost = model.get("cost", {}).get(str(at), 1)
            relations.append({"name": names[at], "outputs": [names[parent]], "inputs": [names[child] for child in children[at]], "cost": cost})
    signals = {name: [name] for name, kind in zip(names, model["provided"]) if kind == "1"}
    return {"goal": "n0", "relations": relations, "signals": signals, "utility": "norm"}


def steps(recorded):
    """Steps of the monitor whose errors and failed substitution are right; and ties in which one was named."""
    counts = {"monitor, errors of a step": [0, 0], "monitor, failed substitution": [0, 0], "monitor, a tie names nobody": [0, 0]}

    def count(name, right):
        counts[name][0] += bool(right)
        counts[name][1] += 1

    for experiment in recorded["experiments"]:
        expected = monitor.run(monitor_task(experiment))["steps"]
        for found, wanted in zip(experiment["steps"], expected):
            count("monitor, errors of a step", all(map(verdicts.close, found["error"], wanted["errors"])))
            failed = None if found["failed"] == -1 else found["failed"]
            if wanted["tied"]:
                count("monitor, a tie names nobody", failed is None)
            else:
                count("monitor, failed substitution", failed == wanted["failed"])
    return counts


def monitor_task(experiment):
    """An experiment as a task: signals that are compared directly."""
    signals = {
        name: {"value_error": [it["verr_low"], it["verr_high"]], "time_error_ns": [it["terr_low"], it["terr_high"]]}
        for name, it in experiment["uncertainty"].items()
    }
    rows = [[{"signal": it["name"], "value": it["v"], "time_ns": int(it["t"])} for it in step["inputs"]] for step in experiment["steps"]]
    substitutions = [it["inputs"][0] for it in experiment["substitutions"]]
    return {"signals": signals, "substitutions": substitutions, "buffer": experiment["buffer_size"], "average": 1, "median": 1, "steps": rows}


def main():
    """A row for each question."""
    by_format = {}
    for path in sys.argv[1:]:
        with open(path) as file:
            content = json.load(file)
        for one in content if isinstance(content, list) else [content]:
            by_format.setdefault(one.get("format", "shsa-tree-model-1"), []).append(one)
    rows = {}
    for one in by_format.pop("shsa-search-golden-1", []):
        rows |= searches(one)
    for one in by_format.pop("shsa-monitor-golden-1", []):
        rows |= steps(one)
    rows |= trees(by_format.pop("shsa-tree-model-1", []))
    if by_format:
        sys.exit(f"unknown form: {', '.join(by_format)}")
    print("| question | right | of |\n|---|---|---|")
    for name, (right, of) in rows.items():
        print(f"| {name} | {right} | {of} |")


if __name__ == "__main__":
    main()
