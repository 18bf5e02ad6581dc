// What was found: findings, signals, problems of the model, decisions.
import { byId, counted, element, shown } from './dom.js';
import { sparkline, stretch } from './draw.js';

/** The findings, each with its drawing and its reasons. */
export function showFindings({ charts, report }) {
  const checked = new Set(report.relations.flatMap((it) => it.signals)).size;
  const by = `${checked} of ${counted(report.signals, 'signal')} are checked by ${counted(report.relations.length, 'relation')} between them.`;
  byId('wrong-told').textContent = charts.length === 0 ? `Nothing contradicts anything else. ${by}` : by;
  // The padding and the border of a card, on both sides.
  const room = byId('wrong').clientWidth - 48;
  byId('findings').replaceChildren(...charts.map((finding, at) => element('article', { class: `card finding${finding.named ? '' : ' between'}`, 'aria-labelledby': `finding-${at}` },
    element('h3', { id: `finding-${at}` }, finding.headline),
    element('p', { class: 'soft' }, finding.when),
    stretch(finding, room),
    element('ul', {}, ...finding.evidence.map((line) => element('li', {}, line))))));
}

/** The signals with their courses. */
export function showContent({ content, columns, warnings }) {
  const topics = content.files.flatMap((file) => file.topics.length);
  const formats = [...new Set(content.files.map((file) => file.format))].join(', ');
  const lost = content.files.some((file) => file.degraded) ? ' Something of it is lost.' : '';
  byId('content-told').textContent = `${formats}: ${counted(columns.columns.length, 'signal')} of ${counted(topics.reduce((sum, it) => sum + it, 0), 'topic')} over ${shown(columns.to_s - columns.from_s)} s.${lost}`;
  const told = [...new Set([...content.files.flatMap((file) => file.warnings), ...warnings])];
  byId('warnings').replaceChildren(...told.map((warning) => element('li', {}, `⚠ ${warning}`)));
  byId('signals').replaceChildren(...columns.columns.map((column) => {
    const values = column.range.flatMap(([, lowest, highest]) => [lowest, highest]);
    const [first, last] = [column.range[0]?.[0], column.range.at(-1)?.[0]];
    const rate = column.count > 1 && last > first ? `${shown((column.count - 1) / (last - first))} Hz` : '–';
    const number = (text) => element('td', { class: 'number' }, text);
    return element('tr', {}, element('th', { scope: 'row' }, column.signal), element('td', {}, sparkline(column, columns.from_s, columns.to_s)),
      number(values.length > 0 ? shown(Math.min(...values)) : '–'), number(values.length > 0 ? shown(Math.max(...values)) : '–'), element('td', {}, column.unit ?? '–'),
      number(String(column.count)), number(rate), number(column.longest_gap_s === null ? '–' : `${shown(column.longest_gap_s)} s`));
  }));
}

/** The problems of a model; `turnTo` shows a place in its text. */
export function showDiagnostics({ ok, diagnostics, variables, signals, relations, needs }, turnTo) {
  byId('model-told').textContent = ok
    ? `A valid model: ${counted(variables, 'variable')}, ${counted(relations, 'relation')}, ${counted(signals, 'signal')}, ${counted(needs, 'need')}.`
    : 'This model has errors; the last valid one stays in use.';
  byId('diagnostics').replaceChildren(...diagnostics.filter((it) => it.severity !== 'note').map((it) => {
    const place = it.line > 0 ? element('button', { type: 'button', class: 'link' }, `line ${it.line}, column ${it.column}`) : null;
    place?.addEventListener('click', () => turnTo(it.line, it.column));
    const words = `${it.severity}: ${it.message}${it.help ? `. ${it.help}` : ''} `;
    return element('li', {}, element('span', { class: it.severity }, words), place);
  }));
}

const WORDS = { failed: 'failed', suspected: 'suspected', restored: 'restored', substituted: 'substituted', silent: 'silent', unhealable: 'nothing left' };

/** The needs and the decisions of a replay. */
export function showReplay({ events, needs, observations, duration }, faults) {
  const faulty = faults.length > 0 ? `with ${faults.join(', ')}` : 'as it was recorded';
  byId('replay-told').textContent = `${counted(observations, 'observation')} over ${shown(duration)} s, ${faulty}: ${events.length === 0 ? 'no decision.' : `${counted(events.length, 'decision')}.`}`;
  const card = ([name, need]) => element('article', { class: `card ${need.met ? '' : 'unserved'}` },
    element('h3', {}, name), element('p', { class: `quality ${need.met ? 'good' : 'unserved'}` }, need.met ? '● served all the time' : '▲ not served all the time'));
  byId('needs').replaceChildren(...Object.entries(needs).map(card));
  byId('decisions-head').hidden = events.length === 0;
  byId('decisions').replaceChildren(...events.map((event) => element('li', {},
    element('time', {}, `${shown(event.time_s)} s`),
    element('span', { class: `kind ${event.kind}` }, WORDS[event.kind] ?? event.kind),
    element('span', { class: 'what' }, `${event.signal ?? event.variable ?? ''}${event.substitution ? `, now from ${event.substitution}` : ''}: ${event.because}`))));
}
