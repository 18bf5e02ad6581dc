"""Random numbers that are the same in every version of Python: a linear congruential generator (Knuth's MMIX constants)."""


class Random:
    """A seeded source of numbers."""

    def __init__(self, seed):
        self.state = (seed * 2862933555777941757 + 3037000493) % 2**64

    def number(self):
        """A number from 0 to 1, without 1."""
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self.state >> 11) / 2**53

    def between(self, low, high):
        """A number from `low` to `high`."""
        return low + (high - low) * self.number()

    def whole(self, low, high):
        """A whole number from `low` to `high`, both included."""
        return low + int(self.number() * (high - low + 1))

    def choose(self, items):
        """One of the items."""
        return items[self.whole(0, len(items) - 1)]

    def some(self, items, count):
        """That many different items, in their order."""
        left, chosen = list(range(len(items))), []
        for _ in range(count):
            chosen.append(left.pop(self.whole(0, len(left) - 1)))
        return [items[at] for at in sorted(chosen)]

    def chance(self, share):
        """Whether something of this probability happens."""
        return self.number() < share
