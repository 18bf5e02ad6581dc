"""Formulas as trees: a number, a name, or [operator, argument, ..]."""

from fractions import Fraction


def value(tree, of):
    """The value for one value of each name."""
    if isinstance(tree, str):
        return of[tree]
    if not isinstance(tree, list):
        return Fraction(str(tree))
    return OPERATORS[tree[0]](*[value(part, of) for part in tree[1:]])


def enclosure(tree, of):
    """The natural interval extension, exact: the lowest and the highest value when each name lies in its interval."""
    if isinstance(tree, str):
        return of[tree]
    if not isinstance(tree, list):
        return (Fraction(str(tree)),) * 2
    parts = [enclosure(part, of) for part in tree[1:]]
    operator = tree[0]
    if operator == "abs":
        low, high = parts[0]
        least = 0 if low <= 0 <= high else min(abs(low), abs(high))
        return (least, max(abs(low), abs(high)))
    if operator == "/" and parts[1][0] <= 0 <= parts[1][1]:
        raise ZeroDivisionError("a divisor that may be zero")
    corners = corner_values(operator, parts)
    return (min(corners), max(corners))


def corner_values(operator, parts):
    """The values at all corners of a box; the operators are monotonic in each argument there."""
    points = [[]]
    for low, high in parts:
        points = [point + [bound] for point in points for bound in (low, high)]
    return [OPERATORS[operator](*point) for point in points]


def names(tree):
    """The names in a formula, in order of appearance."""
    if isinstance(tree, str):
        return [tree]
    if not isinstance(tree, list):
        return []
    found = []
    for part in tree[1:]:
        found += [name for name in names(part) if name not in found]
    return found


OPERATORS = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "min": min,
    "max": max,
    "abs": abs,
}
