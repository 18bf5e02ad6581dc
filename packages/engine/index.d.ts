// The types of @shsa/engine. Objects are those that the command prints with --json; docs/json.md of the project lists their fields.

/** A file: a path (Node.js), a File (in a Web Worker), bytes or text, or a function that reads pieces. */
export type Recording =
  | string
  | File
  | { name: string; data: string | ArrayBuffer | Uint8Array }
  | { name: string; size: number; read(from: number, length: number): Uint8Array; close?(): void };

/** What recordings do not say of themselves. */
export interface ReadOptions {
  /** The column that tells apart whose values a row holds. */
  by?: string;
  timeColumn?: string;
  /** `s`, `ms`, or a span such as `5s`. */
  timeUnit?: string;
  dateOrder?: 'dmy' | 'mdy' | 'ymd';
  /** `UTC`, `+02:00`, `Europe/Vienna`. */
  timeZone?: string;
}

export interface WorkOptions extends ReadOptions {
  onProgress?(done: number, count: number, ofWhat: string): void;
}

export interface Diagnostic {
  severity: 'error' | 'warning' | 'note';
  message: string;
  file: string;
  /** Counted from 1; 0 where the problem is about the whole file. */
  line: number;
  column: number;
  help: string | null;
}

/** Why something cannot be done. */
export class ShsaError extends Error {
  diagnostics: Diagnostic[];
}

export interface Checked {
  ok: boolean;
  variables: number;
  relations: number;
  signals: number;
  needs: number;
  diagnostics: Diagnostic[];
}

export function version(): string;

/** Every problem of a model with its place. */
export function check(text: string, name?: string): Checked;

/** A model without errors. */
export class Model {
  constructor(text: string, options?: { name?: string });
  readonly text: string;
  readonly name: string;
  readonly variables: string[];
  readonly relations: string[];
  readonly signals: { name: string; variable: string; unit: string | null; source: string }[];
  readonly needs: { signal: string; variable: string; unit: string | null }[];
  formatted(): string;
  svg(): string;
  analyze(options?: { additions?: number }): Record<string, any>;
  analysisPage(options?: { additions?: number }): string;
}

/** A Date, milliseconds as of Date.now(), or a bigint of nanoseconds. */
export type Moment = Date | number | bigint;

export interface Published {
  /** The published name. */
  signal: string;
  time_ns: number;
  received_ns: number;
  value: { lo: number; hi: number } | { lo: number; hi: number }[];
  quality: string;
  source: string;
}

export interface Decision {
  kind: string;
  signal: string | null;
  variable: string | null;
  because: string;
  [field: string]: unknown;
}

/** The engine in a loop of your own. Time never goes back. */
export class Engine {
  constructor(model: Model);
  handle(signal: string, value: number | number[] | Float64Array | { lo: number; hi: number }, times?: { time?: Moment; stamp?: Moment }): void;
  advance(time?: Moment): void;
  outputs(): { values: Published[]; events: (Decision & { time_ns: number })[] };
  nextDeadline(): bigint | undefined;
  verdict(signal: string): 'healthy' | 'suspect' | 'failed' | 'silent' | 'unknown';
  snapshot(): string;
  restore(snapshot: string, time?: Moment): void;
}

/** What is in recordings. */
export function info(files: Recording | Recording[], options?: ReadOptions): Record<string, any>;

/** A first model of recordings, as text. */
export function draft(files: Recording | Recording[], options?: WorkOptions): string;

/** What is wrong in recordings, without a model. */
export function doctor(files: Recording | Recording[], options?: WorkOptions): Diagnosis;

export class Diagnosis {
  private constructor();
  readonly json: string;
  readonly report: Record<string, any>;
  readonly findings: { signals: string[]; named: boolean; kind: string; text: string; [field: string]: any }[];
  readonly warnings: string[];
  readonly model: string;
  text(): string;
  page(): string;
  charts(): Record<string, any>[];
  columns(stretches?: number): { from_s: number; to_s: number; columns: Record<string, any>[] };
}

/** Runs the whole loop over recordings, with faults such as `bias=2:wheel_1@20s..`. */
export function replay(model: Model, files: Recording | Recording[], options?: WorkOptions & { inject?: string | string[]; seed?: number }): Replay;

export class Replay {
  private constructor();
  readonly json: string;
  readonly report: Record<string, any>;
  readonly events: (Decision & { time_s: number })[];
  readonly values: Published[];
  readonly warnings: string[];
  text(): string;
  page(): string;
  explain(signal: string, at?: number): Record<string, any>;
  explainPage(signal: string, at?: number): string;
}
