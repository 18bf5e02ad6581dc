"""Cases of conditional safety certificates: which guarantees hold, by the definition of the least fixed point.

The least fixed point is the intersection of all sets that are closed under the certificates; all sets are tried.
"""

from randomness import Random

TYPES = ["speed", "distance", "load"]


def holds(tree, truth):
    """Whether a condition holds; `truth` tells of leaves."""
    if tree is True:
        return True
    if isinstance(tree, str):
        return truth(tree)
    parts = [holds(part, truth) for part in tree[1:]]
    return all(parts) if tree[0] == "and" else any(parts)


def meeting(services, service, demand):
    """The guarantees that meet a demand: of another service, of the same type, no weaker bound."""
    return {
        f"{other['name']}.{guarantee['name']}"
        for other in services
        if other is not service
        for guarantee in other["guarantees"]
        if guarantee["type"] == demand["type"] and guarantee["at_most"] <= demand["at_most"]
    }


def implied(services, given, unknown):
    """The guarantees that hold when those of `given` do; unknown evidence counts as `unknown`."""
    found = set()
    for service in services:
        demands = {demand["name"]: meeting(services, service, demand) for demand in service["demands"]}

        def truth(leaf):
            if leaf in demands:
                return bool(demands[leaf] & given)
            observed = service["evidence"][leaf]
            return unknown if observed is None else observed

        found |= {f"{service['name']}.{it['name']}" for it in service["guarantees"] if holds(it["when"], truth)}
    return found


def least(services, unknown):
    """The intersection of all closed sets."""
    names = [f"{service['name']}.{it['name']}" for service in services for it in service["guarantees"]]
    smallest = set(names)
    for number in range(2 ** len(names)):
        given = {name for at, name in enumerate(names) if number >> at & 1}
        if implied(services, given, unknown) <= given:
            smallest &= given
    return smallest


def case(topic, number, services):
    """A case: what is given, and what would be if the unknown were true."""
    given = least(services, False)
    expected = {"given": sorted(given), "open": sorted(least(services, True) - given)}
    return {"case": f"assurance/{topic}-{number:02}", "kind": "assurance", "topic": topic, "task": {"services": services}, "expected": expected}


def condition(random, leaves, depth):
    """A random condition over the leaves."""
    if not leaves:
        return True
    if depth == 0 or random.chance(0.3):
        return random.choose(leaves)
    return [random.choose(["and", "or"])] + [condition(random, leaves, depth - 1) for _ in range(2)]


def system(seed, count, any_direction):
    """Random services; demands go to earlier types only, or to any."""
    random, services = Random(seed), []
    for at in range(count):
        types = TYPES if any_direction else TYPES[: max(1, min(at, len(TYPES)))]
        demands = [
            {"name": f"d{number}", "type": random.choose(types), "at_most": random.whole(1, 4)} for number in range(random.whole(0 if at == 0 else 1, 2))
        ]
        evidence = {f"e{number}": random.choose([True, True, True, False, None]) for number in range(random.whole(0, 2))}
        leaves = [demand["name"] for demand in demands] + list(evidence)
        own = random.choose(TYPES) if any_direction else TYPES[min(at, len(TYPES) - 1)]
        guarantees = [
            {"name": f"g{number}", "type": own, "at_most": number + random.whole(1, 2), "when": condition(random, leaves, 2)} for number in range(random.whole(1, 2))
        ]
        services.append({"name": f"s{at}", "guarantees": guarantees, "demands": demands, "evidence": evidence})
    return services


def service(name, guarantees, demands=(), evidence=None):
    """A service written by hand: guarantees are (name, type, at_most, when), demands (name, type, at_most)."""
    return {
        "name": name,
        "guarantees": [dict(zip(("name", "type", "at_most", "when"), one)) for one in guarantees],
        "demands": [dict(zip(("name", "type", "at_most"), one)) for one in demands],
        "evidence": evidence or {},
    }


def chosen():
    """Systems in which evaluations are known to go wrong."""
    sensor = service("sensor", [("near", "distance", 1, "ok")], evidence={"ok": True})
    user = service("user", [("stop", "speed", 1, "d")], [("d", "distance", 2)])
    yield "order", [sensor, user]
    yield "order", [user, sensor]
    yield "bounds", [service("sensor", [("near", "distance", 3, True)]), user]
    yield "bounds", [service("sensor", [("near", "distance", 2, True)]), user]
    yield "types", [service("sensor", [("near", "load", 1, True)]), user]
    # Two services that rely on each other, and on nothing else, get nothing.
    one = service("one", [("g", "distance", 1, "d")], [("d", "speed", 1)])
    two = service("two", [("g", "speed", 1, "d")], [("d", "distance", 1)])
    yield "circular", [one, two]
    yield "circular", [one, two, service("third", [("g", "speed", 1, True)])]
    yield "circular", [one, two, service("third", [("g", "speed", 1, "e")], evidence={"e": False})]
    yield "unknown", [service("sensor", [("near", "distance", 1, "ok")], evidence={"ok": None}), user]
    yield "lesser", [service("sensor", [("best", "distance", 1, "ok"), ("last", "distance", 3, True)], evidence={"ok": False}), user]
    # One unmet demand takes one guarantee, not all.
    yield "lesser", [service("user", [("full", "speed", 1, ["and", "d", "e"]), ("slow", "speed", 3, "e")], [("d", "distance", 1)], {"e": True})]


def cases():
    """All cases of this kind."""
    count = {}
    made = list(chosen())
    made += [("acyclic", system(20000 + seed, 2 + seed % 3, False)) for seed in range(15)]
    made += [("any-direction", system(21000 + seed, 2 + seed % 3, True)) for seed in range(25)]
    for topic, services in made:
        count[topic] = count.get(topic, 0) + 1
        yield case(topic, count[topic], services)
