"""How each kind of answer is judged: None for a right one, else what is wrong with it. The README says the same in words."""

TOLERANCE = 1e-9


def close(one, other, tolerance=TOLERANCE):
    """Whether two numbers are equal but for rounding."""
    return abs(one - other) <= tolerance * max(1.0, abs(one), abs(other))


def search(task, expected, answer):
    """Every substitution once, in the order of their utilities; or the best utility of a large tree."""
    found = answer["substitutions"]
    if "best" in expected:
        return best_alone(expected["best"], found)
    wanted = {tuple(it["relations"]): it["utility"] for it in expected["substitutions"]}
    sets = [tuple(sorted(it["relations"])) for it in found]
    if len(set(sets)) < len(sets):
        return "a substitution is given twice"
    if missing := set(wanted) - set(sets):
        return f"{len(missing)} substitutions are missing, such as {sorted(missing)[0]}"
    if wrong := set(sets) - set(wanted):
        return f"{len(wrong)} are no substitutions, such as {sorted(wrong)[0]}"
    for relations, it in zip(sets, found):
        if not close(it["utility"], wanted[relations]):
            return f"the utility of {relations} is {wanted[relations]}, not {it['utility']}"
    worse = [b["utility"] > a["utility"] + TOLERANCE for a, b in zip(found, found[1:])]
    return "a better substitution comes after a worse one" if any(worse) else None


def best_alone(best, found):
    """Whether the first substitution has the best utility."""
    if best is None or not found:
        return None if best is None and not found else f"the best utility is {best}, and there are {len(found)} answers"
    return None if close(found[0]["utility"], best) else f"the best utility is {best}, not {found[0]['utility']}"


def enclosure(task, expected, answer):
    """An interval that holds every value that was tried, and is no wider than the natural interval extension."""
    low, high = answer["interval"]
    (least, most), (lowest, highest) = expected["inner"], expected["outer"]
    slack = TOLERANCE * max(1.0, abs(lowest), abs(highest))
    if low > least + slack or high < most - slack:
        return f"{low}..{high} leaves out values from {least}..{most}"
    if low < lowest - slack or high > highest + slack:
        return f"{low}..{high} is wider than {lowest}..{highest}"
    return None


def monitor(task, expected, answer):
    """In every step the errors of all substitutions, and the one that failed; a tie names nobody."""
    if len(answer["steps"]) != len(expected["steps"]):
        return f"{len(answer['steps'])} steps, not {len(expected['steps'])}"
    for number, (found, wanted) in enumerate(zip(answer["steps"], expected["steps"])):
        errors = found["errors"]
        if len(errors) != len(wanted["errors"]) or not all(map(close, errors, wanted["errors"])):
            return f"step {number}: the errors are {wanted['errors']}, not {errors}"
        if found["failed"] != wanted["failed"]:
            why = "a tie names nobody" if wanted["tied"] else f"{wanted['failed']} failed"
            return f"step {number}: {why}, not {found['failed']}"
    return None


def trace(task, expected, answer):
    """The faulty signals are named in time, and no other; where the evidence does not tell, none is named, and one is doubted."""
    named = {it["signal"]: it["time_s"] for it in answer["failed"]}
    doubted = {it["signal"]: it["time_s"] for it in answer.get("suspected", [])}
    start, last = expected["from_s"] if "from_s" in expected else 0, expected.get("from_s", 0) + expected.get("within_s", 0)
    early = [signal for signal, time in {**doubted, **named}.items() if time < start]
    if early:
        return f"{early[0]} is accused before anything is wrong"
    if wrong := set(named) - set(expected["faulty"]):
        return f"{sorted(wrong)[0]} is said to have failed, and has not"
    if "candidates" in expected:
        outside = set(doubted) - set(expected["candidates"])
        if outside or not doubted or min(doubted.values()) > last:
            return f"suspected are {sorted(doubted)}; the evidence is against {expected['candidates']}"
    if not expected["faulty"]:
        return None if doubted.keys() <= set(expected.get("candidates", [])) else f"{sorted(doubted)[0]} is suspected, and is sound"
    for signal in expected["faulty"]:
        if signal not in named:
            return f"{signal} has failed, and is not named"
        if named[signal] > last:
            return f"{signal} is named at {named[signal]} s, later than {last} s"
    return None


def switching(task, expected, answer):
    """Values without a gap, near the truth, not from a source that is lost, and without needless switches."""
    for judge in (gaps, errors_, nothing, sources):
        if wrong := judge(expected, answer):
            return wrong
    return None


def within(spans, time):
    """Whether the time lies in one of the spans."""
    return any(start <= time <= end for start, end in spans)


def gaps(expected, answer):
    """Whether values come often enough."""
    times = [0.0] + [time for time, *_ in answer["published"]] + [expected["until_s"]]
    for before, after in zip(times, times[1:]):
        excused = any(start <= before and after <= end for start, end in expected.get("may_miss", []))
        if after - before > expected["longest_gap_s"] + TOLERANCE and not excused:
            return f"no value from {before:.2f} to {after:.2f} s"
    return None


def errors_(expected, answer):
    """Whether values are near the truth of their own time."""
    truth = expected["truth"]
    for time, low, high, *_ in answer["published"]:
        error = abs((low + high) / 2 - truth["at_0"] - truth["a_second"] * time)
        if error > expected["error"] and not within(expected.get("may_err", []), time):
            return f"the value at {time:.2f} s is wrong by {error:.2f}"
    return None


def nothing(expected, answer):
    """Whether nothing is published while nothing is known."""
    for time, *_ in answer["published"]:
        if within(expected.get("nothing", []), time):
            return f"a value at {time:.2f} s, when all sources are silent"
    return None


def sources(expected, answer):
    """Whether sources change seldom, and none serves that is lost."""
    if len(answer["switches"]) > expected["switches_at_most"]:
        return f"{len(answer['switches'])} switches, more than {expected['switches_at_most']}"
    for time, _, _, source in answer["published"]:
        for signal, start, end in expected["not_from"]:
            if source == signal and start < time < end:
                return f"{signal} serves at {time:.2f} s"
    return None


def assurance(task, expected, answer):
    """Exactly the guarantees of the least fixed point hold, and exactly those are open that what is unknown decides."""
    for key in ("given", "open"):
        if set(answer[key]) != set(expected[key]):
            return f"{key} are {expected[key]}, not {sorted(answer[key])}"
    return None


def fusion(task, expected, answer):
    """The interval, or mean and standard deviation."""
    if "interval" in expected:
        found, wanted = answer["interval"], expected["interval"]
        same = found == wanted if None in (found, wanted) else all(map(close, found, wanted))
        return None if same else f"the interval is {wanted}, not {found}"
    for key in ("mean", "sd"):
        if not close(answer[key], expected[key], 1e-6):
            return f"the {key} is {expected[key]}, not {answer[key]}"
    return None


JUDGES = {
    "search": search,
    "enclosure": enclosure,
    "monitor": monitor,
    "trace": trace,
    "switching": switching,
    "assurance": assurance,
    "fusion": fusion,
}
