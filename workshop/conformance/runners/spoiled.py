#!/usr/bin/env python3
"""Answers wrongly on purpose: the answers of another runner, each changed a little. No case may be judged as right.

    runners/spoiled.py COMMAND..
"""

import json
import subprocess
import sys


def spoil(answer, task):
    """The answer with one thing wrong."""
    if "substitutions" in answer:
        found = answer["substitutions"]
        answer["substitutions"] = found[1:] if found else [{"utility": 1.0, "relations": ["none"]}]
    elif "steps" in answer:
        answer["steps"][-1]["errors"][0] += 0.001
    elif "suspected" in answer:
        answer["failed"].append({"signal": sorted(task["signals"])[0], "time_s": 1.0})
    elif "published" in answer:
        answer["published"] = [[time, low + 1, high + 1, *rest] for time, low, high, *rest in answer["published"]]
    elif "given" in answer:
        answer["given"] = answer["given"][1:] if answer["given"] else ["nobody.nothing"]
    elif "interval" in answer:
        high = (answer["interval"] or (0.0, 1.0))[1]
        answer["interval"] = [high + 0.001, high + 0.001]
    else:
        answer["sd"] *= 1.001
    return answer


def main():
    """Passes questions on, and spoils the answers."""
    with subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as runner:
        for line in sys.stdin:
            runner.stdin.write(line)
            runner.stdin.flush()
            said = json.loads(runner.stdout.readline())
            if said.get("answer"):
                said["answer"] = spoil(said["answer"], json.loads(line)["task"])
            print(json.dumps(said), flush=True)
        runner.stdin.close()


if __name__ == "__main__":
    main()
