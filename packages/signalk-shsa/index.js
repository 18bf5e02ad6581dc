// A plugin of the Signal K server: hears deltas, gives them to the engine, publishes healed values and what was decided.
'use strict';

const ID = 'signalk-shsa';
/** The source of what is published here; it is never heard. */
const SOURCE = 'shsa';
/** How often time passes where nothing is received, ms. */
const TICK_MS = 200;
/** How many received values are kept for a draft. */
const KEPT = 200_000;
const VERDICTS = { failed: 'alarm', suspected: 'warn', silent: 'alarm', unhealable: 'alarm' };

const SCHEMA = {
  type: 'object',
  title: 'Healing of sensors',
  description: 'Leave the model empty for a while under way, then open /plugins/signalk-shsa/draft: it has a first model of what your boat measures twice, to be pasted here. /plugins/signalk-shsa/findings tells what contradicts itself.',
  properties: {
    model: { type: 'string', title: 'Model (YAML)', description: 'Signals have Signal K paths as sources: `navigation.speedOverGround[source=gps1]`; needs publish under paths.', default: '' },
  },
};

/** The path and the source of a signal's place: `path[source=label]`. */
function place({ name, source }) {
  const [, path, label] = /^([^[\]]+)(?:\[source=([^\]]+)\])?$/.exec(source || name) ?? [];
  return { signal: name, path, label };
}

module.exports = function plugin(app) {
  let stopped = [];
  let shsa = null;
  let kept = [];

  /** Keeps what is received, so that a model can be drafted of it. */
  function keep(path, { value, $source, timestamp }) {
    kept.push(JSON.stringify({ context: 'vessels.self', updates: [{ $source, timestamp, values: [{ path, value }] }] }));
    if (kept.length > KEPT) kept = kept.slice(KEPT / 10);
  }

  function listen(stream, act) {
    stopped.push(stream.onValue(act));
  }

  function publish(engine) {
    const { values, events } = engine.outputs();
    const timestamp = new Date().toISOString();
    const of = ({ signal, value: { lo, hi }, quality, source }) => [
      { path: signal, value: (lo + hi) / 2 },
      { path: `shsa.${signal}`, value: { quality, source, lowest: lo, highest: hi } },
    ];
    const told = ({ kind, signal, variable, because }) => [{
      path: `notifications.shsa.${(signal ?? variable).replace(/[^\w]+/g, '_')}`,
      value: { state: VERDICTS[kind] ?? 'normal', method: ['visual'], message: `${signal ?? variable} ${kind}: ${because}` },
    }];
    // The newest value of each need; what lies before it in the same turn is known already.
    const newest = [...new Map(values.filter((it) => !Array.isArray(it.value)).map((it) => [it.signal, it])).values()];
    const updates = [...newest.flatMap(of), ...events.flatMap(told)];
    if (updates.length > 0) app.handleMessage(ID, { updates: [{ $source: SOURCE, timestamp, values: updates }] });
    events.forEach(({ kind, signal, variable }) => app.setPluginStatus(`${signal ?? variable}: ${kind}`));
  }

  function run(text) {
    const model = new shsa.Model(text, { name: 'model.yaml' });
    const engine = new shsa.Engine(model);
    const takes = (path, { signal, label }) => (delta) => {
      const is = delta.$source === label || label === undefined;
      if (!is || delta.$source === SOURCE || typeof delta.value !== 'number') return;
      engine.handle(signal, delta.value, { time: Date.now(), stamp: Date.parse(delta.timestamp) || Date.now() });
      publish(engine);
    };
    model.signals.map(place).forEach((it) => it.path && listen(app.streambundle.getSelfBus(it.path), takes(it.path, it)));
    const timer = setInterval(() => {
      engine.advance(Date.now());
      publish(engine);
    }, TICK_MS);
    stopped.push(() => clearInterval(timer));
    app.setPluginStatus(`watching ${model.signals.length} signals for ${model.needs.length} needs`);
  }

  /** What the recent past of the boat gives, as plain text. */
  function answer(act) {
    return (_, response) => {
      response.type('text/plain');
      try {
        response.send(act({ name: 'boat.jsonl', data: `${kept.join('\n')}\n` }));
      } catch (error) {
        response.status(422).send(`${error.message}\n`);
      }
    };
  }

  return {
    id: ID,
    name: 'Healing of sensors (shsa)',
    description: 'Finds the sensor that lies, and publishes what the others say in its place',
    schema: SCHEMA,
    start(settings) {
      import('@shsa/engine').then((engine) => {
        shsa = engine;
        listen(app.streambundle.getSelfBus(), (delta) => {
          if (delta.$source !== SOURCE && typeof delta.value === 'number') keep(delta.path, delta);
        });
        if (settings.model?.trim()) run(settings.model);
        else app.setPluginStatus('listening; /plugins/signalk-shsa/draft has a first model');
      }).catch((error) => app.setPluginError(error.message));
    },
    stop() {
      stopped.forEach((stop) => stop());
      stopped = [];
    },
    registerWithRouter(router) {
      router.get('/draft', answer((file) => shsa.draft(file)));
      router.get('/findings', answer((file) => shsa.doctor(file).text()));
    },
  };
};
