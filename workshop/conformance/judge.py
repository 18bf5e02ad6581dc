#!/usr/bin/env python3
"""Judges an implementation by the cases of this suite: asks it over its standard input, reads its answers, prints a table.

    judge.py [--kind KIND].. [--case NAME].. [--verbose] [--limit SECONDS] -- COMMAND..

Exit status: 0 when every case that the implementation supports is answered rightly, 1 when one is not, 2 when it cannot be asked.
"""

import argparse
import json
import queue
import subprocess
import sys
import threading
from pathlib import Path

import verdicts

CASES = Path(__file__).resolve().parent / "cases"


class Implementation:
    """A running implementation: one line of JSON for each case, one line of JSON for each answer."""

    def __init__(self, command, limit):
        self.command, self.limit, self.process = command, limit, None

    def start(self):
        """Starts the command, and a thread that reads its lines."""
        self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines = queue.Queue()
        threading.Thread(target=self.read, args=(self.process.stdout, self.lines), daemon=True).start()

    @staticmethod
    def read(stream, lines):
        """Hands the lines on; None at the end."""
        for line in stream:
            lines.put(line)
        lines.put(None)

    def ask(self, case):
        """The answer to a case. After a time-out or an end the command is started again for the next case."""
        if self.process is None:
            self.start()
        question = {"case": case["case"], "kind": case["kind"], "task": case["task"]}
        try:
            self.process.stdin.write(json.dumps(question) + "\n")
            self.process.stdin.flush()
            line = self.lines.get(timeout=self.limit)
        except queue.Empty:
            return self.given_up(f"no answer within {self.limit:g} s")
        except BrokenPipeError:
            line = None
        if line is None:
            return self.given_up("the command ended")
        return self.read_answer(line, case["case"])

    def read_answer(self, line, name):
        """The answer on a line, or what is wrong with it."""
        try:
            answer = json.loads(line)
        except ValueError:
            return {"wrong": f"not a line of JSON: {line[:60]!r}"}
        if not isinstance(answer, dict) or answer.get("case") != name:
            return {"wrong": "the answer names another case"}
        return answer

    def given_up(self, why):
        """Ends the command; what was asked is answered wrongly."""
        self.stop()
        return {"wrong": why}

    def stop(self):
        """Ends the command."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


def problem(case, answer):
    """None for a right answer, else what is wrong with it."""
    if "wrong" in answer:
        return answer["wrong"]
    if not isinstance(answer.get("answer"), dict):
        return f"no answer: {answer.get('error', 'none is given')}"
    try:
        return verdicts.JUDGES[case["kind"]](case["task"], case["expected"], answer["answer"])
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        return f"the answer has another form: {type(error).__name__} {error}"


def cases(kinds, names):
    """The chosen cases, in the order of the files."""
    for path in sorted(CASES.glob("*.jsonl")):
        for line in path.read_text().splitlines():
            case = json.loads(line)
            if (not kinds or case["kind"] in kinds) and (not names or case["case"] in names):
                yield case


def table(counts):
    """The counts by kind and topic as Markdown."""
    rows = ["| kind | topic | right | wrong | not supported |", "|---|---|---|---|---|"]
    for (kind, topic), (right, wrong, absent) in counts.items():
        rows.append(f"| {kind} | {topic} | {right} | {wrong} | {absent} |")
    totals = [sum(column) for column in zip(*counts.values())] or [0, 0, 0]
    rows.append(f"| all | | {totals[0]} | {totals[1]} | {totals[2]} |")
    return rows, totals


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kind", action="append", default=[], help="only cases of this kind; may be given several times")
    parser.add_argument("--case", action="append", default=[], help="only this case; may be given several times")
    parser.add_argument("--verbose", action="store_true", help="print the answers that are wrong")
    parser.add_argument("--limit", type=float, default=30.0, help="seconds for one answer (30)")
    parser.add_argument("command", nargs="+", help="the implementation, after --")
    return parser.parse_args()


def main():
    """Asks every case and prints the table."""
    given = arguments()
    implementation, counts = Implementation(given.command, given.limit), {}
    try:
        for case in cases(given.kind, given.case):
            answer = implementation.ask(case)
            wrong = None if "unsupported" in answer else problem(case, answer)
            column = 2 if "unsupported" in answer else 1 if wrong else 0
            counts.setdefault((case["kind"], case["topic"]), [0, 0, 0])[column] += 1
            if column:
                print(f"{case['case']}: {wrong or 'not supported: ' + str(answer['unsupported'])}")
            if wrong and given.verbose:
                print(f"  answer: {json.dumps(answer)[:2000]}\n  expected: {json.dumps(case['expected'])[:2000]}")
    except OSError as error:
        print(f"the command cannot be run: {error}", file=sys.stderr)
        return 2
    finally:
        implementation.stop()
    if not counts:
        print("no case has this name or kind", file=sys.stderr)
        return 2
    rows, totals = table(counts)
    print("\n".join(rows))
    return 1 if totals[1] or not totals[0] else 0


if __name__ == "__main__":
    sys.exit(main())
