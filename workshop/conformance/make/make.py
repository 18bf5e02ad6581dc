#!/usr/bin/env python3
"""Writes the cases of the suite; with --check, tells whether the files are what this script writes."""

import json
import sys
from pathlib import Path

import assurance
import enclosure
import fusion
import monitor
import search
import switching
import trace

KINDS = {
    "search": search,
    "enclosure": enclosure,
    "monitor": monitor,
    "trace": trace,
    "switching": switching,
    "assurance": assurance,
    "fusion": fusion,
}
FOLDER = Path(__file__).resolve().parent.parent / "cases"


def main():
    """Exit status 0: done, or the same; 1: a file differs."""
    check, different = "--check" in sys.argv[1:], []
    for kind, module in KINDS.items():
        text = "".join(json.dumps(case, separators=(",", ":")) + "\n" for case in module.cases())
        path = FOLDER / f"{kind}.jsonl"
        if not check:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            different.append(path.name)
    if different:
        sys.exit(f"not what make.py writes: {', '.join(different)}")


if __name__ == "__main__":
    main()
