"""Cases of switching: a value must stay available while its sources fail. What must hold is argued beside each case."""

from randomness import Random

RATE_HZ = 10
SECONDS = 40


def true_value(time):
    """The truth is a straight line, so that the judge can compute it."""
    return 2.0 + 0.05 * time


def series(random, off, bound=0.1, gaps=(), wrong=()):
    """The readings of one source: absent in the gaps, shifted by 2 while it is wrong."""
    rows = []
    for step in range(SECONDS * RATE_HZ):
        time = step / RATE_HZ + off
        if any(start <= time < end for start, end in gaps):
            continue
        shift = 2.0 if any(start <= time < end for start, end in wrong) else 0.0
        rows.append([round(time * 1e9), round(true_value(time) + shift + random.between(-0.9, 0.9) * bound, 4)])
    return rows


def case(topic, number, sources, expected, shares=None):
    """Sources in the order of preference: name -> what is wrong with it."""
    random = Random(11000 + number + sum(map(ord, topic)))
    observations = {name: series(random, 0.01 * at, **faults) for at, (name, faults) in enumerate(sources.items())}
    signals = {
        name: {"rate_hz": RATE_HZ, "value_error": 0.1, "preference": len(sources) - at, "shares": (shares or {}).get(name, [])}
        for at, name in enumerate(sources)
    }
    task = {"variable": {"max_rate": 1}, "signals": signals, "max_age_s": 0.5, "observations": observations}
    expected = {"truth": {"at_0": 2.0, "a_second": 0.05}, "error": 0.3, "longest_gap_s": 0.6, "until_s": SECONDS - 0.5, **expected}
    return {"case": f"switching/{topic}-{number:02}", "kind": "switching", "topic": topic, "task": task, "expected": expected}


def cases():
    """All cases of this kind."""
    sound = {"a": {}, "b": {}, "c": {}}
    # Nothing is wrong: any switch is needless.
    yield case("no-fault", 1, sound, {"switches_at_most": 0, "not_from": []})
    # The preferred source falls silent at 10 s. Its last value may be used for max_age; then another one must serve.
    silent = {**sound, "a": {"gaps": [(10, 99)]}}
    yield case("silent", 1, silent, {"switches_at_most": 2, "not_from": [["a", 10.6, 40]]})
    yield case("silent", 2, {**silent, "b": {"gaps": [(20, 99)]}}, {"switches_at_most": 3, "not_from": [["a", 10.6, 40], ["b", 20.6, 40]]})
    # The preferred source is present and wrong: two others contradict it. A second is enough to see it; until then its value
    # may go out.
    wrong = {**sound, "a": {"wrong": [(10, 99)]}}
    yield case("wrong", 1, wrong, {"switches_at_most": 2, "not_from": [["a", 11, 40]], "may_err": [[10, 11]]})
    # Wrong, and sound again: it may serve again, and need not.
    back = {**sound, "a": {"wrong": [(10, 15)]}}
    yield case("recovery", 1, back, {"switches_at_most": 3, "not_from": [["a", 11, 15]], "may_err": [[10, 11]]})
    yield case("recovery", 2, {**sound, "a": {"gaps": [(10, 15)]}}, {"switches_at_most": 3, "not_from": [["a", 10.6, 15]]})
    # A loose contact: half a second there, one and a half absent, for twenty seconds. Ten times back and forth would be twenty
    # switches; one away and one back is enough.
    loose = [(10 + 2 * at, 11.5 + 2 * at) for at in range(10)]
    yield case("flapping", 1, {**sound, "a": {"gaps": loose}}, {"switches_at_most": 6, "not_from": []})
    # One supply feeds a and b, and both fall silent with it: c alone is left.
    lost = {**silent, "b": {"gaps": [(10, 99)]}}
    supply = {"a": ["supply"], "b": ["supply"]}
    expected = {"switches_at_most": 3, "not_from": [["a", 10.6, 40], ["b", 10.6, 40]]}
    yield case("common-silence", 1, lost, expected, supply)
    # All are silent for five seconds: nothing can be published then, and nothing old may be.
    gone = {name: {"gaps": [(10, 15)]} for name in sound}
    yield case("all-silent", 1, gone, {"switches_at_most": 4, "not_from": [], "nothing": [[10.7, 14.9]], "may_miss": [[10, 16]]})
