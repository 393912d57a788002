// Statements by verdict and words, and tables that are sorted by a click.
(function statements() {
  if (!$("verdicts")) return;
  const items = [...document.querySelectorAll(".said tbody")];
  const sections = [...document.querySelectorAll("#figures figure")];
  const buttons = [...$("verdicts").querySelectorAll("button")];
  function show() {
    const wanted = buttons.filter((b) => b.getAttribute("aria-pressed") === "true").map((b) => b.dataset.verdict);
    const text = $("find").value.trim().toLowerCase(), all = !wanted.length && !text;
    for (const item of items) {
      const asked = !wanted.length || item.dataset.verdict.split("|").some((verdict) => wanted.includes(verdict));
      item.hidden = !(asked && item.textContent.toLowerCase().includes(text));
    }
    for (const section of sections) section.hidden = !all && !section.querySelector(".said tbody:not([hidden])");
    $("shown").textContent = all ? "" : sections.filter((s) => !s.hidden).length + " figures and tables listed.";
  }
  for (const button of buttons)
    button.addEventListener("click", () => {
      button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
      show();
    });
  $("find").addEventListener("input", show);
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
