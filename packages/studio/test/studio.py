"""Looks at the studio in Chromium, as people do: drops files, sees findings, loads the page again, tries a fault.

The argument is the folder in which `cargo xtask wasm` has put it together; with a second one, pictures are written there, too.
"""

import json
import re
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from playwright.sync_api import expect, sync_playwright

# Nothing here depends on how fast the machine is: this bounds the wait for what never comes.
PATIENCE_MS = 120_000
expect.set_options(timeout=PATIENCE_MS)

ROOT = Path(__file__).resolve().parents[3]
FOLDER = Path(sys.argv[1]).resolve()
PICTURES = Path(sys.argv[2]) if len(sys.argv) > 2 else None
AXE = ROOT / "target/npm/package/axe.min.js"
FORMATS = ROOT.parent / "shared/data/formats"
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]


class Server(ThreadingHTTPServer):
    def handle_error(self, *_):
        """A browser that goes away while it is answered is none."""


class Quiet(SimpleHTTPRequestHandler):
    extensions_map = {**SimpleHTTPRequestHandler.extensions_map, ".wasm": "application/wasm", ".js": "text/javascript"}

    def log_message(self, *_):
        pass


def served():
    server = Server(("127.0.0.1", 0), partial(Quiet, directory=str(FOLDER / "studio")))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}"


