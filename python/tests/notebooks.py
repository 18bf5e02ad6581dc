"""Runs the notebooks from the project's folder, in one process, without a notebook server."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import matplotlib

matplotlib.use("Agg")
FOLDER = pathlib.Path("python/notebooks")


def executed(name: str) -> dict[str, Any]:
    """What a notebook has defined; the last line of each cell is evaluated, as a notebook would show it."""
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text())["cells"]
    names: dict[str, Any] = {}
    for cell in cells:
        assert not cell.get("outputs"), f"{name}: outputs are not committed"
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{name}.ipynb, {cell['id']}", "exec"), names)
    return names


drive, model, campaign = (executed(name) for name in ("drive", "model", "campaign"))
assert drive["drive"].report["needs"]["speed"]["met"] and set(drive["values"]["quality"]) == {"good", "substitute"}
assert (drive["events"]["kind"][0], drive["events"]["signal"][0]) == ("failed", "/gnss/speed")
assert model["healthy"] == [] and model["faulty"][0]["signal"] == "gnss", model["faulty"]
assert ["radar" in model["isolable"][at]["gnss"] for at in ("before", "after")] == [False, True], model["isolable"]
assert campaign["rates"].shape[0] == 3 and campaign["rates"].notna().to_numpy().any(), campaign["rates"]
assert len(list(FOLDER.glob("*.ipynb"))) == 3
print("3 notebooks run")
