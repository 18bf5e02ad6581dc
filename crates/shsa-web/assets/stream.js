// The stream of an instance: all rows first, then the changed ones.

/** After this time without a message the shown data are stale; milliseconds. */
const SILENCE = 2000;
/** The time between two attempts to connect; longer after a refusal. */
const PAUSE = 500;
const REFUSED_PAUSE = 5000;

/** The instance has refused the request. */
class Refusal extends Error {}

/** The answer of the instance to a path. */
export async function ask(path, token, more = {}) {
  const headers = { ...more.headers, ...(token ? { Authorization: `Bearer ${token}` } : {}) };
  const response = await fetch(path, { ...more, headers, cache: "no-store" });
  if (response.ok) return response;
  if (response.status === 401 && path !== "/orders") throw new Refusal("looking needs a token: put it into the field under Orders");
  const told = await response.json().catch(() => ({}));
  throw new Refusal(told.error ?? `the instance answers ${response.status}`);
}

/** The messages of a body of server-sent events, one after the other. */
export async function* messages(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    text += value;
    const parts = text.split("\n\n");
    text = parts.pop();
    for (const part of parts) {
      const fields = { event: "message", data: "" };
      for (const line of part.split("\n")) {
        const at = line.indexOf(": ");
        if (at > 0) fields[line.slice(0, at)] = line.slice(at + 2);
      }
      if (fields.data) yield { event: fields.event, data: JSON.parse(fields.data) };
    }
  }
}

/** Merges changed rows into the data: models, tables, rows. A row that is null is removed. */
export function merge(models, part) {
  for (const [model, tables] of Object.entries(part)) {
    models[model] ??= {};
    for (const [name, rows] of Object.entries(tables)) {
      const table = (models[model][name] ??= {});
      for (const [key, row] of Object.entries(rows)) {
        if (row === null) delete table[key];
        else table[key] = row;
      }
    }
  }
}

export class Stream {
  /** `heard` gets the head, the models and new decisions; `lost` the reason of a silence, and its seconds. */
  constructor({ token, heard, lost }) {
    Object.assign(this, { token, heard, lost, models: {}, at: Date.now(), why: "no connection yet", control: null, wake: null });
    setInterval(() => this.watch(), 250);
  }

  /** Connects again at once, with the present token. */
  again() {
    this.control?.abort();
    this.wake?.();
  }

  async run() {
    for (;;) {
      let pause = PAUSE;
      try {
        await this.read();
        this.why = "the instance has ended the stream";
      } catch (error) {
        this.why = error instanceof Refusal ? error.message : "the instance does not answer";
        if (error instanceof Refusal) pause = REFUSED_PAUSE;
      }
      await new Promise((resolve) => {
        this.wake = resolve;
        setTimeout(resolve, pause);
      });
    }
  }

  watch() {
    const silence = Date.now() - this.at;
    if (silence <= SILENCE) return;
    this.lost(this.why, Math.floor(silence / 1000));
    // A silent connection may be a broken one.
    if (silence > 5 * SILENCE) this.control?.abort();
  }

  async read() {
    this.control = new AbortController();
    const response = await ask("/changes", this.token(), { signal: this.control.signal });
    this.why = "the instance is silent";
    for await (const { event, data } of messages(response.body)) {
      if (event === "state") this.models = {};
      merge(this.models, data.models);
      this.at = Date.now();
      this.heard({ head: data.head, models: this.models, events: data.events, isNew: event === "state" });
    }
  }
}
