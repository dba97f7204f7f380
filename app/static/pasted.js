// What a pasted table means: the cell of the entry grid for each value, or why nothing of it was taken. Pure.
"use strict";

const Pasted = (() => {
  const COLUMNS = {
    theta: /^(theta|θ|тета)/, psi: /^(psi|ψ|пси)/, u_jx: /^u[_( ]*j[_ ]?x/, u_jy: /^u[_( ]*j[_ ]?y/, jx: /^j[_ ]?x/,
    jy: /^j[_ ]?y/, duration_s: /^(duration|длит)/, rate_hz: /^(rate|част)/, note: /^(note|прим)/, number: /^(no\.?|n|№)$/,
  };
  const UNITS = [["ua", /(µ|μ|u)a\b|мка/], ["ma", /ma\b|ма$|ма[),\]]/], ["a", /(_|[,(\s])[aа]\)?$/]];
  const NEAR = 1e-6;  // degrees, as everywhere

  const empty = (line) => !line.trim();
  const numeric = (cell) => /\d/.test(cell) && /^[\d\s\u00a0\u202f.,+\-−–eE]+$/.test(cell);
  const value = (cell) => Number(cell.replace(/[\s\u00a0\u202f]/g, "").replace(/[−–]/g, "-").replace(",", "."));
  const columnOf = (name) => Object.keys(COLUMNS).find((key) => COLUMNS[key].test(name)) || null;
  const unitOf = (name) => (UNITS.find(([, pattern]) => pattern.test(name)) || [null])[0];

  // A comma parts columns where it cannot be a decimal one: beside points, names, or another comma.
  const separator = (lines) => {
    const all = (test) => lines.map((line) => line.replace(/\de[+\-−–]?\d/gi, "0")).every(test);
    if (lines.some((line) => line.includes("\t"))) return "\t";
    if (lines.some((line) => line.includes(";"))) return ";";
    if (all((line) => /,.*,|[.a-zа-я].*,|,.*[.a-zа-я]/i.test(line))) return ",";
    if (all((line) => line.trim().split(/\s+/).length > 1 && line.trim().split(/\s+/).every(numeric))) return /\s+/;
    return null;
  };

  const same = (a, b) => { const off = Math.abs(a - b) % 360; return Math.min(off, 360 - off) <= NEAR; };
  const at = (rows, theta, psi) => rows.find((row) => same(row.theta, theta) && same(row.psi, psi));

  // The columns of the table, by the grid's names; a header names them, else they follow the cell pasted into.
  const named = (cells, unit) => {
    const names = cells.map((cell) => cell.trim().toLowerCase());
    const columns = names.map(columnOf);
    const other = names.findIndex((name, n) => name && !columns[n]);
    if (other >= 0) return { why: "column", name: cells[other].trim() };
    const wrong = names.findIndex((name, n) => /j/.test(columns[n]) && unitOf(name) && unitOf(name) !== unit);
    if (wrong >= 0) return { why: "unit", name: cells[wrong].trim() };
    return { columns };
  };

  // text, rows of the grid ({theta, psi, columns: names of its inputs}), the row and the column pasted into, the unit
  const read = (text, rows, start, first, unit) => {
    const lines = text.replace(/\r\n?/g, "\n").replace(/\s+$/, "").split("\n");
    const full = lines.filter((line) => !empty(line));
    const apart = separator(full);
    const cut = (line) => (apart === null ? [line] : line.trim() === "" ? [] : (apart === "\t" ? line : line.trim()).split(apart));
    const table = lines.map((line, n) => ({ line: n + 1, cells: cut(line) }));
    const filled = table.filter(({ cells }) => cells.some((cell) => cell.trim()));
    let columns = rows[start].columns.slice(first);
    const head = filled[0].cells;
    if (head.some((cell) => cell.trim()) && !head.some(numeric)) {
      const found = named(head, unit);
      if (found.why) return found;
      columns = found.columns;
      filled.shift();
      table.splice(0, table.findIndex(({ cells }) => cells === head) + 1);
    } else {
      const placed = ({ cells }) => cells.length > 3 && numeric(cells[0]) && numeric(cells[1])
        && at(rows, value(cells[0]), value(cells[1]));
      if (filled.every(placed)) columns = ["theta", "psi", ...rows[start].columns];
    }
    if (!filled.length) return { why: "empty" };
    const known = columns.includes("theta") && columns.includes("psi");
    if (!known && (columns.includes("theta") || columns.includes("psi"))) return { why: "angles" };
    const below = rows.slice(start);
    const gaps = table.length > filled.length;
    if (!known && filled.length > below.length) return { why: "lines", lines: filled.length, rows: below.length };
    if (!known && gaps && filled.length !== below.length) return { why: "blank" };
    const found = [], taken = new Set();
    for (const [n, { line, cells }] of filled.entries()) {
      const over = cells.findIndex((cell, c) => cell.trim() && (c >= columns.length || columns[c] === null));
      if (over >= 0) return { why: "wide", line, columns: columns.length };
      const off = cells.findIndex((cell, c) => cell.trim() && !["note", "number"].includes(columns[c]) && !numeric(cell));
      if (off >= 0) return { why: "number", line, cell: cells[off].trim() };
      const angle = (name) => value(cells[columns.indexOf(name)] || "");
      const row = known ? at(rows, angle("theta"), angle("psi")) : below[n];
      if (!row) return { why: "position", line };
      if (taken.has(row)) return { why: "twice", line };
      taken.add(row);
      for (const [c, cell] of cells.entries()) {
        if (["theta", "psi", "number", undefined].includes(columns[c])) continue;
        if (!row.columns.includes(columns[c])) return { why: "column", name: columns[c] };
        found.push({ row, column: columns[c], text: cell.trim() });
      }
    }
    return { found };
  };

  return { read };
})();
