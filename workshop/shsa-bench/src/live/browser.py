"""Keeps the page of an instance open in Chromium, and prints the memory of the page as JSON lines until its input ends.

The argument is the address of the instance. Needs the package `playwright` and Chromium.
"""

import json
import shutil
import sys
import threading
import time

from playwright.sync_api import sync_playwright

PERIOD_S = 10


def figures(session):
    # What is no longer in use does not count.
    session.send("HeapProfiler.collectGarbage")
    return {it["name"]: it["value"] for it in session.send("Performance.getMetrics")["metrics"]}


with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.goto(f"http://{sys.argv[1]}/")
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    began, before = time.monotonic(), figures(session)
    while not ended.wait(PERIOD_S):
        now = figures(session)
        busy = (now["TaskDuration"] - before["TaskDuration"]) / (now["Timestamp"] - before["Timestamp"])
        before = now
        row = {"at_s": time.monotonic() - began, "heap_bytes": now["JSHeapUsedSize"], "nodes": now["Nodes"], "busy": busy}
        print(json.dumps(row), flush=True)
    browser.close()
