// The charts of one run; the tension follows the picture that moves.
if (DATA.tension) {
  const run = DATA.pictures[0], shown = DATA.tension, count = shown.pitches;
  $("scale").style.background =
    `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map(tensionColour).join(",")})`;
  $("scale-low").textContent = run.ends[0];
  $("scale-high").textContent = run.ends[1];
  const now = (i) => {
    const joints = shown.first.map((place, b) => [(place + shown.moved[i]) % count, run.tension[i * run.bodies + b]]);
    joints.sort((a, b) => a[0] - b[0]);
    return { x: joints.map(([x]) => x), y: joints.map(([, y]) => y) };
  };
  await chart("tension-plot", () => {
    const band = { x: shown.place, mode: "lines", line: { width: 0, color: colour("left") }, hoverinfo: "skip" };
    const wheels = shown.spans.flatMap(([name, begin, end]) => [0, count].map((back) => [name, begin - back, end - back]))
      .filter(([, begin, end]) => end > 0 && begin < count)
      .map(([name, begin, end]) => [name, Math.max(begin, 0), Math.min(end, count)]);
    const shapes = wheels.map(([, x0, x1]) => ({ type: "rect", xref: "x", yref: "paper", x0, x1, y0: 0, y1: 1, layer: "below",
      line: { width: 0 }, fillcolor: colour("rubber"), opacity: 0.18 }));
    const annotations = wheels.map(([text, x0, x1], k) => ({ text, x: (x0 + x1) / 2, y: 0.02 + 0.08 * (k % 3), yref: "paper", yanchor: "bottom",
      showarrow: false, font: { size: 12, color: colour("ink") } }));
    return [[
      { ...band, name: "least", y: shown.low, showlegend: false },
      { ...band, name: "all instants", y: shown.high, fill: "tonexty", fillcolor: colour("left").replace("rgb(", "rgba(").replace(")", ", 0.25)") },
      { name: "this instant", ...now(FRAME.index), mode: "lines+markers", line: { color: colour("ink"), width: 1.2 },
        marker: { size: 4, color: colour("ink") }, ...hover("%{x:.2f} pitches, %{y:.0f} N", "tension") },
    ], { shapes, annotations, xaxis: axis("position along the loop (pitches)", { range: [0, count] }),
         yaxis: axis("force in the joint (N)", { rangemode: "tozero" }) }];
  });
  let due = 0;
  FRAME.shown.push((i, playing) => { // while it plays ten times a second will do
    if (playing && performance.now() < due) return;
    due = performance.now() + 100;
    const { x, y } = now(i);
    Plotly.restyle("tension-plot", { x: [x], y: [y] }, [2]);
  });
}

await chart("history-plot", () => {
  const s = DATA.signal, color = colour("left"), told = hover("%{x:.3f} s, %{y:.3f} g", "y acceleration");
  const line = { mode: "lines", line: { color, width: 1 } };
  const axes = { xaxis: axis("time in the record (s)"), yaxis: axis("y acceleration (g)"),
                 uirevision: $("history-range").value, showlegend: false };
  if ($("history-range").value === "stretch")
    return [[{ name: "y acceleration", x: spread(s.stretch.length, 1 / s.rate).map((t) => t + 1 / s.rate), y: s.stretch, ...line, ...told }], axes];
  const { time, low, high } = s.whole;
  if (!high) return [[{ name: "y acceleration", x: time, y: low, ...line, ...told }], axes];
  return [[{ name: "least", x: time, y: low, ...line, ...told },
           { name: "largest", x: time, y: high, ...line, fill: "tonexty", ...told }], axes];
}, "history-range");

if ($("spectrum-plot")) await chart("spectrum-plot", () => {
  const range = $("spectrum-range").value, [x, y] = DATA.signal[range], color = colour("left");
  const told = hover("%{x:.4f} Hz, %{y:.4f} g", "y acceleration");
  const traces = [{ name: "y acceleration", x, y, mode: "lines", line: { color, width: 1.4 }, ...told }];
  const line = DATA.signal.line;
  if (range === "low" && line)
    traces.push({ name: "dominant peak", x: line.map(([hz]) => hz), y: line.map(([, g]) => g), mode: "markers",
                  marker: { symbol: ["circle", "circle-open"], size: [8, 13], color, line: { width: 2 } }, ...told });
  return [traces, { showlegend: false, xaxis: axis("frequency (Hz)"), uirevision: range,
                    yaxis: axis("amplitude (g)", { type: range === "low" ? "linear" : "log" }) }];
}, "spectrum-range");

if (DATA.shares) await chart("shares-plot", () => {
  const s = DATA.shares, areas = s.left.map((_, i) => "area " + (i + 1));
  const looks = [["left", "/"], ["right", "\\"], ["ring", ""]];
  const bars = [[areas, s.left], [areas, s.right], [["ring"], [s.ring]]];
  return [bars.map(([x, y], i) => ({ type: "bar", name: s.names[i], x, y, ...hover("%{x}: %{y:.3g} % of a turn", s.names[i]),
    marker: { color: colour(looks[i][0]), pattern: { shape: looks[i][1], fgcolor: colour("card"), fillmode: "overlay" } } })),
  { barmode: "group", xaxis: axis("", { type: "category" }), yaxis: axis("contact duration (% of a turn)", { rangemode: "tozero" }) }];
});

if (DATA.work) await chart("work-plot", () => {
  const tones = { supplied: "accent", dissipated: "right", stored: "ring", residual: "bad" };
  const kinds = [...new Set(DATA.work.map((row) => row.kind))];
  return [kinds.map((kind) => {
    const rows = DATA.work.filter((row) => row.kind === kind);
    return { type: "bar", orientation: "h", name: kind, x: rows.map((row) => row.work_j), y: rows.map((row) => row.entry),
             marker: { color: colour(tones[kind]) }, ...hover("%{y}: %{x:.4g} J", kind) };
  }), { xaxis: axis("work (J)"), yaxis: axis("", { autorange: "reversed", type: "category" }), barmode: "overlay" }];
});

if (!moved) land();
root.dataset.drawn = Math.round(performance.now()); // every chart is there, ms
