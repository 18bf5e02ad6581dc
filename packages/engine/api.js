// What the package offers: models, the engine, and experiments with recordings.
import { ShsaError, call, wasm, withRecordings } from './engine.js';

export { ShsaError };

/** The version of the engine. */
export function version() {
  return call(() => wasm.version());
}

/** Every problem of a model with its place: what `shsa check --json` prints. */
export function check(text, name = 'model.yaml') {
  return JSON.parse(call(() => wasm.check(text, name)));
}

/** A model without errors, from YAML or JSON. */
export class Model {
  #raw;

  constructor(text, { name = 'model.yaml' } = {}) {
    this.#raw = call(() => new wasm.Model(text, name));
    Object.assign(this, JSON.parse(this.#raw.parts()), { text, name });
  }

  get raw() { return this.#raw; }

  /** The text as `shsa fmt` lays it out. */
  formatted() { return call(() => this.#raw.formatted()); }

  /** The knowledge graph as SVG. */
  svg() { return call(() => this.#raw.svg()); }

  /** Which faults can be detected, isolated and healed: what `shsa analyze --json` prints. */
  analyze({ additions = 10 } = {}) { return JSON.parse(call(() => this.#raw.analyze(additions))); }

  /** The analysis as a page for the browser. */
  analysisPage({ additions = 10 } = {}) { return call(() => this.#raw.analysis_page(additions)); }
}

/** Nanoseconds of a moment: a bigint, a Date, or milliseconds as of Date.now(). */
function nanoseconds(time) {
  if (typeof time === 'bigint') return time;
  const milliseconds = Number(time);
  if (!Number.isFinite(milliseconds)) throw new ShsaError(`a time is a Date, milliseconds, or a bigint of nanoseconds, not ${time}`);
  const whole = Math.floor(milliseconds);
  return BigInt(whole) * 1_000_000n + BigInt(Math.round((milliseconds - whole) * 1e6));
}

/** The engine in a loop of your own. */
export class Engine {
  #raw;
  #signals = new Map();

  constructor(model) {
    this.#raw = call(() => new wasm.Engine(model.raw));
  }

  /**
   * Takes a value of a signal: a number, a pair of bounds `{ lo, hi }`, or an array. `time` is when it was received, `stamp` what its
   * source says.
   */
  handle(signal, value, { time = Date.now(), stamp = time } = {}) {
    const [received, stamped] = [nanoseconds(time), nanoseconds(stamp)];
    let number = this.#signals.get(signal);
    call(() => {
      if (number === undefined) {
        number = this.#raw.signal(signal);
        this.#signals.set(signal, number);
      }
      if (typeof value === 'number') this.#raw.handle(number, value, received, stamped);
      else if (Array.isArray(value) || ArrayBuffer.isView(value)) this.#raw.handle_vector(number, Float64Array.from(value), received, stamped);
      else this.#raw.handle_bounds(number, value.lo, value.hi, received, stamped);
    });
  }

  /** Lets time pass, also where nothing is received: silence is found so. */
  advance(time = Date.now()) { call(() => this.#raw.advance(nanoseconds(time))); }

  /** Published values and decisions since the last call. */
  outputs() { return JSON.parse(call(() => this.#raw.outputs())); }

  /** When `advance` is due at the latest, in nanoseconds; undefined: nothing is. */
  nextDeadline() { return call(() => this.#raw.next_deadline()); }

  /** `healthy`, `suspect`, `failed`, `silent` or `unknown`. */
  verdict(signal) { return call(() => this.#raw.verdict(signal)); }

  /** What outlasts the process, as text. */
  snapshot() { return call(() => this.#raw.snapshot()); }

  /** Goes on from a snapshot. */
  restore(snapshot, time = Date.now()) { call(() => this.#raw.restore(snapshot, nanoseconds(time))); }
}

/** What is in recordings: what `shsa info --json` prints. */
export function info(files, options = {}) {
  return JSON.parse(withRecordings(files, reading(options), (recordings) => call(() => recordings.info())));
}

/** A first model of recordings, as `shsa draft` writes it. */
export function draft(files, options = {}) {
  return withRecordings(files, reading(options), (recordings) => call(() => recordings.draft(options.onProgress)));
}

/** What is wrong in recordings, without a model. */
export function doctor(files, options = {}) {
  return new Diagnosis(withRecordings(files, reading(options), (recordings) => call(() => recordings.doctor(options.onProgress))));
}

/** The findings about recordings. */
export class Diagnosis {
  #raw;

  constructor(raw) { this.#raw = raw; }

  /** The text that `shsa doctor --json` prints. */
  get json() { return call(() => this.#raw.json()); }
  get report() { return JSON.parse(this.json); }
  get findings() { return this.report.findings; }
  get warnings() { return call(() => this.#raw.warnings()); }

  /** The model that was found out, ready to edit. */
  get model() { return call(() => this.#raw.model()); }

  /** What `shsa doctor` prints. */
  text() { return call(() => this.#raw.text()); }

  /** A page for the browser that needs nothing else. */
  page() { return call(() => this.#raw.page()); }

  /** The findings with the values around their stretches. */
  charts() { return JSON.parse(call(() => this.#raw.charts())); }

  /** All signals over time, thinned to so many stretches. */
  columns(stretches = 240) { return JSON.parse(call(() => this.#raw.columns(stretches))); }
}

/** Runs the whole loop over recordings, with faults injected where `inject` has some: `bias=2:wheel_1@20s..`. */
export function replay(model, files, options = {}) {
  const { inject = [], seed = 1, onProgress } = options;
  const play = (recordings) => call(() => new wasm.Replay(model.raw, recordings, [inject].flat(), seed, onProgress));
  return new Replay(withRecordings(files, reading(options), play));
}

/** A replay that is over. */
export class Replay {
  #raw;

  constructor(raw) { this.#raw = raw; }

  /** The text that `shsa replay --json` prints, with 0 for the time that it took. */
  get json() { return call(() => this.#raw.json()); }
  get report() { return JSON.parse(this.json); }
  get events() { return this.report.events; }
  get warnings() { return call(() => this.#raw.warnings()); }

  /** Every published value. */
  get values() { return lines(call(() => this.#raw.values())); }

  /** What `shsa replay` prints. */
  text() { return call(() => this.#raw.text()); }

  /** A page for the browser that needs nothing else. */
  page() { return call(() => this.#raw.page()); }

  /** Why a signal was suspected, at its first accusation or at a time in seconds: what `shsa explain --json` prints. */
  explain(signal, at) { return JSON.parse(call(() => this.#raw.explain(signal, at))); }

  /** The same with drawings, as a page for the browser. */
  explainPage(signal, at) { return call(() => this.#raw.explain_page(signal, at)); }
}

function lines(text) {
  return text.split('\n').filter(Boolean).map((line) => JSON.parse(line));
}

function reading({ by, timeColumn, timeUnit, dateOrder, timeZone }) {
  return { by, timeColumn, timeUnit, dateOrder, timeZone };
}
