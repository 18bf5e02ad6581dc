// Asks the engine, which works in a worker of its own; ends it to cancel.

/** The engine; `hear` gets what it tells meanwhile. */
export class Work {
  #worker = null;
  #waiting = new Map();
  #next = 1;

  constructor(hear) {
    this.hear = hear;
    this.#begin();
  }

  #begin() {
    this.#worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
    this.ready = new Promise((resolve, reject) => {
      this.#worker.onerror = (event) => {
        const error = new Error(event.message || 'the engine cannot be loaded');
        reject(error);
        this.#fail(error);
      };
      this.#worker.onmessage = ({ data }) => {
        if (data.ready) resolve();
        else if (data.id === undefined) this.hear(data);
        else this.#answer(data);
      };
    });
    // Who asks is told; nobody need wait for this one.
    this.ready.catch(() => {});
  }

  #answer({ id, result, error }) {
    const { resolve, reject } = this.#waiting.get(id) ?? {};
    this.#waiting.delete(id);
    if (error) reject?.(Object.assign(new Error(error.message), { diagnostics: error.diagnostics }));
    else resolve?.(result);
  }

  #fail(error) {
    this.#waiting.forEach(({ reject }) => reject(error));
    this.#waiting.clear();
  }

  /** Does one thing after all that was asked before. */
  async ask(act, given = {}) {
    await this.ready;
    return new Promise((resolve, reject) => {
      const id = this.#next++;
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, act, ...given });
    });
  }

  /** Ends what is being done, and begins anew. */
  restart() {
    this.#worker.terminate();
    this.#fail(new Error('ended, as something else was begun'));
    this.#begin();
  }
}
