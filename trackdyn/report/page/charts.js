"use strict";
// The charts: each has a function that draws it anew from the choices made above it.
const CHARTS = [];

function layout(extra) {
  const line = colour("line");
  const axis = { gridcolor: line, zerolinecolor: line, linecolor: colour("soft"), automargin: true };
  const merged = {
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: colour("ink") },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 56, r: 12, t: 34, b: 48 },
    hovermode: "closest", hoverlabel: { bgcolor: colour("card"), font: { color: colour("ink") } },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" }, ...extra,
  };
  for (const name of Object.keys(merged)) if (/^[xy]axis/.test(name)) merged[name] = { ...axis, ...merged[name] };
  return merged;
}

function chart(id, draw, ...controls) {
  if (!$(id)) return;
  const show = () => {
    const [traces, extra] = draw();
    Plotly.react(id, traces, layout(extra), {
      responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
    });
  };
  CHARTS.push(show);
  for (const name of controls) $(name).addEventListener("input", show);
  show();
}

const axis = (text, extra = {}) => ({ title: { text }, ...extra });
const hover = (text, name) => ({ hovertemplate: text + "<extra>" + name + "</extra>" });
const spread = (n, step) => Float64Array.from({ length: n }, (_, i) => i * step);

function signalsShown() {
  const both = DATA.signals[$("signal-speed").value];
  const shown = [["simulation", both.simulation, { color: "#0072b2", dash: "solid" }, "circle"]];
  if (both.sensor) shown.push([DATA.sensor_label, both.sensor, { color: "#c07f00", dash: "dot" }, "square"]);
  return shown;
}

if ($("signal-speed")) {
  fill($("signal-speed"), Object.keys(DATA.signals).map((run) => [run, run.replace("rpm", " rpm")]));
  chart("history-plot", () => [
    signalsShown().map(([name, s, line]) => {
      const y = unpack(s.history);
      return { name, x: spread(y.length, 1 / s.rate), y, mode: "lines", line: { ...line, width: 1 },
               ...hover("%{x:.3f} s, %{y:.3f} g", name) };
    }),
    { xaxis: axis("time since a crest of each curve's own fundamental (s)"), yaxis: axis("y acceleration (g)"),
      uirevision: $("signal-speed").value },
  ], "signal-speed");
  chart("spectrum-plot", () => {
    const range = $("signal-range").value;
    const traces = [];
    for (const [name, s, line, symbol] of signalsShown()) {
      const told = hover("%{x:.4f} Hz, %{y:.4f} g", name);
      traces.push({ name, x: unpack(s[range + "_hz"]), y: unpack(s[range + "_g"]), mode: "lines",
                    line: { ...line, width: 1.4 }, ...told });
      // the line of the FFT, and (hollow) the same without the picket fence
      if (range === "low")
        traces.push({ name, x: [s.line[0], s.free[0]], y: [s.line[1], s.free[1]], mode: "markers", showlegend: false,
                      marker: { symbol: [symbol, symbol + "-open"], size: [8, 13], color: line.color,
                                line: { width: 2 } }, ...told });
    }
    return [traces, { xaxis: axis("frequency (Hz)"), uirevision: range + $("signal-speed").value,
                      yaxis: axis("amplitude (g)", { type: range === "low" ? "linear" : "log" }) }];
  }, "signal-speed", "signal-range");
}

if ($("passage")) {
  fill($("passage"), DATA.passages.map((p, i) => [i, radiusName(p.radius) + ", " + p.rpm + " rpm"]));
  $("passage").value = DATA.passages.length - 1;
  const looks = [
    ["left arc", "left", "solid", "circle"], ["right arc", "right", "dash", "square"],
    ["link ahead on the ring", "ring", "dashdot", "triangle-up"],
  ];
  chart("passage-plot", () => {
    const p = DATA.passages[Number($("passage").value)];
    const x = unpack(p.time);
    const traces = [];
    looks.forEach(([name, tone, dash, symbol], i) => {
      const color = colour(tone);
      const y = unpack(p.force[i]);
      if (!y.some((f) => f > 0)) return;
      traces.push({ name, x, y, mode: "lines", line: { color, dash, width: 1.5 },
                    ...hover("%{x:.3f} s, %{y:.0f} N", name) });
      if (!p.area[i]) return;
      const area = Array.from(unpack(p.area[i], Uint8Array), (a) => a || null);
      traces.push({ name, x, y: area, yaxis: "y2", mode: "markers", showlegend: false,
                    marker: { color, symbol, size: 5 }, ...hover("%{x:.3f} s, area %{y}", name) });
    });
    return [traces, { xaxis: axis("time since the first contact (s)", { anchor: "y2" }),
      yaxis: axis("normal force (N)", { domain: [0.36, 1], rangemode: "tozero" }),
      yaxis2: axis("area", { domain: [0, 0.28], range: [0.5, 10.5], dtick: 1 }) }];
  }, "passage");
}

