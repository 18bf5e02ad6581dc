// The values of all ways of knowing a variable as bands over time: conflicts are hatched, ways with an accused signal dashed, gaps stay empty.

import { ask, messages } from "./stream.js";
import { clock, drawn, enclosed, made, number, setText } from "./words.js";

/** The length of the past that is kept, nanoseconds, and the most samples of a way. */
const KEPT = 300e9;
const MOST = 6000;
/** The selectable spans, seconds. */
const SPANS = [5, 10, 30, 60, 300];
/** Disagreements at most this far apart count as one conflict, nanoseconds. */
const APART = 1e9;
const HEIGHT = 360;
const ROOM = { left: 64, right: 8, top: 24, bottom: 32 };
const PAUSE = 1000;

/** A step of 1, 2 or 5 times a power of ten, of which about `count` fit into a range. */
export function step(range, count) {
  const raw = range / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  return [1, 2, 5, 10].map((times) => times * power).find((it) => it >= raw) ?? 10 * power;
}

/** Samples in pieces, separated by gaps. Of many samples, each stretch of time keeps the minimum and the maximum. */
export function pieces(samples, from, to, columns) {
  const shown = samples.filter(([at]) => at >= from && at <= to);
  const spacings = shown.slice(1).map(([at], before) => at - shown[before][0]).sort((one, other) => one - other);
  const gap = Math.max(5e8, 3 * (spacings[Math.floor(spacings.length / 2)] ?? 0));
  const stretch = (to - from) / columns;
  const found = [];
  let last = null;
  for (const [at, lo, hi] of shown) {
    const column = Math.floor((at - from) / stretch);
    if (last && at - last.at <= gap && last.column === column) {
      Object.assign(last, { at, lo: Math.min(last.lo, lo), hi: Math.max(last.hi, hi) });
      continue;
    }
    const isNew = !last || at - last.at > gap;
    last = { at, lo, hi, column };
    if (isNew) found.push([last]);
    else found.at(-1).push(last);
  }
  return found;
}

/** Moments as stretches; close ones are joined. */
export function stretches(moments) {
  const found = [];
  for (const at of moments.toSorted((one, other) => one - other)) {
    const last = found.at(-1);
    if (last && at - last[1] <= APART) last[1] = at;
    else found.push([at, at]);
  }
  return found;
}

