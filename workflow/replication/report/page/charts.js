// The charts of the report.
function signalsShown() {
  const both = DATA.signals[$("signal-speed").value];
  const shown = [["simulation", both.simulation, { color: colour("left"), dash: "solid" }, "circle"]];
  if (both.sensor) shown.push([DATA.sensor_label, both.sensor, { color: "#c07f00", dash: "dot" }, "square"]);
  return shown;
}

if ($("signal-speed")) {
  fill($("signal-speed"), Object.keys(DATA.signals).map((run) => [run, run.replace("rpm", " rpm")]));
  await chart("history-plot", () => [
    signalsShown().map(([name, s, line]) => {
      const y = s.history;
      return { name, x: spread(y.length, 1 / s.rate), y, mode: "lines", line: { ...line, width: 1 },
               ...hover("%{x:.3f} s, %{y:.3f} g", name) };
    }),
    { xaxis: axis("time from a crest (s)"), yaxis: axis("y acceleration (g)"),
      uirevision: $("signal-speed").value },
  ], "signal-speed");
  await chart("spectrum-plot", () => {
    const range = $("signal-range").value;
    const traces = [];
    for (const [name, s, line, symbol] of signalsShown()) {
      const told = hover("%{x:.4f} Hz, %{y:.4f} g", name);
      traces.push({ name, x: s[range + "_hz"], y: s[range + "_g"], mode: "lines",
                    line: { ...line, width: 1.4 }, ...told });
      // the line of the FFT, and (hollow) the same without scalloping loss
      if (range === "low")
        traces.push({ name, x: [s.line[0], s.free[0]], y: [s.line[1], s.free[1]], mode: "markers", showlegend: false,
                      marker: { symbol: [symbol, symbol + "-open"], size: [8, 13], color: line.color,
                                line: { width: 2 } }, ...told });
    }
    const printed = DATA.signals[$("signal-speed").value].printed;
    if (printed && range === "low")
      traces.push({ name: "printed (simulation)", x: [printed[0]], y: [printed[1]], mode: "markers",
                    marker: { symbol: "x-thin", size: 11, line: { width: 2.5, color: colour("bad") } },
                    ...hover("%{x:.4g} Hz, %{y:.4g} g", "printed") });
    return [traces, { xaxis: axis("frequency (Hz)"), uirevision: range + $("signal-speed").value,
                      yaxis: axis("amplitude (g)", { type: range === "low" ? "linear" : "log" }) }];
  }, "signal-speed", "signal-range");
}

if ($("passage")) {
  fill($("passage"), DATA.passages.map((p, i) => [i, p.ring + ", " + p.rpm + " rpm"]));
  $("passage").value = DATA.passages.length - 1;
  const looks = [
    ["left arc", "left", "solid", "circle"], ["right arc", "right", "dash", "square"],
    ["link ahead on the ring", "ring", "dashdot", "triangle-up"],
  ];
  await chart("passage-plot", () => {
    const p = DATA.passages[Number($("passage").value)];
    const x = p.time;
    const traces = [];
    looks.forEach(([name, tone, dash, symbol], i) => {
      const color = colour(tone);
      const y = p.force[i];
      if (!y.some((f) => f > 0)) return;
      traces.push({ name, x, y, mode: "lines", line: { color, dash, width: 1.5 },
                    ...hover("%{x:.3f} s, %{y:.0f} N", name) });
      if (!p.area[i]) return;
      const area = p.area[i].map((a) => a || null);
      traces.push({ name, x, y: area, yaxis: "y2", mode: "markers", showlegend: false,
                    marker: { color, symbol, size: 5 }, ...hover("%{x:.3f} s, area %{y}", name) });
    });
    const events = Object.entries(p.printed), soft = colour("soft");
    traces.push({ name: "printed event", x: events.map(([, time]) => time), y: events.map(() => 0), mode: "markers",
                  text: events.map(([event]) => event),
                  marker: { symbol: "line-ns", size: 12, line: { width: 2, color: soft } },
                  ...hover("%{text}, printed %{x:.2f} s", "printed event") });
    const shapes = events.map(([, x]) => ({ type: "line", xref: "x", yref: "paper", x0: x, x1: x, y0: 0.36, y1: 1,
                                            line: { color: soft, dash: "dot", width: 1 } }));
    return [traces, { shapes, xaxis: axis("time since the first contact (s)", { anchor: "y2" }),
      yaxis: axis("normal force (N)", { domain: [0.36, 1], rangemode: "tozero" }),
      yaxis2: axis("area", { domain: [0, 0.28], range: [0.5, 10.5], dtick: 1 }) }];
  }, "passage");
}

if (DATA.ring) await chart("ring-plot", () => {
  const ring = DATA.ring, what = $("ring-what").value;
  const ticks = ring.rings.map((name) => name.replace(" m", ""));
  const traces = [];
  ["left", "right", "ring"].forEach((side, k) => ring.speeds.forEach((rpm, i) => {
    const { color, dash, symbol } = look(i);
    // the point without a ring stands apart from the curve
    const name = side + "_" + what, cut = ring.radii[0] === null && ring.radii.length > 1;
    const parted = (values) => (values && cut ? [values[0], null, ...values.slice(1)] : values);
    traces.push({ name: rpm + " rpm", legendgroup: rpm, showlegend: k === 0, xaxis: "x", yaxis: "y" + (k ? k + 1 : ""),
      x: cut ? [ticks[0], ticks[0], ...ticks.slice(1)] : ticks, y: parted(ring.values[name][i]),
      error_y: { array: parted(ring.errors[name]?.[i]), visible: true, color, thickness: 1 },
      mode: "lines+markers", line: { color, dash, width: 1.5 }, marker: { color, symbol, size: 7 },
      ...hover("%{x}: %{y:.4g} ± %{error_y.array:.2g}", rpm + " rpm, " + side) });
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
  fill($("trade-measure"), [...new Set(DATA.trade.map((row) => row.group))].map((name) => [name, name]));
  await chart("trade-plot", () => {
    const rows = DATA.trade.filter((row) => row.group === $("trade-measure").value);
    const failed = rows.filter((row) => row.error === null).map((row) => `${row.setting} at ${row.step} s`);
    $("trade-failed").textContent = failed.length ? "Rejected or diverged: " + failed.join("; ") + "." : "";
    const traces = [...new Set(rows.map((row) => row.setting))].map((name, i) => {
      const group = rows.filter((row) => row.setting === name && row.error !== null).sort((a, b) => a.step - b.step);
      const { color, dash, symbol } = look(i);
      return { name, x: group.map((row) => row.cpu), y: group.map((row) => row.error),
        error_y: { array: group.map((row) => row.noise), visible: true, color, thickness: 1 },
        text: group.map((row) => "step " + row.step + " s"), mode: "lines+markers", line: { color, dash, width: 1.5 },
        marker: { color, symbol, size: 8 }, ...hover("%{text}<br>%{x:.3g} s a second<br>error %{y:.3g}", name) };
    });
    const log = { type: "log", exponentformat: "power", dtick: 1 };
    return [traces, { xaxis: axis("CPU time per simulated second (s)", log),
                      yaxis: axis(`error (${rows[0].unit})`, log) }];
  }, "trade-measure");
}

if (!moved) land();
root.dataset.drawn = Math.round(performance.now()); // every chart is there, ms
