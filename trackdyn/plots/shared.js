// Shared by pages: small helpers, themes, paper, addresses, downloads, and the data that a page carries.
const $ = (id) => document.getElementById(id);
const root = document.documentElement;
const REDRAWS = []; // functions that redraw in other colours or on paper

// Compressed data of the page
async function opened(id) {
  const packed = await fetch("data:application/gzip;base64," + $(id).textContent);
  return new Response(packed.body.pipeThrough(new DecompressionStream("gzip"))).text();
}

// A colour of the style sheet as the present theme has it
const probe = document.body.appendChild(document.createElement("i"));
probe.hidden = true;
function colour(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

function redraw() { for (const draw of REDRAWS) draw(); }
$("theme").addEventListener("input", () => { root.style.colorScheme = $("theme").value; redraw(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

// Paper is light, with all details open
addEventListener("beforeprint", () => {
  root.classList.add("printing");
  redraw();
});
addEventListener("afterprint", () => {
  root.classList.remove("printing");
  redraw();
});

// The place that the address names, also if it is folded
function land() {
  const target = $(decodeURIComponent(location.hash.slice(1)) || "-");
  if (!target) return;
  for (const fold of target.querySelectorAll(":scope > details")) fold.open = true;
  for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  target.scrollIntoView();
}
addEventListener("hashchange", land);

function download(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const DATA = JSON.parse(await opened("data"));

// A chart as rows: curve, names of its axes, and its points
function csvOf(plot) {
  const quoted = (text) => '"' + String(text ?? "").replaceAll('"', '""') + '"';
  const title = (letter, at) => quoted(plot.layout[letter + "axis" + (at || letter).slice(1)].title.text);
  const rows = plot.data.flatMap(({ name, x, y, xaxis, yaxis }) => Array.from(x, (value, i) =>
    y[i] === null ? [] : [[quoted(name), title("x", xaxis), quoted(value), title("y", yaxis), y[i]].join(",")]).flat());
  return ["curve,x_axis,x,y_axis,y", ...rows].join("\n") + "\n";
}
document.addEventListener("click", ({ target }) => {
  const { file, chart } = target.closest("button.csv")?.dataset ?? {};
  if (file) download(file.split("/").pop(), DATA.files[file]);
  if (chart && $(chart).data) download(chart.replace("-plot", ".csv"), csvOf($(chart)));
});