class Studio:
    """The page, and everything about it that must not be."""

    def __init__(self, browser, address, **context):
        self.address, self.strange = address, []
        self.context = browser.new_context(**({"viewport": {"width": 1440, "height": 900}} | context))
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE_MS)
        self.page.on("console", lambda said: said.type in ("error", "warning") and self.strange.append(f"console: {said.text}"))
        self.page.on("pageerror", lambda error: self.strange.append(f"error: {error}"))
        self.context.on("request", lambda asked: self.comes_from_here(asked.url))

    def comes_from_here(self, url):
        if not url.startswith((f"{self.address}/", f"blob:{self.address}/")):
            self.strange.append(f"asks {url}")

    def goto(self, path=""):
        self.page.goto(f"{self.address}/{path}")

    def drop(self, paths):
        self.page.locator("#files").set_input_files([str(path) for path in paths])

    def examined(self):
        expect(self.page.locator("#wrong")).to_be_visible()
        expect(self.page.locator("#model-told")).to_contain_text("valid model")

    def looks_fine_to_everyone(self, what):
        self.page.evaluate(f"() => {{ {AXE.read_text()} }}")
        found = self.page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
        broken = [f"{it['id']}: {it['help']}: {[node['html'][:200] for node in it['nodes']]}" for it in found["violations"]]
        assert not broken, f"{what}: {broken}"
        wide = self.page.evaluate("() => document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0, f"{what}: the page is {wide} px too wide"

    def close(self):
        assert not self.strange, self.strange
        self.context.close()


def lying(folder):
    """A drive whose receiver reads 3 m/s too much from the 30th to the 38th second."""
    files = []
    for name in ["gnss.csv", "radar.csv", "wheel.csv"]:
        head, *rows = (ROOT / "examples/monday" / name).read_text().splitlines()
        if name == "gnss.csv":
            pairs = [row.split(",") for row in rows]
            rows = [f"{time},{float(value) + (3 if 30 <= float(time) < 38 else 0):.3f}" for time, value in pairs]
        path = folder / name
        path.write_text("\n".join([head, *rows]) + "\n")
        files.append(path)
    return files


def a_fault_is_found_and_outlasts_a_reload(browser, address, folder):
    studio = Studio(browser, address)
    page = studio.page
    studio.goto()
    studio.looks_fine_to_everyone("the empty page")
    studio.drop(lying(folder))
    studio.examined()
    first = page.locator("#findings .finding").first
    expect(first).to_contain_text("gnss")
    expect(first).to_contain_text("too much")
    expect(first.locator("svg.drawn .blame")).to_have_count(1)
    expect(page.locator("#signals tr")).to_have_count(3)
    took = int(page.locator("html").get_attribute("data-took"))
    assert took < 10_000, f"the findings came after {took} ms"
    studio.looks_fine_to_everyone("findings")
    # What is written is checked as it is written, and kept.
    text = page.locator("#model-text")
    page.locator("#model-text").fill(text.input_value() + "\n# by hand\n")
    expect(page.locator("#model-told")).to_contain_text("valid model")
    text.fill("shsa: 1\nsignals: { a: { variable: b } }\n")
    expect(page.locator("#diagnostics")).to_contain_text("there is no variable `b`")
    page.locator("#model-own").click()
    expect(page.locator("#diagnostics .error")).to_have_count(0)
    text.fill(text.input_value() + "# by hand\n")
    page.locator("#fault-signal").select_option(index=0)
    page.locator("#fault button[type=submit]").click()
    expect(page.locator("#replay-told")).to_contain_text("observations")
    page.wait_for_timeout(1_000)
    page.reload()
    studio.examined()
    expect(page.locator("#findings .finding").first).to_contain_text("gnss")
    expect(text).to_have_value(re.compile("# by hand"))
    expect(page.locator("#replay-told")).to_contain_text("bias=3")
    studio.looks_fine_to_everyone("after a reload")
    page.locator("#graph > summary").click()
    expect(page.locator("#graph-drawing img")).to_be_visible()
    with page.expect_download() as download:
        page.locator("#take-report").click()
    assert download.value.suggested_filename == "report.html"
    page.locator("#forget").click()
    expect(page.locator("#wrong")).to_be_hidden()
    studio.close()


def each_format_is_shown(browser, address):
    if not FORMATS.is_dir():
        print(f"SKIPPED: no samples at {FORMATS}", file=sys.stderr)
        return
    studio = Studio(browser, address)
    studio.goto()
    for family in sorted(it for it in FORMATS.iterdir() if (it / "expected.json").is_file()):
        databases = list(family.glob("*.dbc"))
        for path in sorted(it for it in family.rglob("*") if it.is_file() and it.suffix not in (".json", ".md", ".py", ".dbc")):
            studio.drop([path, *databases] if family.name == "can" else [path])
            done = studio.page.locator("html[data-done]")
            expect(done).to_have_attribute("data-done", path.name)
            shown = studio.page.locator("#signals tr").count() > 0 or studio.page.locator("#problem").inner_text() != ""
            assert shown, f"{path}: neither signals nor a reason"
    studio.close()


def the_example_is_a_link(browser, address):
    studio = Studio(browser, address)
    studio.goto("#example=car")
    studio.examined()
    expect(studio.page.locator("#findings .finding").first).to_contain_text("gnss")
    studio.close()


def pictures(browser, address):
    PICTURES.mkdir(parents=True, exist_ok=True)
    for scheme in ["light", "dark"]:
        for width in [1440, 768, 360]:
            studio = Studio(browser, address, viewport={"width": width, "height": 900}, color_scheme=scheme)
            studio.goto()
            studio.page.screenshot(path=PICTURES / f"empty-{width}-{scheme}.png")
            studio.goto("#example=car")
            studio.page.reload()
            studio.examined()
            studio.page.locator("#fault button[type=submit]").click()
            expect(studio.page.locator("#replay-told")).to_contain_text("observations")
            studio.looks_fine_to_everyone(f"{width} {scheme}")
            studio.page.screenshot(path=PICTURES / f"studio-{width}-{scheme}.png", full_page=True)
            studio.close()


def main():
    address, folder = served(), FOLDER / "dropped"
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        if PICTURES:
            return pictures(browser, address)
        the_example_is_a_link(browser, address)
        a_fault_is_found_and_outlasts_a_reload(browser, address, folder)
        each_format_is_shown(browser, address)
        browser.close()
    print(json.dumps({"seen": "the studio"}))


main()
