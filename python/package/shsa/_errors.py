"""The exceptions of the package."""

from __future__ import annotations

import json
from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """A problem of a model, with its place."""

    severity: str
    """``error``, ``warning`` or ``note``."""
    message: str
    file: str
    line: int
    """From 1; 0 when the problem is about the whole text."""
    column: int
    """In characters, from 1; 0 when the problem is about the whole text."""
    help: str | None
    """How to mend it, if that is known."""


def problems(text: str) -> list[Problem]:
    """The problems in a JSON list."""
    return [Problem(**one) for one in json.loads(text)]


class ShsaError(ValueError):
    """What was asked for cannot be done; the text says why."""


class ModelError(ShsaError):
    """A model has errors.

    >>> import shsa
    >>> try:
    ...     shsa.Model("shsa: 1\\nvariables: { speed: }\\nsignals: { wheel: { variable: sped } }\\n", "car.yaml")
    ... except shsa.ModelError as error:
    ...     problem = error.problems[-1]
    >>> (problem.line, problem.column, problem.help)
    (3, 31, 'did you mean `speed`?')
    """

    def __init__(self, text: str, found: str) -> None:
        super().__init__(text)
        self.problems: list[Problem] = problems(found)
        """All problems, in the order of the text."""
