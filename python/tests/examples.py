"""Runs the examples in the documentation of the package, and of its guide, from the project's folder."""

import contextlib
import doctest
import io
import pathlib
import re

import shsa
import shsa._errors
import shsa._recordings
import shsa.opcua

names = vars(shsa) | {"shsa": shsa}
runner = doctest.DocTestRunner()
for module in (shsa, shsa._errors, shsa.opcua):
    tests = doctest.DocTestFinder(exclude_empty=True).find(module)
    # The module's own example makes the model that the others use.
    for test in sorted(tests, key=lambda test: test.name.count(".")):
        test.globs = names
        runner.run(test, clear_globs=False)
assert runner.failures == 0 and runner.tries > 10, runner.summarize()

guide = re.findall(r"```python\n(.*?)```", pathlib.Path("docs/python.md").read_text(), re.DOTALL)
used: list[object] = []
around = {"now": 0, "stamp": 0, "use": lambda *values: used.append(values), "log": used.append}
printed = io.StringIO()
with contextlib.redirect_stdout(printed):
    for block in guide:
        exec(compile(block, "docs/python.md", "exec"), around)
assert len(guide) == 3 and "failed /gnss/speed" in printed.getvalue() and used, printed.getvalue()
tuned, grid, found = (around[name] for name in ("tuned", "grid", "found"))
assert "signals" in tuned.report and (tuned.patch is None or "signals" in tuned.patch), tuned
assert grid.report["cells"] and "relations" in found.patch, (grid, found)
print(f"{runner.tries} examples hold")
