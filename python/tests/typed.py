"""What a user writes, for the check of types."""

from __future__ import annotations

import shsa


def levels(model: shsa.Model) -> list[float]:
    engine = shsa.Engine(model)
    engine.handle("float_1", 5.0, 0)
    engine.handle("float_2", (4.9, 5.1), 0, stamp_ns=-5)
    engine.advance(0)
    return [output.value for output in engine.outputs() if isinstance(output, shsa.Publication)]


def faults(model: shsa.Model, path: str) -> list[str]:
    drive = shsa.replay(model, [path], inject=["bias=3:/gnss/speed@20s.."], progress=lambda done, total: None)
    found: list[str] = [event["kind"] for event in drive.events]
    plans: list[shsa.Substitution] = model.plan("speed")
    return found + [way.formula for way in plans] + [problem.message for problem in model.check()]


def numbers(model: shsa.Model, path: str) -> str | None:
    return shsa.calibrate(model, path, skip=[(1.0, 2.0)]).patch or shsa.learn(path, model).patch
