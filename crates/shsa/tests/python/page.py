"""Looks at the live page of a running instance in Chromium, as people do.

The argument is a JSON object: {"address": ADDRESS, "token": TOKEN, "axe": FILE}, or {"address": ADDRESS, "screenshots": FOLDER}.
It says {"ready": true}; {"restart": true} when the instance shall be ended and started again, and waits for a line before it goes
on; and {"seen": WHAT} when everything was as it should be.
"""

import json
import re
import shutil
import sys
from pathlib import Path

from playwright.sync_api import expect, sync_playwright

# Nothing here depends on how fast the machine is: this bounds the wait for what never comes.
PATIENCE_MS = 120_000
expect.set_options(timeout=PATIENCE_MS)

VIEWS = ["needs", "signals", "timeline", "bands", "graph", "what-if", "orders"]
WIDTHS = [1440, 768, 360]
# The simulated lidar says nothing for a while, and later something wrong, again and again.
BROKEN = "/lidar/scan"


def say(**what):
    print(json.dumps(what), flush=True)


class Page:
    """The page, and everything about it that must not be."""

    def __init__(self, browser, address):
        self.address, self.strange, self.expected = address, [], []
        self.page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
        self.page.set_default_timeout(PATIENCE_MS)
        self.page.on("console", lambda said: said.type in ("error", "warning") and self.note(f"console: {said.text}"))
        self.page.on("pageerror", lambda error: self.note(f"error: {error}"))
        self.page.on("request", lambda asked: self.comes_from_here(asked.url))
        self.page.goto(f"http://{address}/")

    def note(self, what):
        if not any(words in what for words in self.expected):
            self.strange.append(what)

    def comes_from_here(self, url):
        if not url.startswith(f"http://{self.address}/"):
            self.strange.append(f"asks {url}")

    def turn_to(self, view):
        self.page.locator(f'nav a[href="#{view}"]').click()
        expect(self.page.locator(f"#{view}")).to_be_visible()

    def the_switch_is_shown(self):
        card = self.page.locator("#needs-list article").first
        expect(card.locator(".middle")).not_to_have_text("–")
        expect(card.locator("dd").first).not_to_be_empty()
        # Whoever waits for it is told how long it took from the decision until it stood there.
        delay = self.page.evaluate("""() => new Promise((resolve) => {
            const quality = document.querySelector("#needs-list .quality");
            const look = () => {
                if (!quality.textContent.includes("substitute")) return;
                const time = document.querySelector("#timeline-list .substituted")?.closest("li").querySelector("time");
                if (time) resolve(Date.now() - Date.parse(time.dateTime));
            };
            new MutationObserver(look).observe(document.body, { subtree: true, childList: true, characterData: true });
            look();
        })""")
        expect(card.locator("dd").first).not_to_contain_text(BROKEN)
        expect(card).to_contain_text("1 more loss")
        item = self.page.locator("#timeline-list li", has=self.page.locator(".substituted")).first
        expect(item).to_contain_text(f"{BROKEN} by nearest is not trusted any more")
        self.turn_to("signals")
        line = self.page.locator("#signals-list tr").first
        expect(line).to_contain_text(BROKEN)
        expect(line).to_contain_text("○ silent")
        return delay

    def a_profile_opens(self, name):
        """By keys: the row below that of a vector; returns it."""
        button = self.page.get_by_role("button", name=f"profile of {name}")
        button.focus()
        if button.get_attribute("aria-expanded") == "false":
            self.page.keyboard.press("Enter")
        expect(button).to_have_attribute("aria-expanded", "true")
        return self.page.locator("#signals-list tr", has=button).locator("xpath=following-sibling::tr[1]").locator(".profile-large")

    def a_silent_scan_is_gone(self):
        self.turn_to("signals")
        scan = self.a_profile_opens(BROKEN)
        expect(scan).to_contain_text("No vector: the signal is silent.")
        expect(scan.locator(".line")).to_have_attribute("d", "")
        sonar = self.a_profile_opens("/sonar/ranges")
        expect(sonar.locator("p")).to_have_text(re.compile(r"^12 elements with a value; minimum [\d.]+ m at element \d+, maximum .*"))
        expect(sonar.locator(".line")).to_have_attribute("d", re.compile("^M[^M]+$"))
        expect(self.page.get_by_role("button", name="profile of /odom/speed")).to_have_count(0)

    def a_fresh_page_shows_the_past(self):
        """What was published before the page was opened stands in the drawing at once."""
        fresh = self.page.context.new_page()
        fresh.goto(f"http://{self.address}/")
        # The drawing is 600 wide and three minutes long. What has come since the page was opened is no older than the page.
        fresh.wait_for_function("""() => {
            const line = document.querySelector("#needs-list article .line")?.getAttribute("d");
            const places = (line ?? "").split(/[ML]/).filter(Boolean).map(parseFloat);
            return (600 - Math.min(600, ...places)) / 600 * 180 > performance.now() / 1000 + 3;
        }""")
        fresh.close()

    def the_lie_collapses_the_scan(self):
        self.turn_to("signals")
        scan = self.a_profile_opens(BROKEN)
        expect(scan.locator("p")).to_have_text(re.compile(r"^121 elements with a value; each 3 m\. Dashed: v_dmin is served as [\d.]+ ± [\d.]+ m\.$"))
        # The scale is that of the scans before, so the scan is a flat line, above that of the need.
        self.page.wait_for_function("""(scan) => {
            const [band, line] = [".band", ".served"].map((part) => scan.querySelector(part)?.getBBox());
            return scan.textContent.includes("each 3 m") && band.height < 60 && line.y > band.y;
        }""", arg=scan.element_handle())

    def the_timeline_is_filtered(self):
        self.turn_to("timeline")
        self.page.get_by_label("Kind").select_option("silent")
        expect(self.page.locator("#timeline-list .silent").first).to_be_visible()
        expect(self.page.locator("#timeline-list .substituted")).to_have_count(0)
        self.page.get_by_label("About").fill("no such words")
        expect(self.page.locator("#timeline-list li")).to_have_count(0)
        expect(self.page.locator("#timeline")).to_contain_text("No decision.")
        self.page.get_by_label("About").fill("")
        self.page.get_by_label("Kind").select_option("")

    def the_timeline_says_why(self):
        """By keys: the evidence for an accusation opens."""
        self.turn_to("timeline")
        self.page.get_by_label("Kind").select_option("failed")
        item = self.page.locator("#timeline-list li", has_text=BROKEN).first
        item.locator("summary").focus()
        self.page.keyboard.press("Enter")
        for words in ("Evidence against it", "Other candidates", "What would have cleared it", "To be trusted again"):
            expect(item.locator(".why")).to_contain_text(words)
        self.page.get_by_label("Kind").select_option("")
        expect(self.page.locator("#timeline-list li", has=self.page.locator(".failed")).first.locator("details")).to_be_visible()

    def orders_need_the_token(self, token):
        self.turn_to("orders")
        answer = self.page.locator("#order-answer")
        order = self.page.get_by_role("button", name="Order …")
        self.page.locator("#order-signal").fill(BROKEN)
        order.click()
        expect(answer).to_contain_text("needs the token")
        self.expected.append("401 (Unauthorized)")
        self.page.get_by_label("Token").fill("wrong, and long enough")
        order.click()
        self.page.get_by_role("button", name="Do it").click()
        expect(answer).to_contain_text("✗")
        self.page.get_by_label("Token").fill(token)
        order.click()
        self.page.get_by_role("button", name="Leave it").click()
        expect(self.page.locator("#audit")).not_to_contain_text("ordered")
        order.click()
        expect(self.page.locator("#confirm-words")).to_contain_text(f"forbid a signal: {BROKEN}")
        self.page.get_by_role("button", name="Do it").click()
        expect(answer).to_contain_text("✓")
        expect(self.page.locator("#audit")).to_contain_text("(from 127.0.0.1)")
        expect(self.page.locator("#orders-list")).to_contain_text(f"forbid {BROKEN}")

    def tab_to(self, element):
        """Goes there by the keyboard alone."""
        for _ in range(100):
            self.page.keyboard.press("Tab")
            if self.page.evaluate("document.activeElement?.id || document.activeElement?.getAttribute('href')") == element:
                return
        raise AssertionError(f"{element} cannot be reached by the keyboard")

    def the_keyboard_is_enough(self):
        """By keys alone: to the orders, and the one that stands is taken back."""
        self.page.evaluate("document.activeElement.blur()")
        self.tab_to("#orders")
        self.page.keyboard.press("Enter")
        self.tab_to("order-kind")
        self.page.keyboard.type("allow a sig")
        self.tab_to("order-signal")
        self.page.keyboard.press("Control+a")
        self.page.keyboard.type(BROKEN)
        self.page.keyboard.press("Enter")
        expect(self.page.locator("#confirm-words")).to_contain_text(f"allow a signal: {BROKEN}")
        expect(self.page.locator("#confirm-no")).to_be_focused()
        self.tab_to("confirm-yes")
        self.page.keyboard.press("Enter")
        expect(self.page.locator("#orders-list")).to_contain_text("No order is in force.")

    def it_comes_back_after_a_restart(self):
        self.turn_to("needs")
        link = self.page.locator("#link")
        expect(link).to_contain_text("live")
        # The browser itself writes down that nobody is there.
        self.expected += ["net::ERR_"]
        say(restart=True)
        expect(link).to_contain_text("stale for")
        sys.stdin.readline()
        say(done=True)
        expect(link).to_contain_text("live")
        self.turn_to("orders")
        expect(self.page.locator("#audit")).to_contain_text("Nothing yet.")

    def the_blamed_band_is_marked(self):
        """The lidar lies: the others contradict it, and its band is marked as that of the blamed one."""
        self.turn_to("bands")
        expect(self.page.locator("#bands-variable")).to_have_value("v_dmin")
        row = self.page.locator("#bands-list tr", has_text=BROKEN).first
        expect(row).to_contain_text("✗ rests on what is failed")
        expect(self.page.locator("#bands-drawing .blamed")).not_to_have_count(0)
        expect(self.page.locator("#bands-drawing .contradiction")).not_to_have_count(0)
        expect(self.page.locator("#bands-drawing .decision")).not_to_have_count(0)
        others = self.page.locator("#bands-list tr", has_text="/sonar/ranges by nearest")
        expect(others).not_to_contain_text("✗")
        # What is held stays, and the cursor reads it by keys.
        self.page.get_by_role("button", name="Pause").click()
        self.page.locator("#bands-drawing svg").focus()
        for _ in range(3):
            self.page.keyboard.press("ArrowLeft")
        moment = self.page.locator("#bands-told").text_content()
        self.page.wait_for_timeout(500)
        assert self.page.locator("#bands-told").text_content() == moment
        before = self.page.locator("#bands-span").input_value()
        self.page.keyboard.press("-")
        assert self.page.locator("#bands-span").input_value() > before
        self.page.get_by_role("button", name="Go on").click()

    def the_graph_shows_the_way_in_use(self):
        self.turn_to("graph")
        node = lambda name: self.page.locator("#graph-drawing .node", has_text=name).first
        expect(node("/sonar/ranges")).to_have_class("node signal healthy used")
        expect(node(BROKEN)).to_have_attribute("aria-label", f"signal {BROKEN}, failed")
        expect(self.page.locator("#graph-drawing .edge.used")).not_to_have_count(0)
        node(BROKEN).focus()
        self.page.keyboard.press("Enter")
        expect(self.page.locator("#graph-about")).to_contain_text("✗ failed")
        self.page.locator("#graph-search").fill("/odom/speed")
        self.page.keyboard.press("Enter")
        expect(self.page.locator("#graph-about")).to_contain_text("variable speed")

    def what_nothing_heals_is_told(self):
        self.turn_to("what-if")
        told = self.page.locator("#what-if-told")
        self.page.get_by_role("button", name="None lost").click()
        expect(self.page.locator("#what-if-needs")).to_contain_text("/sonar/ranges by nearest, utility")
        expect(told).to_have_text("✓ Every need is served.")
        for name in (BROKEN, "/sonar/ranges", "/depth/image", "/odom/speed"):
            self.page.locator("#what-if-signals").get_by_label(name).check()
        expect(told).to_have_text("✗ Nothing serves v_dmin without these 4 signals.")

    def nothing_is_too_wide(self):
        for view in VIEWS:
            self.turn_to(view)
            for width in [*WIDTHS, 3840]:
                self.page.set_viewport_size({"width": width, "height": 900})
                wide = self.page.evaluate("document.documentElement.scrollWidth")
                assert wide <= width, f"{view}: {wide} px in a window of {width}"
        self.page.set_viewport_size({"width": 1440, "height": 900})

    def everyone_can_use_it(self, axe):
        # As the policy of the page lets no other script in.
        source = Path(axe).read_text()
        for scheme in ("light", "dark"):
            self.page.emulate_media(color_scheme=scheme)
            for view in VIEWS:
                self.turn_to(view)
                self.page.evaluate(f"() => {{ {source} }}")
                found = self.page.evaluate("axe.run(document, { resultTypes: ['violations'] })")
                told = [f"{it['id']}: {it['help']}: {it['nodes'][0]['html']}" for it in found["violations"]]
                assert not told, f"{view}, {scheme}:\n" + "\n".join(told)

    def screenshots(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        # Until the lidar has lied for a while.
        self.turn_to("bands")
        expect(self.page.locator("#bands-list")).to_contain_text("✗ rests on what is failed")
        self.page.wait_for_timeout(5_000)
        for view in VIEWS:
            self.turn_to(view)
            for scheme in ("light", "dark"):
                self.page.emulate_media(color_scheme=scheme)
                for width in WIDTHS:
                    self.page.set_viewport_size({"width": width, "height": 900})
                    # A look of the page more.
                    self.page.wait_for_timeout(300)
                    self.page.screenshot(path=folder / f"{view}-{width}-{scheme}.png")
            self.page.set_viewport_size({"width": 1440, "height": 900})


def main(address, token=None, axe=None, screenshots=None):
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or sys.exit("chromium is absent")
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = Page(browser, address)
        say(ready=True)
        if screenshots:
            page.screenshots(Path(screenshots))
            return say(seen="the screenshots")
        delay = page.the_switch_is_shown()
        page.a_silent_scan_is_gone()
        page.a_fresh_page_shows_the_past()
        page.the_timeline_is_filtered()
        page.orders_need_the_token(token)
        page.the_keyboard_is_enough()
        page.it_comes_back_after_a_restart()
        page.the_blamed_band_is_marked()
        page.the_lie_collapses_the_scan()
        page.the_timeline_says_why()
        page.the_graph_shows_the_way_in_use()
        page.what_nothing_heals_is_told()
        page.nothing_is_too_wide()
        page.everyone_can_use_it(axe)
        assert not page.strange, "\n".join(page.strange)
        say(seen=f"the switch stood on the page {delay} ms after it was decided")
        browser.close()


main(**json.loads(sys.argv[1]))
