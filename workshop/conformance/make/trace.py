"""Cases of detection and isolation: recorded values of systems with known truth, and which signals are faulty.

What must be found is derived twice: a fault is put in, so it is known; and an exhaustive search over all sets of signals, on the
values of each moment, finds the smallest sets whose removal leaves the others consistent. A case is kept only where both agree.
"""

from itertools import combinations
from math import sin

from randomness import Random

RATE_HZ = 10
SECONDS = 14
FAULT_S = 6.0
MARGIN = 4  # faults are that many times the sum of all bounds


def redundant(count):
    """So many signals of one variable."""
    return {
        "base": ["x"],
        "variables": {"x": {"max_rate": 3}},
        "relations": [],
        "signals": {name: {"variable": "x", "weights": [1]} for name in "abcdefg"[:count]},
    }


def parity():
    """Two quantities, their sum and their difference, each measured once, and one of them twice."""
    return {
        "base": ["x", "y"],
        "variables": {"x": {"max_rate": 3}, "y": {"max_rate": 3}, "s": {"max_rate": 6}, "d": {"max_rate": 6}},
        "relations": [
            {"name": "sum", "output": "s", "formula": ["+", "x", "y"]},
            {"name": "difference", "output": "d", "formula": ["-", "x", "y"]},
        ],
        "signals": {
            "sx": {"variable": "x", "weights": [1, 0]},
            "sy": {"variable": "y", "weights": [0, 1]},
            "ss": {"variable": "s", "weights": [1, 1]},
            "sd": {"variable": "d", "weights": [1, -1]},
        },
    }


def scaled():
    """One quantity, measured directly, doubled, and as a part of a sum whose other part is measured twice."""
    return {
        "base": ["x", "y"],
        "variables": {"x": {"max_rate": 3}, "y": {"max_rate": 3}, "twice": {"max_rate": 6}, "s": {"max_rate": 6}},
        "relations": [
            {"name": "doubling", "output": "twice", "formula": ["*", 2, "x"]},
            {"name": "sum", "output": "s", "formula": ["+", "x", "y"]},
        ],
        "signals": {
            "sx": {"variable": "x", "weights": [1, 0]},
            "st": {"variable": "twice", "weights": [2, 0]},
            "sy": {"variable": "y", "weights": [0, 1]},
            "sz": {"variable": "y", "weights": [0, 1]},
            "ss": {"variable": "s", "weights": [1, 1]},
        },
    }


def truth(name, time):
    """A slow motion; each quantity has its own."""
    return 4 + sin(0.5 * time) if name == "x" else 7 + sin(0.3 * time + 1)


def exact_value(system, signal, time):
    """What a perfect sensor would read."""
    return sum(weight * truth(name, time) for weight, name in zip(system["signals"][signal]["weights"], system["base"]))


def consistent(system, signals, readings, bound):
    """Whether some values of the base quantities lie within `bound` of all readings: tried by every square subsystem, and
    rejected only where a contradiction is larger than all bounds together."""
    size = len(system["base"])
    rows = [(system["signals"][signal]["weights"], readings[signal]) for signal in signals]
    squares = [solution for chosen in combinations(rows, size) if (solution := solve(chosen)) is not None]
    if not squares:
        return all(close_alone(one, other, bound) for one, other in combinations(rows, 2))
    worst = [max(abs(sum(w * x for w, x in zip(weights, solution)) - read) for weights, read in rows) for solution in squares]
    return min(worst) <= 6 * bound


def close_alone(one, other, bound):
    """Whether two readings of multiples of the same quantity agree; others cannot be compared."""
    (first, value), (second, beside) = one, other
    pairs = [(a, b) for a, b in zip(first, second) if a or b]
    if len(pairs) != 1 or not all(pairs[0]):
        return True
    return abs(value / pairs[0][0] - beside / pairs[0][1]) <= 6 * bound


def solve(rows):
    """The solution of one or two equations; `None` where they are dependent."""
    if len(rows) == 1:
        (weights, read) = rows[0]
        return None if weights[0] == 0 else [read / weights[0]]
    (a, b), p = rows[0]
    (c, d), q = rows[1]
    determinant = a * d - b * c
    return None if abs(determinant) < 1e-9 else [(p * d - b * q) / determinant, (a * q - c * p) / determinant]


