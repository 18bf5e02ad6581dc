"""Cases of the search: random and chosen graphs; expected answers by trying every set of relations."""

from itertools import product

from randomness import Random


def directions(task):
    """The relation for each way in which it can be used: (name, output, inputs, relation)."""
    excluded = set(task.get("excluded_relations", []))
    found = []
    for relation in task["relations"]:
        if relation["name"] in excluded:
            continue
        for output in relation["outputs"]:
            inputs = [name for name in relation["inputs"] if name != output]
            found.append((relation["name"], output, inputs, relation))
    return found


def provided(task):
    """The variables that an admissible signal carries."""
    barred = set(task.get("excluded_signals", []))
    shares = task.get("shares", {})
    for suspect in task.get("independent_of", []):
        barred.add(suspect)
        causes = set(shares.get(suspect, []))
        barred |= {signal for signal, others in shares.items() if causes & set(others)}
    return {variable for variable, signals in task["signals"].items() if set(signals) - barred}


def valid(chosen, goal, known):
    """Whether these directions are a substitution of the goal, by the definition in the README."""
    above = {output: inputs for _, output, inputs, _ in chosen}
    if len(above) != len(chosen) or len({name for name, *_ in chosen}) != len(chosen):
        return False
    if goal not in above:
        return not chosen and goal in known
    reached, stack = set(), [goal]
    while stack:
        variable = stack.pop()
        if variable in reached:
            continue
        reached.add(variable)
        if variable in above:
            if variable != goal and variable in known:
                return False
            stack.extend(above[variable])
        elif variable not in known:
            return False
    return set(above) <= reached and acyclic(above)


def acyclic(above):
    """Whether no variable is computed from itself."""
    done, open_ = set(), set()

    def visit(variable):
        if variable in open_:
            return False
        if variable in done or variable not in above:
            return True
        open_.add(variable)
        fine = all(visit(one) for one in above[variable])
        open_.discard(variable)
        done.add(variable)
        return fine

    return all(visit(variable) for variable in above)


def utility(chosen, task, known):
    """The utility of a set of relations."""
    kind = task["utility"]
    ratings = [norm(inputs, relation, task, known) if kind == "norm" else relation["rating"] for _, _, inputs, relation in chosen]
    if kind == "sum":
        return -sum(ratings)
    if kind == "minimum":
        return min(ratings, default=1.0)
    result = 1.0
    for rating in ratings:
        result *= rating
    return result


def norm(inputs, relation, task, known):
    """The published rating of a relation."""
    accuracy = 1.0
    for name in inputs:
        accuracy *= task.get("accuracies", {}).get(name, 1.0)
    unprovided = sum(name not in known for name in inputs)
    return (0.3 / len(inputs) + 0.5 / relation.get("cost", 1) + 0.1 / (unprovided + 1) + 0.5 * accuracy) / 1.4


def every_substitution(task):
    """All substitutions, by trying every choice: for each variable no direction, or one of those that produce it."""
    known = provided(task)
    by_output = {}
    for direction in directions(task):
        by_output.setdefault(direction[1], []).append(direction)
    found = []
    for choice in product(*[[None] + options for options in by_output.values()]):
        chosen = [direction for direction in choice if direction]
        if valid(chosen, task["goal"], known):
            names = sorted(name for name, *_ in chosen)
            found.append({"utility": utility(chosen, task, known), "relations": names})
    return sorted(found, key=lambda it: (-it["utility"], it["relations"]))


def best_of_tree(task):
    """The best utility where no two relations share a variable: the product over inputs is exact there."""
    known = provided(task)
    by_output = {}
    for direction in directions(task):
        by_output.setdefault(direction[1], []).append(direction)

    def best(variable, root=False):
        if variable in known and not root:
            return 1.0
        options = [rated(direction) for direction in by_output.get(variable, [])]
        return max([option for option in options if option is not None], default=None)

    def rated(direction):
        result = norm(direction[2], direction[3], task, known) if task["utility"] == "norm" else direction[3]["rating"]
        for name in direction[2]:
            below = best(name)
            if below is None:
                return None
            result *= below
        return result

    return best(task["goal"], root=True)


