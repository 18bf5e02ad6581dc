"""Cases of the published monitor: errors and the failed substitution in each step, by the definition, in exact numbers."""

from fractions import Fraction
from itertools import product
from statistics import median

import formula
from randomness import Random

STEP = 1_000_000_000


def exact(number):
    """The decimal number as written."""
    return Fraction(str(number))


def outputs(task, recent):
    """All outputs of all substitutions: every combination of items whose times overlap."""
    found = []
    for index, substitution in enumerate(task["substitutions"]):
        signals = formula.names(substitution)
        for items in product(*[[item for item in recent if item[0] == signal] for signal in signals]):
            start, end = max(item[2][0] for item in items), min(item[2][1] for item in items)
            if start <= end:
                bounds = {signal: item[1] for signal, item in zip(signals, items)}
                found.append((index, formula.enclosure(substitution, bounds), (start, end)))
    return found


def item_of(task, observation):
    """An observation as intervals of value and time."""
    signal, value, time = observation["signal"], exact(observation["value"]), observation["time_ns"]
    errors = task["signals"][signal]
    low, high = (value + exact(bound) for bound in errors["value_error"])
    start, end = (time + bound for bound in errors["time_error_ns"])
    return (signal, (low, high), (start, end))


def summed(found, count):
    """The error of each substitution: its distances from the outputs of all others that overlap in time."""
    sums = [Fraction(0)] * count
    for at, (one, value, time) in enumerate(found):
        for other, beside, when in found[at + 1 :]:
            if one != other and max(time[0], when[0]) <= min(time[1], when[1]):
                error = max(0, max(value[0], beside[0]) - min(value[1], beside[1]))
                sums[one] += error
                sums[other] += error
    return sums


def run(task):
    """The expected errors and failed substitution of every step."""
    count, buffers, steps = len(task["substitutions"]), [], []
    errors, averages = [[] for _ in range(count)], [[] for _ in range(count)]
    for observations in task["steps"]:
        buffers = (buffers + [[item_of(task, it) for it in observations]])[-task["buffer"] :]
        sums = summed(outputs(task, [item for items in buffers for item in items]), count)
        filtered = []
        for index, error in enumerate(sums):
            errors[index] = (errors[index] + [error])[-task["average"] :]
            averages[index] = (averages[index] + [sum(errors[index]) / len(errors[index])])[-task["median"] :]
            filtered.append(median(averages[index]))
        highest = max(filtered)
        top = [index for index, error in enumerate(filtered) if error == highest]
        failed = top[0] if highest > 0 and len(top) == 1 else None
        tied = top if highest > 0 and len(top) > 1 else []
        steps.append({"errors": [float(error) for error in filtered], "failed": failed, "tied": tied})
    return {"steps": steps}


def random_case(topic, number, buffer=1, average=1, window=1):
    """Three substitutions of one variable, one of them wrong for some steps."""
    random = Random(7000 + 100 * buffer + 10 * average + window + 1000 * number)
    signals = {
        name: {
            "value_error": [-round(random.between(0.1, 0.4), 2), round(random.between(0.1, 0.4), 2)],
            "time_error_ns": [-random.whole(0, 150) * 1_000_000, random.whole(0, 150) * 1_000_000],
        }
        for name in ["a", "b", "c", "d"]
    }
    substitutions = ["a", ["*", 2, "b"], ["+", "c", "d"]]
    wrong, steps = random.choose(["a", "b", "c"]), []
    for step in range(10):
        truth, observations = random.between(2, 6), []
        for name, value in (("a", truth), ("b", truth / 2), ("c", truth - 1), ("d", 1.0)):
            off = 1.5 if name == wrong and 4 <= step < 8 else 0.0
            low, high = signals[name]["value_error"]
            read = round(value + off - random.between(low, high) * 0.9, 3)
            observations.append({"signal": name, "value": read, "time_ns": step * STEP + random.whole(0, 120) * 1_000_000})
        if random.chance(0.15):
            observations.pop(random.whole(0, 3))
        steps.append(observations)
    task = {"signals": signals, "substitutions": substitutions, "buffer": buffer, "average": average, "median": window, "steps": steps}
    return finished(topic, number, task)


def finished(topic, number, task):
    """The case with its expected answer."""
    return {"case": f"monitor/{topic}-{number:02}", "kind": "monitor", "topic": topic, "task": task, "expected": run(task)}


def by_hand(values, errors=(-0.5, 0.5), times=None):
    """Signals that are compared directly: one list of values a step."""
    names = ["a", "b", "c"][: len(values[0])]
    signals = {name: {"value_error": list(errors), "time_error_ns": [0, 0]} for name in names}
    times = times or [[0] * len(names)] * len(values)
    steps = [
        [{"signal": name, "value": value, "time_ns": step * STEP + at} for name, value, at in zip(names, row, times[step])]
        for step, row in enumerate(values)
    ]
    return {"signals": signals, "substitutions": names, "buffer": 1, "average": 1, "median": 1, "steps": steps}


def cases():
    """All cases of this kind."""
    yield finished("ties", 1, by_hand([[1.0, 5.0]]))
    yield finished("ties", 2, by_hand([[1.0, 5.0, 3.0], [1.0, 1.0, 1.0]]))
    yield finished("touching", 1, by_hand([[1.0, 2.0, 2.0], [1.0, 2.1, 2.0]]))
    yield finished("touching", 2, by_hand([[1.0, 9.0, 1.0]], times=[[0, 0, 1]]))
    for number in range(1, 9):
        yield random_case("plain", number)
    for number in range(1, 7):
        yield random_case("buffer", number, buffer=2 + number % 2)
        yield random_case("filters", number, average=1 + number % 3, window=1 + 2 * (number % 2))
