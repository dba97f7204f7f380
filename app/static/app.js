// Driftbook in the browser: charts, and the notice when a live connection is lost. Pages work without it.
"use strict";

(() => {
  // ---------------------------------------------------------------- charts
  // A specification names colours as var(--series-1) and the like, so the theme changes them by itself.
  const css = (name) => `var(--${name})`;
  const config = () => {
    const style = getComputedStyle(document.documentElement);
    const font = style.getPropertyValue("--sans").trim();
    const size = 0.75 * parseFloat(style.fontSize);
    const text = { labelFont: font, titleFont: font, labelFontSize: size, titleFontSize: size };
    return {
      background: null, font, padding: 0,
      view: { stroke: null },
      axis: { ...text, labelColor: css("ink-2"), titleColor: css("ink-2"), titleFontWeight: 400, domain: false,
              ticks: false, gridColor: css("hair"), labelPadding: 6, titlePadding: 8 },
      axisX: { grid: false, domain: true, domainColor: css("edge"), ticks: true, tickColor: css("edge"), tickSize: 4 },
      legend: { ...text, labelColor: css("ink-2"), titleColor: css("ink-2"), titleFontWeight: 400, symbolStrokeWidth: 1.5 },
      title: { font, fontSize: size, color: css("ink-2"), fontWeight: 400, anchor: "start" },
      header: { ...text, labelColor: css("ink-2"), titleColor: css("ink-2") },
      text: { font, fontSize: size, color: css("ink") },
      line: { strokeWidth: 1.5 }, rule: { strokeWidth: 1 }, point: { size: 50 },
    };
  };
  const options = () => ({
    ast: true, actions: false, defaultStyle: false, renderer: "svg",
    tooltip: { disableDefaultStyle: true }, config: config(),
  });

  const drawn = new WeakMap();

  const specification = async (element) => {
    const given = element.dataset.chart;
    if (given.startsWith("{")) return JSON.parse(given);
    const answer = await fetch(given, { headers: { accept: "application/json" } });
    if (!answer.ok) throw new Error(`${given}: ${answer.status}`);
    return answer.json();
  };

  const draw = async (element) => {
    const width = Math.floor(element.clientWidth);
    const known = drawn.get(element);
    if (!width || (known && known.width === width)) return;
    const spec = known ? known.spec : await specification(element);
    drawn.set(element, { spec, width, view: known && known.view });
    const inner = document.createElement("div");
    const result = await window.vegaEmbed(inner, { ...spec, width, autosize: { type: "fit-x", contains: "padding", resize: false } }, options());
    if (known && known.view) known.view.finalize();
    drawn.set(element, { spec, width, view: result.view });
    element.replaceChildren(inner);
    element.dataset.ready = "";
  };

  const safely = (element) => draw(element).catch((error) => {
    element.dataset.failed = "";
    console.error(error);
  });

  const resized = window.ResizeObserver && new ResizeObserver((entries) => {
    for (const entry of entries) safely(entry.target);
  });

  const mount = (root) => {
    if (!window.vegaEmbed) return;
    const charts = [...root.querySelectorAll("[data-chart]")];
    if (root.matches && root.matches("[data-chart]")) charts.push(root);
    for (const element of charts) resized ? resized.observe(element) : safely(element);
  };

  // ------------------------------------------------------------ live pages
  // <p data-lost hidden> inside an element with sse-connect is shown while the connection is down.
  const tell = (lost) => (event) => {
    for (const notice of event.target.querySelectorAll("[data-lost]")) notice.hidden = !lost;
  };

  // Ages: <time data-age datetime="…"> says how long ago, in the page's language.
  const units = [[86400, "day"], [3600, "hour"], [60, "minute"], [1, "second"]];
  const grow = () => {
    const words = new Intl.RelativeTimeFormat(document.documentElement.lang, { style: "short", numeric: "always" });
    for (const element of document.querySelectorAll("time[data-age]")) {
      const seconds = Math.max(0, (Date.now() - Date.parse(element.dateTime)) / 1000);
      const [size, unit] = units.find(([size]) => seconds >= size) || units[3];
      element.textContent = words.format(-Math.floor(seconds / size), unit);
    }
  };

  document.addEventListener("DOMContentLoaded", () => {
    mount(document);
    setInterval(grow, 1000);
    document.body.addEventListener("htmx:load", (event) => mount(event.detail.elt));
    document.body.addEventListener("htmx:sseError", tell(true));
    document.body.addEventListener("htmx:sseOpen", tell(false));
  });
})();
