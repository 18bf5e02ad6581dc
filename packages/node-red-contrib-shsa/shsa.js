// The nodes of Node-RED: a model, and the healing of the signals that messages carry.
'use strict';

/** How often time passes where nothing is received, ms. */
const TICK_MS = 200;
/** The ring under a node for the quality of its worst need, the worst first. */
const RINGS = [['unserved', 'red'], ['uncertain', 'yellow'], ['substitute', 'yellow'], ['good', 'green']];

/** A problem of a model with its place. */
function place({ line, column, severity, message, help }) {
  return `line ${line}, column ${column}: ${severity}: ${message}${help ? `; ${help}` : ''}`;
}

/** The number that a payload means, as a number, bounds or an array; undefined for anything else. */
function reading(payload) {
  if (typeof payload === 'number' || typeof payload === 'boolean') return Number(payload);
  if (typeof payload === 'string') return payload.trim() !== '' && !Number.isNaN(Number(payload)) ? Number(payload) : undefined;
  const isNumbers = (values) => values.every((value) => typeof value === 'number');
  if (Array.isArray(payload)) return isNumbers(payload) ? payload : undefined;
  return payload && isNumbers([payload.lo, payload.hi]) ? { lo: payload.lo, hi: payload.hi } : undefined;
}

/** Milliseconds of a message's own time; undefined where it has none. */
function stamp(timestamp) {
  if (timestamp === undefined || timestamp === null) return undefined;
  const milliseconds = typeof timestamp === 'number' ? timestamp : Date.parse(timestamp instanceof Date ? timestamp.toISOString() : timestamp);
  if (!Number.isFinite(milliseconds)) throw new Error(`msg.timestamp is milliseconds, a Date or a text such as 2026-01-31T12:00:00Z, not ${timestamp}`);
  return milliseconds;
}

/** The message of a published value. The middle of an uncertain value is no estimate: its payload is null. */
function published({ signal, value, quality, source, time_ns: time }) {
  const middle = ({ lo, hi }) => (quality === 'uncertain' ? null : (lo + hi) / 2);
  const payload = Array.isArray(value) ? value.map(middle) : middle(value);
  return { topic: signal, payload, quality, source, bounds: value, timestamp: time / 1e6 };
}

module.exports = function nodes(RED) {
  const loaded = import('@shsa/engine');

  function ModelNode(config) {
    RED.nodes.createNode(this, config);
    /** The checked model; an error names its problems by line. */
    this.ready = loaded.then(({ Model, check }) => {
      const { diagnostics } = check(config.model, 'model');
      const errors = diagnostics.filter(({ severity }) => severity === 'error');
      if (errors.length > 0) throw new Error(errors.map(place).join('\n'));
      diagnostics.forEach((problem) => this.warn(place(problem)));
      return new Model(config.model, { name: 'model' });
    });
    this.ready.catch((error) => this.error(error.message));
  }
  RED.nodes.registerType('shsa-model', ModelNode);

  function HealNode(config) {
    RED.nodes.createNode(this, config);
    const node = this;
    const model = RED.nodes.getNode(config.model);
    // The wall clock may be set back; the engine's time does not go back.
    const begin = Date.now() - performance.now();
    const now = () => begin + performance.now();
    const standing = new Map();
    const unknown = new Set();
    let shown = '';
    let timer;

    function show(fill, text) {
      if (shown === `${fill} ${text}`) return;
      shown = `${fill} ${text}`;
      node.status({ fill, shape: 'ring', text });
    }

    /** Shows the worst need, and how many others are no better. */
    function showNeeds() {
      const needs = [...standing];
      const [quality, fill] = RINGS.find(([name]) => needs.some(([, need]) => need.quality === name)) ?? [];
      if (!quality) return;
      const [[name, { source }], ...others] = needs.filter(([, need]) => need.quality === quality);
      const more = others.length > 0 ? `, and ${others.length} more` : '';
      show(fill, `${name}: ${quality}${source ? ` from ${source}` : ''}${more}`);
    }

    function follow({ needs }, { values, events }) {
      events.filter(({ kind }) => kind === 'unhealable').forEach(({ variable, need }) => {
        const lost = needs.filter((it) => it.variable === variable && (!need || need === it.signal || need === variable));
        lost.forEach(({ signal }) => standing.set(signal, { quality: 'unserved' }));
      });
      values.forEach(({ signal, quality, source }) => standing.set(signal, { quality, source }));
    }

    function flush(engine, send) {
      const outputs = engine.outputs();
      if (outputs.values.length + outputs.events.length === 0) return;
      follow(engine.model, outputs);
      showNeeds();
      const decided = outputs.events.map((event) => ({ topic: event.signal ?? event.variable, payload: event, timestamp: event.time_ns / 1e6 }));
      send([outputs.values.map(published), decided]);
    }

    const ready = (model ? model.ready : Promise.reject(new Error('no model'))).then((checked) => loaded.then(({ Engine }) => {
      const engine = Object.assign(new Engine(checked), { model: checked });
      // A topic is the name of a signal, or its source.
      const topics = new Map([...checked.signals.map(({ name, source }) => [source, name]), ...checked.signals.map(({ name }) => [name, name])]);
      show('grey', `waiting for ${checked.signals.length} signals`);
      timer = setInterval(() => {
        engine.advance(now());
        flush(engine, (messages) => node.send(messages));
      }, TICK_MS);
      return { engine, topics };
    }));
    ready.catch((error) => show('red', error.message.split('\n')[0]));

    /** Takes in a message. */
    function take({ engine, topics }, { topic, payload, timestamp }, send) {
      const signal = topics.get(topic);
      if (signal === undefined) {
        if (!unknown.has(topic) && unknown.size < 100) node.warn(`no signal of the model has the topic ${JSON.stringify(topic)}`);
        unknown.add(topic);
        return;
      }
      const value = reading(payload);
      if (value === undefined) throw new Error(`${topic}: msg.payload is a number, an array of numbers or { lo, hi }, not ${JSON.stringify(payload)}`);
      const time = now();
      engine.handle(signal, value, { time, stamp: stamp(timestamp) ?? time });
      flush(engine, send);
    }

    node.on('input', (message, send, done) => {
      ready.then((run) => take(run, message, send)).then(() => done(), done);
    });
    node.on('close', () => clearInterval(timer));
  }
  RED.nodes.registerType('shsa', HealNode);

  RED.httpAdmin.post('/shsa/check', RED.auth.needsPermission('flows.write'), (request, response) => {
    loaded.then(({ check }) => response.json(check(String(request.body?.model ?? ''), 'model')))
      .catch((error) => response.status(500).json({ message: error.message }));
  });
};