def case(topic, number, task, best_only=False):
    """A case with the answers of the exhaustive search."""
    if best_only:
        best = best_of_tree(task)
        expected = {"best": best}
    else:
        expected = {"substitutions": every_substitution(task)}
    return {"case": f"search/{topic}-{number:02}", "kind": "search", "topic": topic, "task": task, "expected": expected}


def relation(random, name, outputs, inputs, kind):
    """A relation with a random rating."""
    made = {"name": name, "outputs": outputs, "inputs": inputs}
    if kind == "norm":
        if random.chance(0.5):
            made["cost"] = random.whole(1, 5)
    elif kind == "sum":
        made["rating"] = round(random.between(0.5, 4), 3)
    else:
        made["rating"] = round(random.between(0.3, 1), 3)
    return made


def graph(seed, kind, both_ways, shared):
    """A random graph of at most eight variables; `shared`: variables are inputs of several relations."""
    random = Random(seed)
    variables = [f"v{at}" for at in range(random.whole(4, 8))]
    relations = []
    for number in range(random.whole(3, 7)):
        output = variables[0] if number == 0 else random.choose(variables)
        others = [name for name in variables if name != output]
        if not shared:
            below = [name for name in others if name > output]
            others = below or others
        inputs = random.some(others, min(len(others), random.whole(1, 3)))
        outputs = [output]
        if both_ways and random.chance(0.6):
            outputs = sorted({output, random.choose(inputs)})
            inputs = sorted({output, *inputs})
        relations.append(relation(random, f"r{number}", outputs, inputs, kind))
    signals = {name: [f"s{at}"] for at, name in enumerate(variables[1:]) if random.chance(0.55)}
    if random.chance(0.2):
        signals["v0"] = ["s_goal"]
    task = {"goal": "v0", "variables": variables, "relations": relations, "signals": signals, "utility": kind}
    if kind == "norm":
        task["accuracies"] = {name: round(random.between(0.5, 1), 2) for name in variables if random.chance(0.5)}
    return task


def tree(seed, branch, depth):
    """A tree in which each relation has inputs of its own."""
    random = Random(seed)
    variables, relations, signals = ["v0"], [], {}

    def grow(variable, level):
        for _ in range(branch):
            inputs = []
            for _ in range(branch):
                name = f"v{len(variables)}"
                variables.append(name)
                inputs.append(name)
            relations.append(relation(random, f"r{len(relations)}", [variable], inputs, "product"))
            for name in inputs:
                leaf = level + 1 == depth
                if leaf or random.chance(0.3 + 0.4 * level / depth):
                    signals[name] = [f"s{len(signals)}"]
                if not leaf:
                    grow(name, level + 1)

    grow("v0", 0)
    return {"goal": "v0", "variables": variables, "relations": relations, "signals": signals, "utility": "product"}


def with_requirements(seed):
    """A graph whose signals have causes in common, and some of them, or relations, are ruled out."""
    task = graph(seed, "product", True, True)
    random = Random(seed + 7)
    for signals in task["signals"].values():
        if random.chance(0.4):
            signals.append(signals[0] + "b")
    every = [signal for signals in task["signals"].values() for signal in signals]
    task["shares"] = {signal: [random.choose(["clock", "supply", "bus"])] for signal in every if random.chance(0.5)}
    what = seed % 3
    if what == 0:
        task["excluded_signals"] = random.some(every, min(2, len(every)))
    elif what == 1:
        task["excluded_relations"] = [random.choose(task["relations"])["name"]]
    elif every:
        task["independent_of"] = [random.choose(every)]
    return task


