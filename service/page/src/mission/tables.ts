// Tables as text: a line of names, then a line per row; quotes as RFC 4180 has them.

export function tableOf(text: string): Record<string, string>[] {
  const [names, ...rows] = cellsOf(text);
  if (!names) return [];
  return rows.map((cells) => Object.fromEntries(names.map((name, column) => [name.trim(), cells[column] ?? ""])));
}

export function cellsOf(text: string, separator = ","): string[][] {
  const rows: string[][] = [];
  let [row, cell, quoted]: [string[], string, boolean] = [[], "", false];
  const end = (): void => {
    row.push(cell);
    cell = "";
    if (row.length > 1 || row[0] !== "") rows.push(row);
    row = [];
  };
  for (let at = 0; at < text.length; at += 1) {
    const letter = text[at] as string;
    if (quoted) {
      if (letter !== '"') cell += letter;
      else if (text[at + 1] === '"') {
        cell += '"';
        at += 1;
      } else quoted = false;
    } else if (letter === '"' && cell === "") quoted = true;
    else if (letter === separator) {
      row.push(cell);
      cell = "";
    } else if (letter === "\n") end();
    else if (letter !== "\r") cell += letter;
  }
  if (cell !== "" || row.length > 0) end();
  return rows;
}
