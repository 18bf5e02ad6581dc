#!/usr/bin/env python3
"""Answers the suite with the command `shsa`: writes a model for each task, runs a command on it, reads its JSON.

    runners/shsa.py PATH_OF_SHSA
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import fused
import runs

OPERATORS = {"+", "-", "*", "/"}


def text(tree, name):
    """A formula in the language of models; `name` gives the word for a name."""
    if isinstance(tree, str):
        return name(tree)
    if not isinstance(tree, list):
        return repr(tree)
    parts = [text(part, name) for part in tree[1:]]
    if tree[0] in OPERATORS:
        return f"({parts[0]} {tree[0]} {parts[1]})"
    return f"{tree[0]}({', '.join(parts)})"


def names(tree):
    """The names in a formula, each once."""
    if isinstance(tree, str):
        return [tree]
    if not isinstance(tree, list):
        return []
    return list(dict.fromkeys(name for part in tree[1:] for name in names(part)))


class Program:
    """The command, run in a folder with its files."""

    def __init__(self, path, folder):
        self.path, self.folder = str(Path(path).resolve()), Path(folder)

    def write(self, name, content):
        """A file in the folder: text, or JSON."""
        path = self.folder / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return name

    def run(self, *arguments):
        """The standard output; exit statuses 0, 1 and 3 are answers."""
        done = subprocess.run([self.path, *arguments], capture_output=True, text=True, cwd=self.folder)
        if done.returncode not in (0, 1, 3):
            raise RuntimeError(done.stderr.strip())
        return done.stdout


def search(program, task):
    """Answered by `shsa plan`."""
    accuracies = task.get("accuracies", {})
    variables = {name: {"properties": {"accuracy": accuracies[name]}} if name in accuracies else {} for name in task["variables"]}
    relations = {it["name"]: relation(it) for it in task["relations"]}
    signals = {}
    for variable, carriers in task["signals"].items():
        for signal in carriers:
            signals[signal] = {"variable": variable, "shares": task.get("shares", {}).get(signal, [])}
    aggregate = {"norm": None, "product": "product", "sum": "sum", "minimum": "minimum"}[task["utility"]]
    utility = {"aggregate": aggregate, "relation": "rating", "defaults": {"rating": 1}} if aggregate else "norm"
    model = program.write("model.json", {"shsa": 1, "variables": variables, "relations": relations, "signals": signals, "utility": utility})
    flags = [("--exclude", it) for it in task.get("excluded_signals", [])]
    flags += [("--exclude-relation", it) for it in task.get("excluded_relations", [])]
    flags += [("--independent-of", it) for it in task.get("independent_of", [])]
    every = "--top" if len(task["relations"]) > 30 else "--all"
    flags += [(every, "1")] if every == "--top" else [(every,)]
    found = json.loads(program.run("plan", model, task["goal"], "--json", *[word for flag in flags for word in flag]))
    return {"substitutions": [{"utility": it["utility"], "relations": it["relations"]} for it in found["substitutions"]]}


def relation(it):
    """A relation of structure only."""
    properties = {key: it[key] for key in ("rating", "cost") if key in it}
    return {"outputs": it["outputs"], "inputs": it["inputs"], "properties": properties}


def ranked(count):
    """Ratings that keep the order of that many relations."""
    return [1 - 0.001 * (number + 1) for number in range(count)]


def direct_model(task):
    """Substitutions of one variable `x` as a model: a name alone is a signal of `x`, anything else a relation over variables
    that have one signal each."""
    variables, relations, signals = {"x": {}}, {}, {}
    for number, (tree, rating) in enumerate(zip(task["substitutions"], ranked(len(task["substitutions"])))):
        if isinstance(tree, str):
            signals[tree] = {"variable": "x", "properties": {"rank": rating}}
            continue
        for name in names(tree):
            variables[f"v_{name}"] = {}
            signals[name] = {"variable": f"v_{name}", "properties": {"rank": 1}}
        equation = f"x = {text(tree, lambda name: f'v_{name}')}"
        relations[f"r{number}"] = {"equation": equation, "for": ["x"], "properties": {"rating": rating}}
    utility = {"aggregate": "product", "relation": "rating", "signal": "rank", "defaults": {"rank": 1, "rating": 1}}
    return {"shsa": 1, "variables": variables, "relations": relations, "signals": signals, "utility": utility}


def enclosure(program, task):
    """Answered by a step of `shsa replay --compare`: all inputs at one moment."""
    model = direct_model({"substitutions": [task["formula"]]})
    rows = [row(name, 1_000_000_000, {"lo": low, "hi": high}) for name, (low, high) in task["inputs"].items()]
    steps = stepped(program, model, rows)
    return {"interval": steps[0]["outputs"][0]["value"]}


def monitor(program, task):
    """Answered by `shsa replay --compare --mode thesis`."""
    model = direct_model(task)
    for name, errors in task["signals"].items():
        start, end = errors["time_error_ns"]
        model["signals"][name] |= {"value_error": errors["value_error"], "time_error": [f"{start} ns", f"{end} ns"]}
    rows = []
    for number, observations in enumerate(task["steps"]):
        rows += [row(it["signal"], it["time_ns"] + START, it["value"], (number + 1) * 1_000_000_000) for it in observations]
    flags = [word for key in ("buffer", "average", "median") for word in (f"--{key}", str(task[key]))]
    steps = stepped(program, model, rows, *flags)
    failed = [None if step["failed"] == -1 else step["failed"] for step in steps]
    return {"steps": [{"errors": step["errors"], "failed": name} for step, name in zip(steps, failed)]}


START = 1_000_000_000


def row(signal, time_ns, value, received_ns=None):
    """An observation."""
    return {"signal": signal, "time_ns": time_ns, "received_ns": received_ns or time_ns, "value": value}


def stepped(program, model, rows, *flags):
    """The steps of the monitor, one a second. A step ends with the first observation after it, so a signal of its own follows
    the last one."""
    model["variables"]["end"], model["signals"]["end"] = {}, {"variable": "end"}
    rows = rows + [row("end", rows[-1]["received_ns"] + 1_000_000_000, 0)]
    recording = program.write("rows.jsonl", "".join(json.dumps(it) + "\n" for it in rows))
    path = program.write("model.json", model)
    output = program.run("replay", path, recording, "--compare", "x", "--mode", "thesis", "--json", "--period", "1s", *flags)
    return [json.loads(line) for line in output.splitlines()]


def assurance(program, task):
    """Answered by `shsa assure` over one certificate a service."""
    files = [program.write(f"{service['name']}.yml", yaml(certificate(service))) for service in task["services"]]
    observed = {f"{it['name']}.yml": {k: v for k, v in it["evidence"].items() if v is not None} for it in task["services"] if it["evidence"]}
    flags = ["--with", program.write("evidence.yaml", observed)]
    found = json.loads(program.run("assure", *files, "--json", *flags))
    by_verdict = {"given": [], "open": []}
    for it in found["guarantees"]:
        if it["verdict"] in by_verdict:
            by_verdict[it["verdict"]].append(f"{it['service'].removesuffix('.yml')}.{it['guarantee']}")
    return by_verdict


def certificate(service):
    """A certificate in the form of conserts-rs."""
    gates, flows = [], []

    def wire(tree, target):
        if isinstance(tree, str):
            flows.append({"from": tree, "to": target})
        elif isinstance(tree, list):
            gates.append({"id": f"gate{len(gates)}", "function": tree[0].capitalize()})
            gate = gates[-1]["id"]
            flows.append({"from": gate, "to": target})
            for part in tree[1:]:
                wire(part, gate)

    for guarantee in service["guarantees"]:
        wire(guarantee["when"], guarantee["name"])
    kinds = {
        "provided_services": ("guarantees", service["guarantees"]),
        "required_services": ("demands", service["demands"]),
    }
    services = {
        key: [{"id": f"{key}_{it['name']}", "functional_service_type": it["type"], word: [it["name"]]} for it in items] for key, (word, items) in kinds.items()
    }
    return {
        "guarantees": [statement(it) for it in service["guarantees"]],
        "demands": [statement(it) for it in service["demands"]],
        "evidence": [{"id": name, "description": name, "dimension": {"Binary": {"type": name}}} for name in service["evidence"]],
        "gates": gates,
        "tree_propagations": flows,
        **services,
    }


def yaml(tree):
    """YAML: each key on a line of its own, with JSON behind it."""
    return "".join(f"{key}: {json.dumps(value)}\n" for key, value in tree.items())


def statement(it):
    """A bound as a range from zero, of which the guarantee's lies within the demand's."""
    covered = [{"Inclusive": {"start": 0.0, "end": float(it["at_most"])}}]
    return {"id": it["name"], "dimensions": [{"Numeric": {"type": "error", "covered": covered, "subset": "Guarantee", "uom": "m"}}]}


ANSWERS = {
    "search": search,
    "enclosure": enclosure,
    "monitor": monitor,
    "trace": runs.trace,
    "switching": runs.switching,
    "assurance": assurance,
    "fusion": fused.fusion,
}


def main():
    """One answer for each line."""
    with tempfile.TemporaryDirectory() as folder:
        program = Program(sys.argv[1], folder)
        for line in sys.stdin:
            asked = json.loads(line)
            answer = ANSWERS.get(asked["kind"])
            if answer is None:
                said = {"unsupported": f"nothing answers {asked['kind']}"}
            else:
                try:
                    said = {"answer": answer(program, asked["task"])}
                except (RuntimeError, LookupError, TypeError) as error:
                    said = {"answer": None, "error": str(error)}
            print(json.dumps({"case": asked["case"], **said}), flush=True)


if __name__ == "__main__":
    main()
