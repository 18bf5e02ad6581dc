// What is wrong in a recording: node examples/findings.js RECORDING..
import { doctor } from '@shsa/engine';

const files = process.argv.slice(2);
const found = doctor(files.length > 0 ? files : [sample()]);
found.findings.forEach((finding) => console.log(finding.text));

/** Three thermometers for a quarter of an hour; one reads 2 too much for a minute. */
function sample() {
  const noise = (step, of) => 0.05 * Math.sin((step * 37 + of * 101) * 12.9898);
  const value = (step, of) => 20 + 3 * Math.sin(0.02 * step) + noise(step, of) + (of === 1 && step >= 300 && step < 360 ? 2 : 0);
  const row = (step) => [step, value(step, 0), value(step, 1), value(step, 2)].join(',');
  const rows = Array.from({ length: 900 }, (_, step) => row(step));
  return { name: 'hall.csv', data: ['t [s],north,middle,south', ...rows].join('\n') };
}
