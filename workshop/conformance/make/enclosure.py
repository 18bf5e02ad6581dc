"""Cases of interval computation: what a formula gives when its inputs are only known within bounds."""

from fractions import Fraction

import formula
from randomness import Random

SAMPLES = 400


def tree(random, names, depth):
    """A random formula; divisors are positive, as inputs and sums of them are."""
    if depth == 0 or random.chance(0.15):
        return random.choose(names) if random.chance(0.8) else round(random.between(0.5, 4), 2)
    operator = random.choose(["+", "-", "*", "/", "min", "max", "abs"])
    if operator == "abs":
        return ["abs", tree(random, names, depth - 1)]
    second = random.choose(names) if operator == "/" else tree(random, names, depth - 1)
    return [operator, tree(random, names, depth - 1), second]


def sampled(tree_, bounds, random):
    """The lowest and highest value at the corners, and at random points: a lower bound of the true range."""
    values = []
    names = list(bounds)
    corners = [{}]
    for name in names:
        corners = [{**corner, name: bound} for corner in corners for bound in bounds[name]]
    points = corners + [
        {name: low + (high - low) * Fraction(random.whole(0, 1000), 1000) for name, (low, high) in bounds.items()} for _ in range(SAMPLES)
    ]
    for point in points:
        values.append(formula.value(tree_, point))
    return [float(min(values)), float(max(values))]


def case(number):
    """A random formula with random bounds."""
    random = Random(9000 + number)
    names = ["a", "b", "c"][: random.whole(1, 3)]
    made = tree(random, names, random.whole(1, 4))
    if not formula.names(made):
        made = ["+", made, "a"]
    used = sorted(formula.names(made))
    lows = {name: round(random.between(0.5, 5), 3) for name in used}
    inputs = {name: [low, round(low + random.between(0, 2), 3)] for name, low in lows.items()}
    bounds = {name: tuple(Fraction(str(bound)) for bound in pair) for name, pair in inputs.items()}
    outer = [float(bound) for bound in formula.enclosure(made, bounds)]
    return {
        "case": f"enclosure/random-{number:02}",
        "kind": "enclosure",
        "topic": "random",
        "task": {"formula": made, "inputs": inputs},
        "expected": {"inner": sampled(made, bounds, random), "outer": outer},
    }


def cases():
    """All cases of this kind."""
    return [case(number) for number in range(1, 41)]
