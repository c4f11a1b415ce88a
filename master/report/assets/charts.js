"use strict";
// Draws the charts of the page with plotly.js; follows the reader's colour scheme, and turns light for paper.
(function () {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const config = { responsive: true, displaylogo: false, modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
  const shown = [];

  function look(isDark) {
    return isDark
      ? { ink: "#d5dade", grid: "#30363d", page: "#14171a" }
      : { ink: "#24292f", grid: "#e1e5ea", page: "#ffffff" };
  }

  function axis(given, colours) {
    return Object.assign({
      gridcolor: colours.grid, linecolor: colours.ink, zerolinecolor: colours.grid, tickcolor: colours.ink,
      ticks: "outside", showline: true, automargin: true,
    }, given);
  }

  function layoutOf(chart, colours) {
    const layout = Object.assign({}, chart.layout);
    for (const name of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(name)) layout[name] = axis(layout[name], colours);
    }
    layout.font = { family: "system-ui, sans-serif", size: 12, color: colours.ink };
    layout.paper_bgcolor = layout.plot_bgcolor = colours.page;
    layout.margin = { l: 60, r: 34, t: 10, b: 46 };
    layout.modebar = { orientation: "v", bgcolor: "rgba(0,0,0,0)" };
    layout.legend = { orientation: "h", y: 1.02, yanchor: "bottom", x: 0, font: { size: 11 } };
    layout.height = chart.height;
    layout.hovermode = "closest";
    return layout;
  }

  function recolour(isDark) {
    const colours = look(isDark);
    for (const [element, chart] of shown) Plotly.relayout(element, flat(layoutOf(chart, colours)));
  }

  function flat(layout) {
    const found = { paper_bgcolor: layout.paper_bgcolor, plot_bgcolor: layout.plot_bgcolor, "font.color": layout.font.color };
    for (const name of Object.keys(layout)) {
      if (!/^[xy]axis\d*$/.test(name)) continue;
      for (const key of ["gridcolor", "linecolor", "zerolinecolor", "tickcolor"]) found[name + "." + key] = layout[name][key];
    }
    return found;
  }

  function follow(element, group) {
    element.on("plotly_relayout", function (change) {
      const range = change["xaxis.range[0]"] !== undefined
        ? { "xaxis.range": [change["xaxis.range[0]"], change["xaxis.range[1]"]] }
        : change["xaxis.autorange"] ? { "xaxis.autorange": true } : null;
      if (!range) return;
      for (const [other, chart] of shown) {
        if (other === element || (chart.layout.meta || {}).sync !== group) continue;
        if (JSON.stringify(other.layout.xaxis.range) !== JSON.stringify(range["xaxis.range"])) Plotly.relayout(other, range);
      }
    });
  }

  const drawn = Object.entries(charts).map(function ([key, chart]) {
    const element = document.getElementById("chart-" + key);
    return Plotly.newPlot(element, chart.data, layoutOf(chart, look(dark.matches)), config).then(function () {
      shown.push([element, chart]);
      const group = (chart.layout.meta || {}).sync;
      if (group) follow(element, group);
    });
  });
  Promise.all(drawn).then(function () { document.documentElement.dataset.drawn = String(shown.length); });

  dark.addEventListener("change", function () { recolour(dark.matches); });
  const closed = [];
  window.addEventListener("beforeprint", function () {
    recolour(false);
    for (const d of document.querySelectorAll("details:not([open])")) { d.open = true; closed.push(d); }
  });
  window.addEventListener("afterprint", function () {
    recolour(dark.matches);
    while (closed.length) closed.pop().open = false;
  });
})();
