// The list of claims, the scenes of the ladder, and the ring's slider.
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

if ($("ladder-scene")) {
  const show = () => {
    for (const body of $("ladder").tBodies) body.hidden = body.dataset.scene !== $("ladder-scene").value;
  };
  $("ladder-scene").addEventListener("input", show);
  show();
}

(function ringTable() {
  const ring = DATA.ring;
  if (!ring) return;
  const columns = [
    ["left_share_pct", "contact duration, left arc (% of a turn)"], ["right_share_pct", "contact duration, right arc (% of a turn)"],
    ["ring_share_pct", "contact duration, ring (% of a turn)"], ["left_rms_n", "RMS force, left arc (N)"],
    ["right_rms_n", "RMS force, right arc (N)"], ["ring_rms_n", "RMS force, ring (N)"],
    ["left_phase_start", "first touch, left arc (turns)"],
  ].filter(([name]) => name in ring.texts);
  function row(cells, tag) {
    const line = document.createElement("tr");
    cells.forEach((text, i) => {
      const cell = document.createElement(i === 0 ? "th" : tag);
      cell.textContent = text;
      if (cell.tagName === "TH") cell.scope = tag === "th" ? "col" : "row";
      else cell.className = "number";
      line.append(cell);
    });
    return line;
  }
  function show() {
    const j = Number($("ring-slider").value);
    $("ring-radius").textContent = ring.rings[j];
    $("ring-table").tHead.replaceChildren(row(["motor", ...columns.map(([, title]) => title)], "th"));
    $("ring-table").tBodies[0].replaceChildren(
      ...ring.speeds.map((rpm, i) =>
        row([rpm + " rpm", ...columns.map(([name]) => ring.texts[name][i][j])], "td")),
    );
  }
  $("ring-slider").addEventListener("input", show);
  const usual = ring.radii.findIndex((r) => r !== null && Math.abs(r - 0.308) < 1e-6);
  if (usual >= 0) $("ring-slider").value = usual;
  show();
})();

// A click on a column's name sorts the table by it, a second one the other way round
for (const head of document.querySelectorAll(".sortable thead tr:last-child th")) {
  const button = Object.assign(document.createElement("button"), { type: "button", className: "sort" });
  button.append(...head.childNodes);
  head.append(button);
  button.addEventListener("click", () => {
    const body = head.closest("table").tBodies[0], at = head.cellIndex;
    const up = head.getAttribute("aria-sort") !== "ascending";
    for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const value = (row) => {
      const text = row.cells[at].textContent.replace("\u2212", "-");
      return text.trim() && !Number.isNaN(parseFloat(text)) ? parseFloat(text) : text;
    };
    const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)));
    body.append(...[...body.rows].sort((a, b) => (up ? 1 : -1) * compare(value(a), value(b))));
  });
}

land();
root.dataset.drawn = Math.round(performance.now()); // every control works, ms
