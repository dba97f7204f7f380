// The entry grid: Enter saves a row and goes to the next; a paste fills rows (`pasted.js` says which) and saves each.
"use strict";

(() => {
  const grid = document.querySelector("table.grid");
  if (!grid) return;
  const rows = () => [...grid.querySelectorAll("tbody tr")];
  const inputs = (row) => [...row.querySelectorAll("input.in")];
  const filled = (row) => inputs(row).slice(0, 2).some((input) => input.value.trim());

  // What a row held when it came from the server: a row that was not touched is not saved again.
  const unsaved = (row) => inputs(row).some((input) => input.value !== input.defaultValue);

  // Rows are saved one after the other, so that the line of state is the last one's.
  const queue = [];
  let busy = null;
  const next = () => {
    busy = queue.shift() || null;
    if (!busy) return;
    const form = document.getElementById(`${busy}-f`);
    if (form) form.requestSubmit(); else next();
  };
  const save = (row, pasted) => {
    const form = document.getElementById(`${row.id}-f`);
    if (!form || busy === row.id || !unsaved(row) || !filled(row)) return;
    if (pasted && !form.elements.origin) {
      const origin = document.createElement("input");
      Object.assign(origin, { type: "hidden", name: "origin", value: "pasted" });
      form.append(origin);
    }
    if (!queue.includes(row.id)) queue.push(row.id);
    if (!busy) next();
  };
  document.body.addEventListener("htmx:afterRequest", (event) => {
    if (grid.contains(event.detail.elt) || !event.detail.elt.isConnected) next();
  });

  const column = (input) => inputs(input.closest("tr")).indexOf(input);
  const focus = (row, place) => {
    const wanted = row && inputs(row)[place];
    if (wanted) { wanted.focus(); wanted.select(); }
  };
  const step = (row, by) => {
    const all = rows().filter((item) => inputs(item).length);
    return all[all.indexOf(row) + by];
  };

  grid.addEventListener("keydown", (event) => {
    const input = event.target.closest("input.in");
    if (!input || event.isComposing) return;
    const row = input.closest("tr");
    if (event.key === "Enter" && !event.ctrlKey && !event.altKey && !event.metaKey) {
      event.preventDefault();
      const pair = inputs(row);
      // The second current is still to come: Enter goes there first.
      if (input === pair[0] && !pair[1].value.trim()) { pair[1].focus(); return; }
      const below = step(row, event.shiftKey ? -1 : 1);
      save(row, false);
      focus(below, 0);
    } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      focus(step(row, event.key === "ArrowDown" ? 1 : -1), column(input));
    }
  });

  // Leaving a row saves it, when both currents are there.
  grid.addEventListener("focusout", (event) => {
    const row = event.target.closest("tbody tr");
    if (!row || row.contains(event.relatedTarget)) return;
    const [x, y] = inputs(row);
    if (x && x.value.trim() && y.value.trim()) save(row, false);
  });

  // A paste is placed as a whole or not at all: what it says of itself counts more than where it was dropped.
  const refused = document.getElementById("paste-refused");
  const said = (result) => {
    const text = JSON.parse(refused.dataset.say)[result.why];
    return text.replace(/\{(\w+)\}/g, (_, name) => result[name]);
  };
  const plain = (name) => name.replace(/_(ua|ma)$/, "");
  const described = (row) => ({
    row, theta: Number(row.dataset.theta), psi: Number(row.dataset.psi), columns: inputs(row).map((input) => plain(input.name)),
  });
  grid.addEventListener("paste", (event) => {
    const input = event.target.closest("input.in");
    const text = event.clipboardData && event.clipboardData.getData("text/plain");
    if (!input || !text || !/[\t\n;]/.test(text.trim())) return;
    event.preventDefault();
    const open = rows().filter((row) => inputs(row).length).map(described);
    const start = open.findIndex(({ row }) => row === input.closest("tr"));
    const result = Pasted.read(text, open, start, column(input), grid.dataset.unit);
    refused.hidden = !result.why;
    refused.querySelector("p").textContent = result.why ? said(result) : "";
    if (result.why) return;
    for (const { row: place, column: name, text: value } of result.found) {
      inputs(place.row).find((item) => plain(item.name) === name).value = value;
    }
    const touched = [...new Set(result.found.map(({ row: place }) => place.row))];
    for (const row of touched) save(row, true);
    focus(step(touched[touched.length - 1], 1), column(input));
  });

  // Begin where the address says, else in the first row that is still empty.
  const asked = location.hash && document.querySelector(location.hash.replace(/[^#\w-]/g, ""));
  const empty = rows().find((row) => inputs(row).length && !filled(row));
  const begin = asked && grid.contains(asked) ? asked : empty;
  if (begin && !document.querySelector("[autofocus]")) focus(begin, 0);

  // A swapped row keeps the focus where it was.
  let focused = null;
  document.body.addEventListener("htmx:beforeSwap", (event) => {
    const row = event.detail.target;
    const active = document.activeElement;
    focused = row && row.contains && row.contains(active) ? [row.id, active.name, active.value] : null;
  });
  document.body.addEventListener("htmx:afterSettle", () => {
    if (!focused) return;
    const row = document.getElementById(focused[0]);
    const input = row && row.querySelector(`input[name="${focused[1]}"]`);
    focused = null;
    if (input && document.activeElement === document.body) input.focus();
  });
})();
