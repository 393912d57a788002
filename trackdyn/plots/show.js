// The charts of one run; the tension follows the picture that moves.
if (DATA.tension) {
  const run = DATA.pictures[0], shown = DATA.tension, count = shown.pitches;
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
  const [x, y] = DATA.signal.history;
  const line = { x, y, mode: "lines", line: { color: colour("left"), width: 1 }, ...hover("%{x:.3f} s, %{y:.3f} g", "y acceleration") };
  return [[line], { xaxis: axis("time in the record (s)"), yaxis: axis("y acceleration (g)"), showlegend: false }];
});

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

if (!moved) land();
root.dataset.drawn = Math.round(performance.now()); // every chart is there, ms