def smallest_explanations(system, readings, bound):
    """The smallest sets of signals without which the others are consistent, by trying all sets."""
    names = sorted(system["signals"])
    for size in range(len(names) + 1):
        found = [set(gone) for gone in combinations(names, size) if consistent(system, [n for n in names if n not in gone], readings, bound)]
        if found:
            return found
    return []


def disturbed(kind, value, time, amount, held):
    """The reading of a faulty sensor."""
    if kind == "bias":
        return value + amount
    if kind == "stuck":
        return held
    if kind == "drift":
        return value + 0.5 * amount * (time - FAULT_S)
    if kind == "scale":
        return value * (1 + amount / 4)
    if kind == "invalid":
        return None
    return value


def readings(random, system, faults, bound, from_edge):
    """The values of all signals: within the bounds, but for the faulty ones from the fault on."""
    rows = {}
    for number, signal in enumerate(system["signals"]):
        kind, amount, rows[signal] = faults.get(signal, "sound"), MARGIN * bound * len(system["signals"]), []
        for step in range(SECONDS * RATE_HZ):
            time = step / RATE_HZ + 0.003 * number
            error = random.choose([-1, 1]) * 0.999 if from_edge else random.between(-0.95, 0.95)
            value = exact_value(system, signal, time) + error * bound
            if time >= FAULT_S and kind != "sound":
                value = disturbed(kind, value, time, amount, exact_value(system, signal, 0) - 3 * amount)
            rows[signal].append([round(time * 1e9), None if value is None else round(value, 4)])
    return rows


def explained(system, rows, faults, bound):
    """Whether the exhaustive search finds exactly these faults two seconds after their beginning; or how many other sets."""
    step = int((FAULT_S + 3) * RATE_HZ)
    invalid = {signal for signal, series in rows.items() if series[step][1] is None}
    left = {**system, "signals": {name: it for name, it in system["signals"].items() if name not in invalid}}
    found = smallest_explanations(left, {signal: rows[signal][step][1] for signal in left["signals"]}, bound)
    return [one | invalid for one in found]


def case(topic, number, system, faults, bound=0.1, from_edge=False):
    """A case with its expected verdict."""
    random = Random(5000 + 37 * number + sum(map(ord, topic)))
    rows = readings(random, system, faults, bound, from_edge)
    found = explained(system, rows, faults, bound)
    named = sorted(faults)
    if topic == "not-isolable":
        assert len(found) > 1 and any(set(named) == one for one in found), (topic, number, found)
        union = sorted(set().union(*found))
        expected = {"faulty": [], "candidates": union, "from_s": FAULT_S, "within_s": 3.0}
    else:
        assert found == [set(named)], (topic, number, found)
        expected = {"faulty": named, "from_s": FAULT_S, "within_s": 3.0}
    signals = {
        name: {"variable": it["variable"], "rate_hz": RATE_HZ, "value_error": bound, "time_error_ns": 0} for name, it in system["signals"].items()
    }
    task = {"variables": system["variables"], "relations": system["relations"], "signals": signals, "observations": rows}
    return {"case": f"trace/{topic}-{number:02}", "kind": "trace", "topic": topic, "task": task, "expected": expected}


def cases():
    """All cases of this kind."""
    systems = [redundant(3), redundant(4), parity(), scaled()]
    for number, system in enumerate(systems, 1):
        yield case("sound", number, system, {})
        yield case("sound-at-the-bounds", number, system, {}, from_edge=True)
    number = 0
    for system in systems:
        for signal in sorted(system["signals"])[:3]:
            number += 1
            yield case("one-fault", number, system, {signal: ["bias", "stuck", "drift", "scale"][number % 4]})
    yield case("invalid", 1, redundant(3), {"b": "invalid"})
    yield case("invalid", 2, scaled(), {"sx": "invalid"})
    yield case("two-faults", 1, redundant(5), {"a": "bias", "d": "stuck"})
    yield case("two-faults", 2, redundant(5), {"b": "scale", "c": "stuck"})
    yield case("two-faults", 3, scaled(), {"st": "bias", "sz": "stuck"})
    yield case("not-isolable", 1, redundant(2), {"a": "bias"})
    yield case("not-isolable", 2, {**parity(), "signals": {k: v for k, v in parity()["signals"].items() if k != "sd"}}, {"ss": "bias"})
