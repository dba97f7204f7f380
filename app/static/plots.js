// Points of charts that are links: reachable by keyboard, one stop of the Tab key for each chart.
"use strict";

(() => {
  const links = (chart) => [...chart.querySelectorAll("svg [role='graphics-symbol'], svg [role='link']")]
    .filter((node) => node.__data__ && node.__data__.href);

  const order = (one, other) => {
    const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
    return a.left - b.left || a.top - b.top;
  };

  const decorate = (chart) => {
    links(chart).sort(order).forEach((node, index) => {
      node.setAttribute("role", "link");
      node.setAttribute("tabindex", index ? "-1" : "0");
      node.removeAttribute("aria-roledescription");
    });
    const svg = chart.querySelector("svg");
    if (svg) { svg.removeAttribute("role"); svg.removeAttribute("aria-roledescription"); svg.removeAttribute("aria-label"); }
    const root = chart.querySelector("svg [role='graphics-document']");
    if (root) root.removeAttribute("role");
  };

  const move = (node, step) => {
    const all = links(node.closest("[data-chart]")).sort(order);
    const next = all[all.indexOf(node) + step];
    if (!next) return;
    node.setAttribute("tabindex", "-1");
    next.setAttribute("tabindex", "0");
    next.focus();
  };

  document.addEventListener("keydown", (event) => {
    const node = event.target.closest && event.target.closest("[data-chart] svg [role='link']");
    if (!node || !node.__data__) return;
    if (event.key === "Enter") location.assign(node.__data__.href);
    else if (event.key === "ArrowRight") move(node, 1);
    else if (event.key === "ArrowLeft") move(node, -1);
    else return;
    event.preventDefault();
  });

  const watch = new MutationObserver((changes) => {
    for (const change of changes) decorate(change.target);
  });
  document.addEventListener("DOMContentLoaded", () => {
    for (const chart of document.querySelectorAll("[data-chart]")) {
      watch.observe(chart, { attributes: true, attributeFilter: ["data-ready"] });
      if (chart.dataset.ready !== undefined) decorate(chart);
    }
  });
})();
