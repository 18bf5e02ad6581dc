// The engine beside the page, so that the page stays quick. It has the files that are being looked at.
import { Model, ShsaError, check, doctor, info, replay } from './engine/browser.js';

let files = [];
let found = null;
let played = null;

const onProgress = (done, count, what) => postMessage({ progress: { done, count, what } });

const acts = {
  /** What is in files, and what is wrong. The content is told even where nothing can be examined. */
  examine({ files: dropped }) {
    [files, found, played] = [dropped, null, null];
    const content = info(files);
    postMessage({ content });
    found = doctor(files, { onProgress });
    return { content, report: found.report, charts: found.charts(), columns: found.columns(), model: found.model, warnings: found.warnings };
  },
  check({ text }) {
    return check(text);
  },
  model({ text }) {
    const model = new Model(text);
    return { svg: drawing(model), signals: model.signals };
  },
  tidy({ text }) {
    return new Model(text).formatted();
  },
  replay({ text, inject }) {
    played = replay(new Model(text), files, { inject, onProgress });
    const { events, needs, observations, duration_s: duration } = played.report;
    return { events, needs, observations, duration, warnings: played.warnings };
  },
  report() {
    return found.page();
  },
  replayReport() {
    return played.page();
  },
};

function drawing(model) {
  try {
    return model.svg();
  } catch (error) {
    return { why: error.message };
  }
}

self.onmessage = ({ data: { id, act, ...given } }) => {
  try {
    postMessage({ id, result: acts[act](given) });
  } catch (error) {
    const diagnostics = error instanceof ShsaError ? error.diagnostics : [];
    postMessage({ id, error: { message: error.message, diagnostics } });
  }
};
postMessage({ ready: true });
