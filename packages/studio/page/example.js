// The bundled example: the drive of a car, whose satellite receiver reads too much for a while.
const FILES = ['gnss.csv', 'radar.csv', 'wheel.csv'];
const [FROM_S, TO_S, BIAS] = [30, 38, 3];

/** The files of the example; the fault is put in here, so that its truth is known. */
export async function example() {
  const texts = await Promise.all(FILES.map(async (name) => {
    const answer = await fetch(new URL(`./examples/car/${name}`, import.meta.url));
    if (!answer.ok) throw new Error(`the example cannot be loaded: ${name}`);
    return [name, await answer.text()];
  }));
  return texts.map(([name, text]) => new File([name === 'gnss.csv' ? lying(text) : text], name));
}

/** A table whose second column reads too much between two times of the first one. */
function lying(text) {
  const rows = text.trimEnd().split('\n');
  const data = rows.findIndex((row) => Number.isFinite(Number(row.split(',')[0])) && row.trim() !== '');
  const begin = Number(rows[data].split(',')[0]);
  return rows.map((row, at) => {
    const [time, value, ...rest] = row.split(',');
    const since = Number(time) - begin;
    return at < data || since < FROM_S || since >= TO_S ? row : [time, (Number(value) + BIAS).toFixed(3), ...rest].join(',');
  }).join('\n');
}
