// Undo and redo: whole documents, which share what did not change.

export interface History<T> {
  readonly past: readonly T[];
  readonly present: T;
  readonly future: readonly T[];
}

const MOST = 500;

export function begin<T>(present: T): History<T> {
  return { past: [], present, future: [] };
}

/** A change that can be undone. before: what undo returns to, when the present has followed a drag already. */
export function changed<T>(history: History<T>, present: T, before: T = history.present): History<T> {
  if (present === before) return { ...history, present };
  return { past: [...history.past, before].slice(-MOST), present, future: [] };
}

export function undone<T>(history: History<T>): History<T> {
  const before = history.past.at(-1);
  if (before === undefined) return history;
  return { past: history.past.slice(0, -1), present: before, future: [history.present, ...history.future] };
}

export function redone<T>(history: History<T>): History<T> {
  const [next, ...future] = history.future;
  if (next === undefined) return history;
  return { past: [...history.past, history.present], present: next, future };
}
