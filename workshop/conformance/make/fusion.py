"""Cases of fusion: fault-tolerant intervals by trying every point, Gaussian estimates by conditioning the joint distribution."""

from fractions import Fraction
from math import sqrt

from randomness import Random


def exact(number):
    """The decimal number as written."""
    return Fraction(str(number))


def covered(intervals, faulty):
    """The lowest and highest point that lies in at least n - f intervals; `None` where there is none."""
    needed = len(intervals) - faulty
    ends = [exact(end) for pair in intervals for end in pair]
    inside = [end for end in ends if sum(exact(low) <= end <= exact(high) for low, high in intervals) >= needed]
    return [float(min(inside)), float(max(inside))] if inside else None


def interval_case(topic, number, intervals, faulty):
    """A case of the fault-tolerant interval."""
    task = {"method": "fault-tolerant-interval", "intervals": intervals, "faulty": faulty}
    return {"case": f"fusion/{topic}-{number:02}", "kind": "fusion", "topic": topic, "task": task, "expected": {"interval": covered(intervals, faulty)}}


def random_intervals(number):
    """Intervals around a truth, and up to `faulty` elsewhere."""
    random = Random(30000 + number)
    count = random.whole(3, 7)
    faulty = random.whole(1, (count - 1) // 2)
    intervals = []
    for at in range(count):
        middle = 5.0 + (random.between(3, 9) if at < faulty else random.between(-0.4, 0.4))
        half = random.between(0.5, 1.2)
        intervals.append([round(middle - half, 3), round(middle + half, 3)])
    return intervals, faulty


def solved(matrix, right):
    """The solution of a linear system, in fractions, by elimination."""
    size = len(matrix)
    rows = [row[:] + [value] for row, value in zip(matrix, right)]
    for at in range(size):
        pivot = next(row for row in range(at, size) if rows[row][at] != 0)
        rows[at], rows[pivot] = rows[pivot], rows[at]
        rows[at] = [value / rows[at][at] for value in rows[at]]
        for row in range(size):
            if row != at and rows[row][at] != 0:
                rows[row] = [value - rows[row][at] * top for value, top in zip(rows[row], rows[at])]
    return [row[-1] for row in rows]


def conditioned(task):
    """Mean and standard deviation of the state at the last measurement, given all: x ~ N(initial, spread^2) at the first
    measurement, and independent steps of variance walk^2 a second."""
    rows = task["measurements"]
    first = exact(rows[0][0])
    spread, walk = exact(task["spread"]) ** 2, exact(task["walk"]) ** 2

    def shared(one, other):
        return spread + walk * (min(exact(one[0]), exact(other[0])) - first)

    matrix = [[shared(a, b) + (exact(a[2]) ** 2 if a is b else 0) for b in rows] for a in rows]
    gains = solved(matrix, [shared(row, rows[-1]) for row in rows])
    initial = exact(task["initial"])
    mean = initial + sum(gain * (exact(row[1]) - initial) for gain, row in zip(gains, rows))
    variance = shared(rows[-1], rows[-1]) - sum(gain * shared(row, rows[-1]) for gain, row in zip(gains, rows))
    return {"mean": float(mean), "sd": sqrt(variance)}


def gaussian_case(topic, number, walk):
    """A case of a scalar state with measurements [time_s, value, sd]."""
    random = Random(31000 + number + (100 if walk else 0))
    truth, rows = random.between(-3, 3), []
    for step in range(random.whole(2, 8)):
        sd = round(random.between(0.2, 1.5), 2)
        rows.append([round(step * 0.5, 1), round(truth + random.between(-1, 1) * sd, 3), sd])
    task = {"method": "gaussian", "initial": round(random.between(-2, 2), 2), "spread": round(random.between(1, 4), 2), "walk": walk, "measurements": rows}
    return {"case": f"fusion/{topic}-{number:02}", "kind": "fusion", "topic": topic, "task": task, "expected": conditioned(task)}


def cases():
    """All cases of this kind."""
    yield interval_case("intervals-by-hand", 1, [[8.0, 12.0], [11.0, 13.0], [10.0, 12.0]], 0)
    yield interval_case("intervals-by-hand", 2, [[8.0, 12.0], [11.0, 13.0], [14.0, 15.0]], 1)
    # Two places are covered often enough: the interval spans both.
    yield interval_case("intervals-by-hand", 3, [[0.0, 1.0], [0.5, 5.5], [5.0, 6.0]], 1)
    yield interval_case("intervals-by-hand", 4, [[0.0, 1.0], [1.0, 2.0], [1.0, 3.0]], 1)
    for number in range(1, 21):
        yield interval_case("intervals", number, *random_intervals(number))
    for number in range(1, 11):
        yield gaussian_case("constant", number, 0)
        yield gaussian_case("random-walk", number, 0.4)