def small(goal, relations, signals, utility_="product", **more):
    """A task written by hand: relations are (name, outputs, inputs, rating)."""
    rows = [{"name": n, "outputs": o, "inputs": i, "rating": r} for n, o, i, r in relations]
    names = {name for row in rows for name in row["outputs"] + row["inputs"]} | {goal} | set(signals)
    return {"goal": goal, "variables": sorted(names), "relations": rows, "signals": signals, "utility": utility_, **more}


def chosen():
    """Graphs in which searches are known to go wrong: (topic, task)."""
    one = {"a": ["sa"], "b": ["sb"]}
    yield "ties", small("x", [("p", ["x"], ["a"], 0.5), ("q", ["x"], ["b"], 0.5)], one)
    yield "ties", small("x", [("p", ["x"], ["a"], 1.0), ("q", ["x"], ["b"], 1.0), ("r", ["b"], ["a"], 1.0)], {"a": ["sa"]})
    # Two variables that determine each other, and nothing else: no answer, and no endless search.
    yield "cycles", small("x", [("p", ["x"], ["y"], 0.9), ("q", ["y"], ["x"], 0.9)], {})
    yield "cycles", small("x", [("p", ["x", "y"], ["x", "y"], 0.9), ("q", ["y", "z"], ["y", "z"], 0.8), ("r", ["z", "x"], ["z", "x"], 0.7)], {"z": ["sz"]})
    # The intermediate variable m is used twice and computed once.
    yield "shared", small("x", [("p", ["x"], ["u", "w"], 0.9), ("q", ["u"], ["m"], 0.9), ("r", ["w"], ["m"], 0.9), ("s", ["m"], ["a"], 0.5)], one)
    # Each branch alone prefers another m; together one shared m is best.
    yield "shared", small("x", [("p", ["x"], ["u", "w"], 1.0), ("q", ["u"], ["m"], 0.9), ("r", ["w"], ["m"], 0.9), ("t", ["w"], ["a"], 0.6), ("s", ["m"], ["a"], 0.6), ("v", ["u"], ["b"], 0.7)], one)
    # The greedy choice at the first relation leads to a worse whole.
    yield "greedy", small("x", [("good", ["x"], ["m"], 0.95), ("fair", ["x"], ["a"], 0.7), ("bad", ["m"], ["b"], 0.4)], one)
    yield "greedy", small("x", [("good", ["x"], ["m", "n"], 0.99), ("fair", ["x"], ["a"], 0.5), ("k", ["m"], ["a"], 0.7), ("l", ["n"], ["b"], 0.7)], one)
    # A provided variable is not substituted further.
    yield "provided", small("x", [("p", ["x"], ["m"], 0.5), ("q", ["m"], ["a"], 1.0)], {"m": ["sm"], "a": ["sa"]})
    yield "provided", small("x", [("p", ["x"], ["a"], 0.5)], {"x": ["sx"], "a": ["sa"]})
    yield "none", small("x", [("p", ["x"], ["a", "c"], 0.5)], one)
    yield "none", small("x", [], {})
    # An unprovided variable is needed at two depths.
    yield "two-depths", small("x", [("p", ["x"], ["m", "n"], 0.9), ("q", ["n"], ["m"], 0.9), ("r", ["m"], ["a"], 0.9)], one)


def cases():
    """All cases of this kind."""
    count = {}

    def next_(topic, task, best_only=False):
        count[topic] = count.get(topic, 0) + 1
        return case(topic, count[topic], task, best_only)

    for topic, task in chosen():
        yield next_(topic, task)
    for seed in range(12):
        yield next_("acyclic", graph(100 + seed, "product", False, False))
    for seed in range(20):
        yield next_("random", graph(200 + seed, "product", True, True))
    for seed in range(8):
        yield next_("sum", graph(300 + seed, "sum", True, True))
        yield next_("minimum", graph(400 + seed, "minimum", True, True))
        yield next_("published-utility", graph(500 + seed, "norm", True, True))
    for seed in range(18):
        yield next_("requirements", with_requirements(600 + seed))
    for seed in range(3):
        yield next_("large-tree", tree(700 + seed, 2, 3 + seed), True)
