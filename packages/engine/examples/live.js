// The engine in a loop: a receiver that lies from the tenth second on, and who stands in for it.
import { Engine, Model } from '@shsa/engine';

const model = new Model(`
shsa: 1
variables: { speed: { unit: m/s, range: [-10, 60], max_rate: 6 m/s^2 } }
signals:
  gnss: { variable: speed, unit: m/s, rate: 10 Hz, value_error: 0.3 }
  wheel: { variable: speed, unit: m/s, rate: 10 Hz, value_error: 0.3 }
  radar: { variable: speed, unit: m/s, rate: 10 Hz, value_error: 0.5 }
needs: { speed: { signal: healed, max_age: 300 ms } }
`);
const engine = new Engine(model);
for (let step = 0; step < 200; step += 1) {
  const time = step * 100;
  engine.handle('gnss', step < 100 ? 13 : 16, { time });
  engine.handle('wheel', 13.1, { time });
  engine.handle('radar', 12.9, { time });
  for (const event of engine.outputs().events) console.log(`${event.time_ns / 1e9} s: ${event.kind} ${event.signal ?? event.variable}`);
}
console.log(`gnss is ${engine.verdict('gnss')}`);