export class Bands {
  constructor({ token }) {
    const of = (name) => document.getElementById(name);
    Object.assign(this, { token, model: null, variable: null, control: null, tables: {}, events: [], span: 30, isPaused: false, until: 0, cursor: null, isVisible: false });
    this.clear();
    this.search = of("bands-variable");
    this.offered = of("variable-names");
    this.spans = of("bands-span");
    this.pause = of("bands-pause");
    this.drawing = of("bands-drawing");
    this.list = of("bands-list");
    this.told = of("bands-told");
    of("bands-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.follow(this.search.value.trim());
    });
    this.search.addEventListener("change", () => this.follow(this.search.value.trim()));
    this.spans.replaceChildren(...SPANS.map((span) => new Option(span < 60 ? `${span} s` : `${span / 60} min`, span)));
    this.spans.value = this.span;
    this.spans.addEventListener("change", () => this.zoom(SPANS.indexOf(Number(this.spans.value))));
    this.pause.addEventListener("click", () => this.hold(!this.isPaused));
    this.svg = drawn("svg", { height: HEIGHT, role: "slider", tabindex: 0, "aria-label": "Moment", "aria-valuemin": 0, "aria-valuemax": this.span, "aria-valuenow": this.span });
    this.drawing.replaceChildren(this.svg);
    this.svg.addEventListener("pointermove", (event) => this.point(event.offsetX));
    this.svg.addEventListener("pointerleave", () => this.point(null));
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.drawing.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      this.zoom(SPANS.indexOf(this.span) + Math.sign(event.deltaY || event.deltaX));
    }, { passive: false });
  }

  clear() {
    Object.assign(this, { ways: new Map(), conflicts: [], unit: "", now: 0 });
  }

  reset(model) {
    Object.assign(this, { model, variable: null });
    this.stop();
    this.clear();
  }

  stop() {
    this.control?.abort();
    this.control = null;
  }

  /** Sets the decisions; those about the variable are marked. */
  take(events, areAll) {
    this.events = [...(areAll ? [] : this.events), ...events].slice(-500);
  }

  show(tables, _now, isVisible) {
    this.tables = tables;
    // A variable stays subscribed after its first selection: a time without subscription would look like a gap.
    this.isVisible = isVisible;
    if (!isVisible) return;
    const { needs = {}, signals = {} } = tables;
    if (!this.variable) {
      const first = Object.values(needs)[0]?.variable;
      if (first) this.follow(first);
    } else if (!this.control) this.listen();
    const names = new Set([...Object.values(needs), ...Object.values(signals)].map((it) => it.variable));
    if (this.offered.children.length !== Math.min(names.size, 500)) {
      this.offered.replaceChildren(...[...names].slice(0, 500).map((name) => new Option(name, name)));
    }
  }

  /** Selects a variable; a given moment moves to the middle. */
  follow(variable, moment = null) {
    this.search.value = variable;
    if (variable !== this.variable) {
      this.stop();
      this.clear();
      this.variable = variable;
    }
    if (moment !== null && this.now - moment < KEPT) {
      this.hold(true);
      this.until = moment + (this.span * 1e9) / 2;
      this.cursor = moment;
    }
    this.draw();
  }

  /** Subscribes to the values of the ways until it is stopped. */
  async listen() {
    const control = new AbortController();
    this.control = control;
    const query = new URLSearchParams({ model: this.model, variable: this.variable });
    while (!control.signal.aborted) {
      try {
        const response = await ask(`/bands?${query}`, this.token(), { signal: control.signal });
        for await (const { data } of messages(response.body)) this.hear(data);
      } catch (error) {
        if (control.signal.aborted) return;
        setText(this.told, `✗ ${error.message}`);
      }
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
    }
  }

  hear({ time_ns: now, unit, ways, conflicts, more }) {
    Object.assign(this, { now, unit: unit ?? "", more });
    for (const { words, signals, samples } of ways) {
      if (!this.ways.has(words)) this.ways.set(words, { signals, samples: [] });
      const known = this.ways.get(words);
      known.samples.push(...samples);
      const old = known.samples.findIndex(([at]) => now - at <= KEPT);
      known.samples.splice(0, Math.max(old, known.samples.length - MOST, 0));
    }
    this.conflicts.push(...conflicts.map(([at]) => at));
    this.conflicts = this.conflicts.filter((at) => now - at <= KEPT).slice(-MOST);
    if (!this.isPaused) this.until = now;
    this.draw();
  }

  hold(isPaused) {
    this.isPaused = isPaused;
    this.pause.setAttribute("aria-pressed", String(isPaused));
    setText(this.pause, isPaused ? "▶ Go on" : "‖ Pause");
    if (!isPaused) this.until = this.now;
    this.draw();
  }

  zoom(at) {
    const span = SPANS[Math.min(SPANS.length - 1, Math.max(0, at))];
    if (this.isPaused && this.cursor) this.until = Math.min(this.now, this.cursor + (span * 1e9) / 2);
    this.span = span;
    this.spans.value = span;
    this.draw();
  }

  get from() {
    return this.until - this.span * 1e9;
  }

  /** Moves the cursor to the pointer. */
  point(x) {
    const inside = x !== null && x >= ROOM.left && x <= this.width - ROOM.right;
    this.cursor = inside ? this.from + ((x - ROOM.left) / this.inner) * this.span * 1e9 : null;
    this.draw();
  }

  key(event) {
    const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: 10, PageDown: -10 };
    const at = SPANS.indexOf(this.span);
    if (event.key in steps) {
      const cursor = (this.cursor ?? this.until) + (steps[event.key] * this.span * 1e9) / 100;
      this.cursor = Math.min(this.until, Math.max(this.from, cursor));
      // The end is kept: a moving end would move the values below the cursor.
      this.hold(true);
    } else if (event.key === "Home") this.cursor = this.from;
    else if (event.key === "End") this.cursor = this.until;
    else if (event.key === "+") this.zoom(at - 1);
    else if (event.key === "-") this.zoom(at + 1);
    else if (event.key === " ") this.hold(!this.isPaused);
    else return;
    event.preventDefault();
    this.draw();
  }

  /** Why a way is not trusted: the verdict about one of its signals. */
  blamed({ signals }) {
    const verdicts = signals.map((name) => this.tables.signals?.[name]?.verdict);
    return ["failed", "silent", "suspect"].find((verdict) => verdicts.includes(verdict)) ?? null;
  }

  draw() {
    if (!this.isVisible) return;
    this.width = Math.max(280, this.drawing.clientWidth);
    this.inner = this.width - ROOM.left - ROOM.right;
    if (!this.until) return;
    const { from, until } = this;
    const shown = [...this.ways].map(([words, way], at) => ({ words, way, at, pieces: pieces(way.samples, from, until, this.inner / 2) }));
    const all = shown.flatMap((it) => it.pieces.flat());
    const [least, most] = [Math.min(...all.map((it) => it.lo)), Math.max(...all.map((it) => it.hi))];
    const margin = (most - least) / 16 || Math.abs(most) / 100 || 1;
    const [low, high] = all.length ? [least - margin, most + margin] : [0, 1];
    const x = (at) => ROOM.left + ((at - from) / (until - from)) * this.inner;
    const y = (value) => ROOM.top + (1 - (value - low) / (high - low)) * (HEIGHT - ROOM.top - ROOM.bottom);
    this.svg.setAttribute("width", this.width);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT}`);
    this.svg.replaceChildren(this.hatch(), ...this.grid(x, y, low, high), ...this.hatched(x), ...shown.map((it) => this.band(it, x, y)), ...this.decisions(x), ...this.line(x));
    this.read(shown);
  }

  hatch() {
    const lines = drawn("path", { d: "M-2 2L2 -2M0 8L8 0M6 10L10 6", class: "hatch" });
    return drawn("defs", {}, [drawn("pattern", { id: "hatch", width: 8, height: 8, patternUnits: "userSpaceOnUse" }, [lines])]);
  }

  grid(x, y, low, high) {
    const marks = [];
    const size = step(high - low, 5);
    for (let value = Math.ceil(low / size) * size; value <= high; value += size) {
      marks.push(drawn("path", { class: "grid", d: `M${ROOM.left} ${y(value)}H${this.width - ROOM.right}` }));
      marks.push(drawn("text", { class: "tick end", x: ROOM.left - 8, y: y(value) + 5 }, [number(value, size)]));
    }
    marks.push(drawn("text", { class: "tick", x: 0, y: 16 }, [this.unit]));
    const seconds = step(this.span, Math.max(2, this.inner / 120));
    for (let at = Math.ceil(this.from / 1e9 / seconds) * seconds; at * 1e9 <= this.until; at += seconds) {
      const place = x(at * 1e9);
      marks.push(drawn("path", { class: "grid", d: `M${place} ${ROOM.top}V${HEIGHT - ROOM.bottom}` }));
      const isInside = place > ROOM.left + 24 && place < this.width - 40;
      if (isInside) marks.push(drawn("text", { class: "tick middle", x: place, y: HEIGHT - 8 }, [clock(at * 1e9).slice(0, 8)]));
    }
    return marks;
  }

  hatched(x) {
    const inside = this.conflicts.filter((at) => at >= this.from && at <= this.until);
    return stretches(inside).map(([begin, end]) => drawn("rect", {
      class: "contradiction", x: x(begin) - 2, y: ROOM.top, width: Math.max(4, x(end) - x(begin) + 4), height: HEIGHT - ROOM.top - ROOM.bottom, fill: "url(#hatch)",
    }));
  }

  band({ way, at, pieces }, x, y) {
    const joined = (piece, of) => piece.map((point) => `${x(point.at).toFixed(1)} ${y(of(point)).toFixed(1)}`).join("L");
    const area = pieces.map((piece) => `M${joined(piece, (it) => it.hi)}L${joined(piece.toReversed(), (it) => it.lo)}Z`).join("");
    const middle = pieces.map((piece) => `M${joined(piece, (it) => (it.lo + it.hi) / 2)}`).join("");
    const blamed = this.blamed(way) ? " blamed" : "";
    return drawn("g", { class: `way way-${at % 7}${blamed}` }, [drawn("path", { class: "area", d: area }), drawn("path", { class: "center", d: middle })]);
  }

  /** The decisions about the variable, or about a signal of one of its ways. */
  about() {
    const signals = new Set([...this.ways.values()].flatMap((way) => way.signals));
    return this.events.filter(({ variable, signal }) => variable === this.variable || signals.has(signal));
  }

  decisions(x) {
    const inside = this.about().filter(({ time_ns: at }) => at >= this.from && at <= this.until);
    return inside.map(({ time_ns: at, kind, because }) => {
      const place = x(at);
      const mark = drawn("path", { class: "decision", d: `M${place} ${ROOM.top - 8}V${HEIGHT - ROOM.bottom}M${place - 4} ${ROOM.top - 16}H${place + 4}L${place} ${ROOM.top - 8}Z` });
      mark.append(drawn("title", {}, [`${clock(at)} ${kind}: ${because}`]));
      return mark;
    });
  }

  line(x) {
    if (this.cursor === null || this.cursor < this.from || this.cursor > this.until) return [];
    return [drawn("path", { class: "cursor", d: `M${x(this.cursor)} ${ROOM.top}V${HEIGHT - ROOM.bottom}` })];
  }

  /** The value of each way at the cursor; without a cursor, the latest one. */
  read(shown) {
    const moment = this.cursor ?? this.until;
    const rows = shown.map(({ words, way, at }) => {
      const sample = way.samples.findLast(([time]) => time <= moment);
      const isOld = !sample || moment - sample[0] > 2e9;
      const value = isOld ? "says nothing" : enclosed(sample[1], sample[2], this.unit);
      return { words, value, at, blamed: this.blamed(way) };
    });
    if (this.list.children.length !== rows.length) {
      this.list.replaceChildren(...rows.map(({ at }) => {
        const swatch = drawn("svg", { class: `swatch way way-${at % 7}`, width: 32, height: 16, "aria-hidden": "true" });
        swatch.append(drawn("rect", { class: "area", width: 32, height: 16 }), drawn("path", { class: "center", d: "M0 8H32" }));
        return made("tr", { children: [made("td", { children: [swatch] }), made("td", { className: "words" }), made("td", { className: "number" }), made("td")] });
      }));
    }
    rows.forEach(({ words, value, blamed, at }, row) => {
      const [swatch, name, said, verdict] = this.list.children[row].children;
      swatch.firstChild.setAttribute("class", `swatch way way-${at % 7}${blamed ? " blamed" : ""}`);
      setText(name, words);
      setText(said, value);
      setText(verdict, blamed ? `✗ rests on what is ${blamed}` : "");
    });
    const decision = this.about().findLast(({ time_ns: at }) => at <= moment && moment - at < this.span * 1e9);
    const because = decision ? ` · ${clock(decision.time_ns)} ${decision.kind}: ${decision.because}` : "";
    const more = this.more ? ` · ${this.more} more ways are not drawn` : "";
    setText(this.told, `${clock(moment)}${because}${more}`);
    const place = ((moment - this.from) / 1e9).toFixed(1);
    if (document.activeElement === this.svg) {
      this.svg.setAttribute("aria-valuetext", `${clock(moment)}: ${rows.map((row) => `${row.words} ${row.value}`).join("; ")}`);
    }
    this.svg.setAttribute("aria-valuemax", this.span);
    this.svg.setAttribute("aria-valuenow", place);
  }
}