if (DATA.ring) chart("ring-plot", () => {
  const ring = DATA.ring, what = $("ring-what").value;
  const ticks = ring.radii.map((r) => (r === null ? "none" : r.toFixed(3)));
  const traces = [];
  ["left", "right", "ring"].forEach((side, k) => ring.speeds.forEach((rpm, i) => {
    const { color, dash, symbol } = look(i);
    // the point without a ring stands apart from the curve
    const y = ring.values[side + "_" + what][i];
    const cut = ring.radii[0] === null && y.length > 1;
    traces.push({ name: rpm + " rpm", legendgroup: rpm, showlegend: k === 0, xaxis: "x", yaxis: "y" + (k ? k + 1 : ""),
      x: cut ? [ticks[0], ticks[0], ...ticks.slice(1)] : ticks, y: cut ? [y[0], null, ...y.slice(1)] : y,
      mode: "lines+markers", line: { color, dash, width: 1.5 }, marker: { color, symbol, size: 7 },
      ...hover("%{x}: %{y:.4g}", rpm + " rpm, " + side) });
  }));
  const unit = what === "share_pct" ? " (%)" : " (N)";
  const j = Number($("ring-slider").value);
  const here = { type: "line", xref: "x", yref: "paper", x0: j, x1: j, y0: 0, y1: 1,
                 line: { color: colour("accent"), dash: "dash", width: 1.5 } };
  return [traces, { shapes: [here],
    xaxis: axis("radius of the ring (m)", { type: "category", anchor: "y3", categoryarray: ticks }),
    yaxis: axis("left arc" + unit, { domain: [0.7, 1], rangemode: "tozero" }),
    yaxis2: axis("right arc" + unit, { domain: [0.35, 0.65], rangemode: "tozero" }),
    yaxis3: axis("ring" + unit, { domain: [0, 0.3], rangemode: "tozero" }) }];
}, "ring-what", "ring-slider");

if (DATA.trade) {
  const key = (row) => row.scene + ": " + row.measure;
  fill($("trade-measure"), [...new Set(DATA.trade.map(key))].map((name) => [name, name]));
  chart("trade-plot", () => {
    const bad = (row) => [true, 1, "True", "true"].includes(row.failed) || row.error === null;
    const rows = DATA.trade.filter((row) => key(row) === $("trade-measure").value);
    const groups = new Map();
    for (const row of rows) {
      const name = row.fidelity + ", " + row.integrator;
      if (!groups.has(name)) groups.set(name, []);
      if (!bad(row)) groups.get(name).push(row);
    }
    const failed = rows.filter(bad).map((row) => `${row.fidelity}, ${row.integrator} at ${row.step_s} s`);
    $("trade-failed").textContent = failed.length ? "Failed: " + failed.join("; ") + "." : "";
    const traces = [...groups].map(([name, group], i) => {
      group.sort((a, b) => a.step_s - b.step_s);
      const { color, dash, symbol } = look(i);
      return { name, x: group.map((r) => r.wall_s_per_s), y: group.map((r) => Math.abs(r.error)),
        text: group.map((r) => "step " + r.step_s + " s"),
        mode: "lines+markers", line: { color, dash, width: 1.5 }, marker: { color, symbol, size: 8 },
        ...hover("%{text}<br>%{x:.3g} s a second<br>error %{y:.3g}", name) };
    });
    return [traces, { xaxis: axis("computing time of a simulated second (s)", { type: "log" }),
                      yaxis: axis("error", { type: "log" }) }];
  }, "trade-measure");
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => CHARTS.forEach((show) => show()));
