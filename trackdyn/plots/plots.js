// How charts are drawn: each has a function that redraws it from the choices made above it.
const touch = matchMedia("(pointer: coarse)").matches; // there a drag scrolls the page
const later = () => new Promise((done) => (window.requestIdleCallback ?? setTimeout)(done, { timeout: 200 }));
land();
root.dataset.ready = Math.round(performance.now()); // every control works, ms
let moved = false; // a reader who has set out is not called back
for (const name of ["wheel", "pointerdown", "keydown"]) addEventListener(name, () => { moved = true; }, { once: true });
await later();
if (document.querySelector(".plot"))
  document.head.append(Object.assign(document.createElement("script"), { textContent: await opened("plotly") }));

function layout(extra) {
  const line = colour("line");
  const axis = { gridcolor: line, zerolinecolor: line, linecolor: colour("soft"), automargin: true };
  const merged = {
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: colour("ink") },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 56, r: 12, t: 34, b: 48 },
    hovermode: "closest", dragmode: touch ? false : "zoom", width: root.matches(".printing") ? 670 : undefined,
    hoverlabel: { bgcolor: colour("card"), font: { color: colour("ink") } },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" }, ...extra,
  };
  for (const name of Object.keys(merged)) if (/^[xy]axis/.test(name)) merged[name] = { ...axis, ...merged[name] };
  return merged;
}

async function chart(id, draw, ...controls) {
  const show = () => {
    const [traces, extra] = draw();
    Plotly.react(id, traces, layout(extra), { responsive: true, displayModeBar: false });
  };
  await later();
  $(id).replaceChildren();
  REDRAWS.push(show);
  for (const name of controls) $(name).addEventListener("input", show);
  show();
}

const axis = (text, extra = {}) => ({ title: { text }, ...extra });
const hover = (text, name) => ({ hovertemplate: text + "<extra>" + name + "</extra>" });
const spread = (n, step) => Float64Array.from({ length: n }, (_, i) => i * step);
