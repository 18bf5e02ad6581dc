// Drawings: a signal as a sparkline, and a finding with its stretch.
import { drawn, element, shown } from './dom.js';

const WIDEST = 1600;
const HEIGHT = 240;
const LEFT = 72;
const BOTTOM = 28;
const TICKS = [1, 2, 2.5, 5, 10];

/** The range of values over time, as one filled outline. */
export function sparkline({ range, signal }, from, to) {
  const values = range.flatMap(([, lowest, highest]) => [lowest, highest]);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const x = (time) => (240 * (time - from)) / Math.max(to - from, 1e-9);
  const y = (value) => 30 - (28 * (value - low)) / Math.max(high - low, 1e-300);
  const gap = (4 * (to - from)) / 240 + 1e-9;
  const pieces = [];
  range.forEach((point, at) => {
    if (at === 0 || point[0] - range[at - 1][0] > gap) pieces.push([]);
    pieces.at(-1).push(point);
  });
  const outline = (piece) => {
    const there = piece.map(([time, , highest]) => `${x(time).toFixed(1)},${y(highest).toFixed(1)}`);
    const back = piece.map(([time, lowest]) => `${x(time).toFixed(1)},${y(lowest).toFixed(1)}`).reverse();
    return `M${there.join('L')}L${back.join('L')}Z`;
  };
  const label = range.length === 0 ? `${signal}: no values` : `${signal}: from ${shown(low)} to ${shown(high)}`;
  return drawn('svg', { class: 'sparkline', viewBox: '0 0 240 32', preserveAspectRatio: 'none', role: 'img', 'aria-label': label },
    drawn('path', { d: pieces.map(outline).join('') }));
}

/** Round numbers between two, about so many of them. */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * (TICKS.find((it) => it * power >= rough) ?? 10);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.max(0, Math.floor(high / step) - first + 1) }, (_, at) => (first + at) * step);
}

/** The stretch of a finding in this width, px: what the signal says, and what the others say of it. */
export function stretch(finding, room) {
  const width = Math.max(240, Math.min(room, WIDEST));
  const { own, expected, stretches, unit, of } = finding;
  const all = [...own, ...expected];
  if (own.length === 0) return null;
  const [times, values] = [all.map(([time]) => time), all.map(([, value]) => value)];
  const [from, to] = [Math.min(...times), Math.max(...times)];
  const margin = 0.05 * (Math.max(...values) - Math.min(...values)) || 1;
  const [low, high] = [Math.min(...values) - margin, Math.max(...values) + margin];
  const x = (time) => LEFT + ((width - LEFT) * (time - from)) / Math.max(to - from, 1e-9);
  const y = (value) => (HEIGHT - BOTTOM) * (1 - (value - low) / (high - low));
  const line = (points, name) => drawn('polyline', { class: name, points: points.map(([time, value]) => `${x(time).toFixed(1)},${y(value).toFixed(1)}`).join(' ') });
  const rows = ticks(low, high, 5).flatMap((value) => [
    drawn('path', { class: 'grid', d: `M${LEFT} ${y(value)}H${width}` }),
    drawn('text', { class: 'tick end', x: LEFT - 8, y: y(value) + 5 }, shown(value))]);
  const columns = ticks(from, to, Math.max(3, width / 160)).filter((time) => x(time) < width - 24).map((time) => drawn('text', { class: 'tick middle', x: x(time), y: HEIGHT - 6 }, `${shown(time)} s`));
  const marks = stretches.map(([begin, end]) => {
    const [left, right] = [Math.max(x(begin), LEFT), Math.min(x(end), width)];
    return right <= left ? null : drawn('rect', { class: 'stretch', x: left, y: 0, width: Math.max(right - left, 2), height: HEIGHT - BOTTOM });
  });
  const label = `${of} beside what the others say of it${unit ? `, in ${unit}` : ''}: ${finding.headline}, ${finding.when}`;
  return element('figure', { class: 'figure' },
    drawn('svg', { class: 'drawn', viewBox: `0 0 ${width} ${HEIGHT}`, role: 'img', 'aria-label': label },
      ...marks, ...rows, ...columns, expected.length > 0 ? line(expected, 'others') : null, line(own, 'blame')),
    element('figcaption', { class: 'legend soft' },
      element('span', {}, unit ? `${of}, ${unit}` : of),
      expected.length > 0 ? element('span', { class: 'of-others' }, 'what the others say') : null,
      element('span', { class: 'of-stretch' }, 'where it is wrong')));
}
