// Driftbook in the browser: charts, pasting into tables, live connections. Pages work without it.
"use strict";

(() => {
  // ---------------------------------------------------------------- charts
  // A specification brings its own look; colours are var(--series-1) and the like, so the theme changes them.
  const options = { ast: true, actions: false, defaultStyle: false, renderer: "svg", tooltip: { disableDefaultStyle: true } };
  const charts = new WeakMap();

  const specification = async (given) => {
    if (given.startsWith("{")) return JSON.parse(given);
    const answer = await fetch(given, { headers: { accept: "application/json" } });
    if (!answer.ok) throw new Error(`${given}: ${answer.status}`);
    return answer.json();
  };

  // Drawn anew for every width, never scaled: text keeps its size.
  const draw = async (element) => {
    const width = Math.floor(element.clientWidth);
    const chart = charts.get(element);
    if (!width || chart.width === width) return;
    chart.width = width;
    chart.spec ||= await specification(element.dataset.chart);
    if (chart.width !== width) return;
    const place = document.createElement("div");
    const { view } = await window.vegaEmbed(place, { ...chart.spec, width }, options);
    chart.view?.finalize();
    chart.view = view;
    // Vega gives marks of no point the role of a picture: without a name it would be one nobody can read.
    for (const mark of place.querySelectorAll("[role=graphics-symbol]:not([aria-label])")) {
      if (!mark.childElementCount) mark.setAttribute("aria-hidden", "true");
    }
    element.replaceChildren(place);
    element.dataset.ready = "";
  };

  const drawSafely = (element) => draw(element).catch((error) => {
    for (const notice of element.querySelectorAll("[data-undrawn]")) notice.hidden = false;
    console.error(error);
  });

  const resized = new ResizeObserver((entries) => entries.forEach((entry) => drawSafely(entry.target)));

  // A4 at 96 px to the inch, less the margins of the browser and of the page. Nothing observes sizes while it prints.
  const PAPER_PX = 714;
  const redraw = (fitting) => {
    for (const element of document.querySelectorAll("[data-chart]")) {
      const chart = charts.get(element);
      chart?.view?.width(fitting(chart.width)).runAsync();
    }
  };

  const mount = (root) => {
    if (!window.vegaEmbed) return;
    for (const element of [root, ...root.querySelectorAll("[data-chart]")]) {
      if (!element.dataset?.chart || charts.has(element)) continue;
      charts.set(element, {});
      resized.observe(element);
    }
  };

  // In a live page an event brings rows and values; the drawing stays, and what is drawn anew begins with them.
  const renew = (event) => {
    const chart = charts.get(event.target);
    if (!chart) return;
    event.preventDefault();
    if (!chart.spec) return;
    const { datasets, params } = JSON.parse(event.detail.data);
    Object.assign(chart.spec.datasets, datasets);
    for (const item of chart.spec.params) if (item.name in params) item.value = params[item.name];
    if (!chart.view) return;
    for (const [name, rows] of Object.entries(datasets)) chart.view.data(name, rows);
    for (const [name, value] of Object.entries(params)) chart.view.signal(name, value);
    chart.view.runAsync();
  };

  // --------------------------------------------------------------- pasting
  // Cells of a spreadsheet pasted into a field of <table data-paste> fill the fields to its right and below.
  const paste = (event) => {
    const field = event.target.closest?.("table[data-paste] input");
    const text = event.clipboardData?.getData("text/plain") ?? "";
    if (!field || !/[\t\n]/.test(text.trim())) return;
    event.preventDefault();
    const inputs = (row) => [...row.querySelectorAll("input:not([type=hidden], :disabled, [readonly])")];
    const rows = [...field.closest("table").querySelectorAll("tbody tr")].filter((row) => inputs(row).length);
    const top = rows.indexOf(field.closest("tr"));
    const left = inputs(rows[top]).indexOf(field);
    text.replace(/[\r\n]+$/, "").split(/\r?\n/).forEach((line, down) => {
      const fields = rows[top + down] ? inputs(rows[top + down]) : [];
      line.split("\t").forEach((cell, right) => {
        const target = fields[left + right];
        if (!target) return;
        target.value = cell.trim();
        target.dispatchEvent(new Event("input", { bubbles: true }));
        target.dispatchEvent(new Event("change", { bubbles: true }));
      });
    });
  };

  // ------------------------------------------------------------ live pages
  // An element with data-lost inside one with sse-connect is shown while the connection is down.
  const show = (source, lost) => {
    for (const notice of source.querySelectorAll?.("[data-lost]") ?? []) notice.hidden = !lost;
  };
  const tell = (lost) => (event) => show(event.target, lost);

  // Where data-beat says after how many seconds at most something comes, silence is a lost connection too.
  const heard = new WeakMap();
  const hear = (event) => {
    const source = event.target.closest?.("[data-beat]");
    if (!source) return;
    heard.set(source, performance.now());
    show(source, false);
  };
  const listen = () => {
    for (const source of document.querySelectorAll("[data-beat]")) {
      if (!heard.has(source)) heard.set(source, performance.now());
      if (document.hidden || performance.now() - heard.get(source) < 1000 * source.dataset.beat) continue;
      show(source, true);
    }
  };

  // A browser has six connections to a server: a page that nobody sees gives its own back.
  const pause = () => {
    for (const element of document.querySelectorAll("[sse-connect]")) {
      if (document.hidden) {
        window.htmx.trigger(element, "htmx:beforeCleanupElement");
      } else {
        const fresh = element.cloneNode(true);
        element.replaceWith(fresh);
        window.htmx.process(fresh);
        mount(fresh);
      }
    }
  };

  document.addEventListener("paste", paste);
  window.addEventListener("beforeprint", () => redraw((width) => Math.min(width, PAPER_PX)));
  window.addEventListener("afterprint", () => redraw((width) => width));
  document.addEventListener("visibilitychange", pause);
  document.addEventListener("DOMContentLoaded", () => {
    mount(document);
    document.body.addEventListener("htmx:load", (event) => mount(event.detail.elt));
    document.body.addEventListener("htmx:sseError", tell(true));
    document.body.addEventListener("htmx:sseOpen", tell(false));
    document.body.addEventListener("htmx:sseBeforeMessage", renew);
    document.body.addEventListener("htmx:sseMessage", hear);
    document.body.addEventListener("htmx:sseClose", (event) => {
      if (event.detail.type === "message") event.target.removeAttribute("data-beat");
    });
    if (document.querySelector("[data-beat]")) setInterval(listen, 1000);
  });
})();
