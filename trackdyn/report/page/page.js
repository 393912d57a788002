"use strict";
// What all parts of the page share: the data, small helpers, the list of claims and the ring's slider.
const DATA = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

function unpack(text, Kind = Float32Array) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
}

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const text = Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(digits);
  return text.replace("-", "\u2212");
}

function radiusName(radius) {
  return radius === null ? "no ring" : radius.toFixed(3) + " m";
}

function fill(select, pairs) {
  const before = select.value;
  select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value)));
  if (pairs.some(([value]) => String(value) === before)) select.value = before;
}

// one colour, one dash and one mark for each of several curves
const LOOKS = [
  { color: "ink", dash: "solid", symbol: "circle" },
  { color: "#c07f00", dash: "dash", symbol: "square" },
  { color: "#0072b2", dash: "dashdot", symbol: "triangle-up" },
  { color: "#56b4e9", dash: "dot", symbol: "diamond" },
  { color: "#d55e00", dash: "longdash", symbol: "triangle-down" },
  { color: "#009e73", dash: "longdashdot", symbol: "cross" },
  { color: "#cc79a7", dash: "solid", symbol: "x" },
];
function look(i) {
  const one = LOOKS[i % LOOKS.length], round = Math.floor(i / LOOKS.length);
  return { color: one.color === "ink" ? colour("ink") : one.color, dash: LOOKS[(i + round) % LOOKS.length].dash,
           symbol: one.symbol + (round % 2 ? "-open" : "") };
}

(function claims() {
  const list = $("card");
  if (!list) return;
  const items = [...list.children];
  const buttons = [...$("verdicts").querySelectorAll("button")];
  function show() {
    const wanted = buttons.filter((b) => b.getAttribute("aria-pressed") === "true").map((b) => b.dataset.verdict);
    const text = $("find").value.trim().toLowerCase();
    let count = 0;
    for (const item of items) {
      const asked = !wanted.length || item.dataset.verdict.split("|").some((verdict) => wanted.includes(verdict));
      const fits = asked && item.textContent.toLowerCase().includes(text);
      item.hidden = !fits;
      count += fits;
    }
    $("shown").textContent = count + (count === 1 ? " part shown." : " parts shown.");
  }
  for (const button of buttons)
    button.addEventListener("click", () => {
      button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
      show();
    });
  $("find").addEventListener("input", show);
})();

(function ringTable() {
  const ring = DATA.ring;
  if (!ring) return;
  const columns = [
    ["left_share_pct", "left, % of a turn"], ["right_share_pct", "right, %"], ["ring_share_pct", "ring, %"],
    ["left_rms_n", "RMS left, N"], ["right_rms_n", "RMS right, N"], ["ring_rms_n", "RMS ring, N"],
    ["left_phase_start", "left begins at phase"],
  ].filter(([name]) => name in ring.values);
  function row(cells, tag) {
    const line = document.createElement("tr");
    cells.forEach((text, i) => {
      const cell = document.createElement(i === 0 ? "th" : tag);
      cell.textContent = text;
      if (i > 0) cell.className = "number";
      line.append(cell);
    });
    return line;
  }
  function show() {
    const j = Number($("ring-slider").value);
    $("ring-radius").textContent = radiusName(ring.radii[j]);
    $("ring-table").replaceChildren(
      row(["motor", ...columns.map(([, title]) => title)], "th"),
      ...ring.speeds.map((rpm, i) =>
        row([rpm + " rpm", ...columns.map(([name]) => number(ring.values[name][i][j]))], "td")),
    );
  }
  $("ring-slider").addEventListener("input", show);
  const usual = ring.radii.findIndex((r) => r !== null && Math.abs(r - 0.308) < 1e-6);
  if (usual >= 0) $("ring-slider").value = usual;
  show();
})();
